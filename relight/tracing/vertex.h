#pragma once
// A path vertex: the surface that a path hit, its shading frame, and ways to sample the next direction.
#include <cmath>
#include <vector>

#include "relight/tracing/dielectric.h"
#include "relight/tracing/parameters.h"
#include "relight/tracing/world.h"

namespace lumigraft::relight {

/// Origin of a ray along w, offset from the surface.
inline Eigen::Vector3f ray_origin(const SurfaceHit& surface, const Eigen::Vector3f& w) {
  const float lift = kTracing.lift * (1 + surface.position_m.cwiseAbs().maxCoeff());
  return surface.position_m + std::copysign(lift, surface.face.dot(w)) * surface.face;
}

class PathVertex {
 public:
  PathVertex(const SurfaceHit& surface, const Eigen::Vector3f& arriving_along) : surface_(surface) {
    frame_ = frame_of(surface);
    v_ = frame_.transpose() * -arriving_along;
    if (surface.bsdf.coat > 0) surface_.bsdf.coat_normal = frame_.transpose() * surface.bsdf.coat_normal;
  }

  /// BSDF times cosine: outgoing radiance per radiance and solid angle arriving from w.
  Rgb response(const Eigen::Vector3f& w) const {
    const Eigen::Vector3f local = frame_.transpose() * w;
    const float above = surface_.face.dot(w);
    if (above > 0 && local.z() > 0) return reflected(surface_.bsdf, v_, local) * local.z();
    if (above < 0 && local.z() < 0) return transmitted(surface_.bsdf, v_, local) * -local.z();
    return Rgb::Zero();
  }
  /// The BSDF alone, of light that arrives above the surface.
  Rgb reflects(const Eigen::Vector3f& w) const { return reflected(surface_.bsdf, v_, frame_.transpose() * w); }

  /// Samples the material.
  Eigen::Vector3f sample(Sampler& sampler) const {
    return (frame_ * sample_direction(surface_.bsdf, v_, sampler)).normalized();
  }
  float pdf(const Eigen::Vector3f& w) const { return direction_pdf(surface_.bsdf, v_, frame_.transpose() * w); }

  /// Samples the cones that regions of changed light subtend. Regions that contain the vertex are excluded.
  void aim_at(const std::vector<ChangeRegion>& places) {
    float sum = 0;
    for (const ChangeRegion& place : places) {
      const Eigen::Vector3f to = place.centre_m - surface_.position_m;
      const float distance = to.norm();
      if (!(distance > 1.02f * place.radius_m && place.radius_m > 0)) continue;
      cones_.push_back({to / distance, cone_of_sphere(place.radius_m, distance), place.fraction});
      sum += place.fraction;
    }
    for (Cone& cone : cones_) cone.fraction /= sum;
  }
  bool mirrors() const { return surface_.bsdf.mirrors(); }
  bool transmits() const { return surface_.bsdf.transmits(); }
  bool has_aim() const { return !cones_.empty(); }
  Eigen::Vector3f aim(Sampler& sampler) const {
    float choice = sampler.one();
    std::size_t i = 0;
    for (; i + 1 < cones_.size() && choice >= cones_[i].fraction; ++i) choice -= cones_[i].fraction;
    return in_cone(cones_[i].axis, cones_[i].one_minus_cos, sampler.two());
  }
  float aim_pdf(const Eigen::Vector3f& w) const {
    float sum = 0;
    for (const Cone& cone : cones_) {
      // 1 - cos from the chord: avoids cancellation for narrow cones.
      if (0.5f * (w - cone.axis).squaredNorm() <= cone.one_minus_cos)
        sum += cone.fraction / (2 * kPi * cone.one_minus_cos);
    }
    return sum;
  }

  Eigen::Vector3f leave(const Eigen::Vector3f& w) const { return ray_origin(surface_, w); }
  Eigen::Vector3f leave() const { return leave(surface_.face); }
  /// Origin of shadow rays to a lamp, on the side from which its light arrives.
  Eigen::Vector3f leave_to(const Eigen::Vector3f& lamp_centre_m) const {
    return transmits() ? leave(lamp_centre_m - surface_.position_m) : leave();
  }
  /// Index of refraction beyond the surface over that before it, squared, if w is refracted; else 1.
  float squeezed(const Eigen::Vector3f& w) const {
    return surface_.bsdf.bends && surface_.face.dot(w) < 0 ? surface_.bsdf.eta * surface_.bsdf.eta : 1;
  }
  /// Per metre, what the medium absorbs into which w leaves; `here`: the medium on the side of the ray.
  Rgb absorption(const Eigen::Vector3f& w, const Rgb& here) const {
    return surface_.bounds_volume && surface_.face.dot(w) < 0 ? surface_.absorption_beyond : here;
  }

 private:
  struct Cone {
    Eigen::Vector3f axis;
    float one_minus_cos, fraction;
  };

  /// The facets' wider direction along x, if there is one.
  static Eigen::Matrix3f frame_of(const SurfaceHit& surface) {
    Eigen::Vector3f x, y;
    basis(surface.normal, x, y);
    if (surface.bsdf.stretch > 1) {
      const Eigen::Vector3f& along = surface.bsdf.along;
      const Eigen::Vector3f flat = along - surface.normal.dot(along) * surface.normal;
      if (flat.squaredNorm() > 1e-12f) x = flat.normalized();
      y = surface.normal.cross(x);
    }
    Eigen::Matrix3f frame;
    frame << x, y, surface.normal;
    return frame;
  }

  SurfaceHit surface_;
  Eigen::Matrix3f frame_;  // columns: x, y, normal
  Eigen::Vector3f v_;      // in the frame, direction of the outgoing light
  std::vector<Cone> cones_;
};

}  // namespace lumigraft::relight
