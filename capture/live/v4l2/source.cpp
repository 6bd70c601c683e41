#include "capture/live/v4l2/source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include "capture/error.h"
#include "capture/live/parameters.h"
#include "capture/live/reported_exposure.h"
#include "capture/live/sequence_unwrapper.h"
#include "capture/live/v4l2/controls.h"
#include "capture/live/v4l2/format.h"
#include "capture/live/v4l2/input.h"
#include "capture/live/v4l2/stream.h"

namespace lumigraft::capture {

/// The camera from opening to closing. The constructor throws with the reason alone.
class V4l2Source::Camera : public Source {
 public:
  Camera(const std::string& name, const StreamSpec& spec) : spec_(spec), reported_(spec) {
    auto device = std::make_unique<v4l2::Device>(v4l2::find_node(name));
    v4l2::select_input(*device, spec);
    format_ = v4l2::negotiate_format(*device, spec);
    exposure_ = reported_.of_frame({v4l2::set_controls(*device, spec.stream, spec.settings), {}});
    stream_ = std::make_unique<v4l2::Stream>(std::move(device), format_.planes);
    if (!spec_.settings.bracket_us.empty()) begin_exposure();
    if (v4l2::may_adapt(stream_->device(), spec.stream, spec.settings)) adapt();
  }

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
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
      if (ready_.empty() && !fault().empty()) return std::nullopt;
    }
  }

  bool finished() const override { return !fault().empty(); }
  void rewind() override {}
  std::string fault() const override { return fault_.empty() ? stream_->fault() : fault_; }
  std::string take_warning() override {
    return adapted_.empty() ? reported_.take_warning() : std::exchange(adapted_, "");
  }
  bool on_host_clock() const override { return monotonic_; }
  bool bracket_incomplete() const override { return !ready_.empty(); }  // ready_ holds one frame or one bracket

 private:
  using Clock = std::chrono::steady_clock;

  void accept(const v4l2::FilledBuffer& filled) {
    monotonic_ = filled.monotonic;
    if (old_exposures_ > 0) {
      --old_exposures_;
      stream_->give_back(filled.index);
      return;
    }
    const bool brackets = !spec_.settings.bracket_us.empty();
    Stamp stamp{filled.time_ns, steady_now_ns(), brackets ? count_.next() : count_.sequence_of(filled.sequence)};
    SourceItem item = frame_of(filled, stamp);
    if (!brackets) {
      ready_.push_back(std::move(item));
    } else if (auto* frame = std::get_if<Frame>(&item)) {
      bracket_.push_back(std::move(*frame));
      end_exposure();
    }
  }

  SourceItem frame_of(const v4l2::FilledBuffer& filled, const Stamp& stamp) {
    std::vector<std::uint8_t>
        own;  // without padding, as PixelConverter expects; empty if the driver gave too few bytes
    std::span<const std::uint8_t> bytes = filled.planes[0];
    if (format_.padded || format_.planes > 1) {
      own = format_.planes > 1
                ? nv12_without_padding(spec_.width, spec_.height, format_.row_bytes, filled.planes)
                : without_padding(format_.format, spec_.width, spec_.height, format_.row_bytes[0], filled.planes[0]);
      bytes = own;
    } else if (const auto size = bytes_of(format_.format, spec_.width, spec_.height)) {
      bytes = bytes.first(std::min(bytes.size(), *size));
    }
    if (spec_.stream == Stream::depth) {
      auto counts = filled.damaged ? std::nullopt : to_counts(spec_.width, spec_.height, bytes);
      stream_->give_back(filled.index);
      if (!counts) return LostFrame{stamp, spec_.stream, "the picture is damaged"};
      return RawDepth{stamp, std::move(*counts)};
    }
    auto rgb = filled.damaged ? std::nullopt : pixels_.to_rgb(format_.format, spec_.width, spec_.height, bytes);
    if (!rgb) {
      stream_->give_back(filled.index);
      return LostFrame{stamp, spec_.stream, "the picture is damaged"};
    }
    Frame frame{.stamp = stamp, .stream = spec_.stream, .exposure = exposure_, .encoded = std::move(*rgb)};
    if (format_.format == PixelFormat::rgb8) {
      stream_->give_back(filled.index);
      return frame;
    }
    std::shared_ptr<const void> lent = own.empty() ? stream_->lend(filled.index) : nullptr;
    if (lent) {
      frame.original = std::make_shared<RawFrame>(format_.format, bytes, std::move(lent));
      return frame;
    }
    if (own.empty()) own.assign(bytes.begin(), bytes.end());
    stream_->give_back(filled.index);
    frame.original = std::make_shared<RawFrame>(format_.format, std::move(own));
    return frame;
  }

  /// Lets the camera adapt to the light of the room until its pictures are stable, then holds what it has reached.
  void adapt() {
    const v4l2::AdaptedValues before = v4l2::let_adapt(stream_->device());
    const Clock::time_point end = Clock::now() + kV4l2Parameters.adapt_time;
    Clock::time_point reading = Clock::now();
    std::array<double, 3> last{};
    int stable = 0;
    while (stable < kV4l2Parameters.adapt_readings && Clock::now() < end && !finished()) {
      const std::optional<SourceItem> item = next(kLiveParameters.poll);
      const Frame* frame = item ? std::get_if<Frame>(&*item) : nullptr;
      if (frame == nullptr || Clock::now() < reading) continue;
      reading = Clock::now() + kV4l2Parameters.adapt_reading;
      const std::array<double, 3> mean = mean_of(frame->encoded);
      stable = std::ranges::equal(mean, last, equal_means) ? stable + 1 : 0;
      last = mean;
    }
    if (finished()) return;
    const std::string values = v4l2::hold(stream_->device(), before);
    adapted_ = std::string(name_of(spec_.stream)) + ": automatic exposure " +
               (stable < kV4l2Parameters.adapt_readings ? "still changes, and is held as it is" : "is held") +
               (values.empty() ? "" : ": " + values);
    // Some cameras return to a usual exposure between "manual" and the value that is held.
    drop_old_exposures();
    count_ = {};
  }

  static std::array<double, 3> mean_of(const Image<std::uint8_t>& rgb) {
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < rgb.data.size(); ++i) sum[i % 3] += rgb.data[i];
    for (double& one : sum) one /= static_cast<double>(rgb.data.size()) / 3.0;
    return sum;
  }

  static bool equal_means(double a, double b) {
    return std::abs(a - b) <= kV4l2Parameters.adapt_change * std::max(a, b);
  }

  /// Sets the next exposure of a bracket.
  void begin_exposure() {
    const std::vector<double>& all = spec_.settings.bracket_us;
    exposure_ = reported_.of_frame({v4l2::set_exposure_us(stream_->device(), all[bracket_.size()]), {}});
    drop_old_exposures();
  }

  /// After a change of exposure: drops the frames that have queued up and those that follow with the previous one.
  void drop_old_exposures() {
    old_exposures_ = kV4l2Parameters.old_exposures;
    while (const auto waiting = stream_->next(std::chrono::milliseconds(0))) stream_->give_back(waiting->index);
  }

  /// Delivers the bracket if it is complete, and starts the next exposure.
  void end_exposure() {
    if (bracket_.size() == spec_.settings.bracket_us.size()) {
      const Stamp last = bracket_.back().stamp;
      for (Frame& frame : bracket_) {
        frame.stamp = {last.time_ns, last.host_time_ns, count_.take()};
        ready_.push_back(std::move(frame));
      }
      bracket_.clear();
    }
    try {
      begin_exposure();
    } catch (const InputError& e) {
      fault_ = e.what();
    }
  }

  StreamSpec spec_;
  v4l2::NegotiatedFormat format_;
  PixelConverter pixels_;
  std::unique_ptr<v4l2::Stream> stream_;
  std::deque<SourceItem> ready_;
  std::vector<Frame> bracket_;  ///< incomplete bracket
  ReportedExposure reported_;
  double exposure_ = 1.0;  ///< of frames from now on: V4L2 reports what is set, not what a frame was taken with
  int old_exposures_ = 0;  ///< frames still to drop, which may have the previous exposure
  std::string fault_;      ///< in addition to the stream's
  std::string adapted_;    ///< what automatic exposure has reached, to be reported once
  bool monotonic_ = false;
  SequenceUnwrapper count_;
};

V4l2Source::V4l2Source(const std::string& camera, const StreamSpec& spec)
    : ForwardingSource(with_error_context("v4l2:" + camera, [&] { return std::make_shared<Camera>(camera, spec); })) {}

}  // namespace lumigraft::capture
