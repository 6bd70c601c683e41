#pragma once
// Finds the light of a view by delta final gathering: G-buffer of the room and of what moved in it, the change of light
// on its pixels, and the objects' radiance. What has not changed since the last view is not traced again.
#include <memory>
#include <optional>
#include <vector>

#include "capture/session/session.h"
#include "relight/compose/reduced_view.h"
#include "relight/gather/gather_grid.h"
#include "relight/gather/object_pixels.h"
#include "relight/gather/ray_light.h"
#include "relight/gather/recently_moved.h"
#include "relight/gather_quality.h"
#include "relight/plan.h"
#include "relight/renderer.h"
#include "relight/views/pass_clock.h"
#include "relight/views/view_light.h"

namespace lumigraft::relight {

class ViewLighting {
 public:
  /// What is to be drawn with the light of a view: a picture of that view alone, or also pictures of those nearby,
  /// which need all of ViewLight.
  enum class Views { found, nearby };

  /// `known`: of session.real_surfaces. `models`: prepared on another thread; null: `prepare` does it.
  ViewLighting(const capture::Session& session, const std::vector<KnownSurface>& known,
               std::shared_ptr<const RayModels> models, Views views);

  /// As RayLight::prepare. `preparing` may be null if it was constructed without models.
  Exhibit prepare(const Exhibit& exhibit, std::vector<std::string>* preparing) {
    return light_.prepare(exhibit, preparing);
  }
  void enter(std::shared_ptr<const RayRoom> room);
  const std::shared_ptr<const RayRoom>& room() const { return room_; }  ///< null until `enter`

  /// Takes objects, in the room that was entered.
  void follow(const reconstruct::Scene& scene, const std::vector<ReferenceMesh>& objects, const Plan& plan,
              PassClock& clock);
  /// Finds the light of a frame whose camera is there, after `follow`. `whole`: of all pixels, also those that nothing
  /// changes. `camera`: has taken the frame. False if it is that of the last call.
  bool find(const capture::FrameSet& frame, const CameraUpload& camera, const Eigen::Isometry3f& T_tag_camera,
            const Plan& plan, bool whole, PassClock& clock);

  /// Whether the next `find` of the same view finds other light (RayLight::changes).
  bool changes() const { return light_.changes(); }
  /// Of the last `find`.
  const ViewLight& found() const { return found_; }
  /// Albedo, normals and depth of the room's pixels and, where `shown` covers them, of the objects.
  std::shared_ptr<const RelightMaps> maps(const capture::Image<float>& change, const ObjectLayer& shown) const;

  /// Bounding spheres of the objects of the last `follow`: x, y, z, radius; tag frame.
  const std::vector<Eigen::Vector4f>& spheres() const { return light_.light().objects().meshes().spheres(); }
  const Meshes& meshes() const { return light_.light().objects().meshes(); }

 private:
  const CameraUpload& room_picture() const { return reduced_ ? reduced_->picture() : *camera_; }
  const capture::CameraModel& room_camera() const { return reduced_ ? reduced_->model() : session_.color.model; }
  RoomPixels room_pixels() const { return {seen_, room_camera(), reduced_ ? reduced_->scale() : 1}; }
  capture::Image<float>& change() { return found_.room.change; }
  capture::Image<float>& radiance() { return found_.room.radiance; }
  const capture::Image<float>& radiance() const { return found_.room.radiance; }
  TileMask& tiles() { return found_.room.tiles; }
  float grey_level() const { return 1 / (255 * camera_->exposure().maxCoeff()); }

  void reduce(int scale, const capture::FrameSet& frame);
  TileMask needed_tiles(const CameraRays& eye, const CurrentDepth& depth, const GatherQuality& asked, bool whole,
                        std::optional<TilePixels>* pixels) const;
  void look(const capture::FrameSet& frame, const CameraRays& eye, const CurrentDepth& depth,
            const GatherQuality& asked, bool whole, PassClock& clock);
  void see(const CameraRays& eye, const CurrentDepth& depth, int rays, PassClock& clock);
  void find_change(const std::vector<EmitterSampleSet>& emitters, int rays, const UpdateSubset& turn, PassClock& clock);
  void describe(const CameraRays& eye, const CurrentDepth& depth);

  capture::Session session_;
  Views views_;
  bool any_known_;  ///< surface of known material, which may be glossy
  RayLight light_;
  PixelRays pixel_rays_;

  std::shared_ptr<const RayRoom> room_;
  std::vector<LightSampleSet> lamps_;

  // State of the last view.
  const CameraUpload* camera_ = nullptr;  ///< during `find`
  /// The view whose pixels the room's below are; none: the camera's own.
  std::optional<ReducedView> reduced_;
  Eigen::Matrix4f T_tag_camera_ = Eigen::Matrix4f::Zero();
  std::shared_ptr<const RayRoom> seen_room_;
  GatherQuality detail_;
  std::vector<GBufferPixel> seen_;
  bool clips_ = false;                     ///< some pixel of the picture they were found in
  std::array<float, 3> gain_ = {1, 1, 1};  ///< FrameSet::color_gain of that picture
  RecentlyMoved recent_;
  MovedPixels covered_;  ///< pixels of the room that moved surfaces replace in `seen_`
  std::shared_ptr<const capture::DepthFrame> last_depth_;
  std::optional<GatherGrid> indirect_, gloss_;
  bool new_view_ = false;  ///< nothing was gathered for it yet
  ObjectPixels objects_;
  ViewLight found_;
};

}  // namespace lumigraft::relight
