#include "capture/live/libcamera/camera.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "capture/error.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture::libcam {
namespace {

/// Whether a media device may not be opened: libcamera silently ignores its cameras.
bool any_camera_is_forbidden() {
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (entry.path().filename().string().starts_with("media") &&
        faccessat(AT_FDCWD, entry.path().c_str(), R_OK | W_OK, AT_EACCESS) != 0 && errno == EACCES) {
      return true;
    }
  }
  return false;
}

std::shared_ptr<libcamera::Camera> find(const std::string& name) {
  for (const auto& camera : cameras()) {
    if (name.empty() || camera->id() == name || model_of(*camera) == name) return camera;
  }
  throw CameraFault(any_camera_is_forbidden()
                        ? "found no permission to use all cameras, allowed: root and members of the group video"
                        : "found no such camera, or another program has it");
}

void check(int result, const char* what) {
  if (result < 0) throw CameraFault(std::string(what) + ": " + std::strerror(-result));
}

/// Refuses YUV encodings and value ranges that PixelConverter does not assume.
void check_colors(const libcamera::StreamConfiguration& stream, PixelFormat format) {
  using Space = libcamera::ColorSpace;
  refuse_if(stream.colorSpace && is_yuv(format) &&
                (stream.colorSpace->ycbcrEncoding != Space::YcbcrEncoding::Rec601 ||
                 stream.colorSpace->range != Space::Range::Limited),
            "found " + std::string(name_of(format)) +
                " of another kind than BT.601 from 16 to 235, allowed: pixel_format rgb8 or mjpeg");
}

}  // namespace

Camera::Camera(const std::string& name, const StreamSpec& spec, Send send)
    : spec_(spec), send_(std::move(send)), camera_(find(name)) {
  if (const int error = camera_->acquire(); error != 0) {
    throw CameraFault(error == -EBUSY ? "the camera is in use by another program" : std::strerror(-error));
  }
  negotiate_format();
  make_requests();
}

const std::vector<std::unique_ptr<libcamera::FrameBuffer>>& Camera::buffers() const {
  return allocator_->buffers(configuration_->at(0).stream());
}

void Camera::negotiate_format() {
  std::string offered;
  for (const libcamera::StreamRole role : kRoles) {
    configuration_ = camera_->generateConfiguration({role});
    if (!configuration_ || configuration_->empty()) continue;
    for (const libcamera::PixelFormat& format : configuration_->at(0).formats().pixelformats()) {
      const auto ours = pixel_format_of(format);
      const std::string name = ours ? " " + std::string(name_of(*ours)) : "";
      offered += offered.find(name) == std::string::npos ? name : "";
    }
    for (const PixelFormat format : kPreferredFormats) {
      if ((!spec_.settings.pixel_format || spec_.settings.pixel_format == format) && try_format(format)) return;
    }
  }
  const auto wanted = spec_.settings.pixel_format;
  throw InputError("found no pixel format " + std::string(wanted ? name_of(*wanted) : "that is known") +
                   ", offered:" + offered);
}

/// False if the camera does not offer the format.
bool Camera::try_format(PixelFormat format) {
  libcamera::StreamConfiguration& stream = configuration_->at(0);
  const auto formats = stream.formats().pixelformats();
  const std::optional<libcamera::PixelFormat> wanted = libcamera_format_of(format);
  if (!wanted || std::find(formats.begin(), formats.end(), *wanted) == formats.end()) return false;
  stream.pixelFormat = *wanted;
  stream.size = {static_cast<unsigned>(spec_.width), static_cast<unsigned>(spec_.height)};
  stream.bufferCount = std::max(stream.bufferCount, kLibcameraParameters.buffers);
  const auto status = configuration_->validate();
  const libcamera::Size given = stream.size;
  refuse_if(status == libcamera::CameraConfiguration::Invalid || stream.pixelFormat != *wanted ||
                static_cast<int>(given.width) != spec_.width || static_cast<int>(given.height) != spec_.height,
            "found a camera that gives " + stream.toString() + ", allowed by the session: " +
                size_text(spec_.width, spec_.height) + ", " + std::string(name_of(format)));
  check_colors(stream, format);
  check(camera_->configure(configuration_.get()), "format");
  format_ = format;
  return true;
}

void Camera::make_requests() {
  libcamera::Stream* stream = configuration_->at(0).stream();
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  check(allocator_->allocate(stream), "buffers");
  for (const auto& buffer : buffers()) {
    auto request = camera_->createRequest(requests_.size());
    if (!request || request->addBuffer(stream, buffer.get()) != 0 || buffer->planes().size() > kMaxPlanes) {
      throw CameraFault("buffers: libcamera takes no request");
    }
    requests_.push_back(std::move(request));
  }
  for (const auto& [id, value] : controls_for(camera_->controls(), spec_.settings)) {
    requests_.front()->controls().set(id, value);  // takes effect with the first frame and stays
  }
}

void Camera::start() {
  camera_->requestCompleted.connect(this, &Camera::completed);
  camera_->disconnected.connect(this, &Camera::disconnected);
  check(camera_->start(), "start");
  for (const auto& request : requests_) check(camera_->queueRequest(request.get()), "start");
}

void Camera::give_back(std::uint32_t index) {
  if (index < requests_.size()) {
    requests_[index]->reuse(libcamera::Request::ReuseBuffers);
    camera_->queueRequest(requests_[index].get());  // if the camera is gone, disconnected() is called
  }
}

void Camera::completed(libcamera::Request* request) {
  if (request->status() != libcamera::Request::RequestComplete) return;
  const libcamera::FrameMetadata& frame = request->buffers().begin()->second->metadata();
  const libcamera::ControlList& metadata = request->metadata();
  HelperMessage message;
  message.kind = HelperMessage::Kind::frame;
  message.index = static_cast<std::uint32_t>(request->cookie());
  message.complete = frame.status == libcamera::FrameMetadata::FrameSuccess;
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.planes().size(), kMaxPlanes); ++i) {
    message.used[i] = frame.planes()[i].bytesused;
  }
  message.time_ns =
      metadata.get(libcamera::controls::SensorTimestamp).value_or(static_cast<std::int64_t>(frame.timestamp));
  message.sequence = frame.sequence;
  message.reported = reported_in(metadata);
  send_(message);
}

/// libcamera would abort the process at the next call.
void Camera::disconnected() { _exit(0); }

}  // namespace lumigraft::capture::libcam
