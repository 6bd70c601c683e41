#include "relight/objects/embree_scene.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <type_traits>

namespace lumigraft::relight {

using Eigen::Vector3f;

RTCDevice embree_device() {
  static const std::unique_ptr<std::remove_pointer_t<RTCDevice>, decltype(&rtcReleaseDevice)> device(
      rtcNewDevice("threads=1"), &rtcReleaseDevice);  // one thread: deterministic trees
  if (!device) throw std::runtime_error("Embree has no device");
  return device.get();
}

RTCGeometry triangles_of(const Model& model, const Eigen::Affine3f& T) {
  RTCGeometry geometry = rtcNewGeometry(embree_device(), RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads 16 bytes per vertex, so the positions are copied to a buffer that it pads.
  auto* vertices = static_cast<Vector3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vector3f), model.positions_m.size()));
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), model.indices.size() / 3);
  for (std::size_t i = 0; i < model.positions_m.size(); ++i) vertices[i] = T * model.positions_m[i];
  std::copy(model.indices.begin(), model.indices.end(), static_cast<std::uint32_t*>(indices));
  rtcCommitGeometry(geometry);
  return geometry;
}

}  // namespace lumigraft::relight
