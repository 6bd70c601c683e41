#include "tests/relight/gpu/lost_device/lose.h"

#include <dlfcn.h>

#include <atomic>
#include <cstdlib>

#include "relight/gpu/egl/choose_device.h"

namespace lumigraft::relight::gpu {
namespace {

constexpr const char* kFolder = LUMIGRAFT_LOST_DEVICE_FOLDER;

/// A function of the layer that a program has loaded.
void call_layer(const char* function) {
  void* const layer = dlopen((std::string(kFolder) + "/liblumigraft_lost_device.so").c_str(), RTLD_NOW | RTLD_NOLOAD);
  if (!layer) throw std::runtime_error("the layer that loses Vulkan devices was not loaded");
  reinterpret_cast<void (*)()>(dlsym(layer, function))();
  dlclose(layer);
}

std::atomic<bool> next_hangs = false;
std::atomic<EGLContext> hanging = EGL_NO_CONTEXT;

}  // namespace

LosableDevices::LosableDevices(Backend backend) : backend_(backend) {
  setenv("VK_ADD_LAYER_PATH", kFolder, 1);
  setenv("VK_INSTANCE_LAYERS", "VK_LAYER_LUMIGRAFT_lost_device", 1);
}

LosableDevices::~LosableDevices() {
  unsetenv("VK_INSTANCE_LAYERS");
  unsetenv("VK_ADD_LAYER_PATH");
}

void LosableDevices::lose() const {
  if (backend_ == Backend::egl) {
    for (const egl::Candidate& candidate : egl::find_candidates()) eglTerminate(candidate.display);
    return;
  }
  call_layer("lose_all_devices");
}

void LosableDevices::hang() const {
  if (backend_ == Backend::vulkan) return call_layer("hang_all_devices");
  next_hangs = true;
}

}  // namespace lumigraft::relight::gpu

/// In place of that of the OpenGL library, for the program that this is linked into.
extern "C" GLenum APIENTRY glClientWaitSync(GLsync sync, GLbitfield flags, GLuint64 timeout_ns) {
  using namespace lumigraft::relight::gpu;
  if (next_hangs.exchange(false)) hanging = eglGetCurrentContext();
  if (hanging == eglGetCurrentContext()) return GL_TIMEOUT_EXPIRED;
  static const auto real = reinterpret_cast<PFNGLCLIENTWAITSYNCPROC>(eglGetProcAddress("glClientWaitSync"));
  return real(sync, flags, timeout_ns);
}
