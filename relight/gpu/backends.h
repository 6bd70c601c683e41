#pragma once
// What each way to a GPU tells of its devices. Nothing here throws: what fails is listed with the reason.
#include "relight/gpu/device.h"

namespace lumigraft::gpu {

namespace vulkan {
std::vector<DeviceListing> list_devices();
}

namespace egl {
std::vector<DeviceListing> list_devices();
bool may_have_hardware();  ///< quick: opens nothing
}  // namespace egl

}  // namespace lumigraft::gpu
