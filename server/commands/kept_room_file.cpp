#include "server/commands/kept_room_file.h"

#include <exception>
#include <system_error>
#include <utility>

#include "capture/message_text.h"
#include "reconstruct/kept_room/room_file.h"
#include "server/commands/unused_file.h"

namespace lumigraft::server {

namespace fs = std::filesystem;

KeptRoomFile::KeptRoomFile(fs::path file, capture::Tag tag, const reconstruct::FusionSettings& fusion)
    : file_(std::move(file)), tag_(std::move(tag)) {
  std::error_code error;
  if (!fs::exists(file_, error)) return;
  try {
    room_ = reconstruct::read_room(file_, tag_, fusion);
    const std::uintmax_t size = fs::file_size(file_, error);
    size_ = error ? 0 : size;
    message_ = capture::formatted(
        "%s: the room with %zu bricks of surface, as kept before, is used as soon as the camera "
        "sees that it is this one",
        file_.c_str(), room_->field.bricks.size());
  } catch (const std::exception& e) {
    unusable_ = true;
    message_ = capture::on_one_line(e.what()) + "; this room is not used, and kept as " + file_.string() +
               ".unused when another one is";
  }
}

std::string KeptRoomFile::save(const reconstruct::RoomToKeep& room) {
  try {
    std::error_code ignored;
    if ((unusable_ || (room.another && !renamed_)) && fs::exists(file_, ignored)) keep_as_unused(file_);
    unusable_ = false;
    renamed_ = room.another;
    size_ = reconstruct::write_room(file_, room.room, tag_);
    failed_ = false;
  } catch (const std::exception& e) {
    if (!std::exchange(failed_, true))
      return "the room cannot be kept: " + capture::on_one_line(e.what()) + "; it is learnt anew at the next start";
  }
  return {};
}

fs::path default_kept_room(const fs::path& configuration) {
  return configuration.parent_path() / (configuration.stem().string() + ".room");
}

}  // namespace lumigraft::server
