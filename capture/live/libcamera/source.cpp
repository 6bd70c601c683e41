#include "capture/live/libcamera/source.h"

#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "capture/camera/camera_serial.h"
#include "capture/descriptor.h"
#include "capture/error.h"
#include "capture/live/helper_process.h"
#include "capture/live/libcamera/messages.h"
#include "capture/live/parameters.h"
#include "capture/live/sequence_unwrapper.h"
#include "capture/message_text.h"

namespace lumigraft::capture {
namespace {

using libcam::HelperMessage;
using Bytes = std::span<const std::uint8_t>;

/// A plane of a buffer in memory.
struct MappedPlane {
  std::shared_ptr<void> mapping;  ///< of the plane's descriptor, from its first byte
  Bytes bytes;
};

std::vector<MappedPlane> mapped(const HelperMessage& memory, const std::vector<Descriptor>& files) {
  std::vector<MappedPlane> planes;
  for (std::uint32_t i = 0; i < std::min<std::size_t>(memory.planes, files.size()); ++i) {
    const auto [offset, length] = memory.plane[i];
    const std::size_t size = std::size_t{offset} + length;
    void* begin = mmap(nullptr, size, PROT_READ, MAP_SHARED, files[i].number(), 0);
    if (begin == MAP_FAILED) throw CameraFault(std::string("buffers: ") + std::strerror(errno));
    planes.push_back({{begin, [size](void* mapping) { munmap(mapping, size); }},
                      {static_cast<const std::uint8_t*>(begin) + offset, length}});
  }
  return planes;
}

/// State shared by the camera and the holders of lent buffers.
struct Shared {
  void give_back(std::uint32_t index) {
    const std::lock_guard lock(mutex);
    ++with_driver;
    if (socket.number() >= 0) {
      send(socket.number(), &index, sizeof index, MSG_NOSIGNAL);  // receive() reports a helper that is gone
    }
  }

  std::mutex mutex;
  Descriptor socket;                              ///< empty after the camera was closed
  int with_driver = 0;                            ///< number of buffers that the driver has
  std::vector<std::vector<MappedPlane>> buffers;  ///< by index
};

std::string text_of(double value) { return formatted("%.17g", value); }

std::vector<std::string> helper_arguments(const std::string& camera, const StreamSpec& spec) {
  std::vector<std::string> arguments = {"open", camera, std::to_string(spec.width), std::to_string(spec.height)};
  const CameraSettings& s = spec.settings;
  if (s.pixel_format) arguments.push_back("pixel_format=" + std::string(name_of(*s.pixel_format)));
  const std::pair<const char*, std::optional<double>> numbers[] = {
      {"rate_hz", s.rate_hz}, {"exposure_us", s.exposure_us}, {"gain", s.gain}};
  for (const auto& [key, value] : numbers) {
    if (value) arguments.push_back(std::string(key) + "=" + text_of(*value));
  }
  for (const auto& [name, value] : s.controls) arguments.push_back("controls." + name + "=" + text_of(value));
  return arguments;
}

}  // namespace

/// The camera from opening to closing. The constructor throws with the reason alone.
class LibcameraSource::Camera : public Source {
 public:
  Camera(const std::string& name, const StreamSpec& spec) : spec_(spec), exposure_(spec) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) throw CameraFault(std::strerror(errno));
    shared_->socket = Descriptor(ends[0]);
    {
      const Descriptor helper_end(ends[1]);  // closed in this process, which so notices if the helper dies
      process_ = std::make_unique<HelperProcess>("lumigraft_libcamera", helper_arguments(name, spec),
                                                 helper_end.number(), libcam::kHelperSocket);
    }
    const HelperMessage opened = demand(HelperMessage::Kind::opened).first;
    serial_ = opened.text.data();
    check_serial(serial_, spec_.serial);
    format_ = opened.format;
    stride_ = opened.stride;
    shared_->buffers.resize(opened.buffers);
    for (std::uint32_t i = 0; i < opened.buffers; ++i) {
      const auto [memory, files] = demand(HelperMessage::Kind::memory);
      if (memory.index < shared_->buffers.size()) shared_->buffers[memory.index] = mapped(memory, files);
    }
    shared_->with_driver = static_cast<int>(opened.buffers);
  }
  ~Camera() override {
    const std::lock_guard lock(shared_->mutex);
    process_.reset();
    shared_->socket = Descriptor();
  }

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
    auto message = receive(timeout);
    if (message && refused(message->first)) return std::nullopt;
    return message && message->first.kind == HelperMessage::Kind::frame &&
                   message->first.index < shared_->buffers.size()
               ? std::optional(to_item(message->first))
               : std::nullopt;
  }

  bool finished() const override { return !fault_.empty(); }
  void rewind() override {}
  std::string fault() const override { return fault_; }
  std::string take_warning() override { return exposure_.take_warning(); }
  std::string serial() const override { return serial_; }
  bool on_host_clock() const override { return true; }
  pid_t process() const { return process_->id(); }

 private:
  using Received = std::pair<HelperMessage, std::vector<Descriptor>>;

  /// Empty: timeout, or the camera is gone (fault()).
  std::optional<Received> receive(std::chrono::milliseconds timeout) {
    pollfd waiting{shared_->socket.number(), POLLIN, 0};
    if (!fault_.empty() || poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return std::nullopt;
    Received out;
    iovec piece{&out.first, sizeof out.first};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(libcam::kMaxPlanes * sizeof(int))> room{};
    msghdr envelope{};
    envelope.msg_iov = &piece;
    envelope.msg_iovlen = 1;
    envelope.msg_control = room.data();
    envelope.msg_controllen = room.size();
    if (recvmsg(waiting.fd, &envelope, MSG_CMSG_CLOEXEC) != static_cast<ssize_t>(sizeof out.first)) {
      fault_ = "the camera is disconnected";
      return std::nullopt;
    }
    for (cmsghdr* head = CMSG_FIRSTHDR(&envelope); head != nullptr; head = CMSG_NXTHDR(&envelope, head)) {
      std::vector<int> numbers((head->cmsg_len - CMSG_LEN(0)) / sizeof(int));
      std::memcpy(numbers.data(), CMSG_DATA(head), numbers.size() * sizeof(int));
      for (const int number : numbers) out.second.emplace_back(number);
    }
    return out;
  }

  /// Whether the camera failed after it was opened.
  bool refused(const HelperMessage& message) {
    if (message.kind == HelperMessage::Kind::unavailable) fault_ = message.text.data();
    return !fault_.empty();
  }

  /// Waits for a message of that kind; throws the helper's reason if another one comes.
  Received demand(HelperMessage::Kind kind) {
    auto received = receive(kLibcameraParameters.open_timeout);
    if (!received) throw CameraFault(fault_.empty() ? "libcamera does not answer" : fault_);
    if (received->first.kind == HelperMessage::Kind::unfit) throw InputError(received->first.text.data());
    if (received->first.kind != kind) throw CameraFault(received->first.text.data());
    return std::move(*received);
  }

  SourceItem to_item(const HelperMessage& frame) {
    {
      const std::lock_guard lock(shared_->mutex);
      --shared_->with_driver;
    }
    // The buffer returns to the driver with the last copy of this.
    std::shared_ptr<const void> lent(
        shared_.get(), [shared = shared_, index = frame.index](const void*) { shared->give_back(index); });
    const Stamp stamp{frame.time_ns, steady_now_ns(), count_.sequence_of(frame.sequence)};
    const double exposure = exposure_.of_frame(frame.reported);
    std::vector<std::uint8_t> own;
    const Bytes bytes = frame.complete ? bytes_of_frame(frame, own) : Bytes();
    auto rgb = bytes.empty() ? std::nullopt : pixels_.to_rgb(format_, spec_.width, spec_.height, bytes);
    if (!rgb) return LostFrame{stamp, spec_.stream, "the picture is damaged"};
    Frame picture{.stamp = stamp,
                  .stream = spec_.stream,
                  .exposure = exposure,
                  .readout_s = frame.reported.readout_s,
                  .encoded = std::move(*rgb)};
    if (format_ == PixelFormat::rgb8) return picture;
    if (own.empty() && can_spare()) {
      picture.original = std::make_shared<RawFrame>(format_, bytes, std::move(lent));
      return picture;
    }
    if (own.empty()) own.assign(bytes.begin(), bytes.end());
    picture.original = std::make_shared<RawFrame>(format_, std::move(own));
    return picture;
  }

  bool can_spare() const {
    const std::lock_guard lock(shared_->mutex);
    return 2 * shared_->with_driver >= static_cast<int>(shared_->buffers.size());  // half stays with the driver
  }

  /// The frame's bytes without padding: in the driver's memory if possible, else copied to `own`. Empty if too short.
  Bytes bytes_of_frame(const HelperMessage& frame, std::vector<std::uint8_t>& own) const {
    const std::vector<MappedPlane>& planes = shared_->buffers[frame.index];
    const auto plane = [&](std::size_t i) {
      const Bytes bytes = i < planes.size() ? planes[i].bytes : Bytes();
      return bytes.first(std::min<std::size_t>(bytes.size(), frame.used[i]));
    };
    if (format_ == PixelFormat::mjpeg) return plane(0);
    const std::size_t wanted = *bytes_of(format_, spec_.width, spec_.height);
    if (format_ == PixelFormat::nv12 && planes.size() == 2) {
      own = nv12_without_padding(spec_.width, spec_.height, {stride_, stride_}, {plane(0), plane(1)});
      return own;
    }
    const auto width = static_cast<std::size_t>(spec_.width);
    const std::size_t row = format_ == PixelFormat::nv12 ? width : wanted / static_cast<std::size_t>(spec_.height);
    if (stride_ != row) {
      own = without_padding(format_, spec_.width, spec_.height, stride_, plane(0));
      return own;
    }
    return plane(0).size() >= wanted ? plane(0).first(wanted) : Bytes();
  }

  StreamSpec spec_;
  PixelFormat format_ = PixelFormat::rgb8;
  std::size_t stride_ = 0;
  PixelConverter pixels_;
  ReportedExposure exposure_;
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  std::unique_ptr<HelperProcess> process_;
  std::string fault_, serial_;
  SequenceUnwrapper count_;
};

LibcameraSource::LibcameraSource(const std::string& camera, const StreamSpec& spec)
    : ForwardingSource(
          with_error_context("libcamera:" + camera, [&] { return std::make_shared<Camera>(camera, spec); })) {}

pid_t LibcameraSource::process() const { return static_cast<const Camera&>(*source_).process(); }

}  // namespace lumigraft::capture
