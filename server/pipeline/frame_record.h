#pragma once
// A frame's record as a line of frames.jsonl.
#include <cstdint>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "server/pipeline/offline_pipeline.h"

namespace lumigraft::server {

/// Without a line break. Keys: index, time_s, T_tag_camera (4x4 rows or null), color_gain, lights, sh (9x3 or null),
/// plan, planned (keys that were adapted to the scene: key, most, value, left_out: fraction of the irradiance),
/// stage_ms and stage_cpu_ms by stage, pass_ms by GPU pass, and warnings.
std::string frame_record_line(const capture::FrameSet& frame, const FrameRecord& record);

/// A colour frame that was lost: the same keys and "skipped": true. There is no image for it.
std::string skipped_frame_line(std::uint64_t index, const std::vector<std::string>& warnings);

}  // namespace lumigraft::server
