#include "capture/live/v4l2/source.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

#include "capture/error.h"
#include "capture/live/error_context.h"
#include "capture/live/sequence_unwrapper.h"
#include "capture/live/v4l2/controls.h"
#include "capture/live/v4l2/format.h"
#include "capture/live/v4l2/input.h"
#include "capture/live/v4l2/stream.h"

namespace lumigraft::capture {
namespace {

/// Pictures that come after a new exposure was set and may still have the old one: those in the sensor, two or three of
/// them, and one on the way.
constexpr int kOldExposures = 4;

/// One after the other, as PixelConverter wants them. Empty where the driver gave too few bytes.
std::vector<std::uint8_t> gathered(const v4l2::Filled& filled, const v4l2::Agreed& agreed, const StreamSpec& spec) {
  if (agreed.planes == 1) {
    return without_padding(agreed.format, spec.width, spec.height, agreed.row_bytes[0], filled.planes[0]);
  }
  // The rows of both halves of nv12 are as wide as grey ones.
  auto out = without_padding(PixelFormat::grey8, spec.width, spec.height, agreed.row_bytes[0], filled.planes[0]);
  const auto colors =
      without_padding(PixelFormat::grey8, spec.width, spec.height / 2, agreed.row_bytes[1], filled.planes[1]);
  if (out.empty() || colors.empty()) {
    return {};
  }
  out.insert(out.end(), colors.begin(), colors.end());
  return out;
}

}  // namespace

/// One run of the camera. The constructor throws with the reason alone.
class V4l2Source::Camera {
 public:
  Camera(const std::string& name, const StreamSpec& spec) : spec_(spec) {
    auto device = std::make_unique<v4l2::Device>(v4l2::node_named(name));
    v4l2::choose_input(*device, spec);
    agreed_ = v4l2::agree(*device, spec);
    v4l2::set_controls(*device, spec.settings);
    stream_ = std::make_unique<v4l2::Stream>(std::move(device), agreed_.planes);
    if (!spec_.settings.bracket_us.empty()) {
      begin_exposure();
    }
  }

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point deadline = Clock::now() + timeout;
    for (;;) {
      if (!ready_.empty()) {
        SourceItem item = std::move(ready_.front());
        ready_.pop_front();
        return item;
      }
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
      const auto filled = stream_->next(std::max(left, std::chrono::milliseconds(0)));
      if (filled) {
        accept(*filled);
      } else if (left.count() <= 0) {
        return std::nullopt;
      }
      if (ready_.empty() && !fault().empty()) {
        return std::nullopt;
      }
    }
  }

  const std::string& fault() const { return trouble_.empty() ? stream_->fault() : trouble_; }
  bool on_host_clock() const { return monotonic_; }
  bool bracket_incomplete() const {
    return !ready_.empty();
  }  // a bracket is made ready as a whole, and nothing else waits

 private:
  void accept(const v4l2::Filled& filled) {
    monotonic_ = filled.monotonic;
    const bool brackets = !spec_.settings.bracket_us.empty();
    if (brackets && old_exposures_ > 0) {
      --old_exposures_;
      stream_->give_back(filled.index);
      return;
    }
    Stamp stamp{filled.time_ns, steady_now_ns(), brackets ? count_.next() : count_.sequence_of(filled.sequence)};
    SourceItem item = picture_of(filled, stamp);
    if (!brackets) {
      ready_.push_back(std::move(item));
    } else if (auto* picture = std::get_if<Picture>(&item)) {
      bracket_.push_back(std::move(*picture));
      end_exposure();
    }
  }

  SourceItem picture_of(const v4l2::Filled& filled, const Stamp& stamp) {
    const auto lost = [&](const char* reason) { return LostPicture{stamp, spec_.stream, reason}; };
    std::vector<std::uint8_t> own;
    std::span<const std::uint8_t> bytes = filled.planes[0];
    if (agreed_.padded || agreed_.planes > 1) {
      own = gathered(filled, agreed_, spec_);
      bytes = own;
    } else if (const auto size = bytes_of(agreed_.format, spec_.width, spec_.height)) {
      bytes = bytes.first(std::min(bytes.size(), *size));
    }
    auto rgb = filled.damaged ? std::nullopt : pixels_.to_rgb(agreed_.format, spec_.width, spec_.height, bytes);
    if (!rgb) {
      stream_->give_back(filled.index);
      return lost("the picture is damaged");
    }
    Picture picture;
    picture.stamp = stamp;
    picture.stream = spec_.stream;
    picture.exposure = exposure_;
    picture.encoded = std::move(*rgb);
    if (agreed_.format == PixelFormat::rgb8) {
      stream_->give_back(filled.index);
      return picture;
    }
    std::shared_ptr<const void> lent = own.empty() ? stream_->lend(filled.index) : nullptr;
    if (lent) {
      picture.original = std::make_shared<CameraPicture>(agreed_.format, bytes, std::move(lent));
      return picture;
    }
    if (own.empty()) {
      own.assign(bytes.begin(), bytes.end());
    }
    stream_->give_back(filled.index);
    picture.original = std::make_shared<CameraPicture>(agreed_.format, std::move(own));
    return picture;
  }

  /// The session's exposure is that of exposure_us; what is gathered in another time stands in proportion.
  void begin_exposure() {
    const std::vector<double>& all = spec_.settings.bracket_us;
    const double given_us = v4l2::set_exposure_us(stream_->device(), all[bracket_.size()]);
    exposure_ = spec_.exposure * given_us / *spec_.settings.exposure_us;
    old_exposures_ = kOldExposures;
    while (const auto waiting = stream_->next(std::chrono::milliseconds(0))) {  // what nobody had the time to take yet
      stream_->give_back(waiting->index);
    }
  }

  /// Starts the next one; hands on the bracket where it is whole.
  void end_exposure() {
    if (bracket_.size() == spec_.settings.bracket_us.size()) {
      const Stamp last = bracket_.back().stamp;
      for (Picture& picture : bracket_) {
        picture.stamp = {last.time_ns, last.host_time_ns, count_.take()};
        ready_.push_back(std::move(picture));
      }
      bracket_.clear();
    }
    try {
      begin_exposure();
    } catch (const InputError& e) {
      trouble_ = e.what();
    }
  }

  StreamSpec spec_;
  v4l2::Agreed agreed_;
  PixelConverter pixels_;
  std::unique_ptr<v4l2::Stream> stream_;
  std::deque<SourceItem> ready_;
  std::vector<Picture> bracket_;  ///< not yet whole
  double exposure_ = spec_.exposure;
  int old_exposures_ = 0;
  std::string trouble_;  ///< beside the stream's
  bool monotonic_ = false;
  SequenceUnwrapper count_;
};

V4l2Source::V4l2Source(const std::string& camera, const StreamSpec& spec)
    : camera_(with_error_context("v4l2:" + camera, [&] { return std::make_unique<Camera>(camera, spec); })) {}

V4l2Source::~V4l2Source() = default;

std::optional<SourceItem> V4l2Source::next(std::chrono::milliseconds timeout) { return camera_->next(timeout); }

bool V4l2Source::finished() const { return !camera_->fault().empty(); }

std::string V4l2Source::fault() const { return camera_->fault(); }

bool V4l2Source::bracket_incomplete() const { return camera_->bracket_incomplete(); }

bool V4l2Source::on_host_clock() const { return camera_->on_host_clock(); }

}  // namespace lumigraft::capture
