#pragma once
// Alpha matte of real surfaces in front of the objects. Depth locates their outlines to a pixel or two; the colour
// image gives the fraction of each pixel.
#include <optional>

#include "relight/compose/current_depth.h"
#include "relight/compose/object_layer.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

/// Reduces the coverage of the objects by the surfaces that `depth` shows in front of them. Near an outline of such a
/// surface the colour of a pixel is C = α F + (1 - α) B (Chuang et al. 2001, eq. 1); F and B, the colours of foreground
/// and background, are estimated from pixels on both sides. α is its posterior mean; depth gives the prior: the outline
/// is at the depth discontinuity, with a Gaussian error. The object replaces (1 - α) B.
void hide_behind_foreground(const CurrentDepth& depth, const CameraUpload& picture, ObjectLayer& objects);
/// The same for a copy; none if nothing is in front of them.
std::optional<ObjectLayer> behind_foreground(const CurrentDepth& depth, const CameraUpload& picture,
                                             const ObjectLayer& objects);

}  // namespace lumigraft::relight
