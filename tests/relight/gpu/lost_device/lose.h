#pragma once
// Makes devices that a program uses fail as lost.
#include <string>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

/// Devices created during its lifetime can be lost. Vulkan: by a layer between program and driver, which returns
/// VK_ERROR_DEVICE_LOST (layer.cpp). EGL: by closing the driver's connection, which destroys all contexts. They can
/// also hang: waits for their work time out, by the layer, and by this library's own glClientWaitSync.
class LosableDevices {
 public:
  explicit LosableDevices(Backend backend);
  ~LosableDevices();
  LosableDevices(const LosableDevices&) = delete;
  LosableDevices& operator=(const LosableDevices&) = delete;

  void lose() const;  ///< loses the existing devices; later ones work
  void hang() const;  ///< with Vulkan the existing devices, with EGL the one that waits next; others work

 private:
  Backend backend_;
};

}  // namespace lumigraft::relight::gpu
