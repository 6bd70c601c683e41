#pragma once
// An OpenGL 4.5 context without a window, and the state shared by everything created from it. Textures, buffers,
// pipelines and lists hold it by shared_ptr, so it is destroyed last.
//
// OpenGL has one current context per thread. Code that calls OpenGL holds a Current for that time; it makes the context
// current and releases it at the end, so that the device may be used from another thread next time.
#include <EGL/egl.h>
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <array>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "relight/gpu/device.h"
#include "relight/gpu/messages.h"

namespace lumigraft::relight::gpu::egl {

/// Reason of this thread's last failed EGL call.
std::string egl_error_text();

/// The EGL objects only. One that hangs is not entered, and not destroyed, any more.
struct ContextHandle {
  ContextHandle(EGLDisplay of_display, bool debug);  ///< throws GpuError with the reason
  ~ContextHandle() {
    if (!hung) eglDestroyContext(display, context);
  }
  ContextHandle(const ContextHandle&) = delete;
  ContextHandle& operator=(const ContextHandle&) = delete;

  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  bool hung = false;
};

/// Makes the context current in this thread during its lifetime.
class Current {
 public:
  explicit Current(const ContextHandle& handle);                  ///< throws DeviceLost on failure
  Current(const ContextHandle& handle, std::nothrow_t) noexcept;  ///< for destructors, which check good()
  ~Current();
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;
  bool good() const { return good_; }

 private:
  EGLDisplay display_;
  EGLContext before_;
  EGLDisplay display_before_;
  bool entered_ = false, good_ = true;
};

struct Limits {
  std::size_t texture_edge = 0, volume_edge = 0, storage_bytes = 0, params_alignment = 0;
  std::array<std::uint32_t, 3> groups{};
};

class Context {
 public:
  Context(std::unique_ptr<ContextHandle> handle, const DeviceOptions& options);
  ~Context();

  const ContextHandle& handle() const { return *handle_; }
  const std::string& name() const { return name_; }
  bool is_software() const { return is_software_; }
  const Limits& limits() const { return limits_; }
  const std::shared_ptr<Holdings>& holdings() const { return holdings_; }
  GLuint sampler(const Sampling& sampling) const { return samplers_[sampling.index()]; }
  GLuint framebuffer() const { return framebuffer_; }  ///< attachments of the current draw
  GLuint params() const { return params_; }            ///< uniform blocks of the current list
  GLuint timestamp(std::size_t index);                 ///< a query object, reused by later lists

  Current enter() const { return Current(*handle_); }
  /// Throws GpuError if OpenGL or its debug output has reported an error since the last call, DeviceLost if the context
  /// is lost.
  void check(const std::string& doing);
  /// Waits until all that was said before is done, and checks. Throws DeviceHung, too.
  void finish(const std::string& doing);

 private:
  void read_limits();
  void create_objects();

  std::shared_ptr<Holdings> holdings_ = std::make_shared<Holdings>();
  Messages messages_{"OpenGL debug output"};
  std::unique_ptr<ContextHandle> handle_;
  std::string name_;
  bool is_software_ = false;
  std::chrono::milliseconds hangs_after_{0};
  Limits limits_;
  std::array<GLuint, Sampling::kCount> samplers_{};
  GLuint framebuffer_ = 0, params_ = 0;
  std::vector<GLuint> timestamps_;
};

}  // namespace lumigraft::relight::gpu::egl
