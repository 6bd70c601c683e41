#include "tests/relight/gpu/lost_device/lose.h"

#include <dlfcn.h>

#include <cstdlib>

#include "relight/gpu/egl/choose_device.h"

namespace lumigraft::relight::gpu {
namespace {

constexpr const char* kFolder = LUMIGRAFT_LOST_DEVICE_FOLDER;

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
  void* const layer = dlopen((std::string(kFolder) + "/liblumigraft_lost_device.so").c_str(), RTLD_NOW | RTLD_NOLOAD);
  if (!layer) throw std::runtime_error("the layer that loses Vulkan devices was not loaded");
  reinterpret_cast<void (*)()>(dlsym(layer, "lose_all_devices"))();
  dlclose(layer);
}

}  // namespace lumigraft::relight::gpu
