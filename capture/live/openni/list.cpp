#include <OpenNI.h>

#include <limits>

#include "capture/live/camera_list.h"
#include "capture/live/usb_permission.h"

namespace lumigraft::capture {
namespace {

std::string pixels_of(openni::PixelFormat format) {
  switch (format) {
    case openni::PIXEL_FORMAT_RGB888:
      return "rgb8";
    case openni::PIXEL_FORMAT_DEPTH_1_MM:
      return "depth-1mm";
    case openni::PIXEL_FORMAT_DEPTH_100_UM:
      return "depth-0.1mm";
    default:
      return "OpenNI2 " + std::to_string(format);
  }
}

void list_device(openni::Device& device, CameraListing& listing) {
  for (const openni::SensorType sensor : {openni::SENSOR_COLOR, openni::SENSOR_DEPTH}) {
    const openni::SensorInfo* info = device.getSensorInfo(sensor);
    for (int i = 0; info != nullptr && i < info->getSupportedVideoModes().getSize(); ++i) {
      const openni::VideoMode& mode = info->getSupportedVideoModes()[i];
      listing.formats.push_back({pixels_of(mode.getPixelFormat()), mode.getResolutionX(), mode.getResolutionY(),
                                 static_cast<double>(mode.getFps())});
    }
  }
  openni::VideoStream color;
  if (device.hasSensor(openni::SENSOR_COLOR) && color.create(device, openni::SENSOR_COLOR) == openni::STATUS_OK) {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    if (openni::CameraSettings* settings = color.getCameraSettings()) {
      listing.controls = {{"exposure", kUnknown, kUnknown, static_cast<double>(settings->getExposure())},
                          {"gain", kUnknown, kUnknown, static_cast<double>(settings->getGain())}};
    }
    color.destroy();
  }
}

}  // namespace

std::vector<CameraListing> list_openni_cameras() {
  std::vector<CameraListing> out;
  if (openni::OpenNI::initialize() != openni::STATUS_OK) return out;
  openni::Array<openni::DeviceInfo> devices;
  openni::OpenNI::enumerateDevices(&devices);
  for (int i = 0; i < devices.getSize(); ++i) {
    CameraListing listing{.source = "openni2:" + std::string(devices[i].getUri()),
                          .name = std::string(devices[i].getVendor()) + " " + devices[i].getName()};
    openni::Device device;
    if (device.open(devices[i].getUri()) == openni::STATUS_OK) {
      list_device(device, listing);
      device.close();
    } else if (is_forbidden_usb_device(devices[i].getUri())) {
      listing.rejection_reason = kForbiddenUsb;
    } else {
      listing.rejection_reason = "OpenNI2 cannot open it, another program may have it";
    }
    out.push_back(std::move(listing));
  }
  openni::OpenNI::shutdown();
  return out;
}

}  // namespace lumigraft::capture
