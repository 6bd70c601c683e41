#pragma once
// Scenes of Embree.
#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <cstddef>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// One for all, so that trees can be moved between scenes.
RTCDevice embree_device();

/// The model's triangles at T, committed.
RTCGeometry triangles_of(const Model& model, const Eigen::Affine3f& T);

/// From its origin to `limit_m`, at all geometries.
inline RTCRay single_ray(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) {
  return {from_m.x(), from_m.y(), from_m.z(), 0, w.x(), w.y(), w.z(), 0, limit_m, ~0u, 0, 0};
}

struct EmbreeScene {
  RTCScene scene = rtcNewScene(embree_device());
  explicit EmbreeScene(int flags = RTC_SCENE_FLAG_NONE) {
    rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(flags | RTC_SCENE_FLAG_ROBUST));
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;
  ~EmbreeScene() { rtcReleaseScene(scene); }

  /// Takes the geometry.
  void add(RTCGeometry geometry, std::size_t id) {
    rtcAttachGeometryByID(scene, geometry, static_cast<unsigned>(id));
    rtcReleaseGeometry(geometry);
  }
};

}  // namespace lumigraft::relight
