#pragma once
// Ways to lose a device under a program that uses it.
#include <string>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

/// While it lives, devices that are made can be lost. Vulkan: by a layer between program and driver, which answers
/// VK_ERROR_DEVICE_LOST (layer.cpp). EGL: by closing the driver's connection, which takes all contexts along.
class LosableDevices {
 public:
  explicit LosableDevices(Backend backend);
  ~LosableDevices();
  LosableDevices(const LosableDevices&) = delete;
  LosableDevices& operator=(const LosableDevices&) = delete;

  void lose() const;  ///< those that are there; later ones work

 private:
  Backend backend_;
};

}  // namespace lumigraft::relight::gpu
