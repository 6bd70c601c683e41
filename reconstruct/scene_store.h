#pragma once
// Holds the newest published result of every stage, for relight to read. Stages publish at different rates. Any thread;
// published parts are immutable.
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "reconstruct/albedo/shadow_carving.h"
#include "reconstruct/field/masked_field.h"
#include "reconstruct/scene.h"

namespace lumigraft::reconstruct {

class SceneStore {
 public:
  void publish_field(std::shared_ptr<const DistanceField> field);
  /// Light that is estimated without a fish-eye replaces no light that a fish-eye measured.
  void publish_light(std::shared_ptr<const Illumination> light);
  /// The light that a fish-eye measured is not that of the room: as if there were none.
  void withdraw_light();
  /// The albedo solution of a field and the measured light; its lamps are also applied to later measured light.
  void publish_solution(AlbedoStage::Result solution, std::uint64_t field_version,
                        std::shared_ptr<const Illumination> measured);
  /// Surface of lamps, which is no obstacle to light; null: none.
  void publish_lamp_surface(std::shared_ptr<const SurfaceMask> surface);
  /// Replaces only the albedo.
  void publish_albedo(std::shared_ptr<const AlbedoField> albedo);
  /// Null: none.
  void publish_shadows(std::shared_ptr<const LampShadows> shadows);
  void publish_enclosure(std::shared_ptr<const Enclosure> enclosure);
  /// Warnings of a stage, shown with every frame until the stage publishes again.
  void publish_warnings(const std::string& stage, std::vector<std::string> warnings);

  /// The newest parts; without pose, which belongs to a frame.
  Scene newest() const;
  /// Whether the scene has converged: the last runs of geometry and light changed nothing, albedo was solved for their
  /// results, and `scene` contains all of these.
  bool settled(const Scene& scene) const;
  /// The newest published light, without lamp distances from albedo solutions.
  std::shared_ptr<const Illumination> measured_light() const;
  /// The newest published field: what was observed, with the surface of lamps.
  std::shared_ptr<const DistanceField> observed_field() const;
  /// The same without that surface, and without occluders from albedo solutions.
  std::shared_ptr<const DistanceField> room_field() const;

 private:
  void combine();
  void combine_fields();

  mutable std::mutex mutex_;
  Scene scene_;
  std::shared_ptr<const DistanceField> field_, room_field_;
  std::shared_ptr<const SurfaceMask> lamp_surface_;
  MaskedField lamp_mask_;
  std::shared_ptr<const BrickMap<FieldBrick>> occluders_;
  OccluderMerge occluder_merge_;
  std::shared_ptr<const Illumination> light_, solved_light_;
  std::shared_ptr<const Illumination> solved_from_;  ///< the measured light that solved_light_ was solved from
  std::uint64_t solved_field_version_ = 0;
  bool same_field_again_ = false, same_light_again_ = false;
  std::map<std::string, std::vector<std::string>> warnings_;
};

/// `newest` with the changes that solving made to the lamps of `measured`, by id: light is measured ten times a second
/// but solved less often. Distance and plane are kept; a clipped lamp keeps its ratio to the lower bound of its power;
/// lamps that were found to be reflections become part of the environment. A lamp with a tag keeps the tag's position;
/// one that the fish-eye does not see keeps its solved power, or stays off. Clipped cells of the environment keep their
/// solved ratio. Otherwise the energy at the probe is that of the newest fish-eye frame.
std::shared_ptr<const Illumination> carry_lamps(const Illumination& newest, const Illumination& measured,
                                                const Illumination& solved);

/// Appends the lines that `to` does not contain yet.
void append_warnings(std::vector<std::string>& to, const std::vector<std::string>& from);

}  // namespace lumigraft::reconstruct
