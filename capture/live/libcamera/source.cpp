#include "capture/live/libcamera/source.h"

#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "capture/camera/camera_serial.h"
#include "capture/error.h"
#include "capture/live/error_context.h"
#include "capture/live/helper_process.h"
#include "capture/live/libcamera/messages.h"
#include "capture/live/sequence_unwrapper.h"

namespace lumigraft::capture {
namespace {

using libcam::HelperMessage;
using Bytes = std::span<const std::uint8_t>;
constexpr std::chrono::seconds kPatience{10};  ///< until the camera runs

class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) {
      close(number_);
    }
  }
  int number() const { return number_; }

 private:
  int number_;
};

/// A buffer's planes, mapped from its first byte on.
class Mapped {
 public:
  Mapped() = default;
  Mapped(const HelperMessage& memory, const std::vector<Descriptor>& files) {
    for (std::uint32_t i = 0; i < std::min<std::size_t>(memory.planes, files.size()); ++i) {
      const std::size_t size = std::size_t{memory.plane[i].offset} + memory.plane[i].length;
      void* begin = mmap(nullptr, size, PROT_READ, MAP_SHARED, files[i].number(), 0);
      if (begin == MAP_FAILED) {
        throw CameraFault(std::string("buffers: ") + std::strerror(errno));
      }
      files_.emplace_back(begin, size);
      planes_.emplace_back(static_cast<const std::uint8_t*>(begin) + memory.plane[i].offset, memory.plane[i].length);
    }
  }
  Mapped(Mapped&&) = default;
  Mapped& operator=(Mapped&& other) noexcept {
    std::swap(files_, other.files_);
    std::swap(planes_, other.planes_);
    return *this;
  }
  ~Mapped() {
    for (const auto& [begin, size] : files_) {
      munmap(begin, size);
    }
  }

  const std::vector<Bytes>& planes() const { return planes_; }

 private:
  std::vector<std::pair<void*, std::size_t>> files_;
  std::vector<Bytes> planes_;
};

/// What those who hold a lent picture share with the camera.
struct Shared {
  void give_back(std::uint32_t index) {
    const std::lock_guard lock(mutex);
    ++with_driver;
    if (socket.number() >= 0) {
      send(socket.number(), &index, sizeof index, MSG_NOSIGNAL);  // a helper that is gone says so by itself
    }
  }

  std::mutex mutex;
  Descriptor socket;  ///< empty once the camera is closed
  int with_driver = 0;
  std::vector<Mapped> memory;  ///< by index
};

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::vector<std::string> words_for(const std::string& camera, const StreamSpec& spec) {
  std::vector<std::string> words = {"open", camera, std::to_string(spec.width), std::to_string(spec.height),
                                    text_of(spec.exposure)};
  const CameraSettings& s = spec.settings;
  if (s.pixel_format) {
    words.push_back("pixel_format=" + std::string(name_of(*s.pixel_format)));
  }
  const std::pair<const char*, std::optional<double>> numbers[] = {
      {"rate_hz", s.rate_hz}, {"exposure_us", s.exposure_us}, {"gain", s.gain}};
  for (const auto& [key, value] : numbers) {
    if (value) {
      words.push_back(std::string(key) + "=" + text_of(*value));
    }
  }
  for (const auto& [name, value] : s.controls) {
    words.push_back("controls." + name + "=" + text_of(value));
  }
  return words;
}

}  // namespace

/// One run of the camera. The constructor throws with the reason alone.
class LibcameraSource::Camera {
 public:
  Camera(const std::string& name, const StreamSpec& spec) : spec_(spec) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
      throw CameraFault(std::strerror(errno));
    }
    shared_->socket = Descriptor(ends[0]);
    const Descriptor theirs(ends[1]);
    process_ = std::make_unique<HelperProcess>("lumigraft_libcamera", words_for(name, spec), theirs.number(),
                                               libcam::kHelperSocket);
  }
  /// Apart from the constructor, so that the helper's own end is closed here by then, and its death seen.
  void open() {
    const HelperMessage opened = demand(HelperMessage::Kind::opened).first;
    serial_ = opened.text.data();
    check_serial(serial_, spec_.serial);
    format_ = opened.format;
    stride_ = opened.stride;
    shared_->memory.resize(opened.buffers);
    for (std::uint32_t i = 0; i < opened.buffers; ++i) {
      const auto [memory, files] = demand(HelperMessage::Kind::memory);
      if (memory.index < shared_->memory.size()) {
        shared_->memory[memory.index] = Mapped(memory, files);
      }
    }
    shared_->with_driver = static_cast<int>(opened.buffers);
  }
  ~Camera() {
    const std::lock_guard lock(shared_->mutex);
    process_.reset();
    shared_->socket = Descriptor();
  }
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) {
    auto message = hear(timeout);
    if (message && refused(message->first)) {
      return std::nullopt;
    }
    return message && message->first.kind == HelperMessage::Kind::picture &&
                   message->first.index < shared_->memory.size()
               ? std::optional(take(message->first))
               : std::nullopt;
  }

  const std::string& fault() const { return trouble_; }
  const std::string& serial() const { return serial_; }
  pid_t process() const { return process_->id(); }

 private:
  using Heard = std::pair<HelperMessage, std::vector<Descriptor>>;

  /// Empty: nothing came, or trouble() says why nothing will.
  std::optional<Heard> hear(std::chrono::milliseconds timeout) {
    pollfd waiting{shared_->socket.number(), POLLIN, 0};
    if (!trouble_.empty() || poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) {
      return std::nullopt;
    }
    Heard out;
    iovec piece{&out.first, sizeof out.first};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(libcam::kMostPlanes * sizeof(int))> room{};
    msghdr whole{};
    whole.msg_iov = &piece;
    whole.msg_iovlen = 1;
    whole.msg_control = room.data();
    whole.msg_controllen = room.size();
    if (recvmsg(waiting.fd, &whole, MSG_CMSG_CLOEXEC) != static_cast<ssize_t>(sizeof out.first)) {
      trouble_ = "the camera is gone";
      return std::nullopt;
    }
    for (cmsghdr* head = CMSG_FIRSTHDR(&whole); head != nullptr; head = CMSG_NXTHDR(&whole, head)) {
      std::vector<int> numbers((head->cmsg_len - CMSG_LEN(0)) / sizeof(int));
      std::memcpy(numbers.data(), CMSG_DATA(head), numbers.size() * sizeof(int));
      for (const int number : numbers) {
        out.second.emplace_back(number);
      }
    }
    return out;
  }

  /// What went wrong after the camera was opened.
  bool refused(const HelperMessage& message) {
    if (message.kind == HelperMessage::Kind::unavailable) {
      trouble_ = message.text.data();
    }
    return !trouble_.empty();
  }

  Heard demand(HelperMessage::Kind kind) {
    auto heard = hear(std::chrono::duration_cast<std::chrono::milliseconds>(kPatience));
    if (!heard) {
      throw CameraFault(trouble_.empty() ? "libcamera does not answer" : trouble_);
    }
    if (heard->first.kind == HelperMessage::Kind::unfit) {
      throw InputError(heard->first.text.data());
    }
    if (heard->first.kind != kind) {
      throw CameraFault(heard->first.text.data());
    }
    return std::move(*heard);
  }

  SourceItem take(const HelperMessage& said) {
    {
      const std::lock_guard lock(shared_->mutex);
      --shared_->with_driver;
    }
    // Lent until the last copy of this goes.
    std::shared_ptr<const void> lent(shared_.get(),
                                     [shared = shared_, index = said.index](const void*) { shared->give_back(index); });
    const Stamp stamp{said.time_ns, steady_now_ns(), count_.sequence_of(said.sequence)};
    std::vector<std::uint8_t> own;
    const Bytes bytes = said.whole ? bytes_of_picture(said, own) : Bytes();
    auto rgb = bytes.empty() ? std::nullopt : pixels_.to_rgb(format_, spec_.width, spec_.height, bytes);
    if (!rgb) {
      return LostPicture{stamp, spec_.stream, "the picture is damaged"};
    }
    Picture picture;
    picture.stamp = stamp;
    picture.stream = spec_.stream;
    picture.exposure = said.exposure;
    picture.encoded = std::move(*rgb);
    if (format_ == PixelFormat::rgb8) {
      return picture;
    }
    if (own.empty() && can_spare()) {
      picture.original = std::make_shared<CameraPicture>(format_, bytes, std::move(lent));
      return picture;
    }
    if (own.empty()) {
      own.assign(bytes.begin(), bytes.end());
    }
    picture.original = std::make_shared<CameraPicture>(format_, std::move(own));
    return picture;
  }

  bool can_spare() const {
    const std::lock_guard lock(shared_->mutex);
    return 2 * shared_->with_driver >= static_cast<int>(shared_->memory.size());  // the driver keeps half
  }

  /// In the driver's memory where it lies there as it is kept, else in `own`. Empty where it is too short.
  Bytes bytes_of_picture(const HelperMessage& said, std::vector<std::uint8_t>& own) const {
    const std::vector<Bytes>& planes = shared_->memory[said.index].planes();
    const auto plane = [&](std::size_t i) {
      return i < planes.size() ? planes[i].first(std::min<std::size_t>(planes[i].size(), said.used[i])) : Bytes();
    };
    if (format_ == PixelFormat::mjpeg) {
      return plane(0);
    }
    const std::size_t wanted = *bytes_of(format_, spec_.width, spec_.height);
    if (format_ == PixelFormat::nv12 && planes.size() == 2) {
      // The rows of both its halves are as wide as grey ones.
      own = without_padding(PixelFormat::grey8, spec_.width, spec_.height, stride_, plane(0));
      const auto colors = without_padding(PixelFormat::grey8, spec_.width, spec_.height / 2, stride_, plane(1));
      own.insert(own.end(), colors.begin(), colors.end());
      return own.size() == wanted ? Bytes(own) : Bytes();
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
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  std::unique_ptr<HelperProcess> process_;
  std::string trouble_, serial_;
  SequenceUnwrapper count_;
};

LibcameraSource::LibcameraSource(const std::string& camera, const StreamSpec& spec) {
  with_error_context("libcamera:" + camera, [&] {
    camera_ = std::make_unique<Camera>(camera, spec);
    camera_->open();
  });
}

LibcameraSource::~LibcameraSource() = default;

std::optional<SourceItem> LibcameraSource::next(std::chrono::milliseconds timeout) { return camera_->next(timeout); }

bool LibcameraSource::finished() const { return !camera_->fault().empty(); }

std::string LibcameraSource::fault() const { return camera_->fault(); }

std::string LibcameraSource::serial() const { return camera_->serial(); }

pid_t LibcameraSource::process() const { return camera_->process(); }

}  // namespace lumigraft::capture
