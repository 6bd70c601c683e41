#pragma once
// The light of a room with objects that does not depend on the camera, kept from frame to frame.
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "relight/gather/bounce_series.h"
#include "relight/gather/delta_light.h"
#include "relight/gather/surface_gather.h"
#include "relight/plan.h"

namespace lumigraft::relight {

class RayLight {
 public:
  /// Makes what the exhibit's models need, hidden ones too: when they are shown, light is all that is to be found.
  void prepare(const Exhibit& exhibit);

  /// Follows room and objects. Where the plan's detail has rounds of frames, light follows in these, also when objects
  /// come and go; it is solved in one frame where there is nothing to go on from. False: nothing has changed.
  /// `done(pass)` is called after each pass.
  bool follow(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, const Plan& plan,
              const std::function<void(const char*)>& done);

  /// After the first `follow`.
  const DeltaLight& light() const { return world_->light; }
  const std::vector<ChangeRegion>& places() const { return world_->places; }
  /// Which places got new light last; what is seen of it may follow in the same rounds.
  const UpdateSubset& turn() const { return turn_; }

 private:
  struct World {
    /// `known`: the cells of the same surfaces and objects; may be null.
    World(std::shared_ptr<const RayRoom> room, std::vector<PlacedModel> placed, const IrradianceChangeCache* known);

    std::shared_ptr<const RayRoom> room;
    RayObjects objects;
    BoundingSphere sphere;
    IrradianceChangeCache cells;
    std::vector<ChangeRegion> places;  ///< where light changes
    DeltaLight light;
  };

  /// A model that is exhibited, and its places.
  struct Prepared {
    std::shared_ptr<const Model> model;
    std::shared_ptr<const IrradianceProbes> places;
  };

  const std::shared_ptr<const IrradianceProbes>& places_of(const std::shared_ptr<const Model>& model);
  PlacedModel placed(const ReferenceMesh& object);
  void place(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, bool goes_on);
  void solve(const Plan& plan, const std::function<void(const char*)>& done);
  void go_on(int rounds, const Plan& plan, const std::function<void(const char*)>& done);
  void gather_on_objects(int bounces, const Plan& plan, const std::function<void(const char*)>& done);
  void gather_in_cells(const Plan& plan, const std::function<void(const char*)>& done);

  std::vector<Prepared> prepared_;
  std::vector<PlacedModel> placed_;
  std::vector<ReferenceMesh> objects_;
  int rays_ = 0, trace_scale_ = 0;
  UpdateSubset turn_;
  int outstanding_ = 0;                  ///< frames until all places have light that is of now
  std::optional<BounceSeries> bounces_;  ///< to be followed to their end, since objects have come or gone
  std::unique_ptr<World> world_;
  bool solved_ = false;  ///< there is light in it to go on from
};

}  // namespace lumigraft::relight
