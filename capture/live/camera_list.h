#pragma once
// Lists the connected cameras with their formats, controls and inputs.
#include <string>
#include <vector>

namespace lumigraft::capture {

struct OfferedFormat {
  std::string pixels;  ///< as `pixel_format` in a configuration; else the camera's own name for it
  int width = 0, height = 0;
  double rate_hz = 0.0;  ///< the highest; 0 if unknown
};

struct OfferedControl {
  std::string name;
  double low = 0.0;  ///< `low` and `high` are NaN if unknown
  double high = 0.0;
  double value = 0.0;
};

struct OfferedInput {
  std::string name;
  bool chosen = false;
  std::string signal;  ///< of the chosen input if digital: frame size and rate, or the reason why there is none
};

struct CameraListing {
  std::string source;  ///< for `source = ` in a configuration
  std::string name;
  std::vector<OfferedInput> inputs = {};  ///< of a frame grabber; empty for cameras with one analog input
  std::vector<OfferedFormat> formats = {};
  std::vector<OfferedControl> controls = {};
  std::string rejection_reason = {};            ///< why it cannot be opened; empty if it can
  std::vector<std::string> nodes = {};          ///< its device nodes, if known
  std::vector<std::string> same_hardware = {};  ///< sources of other libraries for the same camera
};

/// Fills in `same_hardware`: cameras that share a device node.
void find_same_hardware(std::vector<CameraListing>& cameras);

/// Cameras of every library, in the order openni2, freenect, v4l2, libcamera, aravis, with `same_hardware`.
std::vector<CameraListing> list_cameras();

std::vector<CameraListing> list_openni_cameras();
std::vector<CameraListing> list_freenect_cameras();
std::vector<CameraListing> list_v4l2_cameras();
std::vector<CameraListing> list_libcamera_cameras();
std::vector<CameraListing> list_aravis_cameras();

}  // namespace lumigraft::capture
