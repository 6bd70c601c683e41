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
