#include "server/commands/tag_map_file.h"

#include <algorithm>
#include <utility>

#include "capture/message_text.h"
#include "capture/text_file.h"
#include "reconstruct/pose/tag_map_file.h"
#include "server/commands/unused_file.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

}  // namespace

TagMapFile::TagMapFile(fs::path file, capture::Tag tag) : file_(std::move(file)), tag_(std::move(tag)) {
  std::error_code ignored;
  if (!fs::exists(file_, ignored)) return;
  try {
    learnt_ = reconstruct::read_tag_map(file_, tag_);
    const auto located =
        std::ranges::count_if(learnt_->tags, [](const auto& each) { return each.T_world_tag.has_value(); });
    message_ = file_.string() + ": " + std::to_string(located) + " of " + std::to_string(learnt_->tags.size()) +
               " tags are located, as learnt before";
  } catch (const std::exception& e) {
    unusable_ = true;
    message_ = capture::on_one_line(e.what()) + "; the tag map is not used, and kept as " + file_.string() +
               ".unused when a new one is learnt";
  }
}

std::string TagMapFile::save(const reconstruct::TagMap::State& state) {
  try {
    if (unusable_) keep_as_unused(file_);
    unusable_ = false;
    capture::write_text(file_, reconstruct::tag_map_text(tag_, state));
    failed_ = false;
  } catch (const std::exception& e) {
    if (!std::exchange(failed_, true))
      return "the tag map cannot be saved: " + capture::on_one_line(e.what()) +
             "; tags are learnt anew at the next start";
  }
  return {};
}

fs::path default_tag_map(const fs::path& configuration) {
  return configuration.parent_path() / (configuration.stem().string() + ".tags.toml");
}

}  // namespace lumigraft::server
