#pragma once
// The camera-independent light of a room with objects, updated from frame to frame.
#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "relight/gather/delta_light.h"
#include "relight/gather/surface_gather.h"
#include "relight/plan.h"

namespace lumigraft::relight {

/// Extrapolation of later bounces of light between real surfaces. Each round of gathering adds a bounce. Later bounces
/// are similar, each a constant fraction of the previous one: in every third round the sum of their geometric series is
/// applied at once (Aitken 1926).
class BounceSeries {
 public:
  /// Call before a round; `irradiance`: of all cells.
  void begin(const std::vector<Rgb>& irradiance) { before_ = irradiance; }
  /// Call after it. False if no further round is needed: at least `min_rounds` rounds ran and the last bounce was
  /// negligible, or the maximum number of rounds is reached.
  bool goes_on(std::vector<Rgb>& irradiance, int min_rounds);
  int round() const { return round_; }  ///< the next round, from 1

 private:
  std::vector<Rgb> before_;
  int round_ = 1;
  float last_ = 0;  ///< contribution of the last round
};

class RayLight {
 public:
  /// `models`: prepared on another thread; null: `prepare` does it.
  explicit RayLight(std::shared_ptr<const RayModels> models) : models_(std::move(models)) {}

  /// Prepares the exhibit's models, hidden ones too, so that showing one only requires computing its light. Returns the
  /// exhibit without visible objects that another thread has yet to prepare, which `preparing` names.
  Exhibit prepare(const Exhibit& exhibit, std::vector<std::string>* preparing);

  /// Takes a room and objects. Calls `done(pass)` if they have changed.
  void follow(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, const Plan& plan,
              const std::function<void(const char*)>& done);
  /// Shadows that the colour frame shows (LampShadows); null: none. Hold until the next call.
  void set_shadows(std::shared_ptr<const reconstruct::LampShadows> shadows) { shadows_ = std::move(shadows); }
  /// What moved since the room was fused, and the light of now on it; null: nothing, the same light. Holds until the
  /// next call. After `follow`.
  void set_moved(std::shared_ptr<const MovedOccluders> moved, std::shared_ptr<const LightChange> light);
  /// Updates light to what was taken. If the plan's quality has rounds, it is updated over that many frames, also when
  /// objects appear or disappear; if another thread prepares models, over twice as many parts, in every other frame
  /// then. Else it is solved within one frame if there is no previous solution. Returns false if the view need not be
  /// drawn anew for it. Calls `done(pass)` after each pass.
  bool gather(const Plan& plan, const std::function<void(const char*)>& done);

  /// Valid after the first `follow`.
  const DeltaLight& light() const { return world_->light; }
  const std::vector<ChangeRegion>& places() const { return world_->places; }
  /// The objects of the last `follow`.
  const std::vector<PlacedModel>& placed() const { return placed_; }
  /// The change of indirect light as it was last gathered.
  const IrradianceChangeCache& cells() const { return world_->cells; }
  /// Whether the next `gather` changes light.
  bool changes() const { return !same_ || outstanding_ > 0; }
  /// Whether that is near to what the next `gather` finds: no object has appeared or disappeared a moment ago.
  bool is_known() const { return !bounces_ && (goes_on_ || (same_ && solved_)); }
  /// The subset that was updated last; light that depends on the camera can be updated with the same subset.
  UpdateSubset turn() const { return {std::min(turn_.of, kCameraTurns), turn_.now % kCameraTurns}; }

 private:
  struct World {
    /// `known`: the cells of the same surfaces and objects; may be null.
    World(std::shared_ptr<const RayRoom> room, std::vector<PlacedModel> placed, const IrradianceChangeCache* known);

    std::shared_ptr<const RayRoom> room;
    RayObjects objects;
    BoundingSphere sphere;
    IrradianceChangeCache cells;
    std::vector<ChangeRegion> places;  ///< regions where light changes
    DeltaLight light;
  };

  /// A model of the exhibit, and its probes.
  struct Prepared {
    std::shared_ptr<const Model> model;
    std::shared_ptr<const IrradianceProbes> places;
    PosedTrees trees = {};
  };

  /// Null if another thread has yet to prepare the model.
  Prepared* prepared_of(const std::shared_ptr<const Model>& model);
  PlacedModel placed(const ReferenceMesh& object);
  void place(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, bool goes_on);
  void solve(const Plan& plan, const std::function<void(const char*)>& done);
  void go_on(int rounds, const Plan& plan, const std::function<void(const char*)>& done);
  /// Photons of the world as it is.
  void send_photons(const Plan& plan, const std::function<void(const char*)>& done);
  void gather_on_objects(int bounces, const Plan& plan, const std::function<void(const char*)>& done);
  void gather_in_cells(const Plan& plan, const std::function<void(const char*)>& done);

  std::shared_ptr<const RayModels> models_;
  std::vector<Prepared> prepared_;
  std::vector<PlacedModel> placed_;
  std::vector<ReferenceMesh> objects_;
  int rays_ = 0, trace_scale_ = 0;
  static constexpr int kCameraTurns = 8;  ///< most parts of light that depends on the camera (gather_grid.h)

  UpdateSubset turn_;
  bool draws_next_ = false;              ///< light was gathered that the last frame does not show
  int outstanding_ = 0;                  ///< frames until every probe has been updated since the last change
  std::optional<BounceSeries> bounces_;  ///< iterated to convergence after objects appeared or disappeared
  std::unique_ptr<World> world_;
  std::shared_ptr<const MovedOccluders> moved_;
  std::shared_ptr<const LightChange> light_change_;
  std::shared_ptr<const reconstruct::LampShadows> shadows_, lit_with_;
  bool solved_ = false;  ///< a previous solution exists
  // Of the last `follow`.
  int rounds_ = 1;            ///< frames over which light is updated
  bool same_ = false;         ///< nothing that light depends on has changed
  bool goes_on_ = false;      ///< from the previous solution
  bool apart_ = false;        ///< frames gather or draw, none does both
  bool drawn_first_ = false;  ///< new objects are drawn before their light is gathered
};

}  // namespace lumigraft::relight
