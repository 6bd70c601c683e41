#pragma once
// A session with truth, and what the program knows of its room after looking at it.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "reconstruct/scene_builder.h"
#include "server/bench/measures.h"
#include "server/pipeline/service_config.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

/// The session's first frames, as far as the bench looks: enough for the room to be known.
constexpr int kBenchFrames = 24;

/// Reads a session and looks whether it has what the bench and the oracle need of truth/. Throws InputError.
ServiceInput open_bench_session(const std::filesystem::path& folder, const OracleParts& oracle);

struct BenchScene {
  capture::FrameSet frame;   ///< the last one that has the truth asked for
  reconstruct::Scene scene;  ///< as known then
  capture::Image<std::uint8_t> camera;
  TruePictures truth;
  std::map<std::string, reconstruct::StageCost> stages;  ///< median over the frames, of those on which a stage ran
  std::vector<std::string> warnings;
};

/// Scores a frame whose truth has all that `needed` names: a superset of `oracle`. Throws InputError where no such
/// frame can be read.
BenchScene learn_bench_scene(const capture::Session& session, const OracleParts& oracle, const OracleParts& needed);

}  // namespace lumigraft::server
