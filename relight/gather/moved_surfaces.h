#pragma once
// Surfaces that this frame's depth shows and the fused room does not: hands, people, what was just moved or has left.
// Fusion takes them over some frames later.
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "relight/compose/current_depth.h"
#include "relight/gather/gbuffer.h"
#include "relight/gather/recently_moved.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/tracing/light_samples.h"

namespace lumigraft::relight {

/// Pixels of `seen`, the G-buffer of the fused room, whose depth differs from it by more than noise, in areas wider
/// than fusion displaces edges; with their surfaces: matt, of the albedo that explains the pixel's radiance under
/// unoccluded lamps and the environment. `voxel_m`: of the fused room. Surface of what has `arrived` is moved surface,
/// too, where depth does not differ from it or is unknown; null: nothing has. Pixels of `seen` that were not traced
/// count as unmoved.
MovedPixels moved_surfaces(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps,
                           float voxel_m, const CameraRays& eye, const CurrentDepth& depth, const CameraUpload& picture,
                           const std::vector<GBufferPixel>& seen, const ArrivedSurface* arrived = nullptr);

/// At each pixel of the camera, 255 if it shows a moved surface in front of the room or where it was fused since, else
/// 0, also where depth sees through fused surface. `covered`: the fused pixels that `room` has moved surfaces for.
capture::Image<std::uint8_t> front_mask(const MovedPixels& covered, const RoomPixels& room, const CurrentDepth& depth,
                                        int width, int height);

/// Adds the tiles in which depth may differ from the field's surface, or shows what has arrived.
void add_moved_tiles(const CameraRays& eye, const CurrentDepth& depth, const reconstruct::DistanceField& field,
                     const ArrivedSurface& arrived, TileMask& tiles);

/// The depth that moved as triangles (depth_shell.h), null: none. `fused`: the room's pixels that `moved` replaces, in
/// the same order; the triangles end before these, unless they are of what has arrived, and before `objects`. With
/// `colored` their colours are the albedo.
std::shared_ptr<const Model> moved_shell(const CameraRays& eye, const CurrentDepth& depth, const MovedPixels& moved,
                                         const MovedPixels& fused, const Meshes& objects, bool colored);

/// The same without colours, found in the field alone, for methods without a mesh of the room.
struct MovedInField {
  MovedPixels now, fused;              ///< depths and positions alone; none unless something is where it matters
  std::shared_ptr<const Model> shell;  ///< null likewise
};
/// `may_matter`: of a point, tag frame; `objects` is called if something of what moved is there.
MovedInField moved_in_field(const CameraRays& eye, const CurrentDepth& depth, const reconstruct::DistanceField& field,
                            const ArrivedSurface& arrived,
                            const std::function<bool(const Eigen::Vector3f&)>& may_matter,
                            const std::function<const Meshes&()>& objects);

}  // namespace lumigraft::relight
