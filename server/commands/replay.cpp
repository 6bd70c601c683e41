#include "server/commands/replay.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <regex>

#include "capture/error.h"
#include "capture/formats/picture_writer.h"
#include "capture/message_text.h"
#include "capture/recorded/seekable_reader.h"
#include "capture/source.h"
#include "reconstruct/field/surface_mesh.h"
#include "server/commands/kept_room_file.h"
#include "server/commands/tag_map_file.h"
#include "server/pipeline/frame_record.h"
#include "server/pipeline/offline_pipeline.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

/// Directory that holds a replay's files until all are written.
class PartialOutput {
 public:
  explicit PartialOutput(fs::path out) : out_(std::move(out)), partial_(out_ / ".lumigraft-partial") {
    capture::refuse_if(fs::exists(out_) && !fs::is_directory(out_),
                       "--out: " + out_.string() + " is a file, allowed: a folder, existing or not");
    made_out_ = !fs::exists(out_);
    std::error_code error;
    fs::create_directories(out_, error);
    if (!error) {
      fs::remove_all(partial_, error);
      fs::create_directory(partial_, error);
    }
    capture::refuse_if(error.value() != 0, "--out: " + out_.string() + ": " + error.message());
  }
  PartialOutput(const PartialOutput&) = delete;
  PartialOutput& operator=(const PartialOutput&) = delete;
  ~PartialOutput() {
    std::error_code ignored;
    fs::remove_all(partial_, ignored);
    if (made_out_ && !kept_) fs::remove(out_, ignored);  // removes only an empty folder
  }

  const fs::path& folder() const { return partial_; }

  /// Moves all files up, replacing those of an earlier replay.
  void keep() {
    static const std::regex ours(R"(frame_\d{6,}(_[a-z]+)?\.(png|exr)|frames\.jsonl|surface\.ply)");
    std::vector<fs::path> earlier;
    for (const fs::directory_entry& entry : fs::directory_iterator(out_)) {
      if (entry.is_regular_file() && std::regex_match(entry.path().filename().string(), ours)) {
        earlier.push_back(entry.path());
      }
    }
    for (const fs::path& path : earlier) fs::remove(path);
    for (const fs::directory_entry& entry : fs::directory_iterator(partial_)) {
      fs::rename(entry.path(), out_ / entry.path().filename());
    }
    kept_ = true;
  }

 private:
  fs::path out_, partial_;
  bool made_out_ = false, kept_ = false;
};

/// The warning of capture about a colour picture that is missing before `frame`.
std::string lost_frame(const capture::FrameSet& frame, std::uint64_t index) {
  const std::string about = "colour picture " + std::to_string(index) + " ";
  const auto found = std::ranges::find_if(frame.warnings, [&](const std::string& w) { return w.starts_with(about); });
  return found != frame.warnings.end() ? *found : about + "is missing";
}

void write_maps(const fs::path& stem, const relight::RelightMaps& maps) {
  const auto write = [&](const char* name, const capture::Image<float>& image) {
    if (!image.empty()) capture::write_exr(stem.string() + "_" + name + ".exr", image);
  };
  write("albedo", maps.albedo);
  write("normals", maps.normals);
  write("depth", maps.depth_m);
  write("delta", maps.delta);
  write("mask", maps.mask);
}

}  // namespace

bool run_replay(const ReplayCommand& command, const std::atomic<bool>& interrupted) {
  ServiceInput input = read_service(command.files, replay_plan());
  for (const std::string& warning : input.warnings) std::cerr << "lumigraft: " << warning << '\n';
  std::unique_ptr<capture::FrameReader> frames =
      command.from_s > 0.0 ? capture::open_frames_from(input.session, std::llround(1e9 * command.from_s))
                           : capture::open_paired_frames(input.session);
  capture::refuse_if(frames->live(),
                     "replay: " + input.session.name + " has live cameras, allowed: a recorded session");
  std::unique_ptr<Oracle> oracle;
  if (command.oracle.any()) oracle = std::make_unique<Oracle>(input.session, command.oracle);
  PartialOutput output(command.out);
  const auto make_device = [backend = input.server.backend] { return relight::gpu::create_device(backend, {}); };
  OfflinePipeline pipeline(input.session, std::move(input.exhibit), input.plan, make_device, std::move(oracle),
                           input.server.fusion);
  if (const fs::path& map = input.session.tag.map; !map.empty()) {
    const TagMapFile file(map, input.session.tag);
    std::cerr << "lumigraft: "
              << (file.message().empty() ? map.string() + ": no such file, tags are learnt anew" : file.message())
              << '\n';
    if (file.learnt()) pipeline.restore_tag_map(*file.learnt());
  }
  if (const fs::path& room = input.server.room; !room.empty()) {
    KeptRoomFile file(room, input.session.tag, input.server.fusion);
    std::cerr << "lumigraft: "
              << (file.message().empty() ? room.string() + ": no such file, the room is learnt anew" : file.message())
              << '\n';
    if (auto kept = file.take()) pipeline.restore_room(*std::move(kept));
  }

  std::ofstream lines(output.folder() / "frames.jsonl", std::ios::binary);
  auto limit = static_cast<std::uint64_t>(command.frames);
  std::uint64_t expected = 0, written = 0, skipped = 0;
  std::shared_ptr<const reconstruct::DistanceField> field;
  while (expected < limit && !interrupted) {
    const std::optional<capture::FrameSet> frame = frames->next(std::chrono::seconds(10));
    if (!frame) break;
    if (command.from_s > 0.0 && written == 0 && skipped == 0) {
      expected = frame->index;
      limit += frame->index;
    }
    for (; expected < frame->index && expected < limit; ++expected, ++skipped) {
      const std::string reason = lost_frame(*frame, expected);
      lines << skipped_frame_line(expected, {reason}) << '\n';
      std::cerr << "lumigraft: frame " << expected << " is skipped: " << reason << '\n';
    }
    if (frame->index >= limit) break;
    const FrameRecord record = pipeline.step(*frame, command.dump);
    const fs::path stem = output.folder() / capture::formatted("frame_%06ju", std::uintmax_t{frame->index});
    capture::write_png(stem.string() + ".png", record.picture.srgb);
    if (command.dump && record.picture.maps) write_maps(stem, *record.picture.maps);
    lines << frame_record_line(*frame, record) << '\n';
    field = record.scene.field;
    expected = frame->index + 1;
    ++written;
  }
  if (interrupted) return false;
  capture::refuse_if(written == 0,
                     input.session.folder.string() + ": no colour picture of the session can be read" +
                         (command.from_s > 0.0 ? " from second " + std::to_string(command.from_s) + " on" : ""));
  if (command.dump && field) {
    reconstruct::write_ply(reconstruct::extract_surface(*field), output.folder() / "surface.ply");
  }
  lines.close();
  if (!lines) throw std::runtime_error((output.folder() / "frames.jsonl").string() + ": cannot be written");
  output.keep();
  std::cerr << "lumigraft: " << written << " pictures in " << command.out.string()
            << (skipped > 0 ? ", " + std::to_string(skipped) + " frames skipped" : "") << '\n';
  return true;
}

}  // namespace lumigraft::server
