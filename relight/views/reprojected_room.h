#pragma once
// The room of a view as the camera sees it from another pose: what was found for one picture is drawn in the next ones.
#include "relight/compose/current_depth.h"
#include "relight/compose/pixel_rays.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/views/view_light.h"

namespace lumigraft::relight {

/// Each pixel takes what the view found of the surface that its ray meets: a fixed point of ray, plane of the surface
/// at a pixel of the view, and the pixel there (Bowles et al. 2012, "Iterative Image Warping"), interpolated between
/// pixels of this surface. A change of light on matt surfaces is the same from all sides. Surface that the view did not
/// see continues what is beside it and explains the depth of now; where nothing does, nothing changes. Beyond the
/// view's border its last pixels continue. `rays`: of the view's camera. `depth`: of now, of the camera's own pixels;
/// it tells which of several surfaces on a ray is seen. `picture`: of now; where it is much brighter than the view
/// was, as where a hand's shadow has left, a part of its light would be too much: the change is bounded by that of the
/// view. Null: nowhere. `memory`: an earlier result, whose memory is reused.
RoomInView reprojected(const RoomInView& view, const Eigen::Isometry3f& T_tag_view, const PixelRays& rays,
                       const Eigen::Isometry3f& T_tag_camera, const CurrentDepth& depth, const CameraUpload* picture,
                       RoomInView memory);

/// Of the pixels of the camera at this pose, the fraction whose surface the view's image contains, about.
float overlap(const RoomInView& view, const Eigen::Isometry3f& T_tag_view, const Eigen::Isometry3f& T_tag_camera);

}  // namespace lumigraft::relight
