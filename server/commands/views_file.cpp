#include "server/commands/views_file.h"

#include <utility>

#include "capture/message_text.h"
#include "reconstruct/kept_room/keyframe_file.h"
#include "server/commands/unused_file.h"

namespace lumigraft::server {

namespace fs = std::filesystem;

ViewsFile::ViewsFile(fs::path file, const capture::Session& session)
    : file_(std::move(file)), tag_(session.tag), color_(session.color.model) {
  std::error_code ignored;
  if (!fs::exists(file_, ignored)) return;
  try {
    views_ = reconstruct::read_views(file_, tag_, color_);
    message_ = file_.string() + ": " + std::to_string(views_.size()) + " views of the room, as kept before";
  } catch (const std::exception& e) {
    unusable_ = true;
    message_ = capture::on_one_line(e.what()) + "; these views are not used, and kept as " + file_.string() +
               ".unused when new ones are";
  }
}

std::string ViewsFile::save(const reconstruct::KeyframeMap::Views& views) {
  try {
    if (unusable_) keep_as_unused(file_);
    unusable_ = false;
    reconstruct::write_views(file_, views, tag_, color_);
    failed_ = false;
  } catch (const std::exception& e) {
    if (!std::exchange(failed_, true))
      return "views of the room cannot be saved: " + capture::on_one_line(e.what()) +
             "; after a restart the camera is located by a tag alone";
  }
  return {};
}

fs::path views_file_of(const fs::path& configuration) {
  return configuration.parent_path() / (configuration.stem().string() + ".views.yml.gz");
}

}  // namespace lumigraft::server
