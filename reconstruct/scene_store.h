#pragma once
// Where stages publish what they know of the room, each part at its own rate, and from where relight takes the newest
// of everything. Any thread; what is published is immutable.
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/scene.h"

namespace lumigraft::reconstruct {

class SceneStore {
 public:
  void publish_field(std::shared_ptr<const DistanceField> field);
  void publish_light(std::shared_ptr<const Illumination> light);
  /// What albedo found for a field and the light that was measured: it holds for the lamps of later light too.
  void publish_solution(AlbedoStage::Result solution, std::uint64_t field_version,
                        std::shared_ptr<const Illumination> measured);
  /// Replaces the albedo alone.
  void publish_albedo(std::shared_ptr<const AlbedoField> albedo);
  void publish_enclosure(std::shared_ptr<const Enclosure> enclosure);
  /// What a stage complains about, until its next word. Shown with every frame.
  void publish_warnings(const std::string& stage, std::vector<std::string> warnings);

  /// The newest of everything but the pose, which belongs to a frame.
  Scene newest() const;
  /// Nothing is left to learn from what the camera shows: the last look of geometry and light changed nothing, albedo
  /// was solved from what they know, and `scene` holds all of it.
  bool settled(const Scene& scene) const;
  /// As the light stage gave it, without distances found since.
  std::shared_ptr<const Illumination> measured_light() const;

 private:
  void combine();

  mutable std::mutex mutex_;
  Scene scene_;
  std::shared_ptr<const Illumination> light_, solved_light_;
  std::shared_ptr<const Illumination> solved_from_;  ///< what solved_light_ was when it was measured
  std::uint64_t solved_field_version_ = 0;
  bool same_field_again_ = false, same_light_again_ = false;
  std::map<std::string, std::vector<std::string>> warnings_;
};

/// `newest` with what solving made of the lamps of `measured`, by id: light is seen ten times a second, solved once.
/// Distance and plane hold; a clipped lamp stays as much stronger than its lower bound as it was found; what was a
/// reflection belongs to the remainder. A lamp whose tag says where it stands stands there; one that no fish-eye sees
/// keeps its power, or none. What of the remainder is clipped stays as much brighter as it was found. Other energy at
/// the probe stays the newest picture's.
std::shared_ptr<const Illumination> carry_lamps(const Illumination& newest, const Illumination& measured,
                                                const Illumination& solved);

/// Appends the lines that are not there yet.
void append_warnings(std::vector<std::string>& to, const std::vector<std::string>& from);

}  // namespace lumigraft::reconstruct
