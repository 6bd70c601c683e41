#pragma once
// The room of a view as the camera sees it from another pose: what was found for one picture is drawn in the next ones.
#include "relight/compose/current_depth.h"
#include "relight/compose/pixel_rays.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/views/view_light.h"

namespace lumigraft::relight {

/// Each pixel takes change and radiance of the surface that its ray intersects, from the pixels of the view that show
/// it: a fixed-point iteration of ray, plane of the surface at a pixel of the view, and projection into the view
/// (Bowles et al. 2012, "Iterative Image Warping"), then interpolation between pixels of that surface. On matt surfaces
/// a change of light is the same from all directions. `rays`: of the view's camera. `depth`: of now, of the camera's
/// own pixels; it selects one of several surfaces on a ray. Surface that the view does not contain gets the values of
/// the nearest pixels whose plane explains its depth, else no change; beyond the view's border its last pixels count.
/// `picture`: of now; where it is much brighter than the view, as after a hand's shadow, the change is limited to that
/// of the view. Null: nowhere. `memory`: an earlier result, whose memory is reused.
RoomInView reprojected(const RoomInView& view, const Eigen::Isometry3f& T_tag_view, const PixelRays& rays,
                       const Eigen::Isometry3f& T_tag_camera, const CurrentDepth& depth, const CameraUpload* picture,
                       RoomInView memory);

/// Of the pixels of the camera at this pose, the fraction whose surface the view's image contains, about.
float overlap(const RoomInView& view, const Eigen::Isometry3f& T_tag_view, const Eigen::Isometry3f& T_tag_camera);

}  // namespace lumigraft::relight
