#pragma once
// Device enumeration per backend. Nothing here throws: failures are listed with the reason.
#include <initializer_list>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

/// "; NAME is VALUE" for each of these environment variables that is set, as they can hide a driver.
std::string settings_text(std::initializer_list<const char*> variables);

namespace vulkan {
std::vector<DeviceListing> list_devices();
}

namespace egl {
std::vector<DeviceListing> list_devices();
bool may_have_hardware();  ///< fast: opens no device
}  // namespace egl

}  // namespace lumigraft::relight::gpu
