#pragma once
// The light of a room with objects that does not depend on the camera, kept from frame to frame.
#include <functional>
#include <memory>
#include <vector>

#include "relight/gather/delta_light.h"
#include "relight/gather/surface_gather.h"
#include "relight/plan.h"

namespace lumigraft::relight {

class RayLight {
 public:
  /// Follows room and objects, in rounds of frames where the plan's detail has such. False: nothing has changed.
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
    World(std::shared_ptr<const RayRoom> room, std::vector<PlacedModel> placed);

    std::shared_ptr<const RayRoom> room;
    RayObjects objects;
    BoundingSphere sphere;
    IrradianceChangeCache cells;
    std::vector<ChangeRegion> places;  ///< where light changes
    DeltaLight light;
  };

  void place(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, bool goes_on);
  void gather_on_objects(int bounces, const Plan& plan, const std::function<void(const char*)>& done);
  void gather_in_cells(const Plan& plan, const std::function<void(const char*)>& done);

  std::vector<PlacedModel> placed_;
  std::vector<ReferenceMesh> objects_;
  int rays_ = 0, trace_scale_ = 0;
  UpdateSubset turn_;
  int outstanding_ = 0;  ///< rounds until all places have light that is of now
  std::unique_ptr<World> world_;
};

}  // namespace lumigraft::relight
