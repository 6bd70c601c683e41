#pragma once
// Tracking of lamps from one fish-eye image to the next, and averaging while the light is still.
#include <map>
#include <set>
#include <vector>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Gives each lamp of `now` the id of the nearest lamp of `last`, or of an earlier one that shone from there and was
/// switched off; a new id if none is near. A lamp with a tag keeps its id. And averages both images while lamps and
/// environment are still, so that their sum is an averaged image.
///
/// A fixed lamp of which something hides a part stays as it was (PointLight::covered): what is left of its image lies
/// within its outline, is as bright as before, and its centroid has moved. Where all of it is gone, it is covered if
/// the rest of the image, which it lights, is as before.
///
/// Another lamp that disappears with its energy may be occluded, too: it is held for some frames, then faded out. One
/// whose energy appears elsewhere has moved or was cut differently, and is dropped.
class LightTracker {
 public:
  explicit LightTracker(std::size_t max_lamps) : max_lamps_(max_lamps) {}

  void update(const Illumination* last, Illumination& now);
  /// The id of the tagged lamp `lamp_tag`, which is not among `lights`; a new id if one of those has it.
  int id_of_tag(int lamp_tag, const std::vector<PointLight>& lights);

 private:
  static constexpr int kFirstHeld = 1000;  ///< above all regions of an image

  /// A lamp without a tag, as it was when all of it was last seen.
  struct Fixed {
    PointLight light;
    int images = 0;  ///< in a row at this place with this size
  };
  void restore_cut(Illumination& now) const;
  void restore_missing(const Illumination& last, std::vector<int>& found, Illumination& now) const;
  void average(const Illumination& last, const std::vector<int>& found, Illumination& now) const;
  void remember_fixed(const Illumination& now);
  void hold_missing(const Illumination& last, const std::vector<int>& found, Illumination& now);

  void assign_ids(const std::vector<PointLight>& before, const std::vector<int>& found,
                  std::vector<PointLight>& lights);

  std::size_t max_lamps_;
  int earlier_id(const PointLight& light, const std::vector<PointLight>& before, const std::set<int>& taken) const;

  std::map<int, int> ids_of_tags_;
  std::map<int, Eigen::Vector3f> last_directions_;  ///< of all lamps so far without a tag, by id
  std::map<int, Fixed> fixed_;                      ///< by id
  EnvironmentMap uncovered_;                        ///< of the newest image in which no lamp was covered or missing
  int next_id_ = 0;
  int next_held_region_ = kFirstHeld;  ///< a held lamp's region differs from those of any image
  int averaged_ = 0;                   ///< frames in the running mean
};

}  // namespace lumigraft::reconstruct
