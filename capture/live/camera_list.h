#pragma once
// Which cameras are plugged in, with what they offer.
#include <optional>
#include <string>
#include <vector>

namespace lumigraft::capture {

struct OfferedFormat {
  std::string pixels;  ///< as `pixel_format` in a configuration; the camera's own word where that is none
  int width = 0;
  int height = 0;
  double rate_hz = 0.0;  ///< the highest; 0 where the camera does not say
};

struct OfferedControl {
  std::string name;
  double low = 0.0;  ///< NaN where the camera does not say, as `high`
  double high = 0.0;
  double value = 0.0;
};

struct OfferedInput {
  std::string name;
  bool chosen = false;
  std::string signal;  ///< at a digital one that is chosen: its size and rate, or what it lacks
};

struct CameraListing {
  std::string source;  ///< for `source = ` in a configuration
  std::string name;
  std::vector<OfferedInput> inputs = {};  ///< of a frame grabber; empty where there is nothing to choose or to plug in
  std::vector<OfferedFormat> formats = {};
  std::vector<OfferedControl> controls = {};
  std::string rejection_reason = {};            ///< why it cannot be looked into; empty where it can
  std::vector<std::string> nodes = {};          ///< of the kernel that it is read from, where it is known
  std::vector<std::string> same_hardware = {};  ///< sources of other libraries that are this camera too
};

/// Says in each of them which others are read from the same nodes.
void find_same_hardware(std::vector<CameraListing>& cameras);

/// Of every library, in the order openni2, v4l2, libcamera, aravis, with their same_hardware.
std::vector<CameraListing> list_cameras();

std::vector<CameraListing> list_openni_cameras();
std::vector<CameraListing> list_v4l2_cameras();
std::vector<CameraListing> list_libcamera_cameras();
std::vector<CameraListing> list_aravis_cameras();

}  // namespace lumigraft::capture
