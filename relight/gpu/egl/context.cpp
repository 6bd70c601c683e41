#include "relight/gpu/egl/context.h"

#include <EGL/eglext.h>

#include <map>

#include "relight/gpu/egl/choose_device.h"
#include "relight/gpu/hang.h"

namespace lumigraft::relight::gpu::egl {
namespace {

std::string text_of(GLenum error) {
  const std::map<GLenum, std::string> texts{
      {GL_OUT_OF_MEMORY, "out of device memory"},
      {GL_CONTEXT_LOST, "the device was lost (it hung, crashed or was removed)"},
      {GL_INVALID_ENUM, "GL_INVALID_ENUM"},
      {GL_INVALID_VALUE, "GL_INVALID_VALUE"},
      {GL_INVALID_OPERATION, "GL_INVALID_OPERATION"},
      {GL_INVALID_FRAMEBUFFER_OPERATION, "GL_INVALID_FRAMEBUFFER_OPERATION"},
  };
  const auto text = texts.find(error);
  return text == texts.end() ? "OpenGL error " + std::to_string(error) : text->second;
}

/// Drivers also use the debug output for information (buffer locations, compiled shaders); errors have one of these
/// types.
void APIENTRY on_message(GLenum, GLenum type, GLuint, GLenum severity, GLsizei length, const GLchar* text,
                         const void* messages) {
  const bool wrong = type == GL_DEBUG_TYPE_ERROR || type == GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR ||
                     type == GL_DEBUG_TYPE_DEPRECATED_BEHAVIOR || type == GL_DEBUG_TYPE_PORTABILITY;
  if (!wrong || severity == GL_DEBUG_SEVERITY_NOTIFICATION) return;
  const std::size_t size = length < 0 ? std::char_traits<char>::length(text) : static_cast<std::size_t>(length);
  static_cast<Messages*>(const_cast<void*>(messages))->add(std::string(text, size));
}

GLint integer(GLenum what) {
  GLint value = 0;
  glGetIntegerv(what, &value);
  return value;
}

}  // namespace

std::string egl_error_text() {
  static const std::string missing = "the driver does not have it", lost = "the device was lost";
  static const std::map<EGLint, std::string> texts{
      {EGL_BAD_ALLOC, "out of memory"},
      {EGL_BAD_MATCH, missing},
      {EGL_BAD_ATTRIBUTE, missing},
      {EGL_BAD_CONFIG, missing},
      {EGL_BAD_ACCESS, "another thread is using it, or access is denied"},
      {EGL_NOT_INITIALIZED, "the driver could not start, or was shut down"},
      {EGL_BAD_CONTEXT, lost},
      {EGL_CONTEXT_LOST, lost},
  };
  const EGLint error = eglGetError();
  const auto text = texts.find(error);
  return text == texts.end() ? "EGL error " + std::to_string(error) : text->second;
}

ContextHandle::ContextHandle(EGLDisplay of_display, bool debug) : display(of_display) {
  eglBindAPI(EGL_OPENGL_API);
  // Requests notification of a reset, if supported; otherwise a reset device would continue without results.
  for (const bool tells_reset : {true, false}) {
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,
        4,
        EGL_CONTEXT_MINOR_VERSION,
        5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
        EGL_CONTEXT_OPENGL_DEBUG,
        debug ? EGL_TRUE : EGL_FALSE,
        tells_reset ? EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY : EGL_NONE,
        EGL_LOSE_CONTEXT_ON_RESET,
        EGL_NONE,
    };
    context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context != EGL_NO_CONTEXT) return;
  }
  throw GpuError("no OpenGL 4.5 context: " + egl_error_text());
}

Current::Current(const ContextHandle& handle) : Current(handle, std::nothrow) {
  if (handle.hung) throw DeviceHung("OpenGL hangs");
  if (!good_) throw DeviceLost("OpenGL cannot be entered any more: " + egl_error_text());
}

Current::Current(const ContextHandle& handle, std::nothrow_t) noexcept : display_(handle.display) {
  eglBindAPI(EGL_OPENGL_API);
  before_ = eglGetCurrentContext();
  display_before_ = eglGetCurrentDisplay();
  good_ = !handle.hung;
  if (!good_) return;
  if (before_ == handle.context) return;
  entered_ = good_ = eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, handle.context) == EGL_TRUE;
}

Current::~Current() {
  if (!entered_) return;
  const EGLDisplay display = before_ == EGL_NO_CONTEXT ? display_ : display_before_;
  eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, before_);
}

Context::Context(std::unique_ptr<ContextHandle> handle, const DeviceOptions& options) : handle_(std::move(handle)) {
  const Current current = enter();
  name_ = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  is_software_ = draws_in_software(name_);
  hangs_after_ = options.hangs_after.value_or(is_software_ ? kNever_hangs : kHardware_hangs_after);
  if (options.validation) {
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(on_message, &messages_);
  }
  read_limits();
  create_objects();
  // With OpenGL's default origin, row 0 of a texture is at clip-space y = -1: the first texel in memory is what it
  // calls the lower left corner. Only depth, winding and provoking vertex differ.
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  glFrontFace(GL_CW);  // OpenGL defines winding with y up, device.h with y down
  glProvokingVertex(GL_FIRST_VERTEX_CONVENTION);
  glDisable(GL_DITHER);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  check("opening " + name_);
}

Context::~Context() {
  const Current current(*handle_, std::nothrow);
  if (!current.good()) return;  // its objects are destroyed with it
  glDeleteQueries(static_cast<GLsizei>(timestamps_.size()), timestamps_.data());
  glDeleteBuffers(1, &params_);
  glDeleteFramebuffers(1, &framebuffer_);
  glDeleteSamplers(static_cast<GLsizei>(samplers_.size()), samplers_.data());
}

void Context::read_limits() {
  limits_.texture_edge = static_cast<std::size_t>(integer(GL_MAX_TEXTURE_SIZE));
  limits_.volume_edge = static_cast<std::size_t>(integer(GL_MAX_3D_TEXTURE_SIZE));
  GLint64 storage = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &storage);
  limits_.storage_bytes = static_cast<std::size_t>(storage);
  limits_.params_alignment = static_cast<std::size_t>(integer(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT));
  for (GLuint i = 0; i < 3; ++i) {
    GLint max_groups = 0;
    glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, i, &max_groups);
    limits_.groups[i] = static_cast<std::uint32_t>(max_groups);
  }
}

GLint gl_wrap(Wrap wrap) {
  switch (wrap) {
    case Wrap::repeat:
      return GL_REPEAT;
    case Wrap::mirrored_repeat:
      return GL_MIRRORED_REPEAT;
    case Wrap::clamp_to_edge:
      break;
  }
  return GL_CLAMP_TO_EDGE;
}

void Context::create_objects() {
  glCreateSamplers(static_cast<GLsizei>(samplers_.size()), samplers_.data());
  constexpr std::pair<GLint, GLint> magnify_minify[] = {
      {GL_NEAREST, GL_NEAREST_MIPMAP_NEAREST},
      {GL_LINEAR, GL_LINEAR_MIPMAP_NEAREST},
      {GL_LINEAR, GL_LINEAR_MIPMAP_LINEAR},
  };
  for (std::size_t i = 0; i < samplers_.size(); ++i) {
    const Sampling sampling = Sampling::at(i);
    const auto& [magnify, minify] = magnify_minify[static_cast<std::size_t>(sampling.filter)];
    glSamplerParameteri(samplers_[i], GL_TEXTURE_MAG_FILTER, magnify);
    glSamplerParameteri(samplers_[i], GL_TEXTURE_MIN_FILTER, minify);
    glSamplerParameteri(samplers_[i], GL_TEXTURE_WRAP_S, gl_wrap(sampling.wrap_u));
    glSamplerParameteri(samplers_[i], GL_TEXTURE_WRAP_T, gl_wrap(sampling.wrap_v));
    glSamplerParameteri(samplers_[i], GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    glSamplerParameterf(samplers_[i], GL_TEXTURE_MIN_LOD, 0);
  }
  glCreateFramebuffers(1, &framebuffer_);
  glCreateBuffers(1, &params_);
}

GLuint Context::timestamp(std::size_t index) {
  while (timestamps_.size() <= index) {
    GLuint query = 0;
    glCreateQueries(GL_TIMESTAMP, 1, &query);
    timestamps_.push_back(query);
  }
  return timestamps_[index];
}

void Context::check(const std::string& doing) {
  const GLenum error = glGetError();
  if (error != GL_NO_ERROR) {
    for (GLenum more = error; more != GL_NO_ERROR && more != GL_CONTEXT_LOST;) more = glGetError();
  }
  const bool lost = error == GL_CONTEXT_LOST || glGetGraphicsResetStatus() != GL_NO_ERROR;
  const std::string said = messages_.take();
  if (!lost && error == GL_NO_ERROR && said.empty()) return;
  std::string what = doing;
  if (lost || error != GL_NO_ERROR) what += ": " + text_of(lost ? GL_CONTEXT_LOST : error);
  if (!said.empty()) what += "\n" + said;
  if (lost) throw DeviceLost(what);
  throw GpuError(what);
}

void Context::finish(const std::string& doing) {
  const GLsync all = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  handle_->hung = !ends_within(hangs_after_, [&](std::chrono::nanoseconds slice) {
    const auto slice_ns = static_cast<GLuint64>(slice.count());
    return glClientWaitSync(all, GL_SYNC_FLUSH_COMMANDS_BIT, slice_ns) != GL_TIMEOUT_EXPIRED;  // check() sees failures
  });
  if (handle_->hung) throw DeviceHung(name_ + " hangs");
  glDeleteSync(all);
  check(doing);
}

}  // namespace lumigraft::relight::gpu::egl
