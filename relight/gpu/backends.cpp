#include "relight/gpu/backends.h"

#include <algorithm>
#include <cstdlib>

namespace lumigraft::relight::gpu {
namespace {

enum class Wanted { hardware, anything };

bool any_usable(const std::vector<DeviceListing>& listings, Wanted wanted) {
  return std::any_of(listings.begin(), listings.end(), [&](const DeviceListing& listing) {
    return listing.rejection_reason.empty() && (wanted == Wanted::anything || !listing.software);
  });
}

}  // namespace

std::string settings_text(std::initializer_list<const char*> variables) {
  std::string text;
  for (const char* variable : variables) {
    if (const char* value = std::getenv(variable)) text += std::string("; ") + variable + " is " + value;
  }
  return text;
}

std::string_view name_of(Backend backend) {
  constexpr std::string_view names[] = {"best", "vulkan", "egl"};
  return names[static_cast<std::size_t>(backend)];
}

std::optional<Backend> backend_named(std::string_view name) {
  for (const Backend backend : {Backend::best, Backend::vulkan, Backend::egl}) {
    if (name == name_of(backend)) return backend;
  }
  return std::nullopt;
}

// Queries as few drivers as possible: opening one takes a tenth of a second.
Backend best_backend() {
  const std::vector<DeviceListing> vulkan_devices = vulkan::list_devices();
  if (any_usable(vulkan_devices, Wanted::hardware)) return Backend::vulkan;
  if (egl::may_have_hardware() && any_usable(egl::list_devices(), Wanted::hardware)) return Backend::egl;
  if (any_usable(vulkan_devices, Wanted::anything)) return Backend::vulkan;
  const std::vector<DeviceListing> egl_devices = egl::list_devices();
  if (any_usable(egl_devices, Wanted::anything)) return Backend::egl;
  std::string reasons;
  for (const auto& listings : {vulkan_devices, egl_devices}) {
    for (const DeviceListing& listing : listings) {
      reasons += "; " + std::string(name_of(listing.backend)) + ": " + listing.name + ": " + listing.rejection_reason;
    }
  }
  throw GpuError("no usable GPU and no software driver (mesa-vulkan-drivers)" + reasons);
}

std::unique_ptr<Device> create_device(Backend backend, const DeviceOptions& options) {
  if (backend == Backend::best) backend = best_backend();
  return backend == Backend::vulkan ? create_vulkan_device(options) : create_egl_device(options);
}

std::vector<DeviceListing> list_devices() {
  std::vector<DeviceListing> all = vulkan::list_devices();
  for (DeviceListing& listing : egl::list_devices()) all.push_back(std::move(listing));
  return all;
}

}  // namespace lumigraft::relight::gpu
