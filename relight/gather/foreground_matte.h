#pragma once
// Which part of a pixel shows what stands before the objects. Depth says on which side of its outline a pixel lies, to
// a pixel or two; colour says how it is divided.
#include "relight/gather/object_pixels.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

/// Reduces the coverage of the objects by what `depth` shows before them. Within reach of the outline of such a surface
/// a pixel C is a mixture α F + (1 - α) B of the colours of the foreground and of what is behind it, estimated from the
/// pixels on both sides; α is the mean of its posterior, of which depth is the prior: the outline is where depth jumps,
/// with a Gaussian error. The object replaces (1 - α) B.
void hide_behind_foreground(const CurrentDepth& depth, const CameraUpload& picture, ObjectPixels& objects);

}  // namespace lumigraft::relight
