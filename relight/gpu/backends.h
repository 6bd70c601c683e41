#pragma once
// What each way to a GPU tells of its devices. Nothing here throws: what fails is listed with the reason.
#include <initializer_list>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

/// "; NAME is VALUE" for each of these environment variables that is set: they can hide a driver.
std::string settings_text(std::initializer_list<const char*> variables);

namespace vulkan {
std::vector<DeviceListing> list_devices();
}

namespace egl {
std::vector<DeviceListing> list_devices();
bool may_have_hardware();  ///< quick: opens nothing
}  // namespace egl

}  // namespace lumigraft::relight::gpu
