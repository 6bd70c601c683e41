#pragma once
// How surfaces reflect, as far as views of them show it: matt, glossy or a mirror; unknown where no view came near the
// reflection of a lamp.
//
// A matt surface is as bright from everywhere. Of each place of the surface it is kept how bright it was by how near
// the camera stood to where a mirror would show it a lamp: excess there over what is seen far from any reflection is
// gloss, and how far out it reaches tells its width. A lamp counts where it shines on the place, and where even a
// polished dielectric (4 % at normal incidence) would show it: bright enough to be seen on what the surface scatters.
#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include "capture/frame.h"
#include "capture/session.h"
#include "reconstruct/albedo.h"
#include "reconstruct/distance_field.h"
#include "reconstruct/light.h"
#include "reconstruct/pose.h"

namespace lumigraft {

enum class Gloss : std::uint8_t {
  unknown,
  matt,    ///< nothing but diffuse; or a lobe too faint or wide to be told from it (a dielectric's of GGX alpha above
           ///< 0.4)
  glossy,  ///< in between; or narrower, where views do not show by how much
  mirror   ///< alpha below 0.05 or so
};

struct GlossField {
  float cell_m = 0.032f;  ///< edge of a cell: cell (i, j, k) holds places from cell_m · (i, j, k) on, tag frame
  std::unordered_map<BrickKey, Gloss, BrickKeyHash> cells;  ///< known ones alone
  std::size_t surface_cells = 0;                            ///< of all, known or not

  Gloss at(const Eigen::Vector3f& position_m) const;
  /// Part of the surface that is known to be glossy or a mirror.
  float glossy_share() const;
  float known_share() const;
};

class GlossStage {
 public:
  explicit GlossStage(const Session& session);
  ~GlossStage();
  /// Looks at the surface from where the camera is, once it has moved. Lamps count once their distance is known. What a
  /// place tells holds for its surroundings of the same colour, where `albedo` (may be null) knows it. The same pointer
  /// again while nothing is told anew; null before anything was.
  std::shared_ptr<const GlossField> look(const FrameSet& frame, const Pose& pose, const DistanceField& field,
                                         const Illumination& light, const AlbedoField* albedo);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft
