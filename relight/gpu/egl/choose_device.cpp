#include "relight/gpu/egl/choose_device.h"

#include <EGL/eglext.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "relight/gpu/backends.h"

namespace lumigraft::relight::gpu::egl {
namespace {

constexpr EGLint max_devices = 32;

/// Whether a space-separated list of names contains `name`.
bool lists(const char* names, std::string_view name) {
  const std::string all = std::string(" ") + (names ? names : "") + " ";
  return all.find(" " + std::string(name) + " ") != std::string::npos;
}

template <typename Function>
Function entry_point(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

std::vector<Candidate> device_candidates() {
  const auto query_devices = entry_point<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto query_string = entry_point<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
  EGLDeviceEXT devices[max_devices];
  EGLint count = 0;
  if (!query_devices || !query_string || !query_devices(max_devices, devices, &count)) return {};
  std::vector<Candidate> candidates;
  for (EGLint i = 0; i < count; ++i) {
    Candidate candidate{.name = "EGL device " + std::to_string(i)};
    const char* extensions = query_string(devices[i], EGL_EXTENSIONS);
    candidate.software = lists(extensions, "EGL_MESA_device_software");
    if (!candidate.software && lists(extensions, "EGL_EXT_device_drm")) {
      if (const char* file = query_string(devices[i], EGL_DRM_DEVICE_FILE_EXT)) {
        candidate.name += std::string(" (") + file + ")";
      }
    }
    candidate.display = eglGetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
    candidates.push_back(std::move(candidate));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.software < b.software; });
  return candidates;
}

/// Renderer name reported by the driver of an open context.
std::string renderer_name(const ContextHandle& handle) {
  const Current current(handle);
  return reinterpret_cast<const char*>(glGetString(GL_RENDERER));
}

}  // namespace

bool draws_in_software(const std::string& renderer) {
  return renderer.find("llvmpipe") != std::string::npos || renderer.find("softpipe") != std::string::npos;
}

std::vector<Candidate> find_candidates() {
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (lists(extensions, "EGL_EXT_platform_device")) {
    std::vector<Candidate> candidates = device_candidates();
    if (!candidates.empty()) return candidates;
  }
  if (lists(extensions, "EGL_MESA_platform_surfaceless")) {
    const EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    return {{.name = "Mesa without a surface", .display = display, .software = false}};
  }
  throw GpuError("no EGL device: no driver that draws without a window is installed (for software, libegl-mesa0)" +
                 settings_text({"__EGL_VENDOR_LIBRARY_FILENAMES", "__EGL_VENDOR_LIBRARY_DIRS"}));
}

std::unique_ptr<ContextHandle> open(const Candidate& candidate, bool validation) {
  // The display is never terminated: it is shared by all users, and terminating it would destroy their contexts.
  EGLint major = 0, minor = 0;
  if (candidate.display == EGL_NO_DISPLAY || !eglInitialize(candidate.display, &major, &minor)) {
    throw GpuError(egl_error_text());
  }
  const char* extensions = eglQueryString(candidate.display, EGL_EXTENSIONS);
  for (const char* wanted : {"EGL_KHR_no_config_context", "EGL_KHR_surfaceless_context"}) {
    if (!lists(extensions, wanted)) throw GpuError(std::string("it lacks ") + wanted);
  }
  return std::make_unique<ContextHandle>(candidate.display, validation);
}

std::unique_ptr<ContextHandle> open_best(bool validation) {
  const char* wanted_name = std::getenv("LUMIGRAFT_EGL_DEVICE");
  std::string reasons;
  for (const Candidate& candidate : find_candidates()) {
    std::string name = candidate.name;
    try {
      std::unique_ptr<ContextHandle> handle = open(candidate, validation);
      name = renderer_name(*handle);
      if (!wanted_name || name.find(wanted_name) != std::string::npos) return handle;
      reasons += "; " + name + ": LUMIGRAFT_EGL_DEVICE asks for \"" + wanted_name + "\"";
    } catch (const GpuError& e) {
      reasons += "; " + name + ": " + e.what();
    }
  }
  throw GpuError("no usable EGL device" + reasons);
}

std::vector<DeviceListing> list_devices() {
  std::vector<DeviceListing> listings;
  try {
    for (const Candidate& candidate : find_candidates()) {
      DeviceListing listing{.backend = Backend::egl, .name = candidate.name, .software = candidate.software};
      try {
        listing.name = renderer_name(*open(candidate, false));
        listing.software = listing.software || draws_in_software(listing.name);
      } catch (const GpuError& e) {
        listing.rejection_reason = e.what();
      }
      listings.push_back(std::move(listing));
    }
  } catch (const GpuError& e) {
    listings.push_back({.backend = Backend::egl, .name = "EGL", .rejection_reason = e.what()});
  }
  return listings;
}

bool may_have_hardware() {
  try {
    const std::vector<Candidate> candidates = find_candidates();
    return std::any_of(candidates.begin(), candidates.end(), [](const auto& c) { return !c.software; });
  } catch (const GpuError&) {
    return false;
  }
}

}  // namespace lumigraft::relight::gpu::egl
