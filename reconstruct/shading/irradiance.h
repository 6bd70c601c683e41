#pragma once
// Irradiance on surfaces of the room: from lamps with visibility through the field, and from measured radiance.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/light/light.h"
#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {

constexpr float kInfinitelyFar = 0;  ///< as the distance of a lamp

class IrradianceModel {
 public:
  IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                  const Illumination& illumination, const Enclosure* room = nullptr);

  /// Light from beyond the known surface.
  struct Surroundings {
    Eigen::Vector3f probe;
    EnvironmentMap far;        ///< the environment without surfaces between the probe and the enclosure
    bool use_guessed = false;  ///< guessed sides of the enclosure count
    Eigen::Vector3f up = Eigen::Vector3f::Zero();  ///< centre of the fish-eye's view; zero if it covers the sphere
    float floor_m = 0;                             ///< height of the floor along `up`, from the origin
    Eigen::Vector3f floor_irradiance = Eigen::Vector3f::Zero();  ///< on the floor, from the environment
  };
  const Surroundings& surroundings() const { return surroundings_; }
  /// Reuses the surroundings of an earlier model for a field that changed a little.
  IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, const Enclosure* room,
                  Surroundings surroundings);

  /// Irradiance except direct light of lamps: `directions` rays, cosine-distributed (Hammersley points). A ray that
  /// hits coloured surface returns its measured radiance, which includes all bounces. One that goes down outside the
  /// view of all cameras hits a floor of typical albedo, lit by the environment. Any other returns the far environment.
  struct Gathered {
    Eigen::Vector3f irradiance;
    float from_surface = 0;                   ///< the part of it that the colour camera measured; mean of the channels
    float metal_fraction = 0;                 ///< of the rays: metal was measured towards the camera, not towards here
    std::vector<Eigen::Vector3f> floor_hits;  ///< of rays that hit the unseen floor
    float floor_weight = 0;                   ///< of the floor's lamp irradiance at each hit
  };
  Gathered gather(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal, int directions) const;

  /// Irradiance of the lamps on the unseen floor, on a grid around the point below the probe. Lamps at unknown distance
  /// are assumed at a usual one.
  std::vector<Eigen::Vector3f> lamp_irradiance_on_floor(const std::vector<PointLight>& lamps) const;
  /// The part of it that the gathered rays reflect to their origin.
  Eigen::Vector3f irradiance_from_floor(const Gathered& gathered, const std::vector<Eigen::Vector3f>& floor_grid) const;

  /// Visible fraction of a lamp's disk at `distance_m` from the probe (kInfinitelyFar allowed): mean of `rays` points.
  float visibility(const PointLight& light, float distance_m, const Eigen::Vector3f& position_m,
                   const Eigen::Vector3f& normal, int rays) const;

  /// As many rays to a lamp's disk as its share of all lamps' light needs, where `rays` are enough for half of it. With
  /// rays in proportion to the share their errors add up to the same variance for any number of lamps.
  static int rays_for(float share, int rays);

  /// Whether the ray from a point to a lamp passes space that is occluded from all camera positions, where an
  /// unobserved object may be.
  bool passes_unobserved_space(const PointLight& light, const Eigen::Vector3f& position_m,
                               const Eigen::Vector3f& normal) const;

 private:
  /// Radiance of a ray that hits no known surface: that of the fish-eye towards the ray's exit from the enclosure.
  /// Without an enclosure the environment is infinitely far; a guessed side counts half, and half as infinitely far, as
  /// it may be anywhere beyond.
  Eigen::Vector3f far_radiance(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const;
  /// Where a ray that hits no known surface hits the unseen floor; empty if that direction was seen or goes up.
  std::optional<Eigen::Vector3f> floor_hit(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const;

  const DistanceField& field_;
  const FieldRays& rays_;
  const MetalMask& metal_;
  const Enclosure* enclosure_;
  float lift_m_;  ///< start of rays above the surface
  Surroundings surroundings_;
};

}  // namespace lumigraft::reconstruct
