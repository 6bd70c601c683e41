#pragma once
// A camera as libcamera runs it, in the helper's process. Included by .cpp files alone.
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
  using Tell = std::function<void(const HelperMessage&)>;

  /// Agrees with the camera on what the session wants, and makes buffers. Throws CameraFault or InputError with the
  /// reason alone. `tell` is called on a thread of libcamera's for each picture.
  Camera(const std::string& name, const StreamSpec& spec, Tell tell);

  const libcamera::Camera& camera() const { return *camera_; }
  PixelFormat format() const { return format_; }
  std::uint32_t stride() const { return configuration_->at(0).stride; }
  const std::vector<std::unique_ptr<libcamera::FrameBuffer>>& buffers() const;

  void start();
  /// The buffer may be filled again.
  void give_back(std::uint32_t index);

 private:
  void agree();
  bool agree(PixelFormat format);
  void make_requests();
  void completed(libcamera::Request* request);
  void disconnected();

  StreamSpec spec_;
  Tell tell_;
  PixelFormat format_ = PixelFormat::rgb8;
  std::shared_ptr<libcamera::Camera> camera_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;
};

}  // namespace lumigraft::capture::libcam
