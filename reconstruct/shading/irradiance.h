#pragma once
// Irradiance on surfaces of the room: lamps through the field, and everything else as it was measured.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/metal_mask.h"
#include "reconstruct/light/light.h"
#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {

constexpr float kInfinitelyFar = 0;  ///< as a lamp's distance

class IrradianceModel {
 public:
  IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                  const Illumination& illumination, const Enclosure* room = nullptr);

  /// What lies beyond all that is known.
  struct Beyond {
    Eigen::Vector3f probe;
    EnvironmentMap far;    ///< the environment without what stands between the probe and the distance
    bool guessed = false;  ///< what of the enclosure is guessed counts
    Eigen::Vector3f up = Eigen::Vector3f::Zero();        ///< the middle of what the fish-eye sees; zero: it sees all
    float floor_m = 0;                                   ///< along `up`, from the origin
    Eigen::Vector3f on_floor = Eigen::Vector3f::Zero();  ///< the environment's irradiance there
  };
  const Beyond& beyond() const { return beyond_; }
  /// The same beyond a field of which somewhat more is known, or somewhat else.
  IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, const Enclosure* room,
                  Beyond beyond);

  /// Irradiance that is not straight from a lamp: `directions` rays, cosine-distributed (Hammersley points). A ray that
  /// meets a coloured surface returns that surface's own measured radiance, which holds all bounces; one that goes down
  /// where no camera looked meets a floor of usual albedo, which the environment lights; any other returns the far
  /// environment, which has no lamps in it.
  struct Gathered {
    Eigen::Vector3f irradiance;
    float metal_share = 0;                  ///< of the rays: metal was measured towards the camera, not towards here
    std::vector<Eigen::Vector3f> on_floor;  ///< where rays met it
    float floor_share = 0;                  ///< irradiance of what they bring over the floor's own, for each
  };
  Gathered gather(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal, int directions) const;

  /// Irradiance of the lamps on the floor that nobody saw, in squares around the place below the probe. Lamps whose
  /// distance is not known are where lamps usually are.
  std::vector<Eigen::Vector3f> light_on_floor(const std::vector<PointLight>& lamps) const;
  /// What gathered rays bring of it.
  Eigen::Vector3f by_floor(const Gathered& gathered, const std::vector<Eigen::Vector3f>& on_floor) const;

  /// How much of the lamp's disk a point sees, were the lamp `distance_m` from the probe: mean over `rays` points of
  /// it.
  float visibility(const PointLight& light, float distance_m, const Eigen::Vector3f& position_m,
                   const Eigen::Vector3f& normal, int rays) const;

  /// Whether the way from a point to a lamp leads through space that something hides from every place a camera looked
  /// from: what nobody saw may stand there.
  bool hidden_way(const PointLight& light, const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal) const;

 private:
  /// Of what a ray meets beyond all that is known: the fish-eye saw the same place of the enclosure, in another
  /// direction. Without an enclosure it is infinitely far; a guessed side may stand anywhere beyond, and is taken half
  /// as if it stood there, half as if it were infinitely far.
  Eigen::Vector3f far_radiance(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const;
  /// Where a ray that meets nothing known meets the floor; empty where a camera saw that way, or it goes up.
  std::optional<Eigen::Vector3f> floor_ahead(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const;

  const DistanceField& field_;
  const FieldRays& rays_;
  const MetalMask& metal_;
  const Enclosure* enclosure_;
  float lift_m_;  ///< rays start so far above the surface
  Beyond beyond_;
};

}  // namespace lumigraft::reconstruct
