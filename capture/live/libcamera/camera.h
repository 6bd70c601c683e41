#pragma once
// A camera driven by libcamera, in the helper process. Included by .cpp files alone.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/live/libcamera/library.h"
#include "capture/live/libcamera/messages.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::libcam {

class Camera {
 public:
  using Send = std::function<void(const HelperMessage&)>;

  /// Negotiates the session's format with the camera and allocates buffers. Throws CameraFault or InputError with the
  /// reason alone. `send` is called for each frame on a thread of libcamera.
  Camera(const std::string& name, const StreamSpec& spec, Send send);

  const libcamera::Camera& camera() const { return *camera_; }
  PixelFormat format() const { return format_; }
  std::uint32_t stride() const { return configuration_->at(0).stride; }
  const std::vector<std::unique_ptr<libcamera::FrameBuffer>>& buffers() const;

  void start();
  /// Returns a buffer to the camera.
  void give_back(std::uint32_t index);

 private:
  void negotiate_format();
  bool try_format(PixelFormat format);
  void make_requests();
  void completed(libcamera::Request* request);
  void disconnected();

  StreamSpec spec_;
  Send send_;
  PixelFormat format_ = PixelFormat::rgb8;
  std::shared_ptr<libcamera::Camera> camera_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;
};

}  // namespace lumigraft::capture::libcam
