#pragma once
// Lamps from one fish-eye picture to the next: who is who, and averaging while nothing moves.
#include <map>
#include <vector>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Gives the lamps of `now` the ids of the nearest lamps of `last` (new ones where none is near), and averages the two
/// while the light stands still, lamps and environment alike, so that they still sum to an (averaged) picture.
///
/// A lamp with a mark keeps its id wherever it goes.
///
/// A lamp that is gone with its energy may be covered by what moves: it stays for kHeld pictures and is faded out over
/// kFaded more. One whose energy is found elsewhere has moved, or is cut otherwise, and is not kept.
class LightTracker {
 public:
  explicit LightTracker(std::size_t most_lamps) : most_(most_lamps) {}

  void update(const Illumination* last, Illumination& now);
  /// The id of the lamp with this mark, which none of `lights` is: a new one where another has it.
  int id_of_mark(int mark, const std::vector<PointLight>& lights);

 private:
  static constexpr int kHeld = 3, kFaded = 4, kFirstHeld = 1000;

  void keep_hidden(const Illumination& last, const std::vector<int>& found, Illumination& now);

  void name(const std::vector<PointLight>& before, const std::vector<int>& found, std::vector<PointLight>& lights);

  std::size_t most_;
  std::map<int, int> ids_of_marks_;
  int next_id_ = 0;
  int next_held_region_ = kFirstHeld;  ///< a hidden lamp's region is none of any picture's
  int averaged_ = 0;                   ///< pictures in the running mean
};

}  // namespace lumigraft::reconstruct
