#pragma once
// Decides whether a calibration is accepted. The rejection reason is the one most useful to the person who holds the
// board.
#include <string>

#include "reconstruct/calibrate/camera.h"
#include "reconstruct/calibrate/depth.h"
#include "reconstruct/calibrate/extrinsics.h"
#include "reconstruct/calibrate/time_offset.h"
#include "reconstruct/calibrate/vignetting.h"

namespace lumigraft::reconstruct {

/// Empty where the calibration is accepted.
std::string rejection_reason(const CameraCalibration& calibration);
std::string rejection_reason(const ExtrinsicsCalibration& extrinsics);
std::string rejection_reason(const RoomTagPose& place);
std::string rejection_reason(const VignettingCalibration& vignetting);
std::string rejection_reason(const TimeOffsetCalibration& time);
std::string rejection_reason(const DepthCalibration& depth);

}  // namespace lumigraft::reconstruct
