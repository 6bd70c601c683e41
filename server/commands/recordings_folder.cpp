#include "server/commands/recordings_folder.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

struct KeptRecording {
  fs::path folder;
  fs::file_time_type began;  ///< when it was marked
  std::uintmax_t bytes = 0;
};

/// Such as 2026-11-22T05-04-03Z, which is valid on every file system.
std::string time_name() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H-%M-%SZ", &utc);
  return text.data();
}

std::uintmax_t bytes_in(const fs::path& folder) {
  std::uintmax_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code gone;
    const std::uintmax_t size =
        entry->symlink_status(gone).type() == fs::file_type::regular ? entry->file_size(gone) : 0;
    if (!gone) bytes += size;
  }
  return bytes;
}

/// The oldest first. A link to a folder is none.
std::vector<KeptRecording> recordings_in(const fs::path& folder) {
  std::vector<KeptRecording> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code absent;
    if (entry->symlink_status(absent).type() != fs::file_type::directory) continue;
    const fs::file_time_type began = fs::last_write_time(entry->path() / RecordingsFolder::kMark, absent);
    if (!absent) found.push_back({entry->path(), began, bytes_in(entry->path())});
  }
  std::ranges::sort(found, {}, [](const KeptRecording& one) { return std::pair(one.began, one.folder); });
  return found;
}

std::string gb_text(double gb) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g GB", gb);
  return text.data();
}

/// Says it in the log. False where it fails.
bool remove_recording(const fs::path& recording) {
  std::error_code error;
  // The mark goes last: what is removed in part is still known.
  for (const fs::directory_entry& entry : fs::directory_iterator(recording, error))
    if (std::error_code ignored; entry.path().filename() != RecordingsFolder::kMark)
      fs::remove_all(entry.path(), ignored);
  fs::remove_all(recording, error);
  const std::string done = error ? "cannot be removed: " + error.message() : "removed as the oldest recording";
  std::fprintf(stderr, "lumigraft: %s: %s\n", recording.c_str(), done.c_str());
  return !error;
}

}  // namespace

RecordingsFolder::RecordingsFolder(fs::path folder, const RecordingLimits& limits, FreeBytes free_bytes)
    : folder_(std::move(folder)), limits_(limits), free_bytes_(std::move(free_bytes)) {}

fs::path RecordingsFolder::new_recording() const {
  const fs::path name = folder_ / time_name();
  fs::path free = name;
  for (int number = 2; fs::exists(free); ++number) free = name.string() + "-" + std::to_string(number);
  return free;
}

void RecordingsFolder::mark(const fs::path& recording) {
  std::ofstream out(recording / kMark);
  out << "lumigraft made this recording, and removes it when newer ones need its space. Delete this file to keep it.\n";
  out.close();
  if (!out) throw std::runtime_error((recording / kMark).string() + ": cannot be written; is the disk full?");
  std::error_code ignored;
  fs::file_time_type began = fs::last_write_time(recording / kMark, ignored);
  for (fs::directory_iterator other(recording.parent_path(), ignored), end; !ignored && other != end;
       other.increment(ignored)) {
    std::error_code absent;
    const fs::file_time_type before = fs::last_write_time(other->path() / kMark, absent);
    if (!absent && other->path() != recording && before >= began) began = before + std::chrono::seconds(1);
  }
  fs::last_write_time(recording / kMark, began, ignored);
}

std::uintmax_t RecordingsFolder::disk_free_bytes(const fs::path& folder) {
  std::error_code error;
  fs::path existing = fs::absolute(folder, error);
  while (!fs::exists(existing, error) && existing.has_relative_path()) existing = existing.parent_path();
  const fs::space_info space = fs::space(existing, error);
  return error ? 0 : space.available;
}

std::string RecordingsFolder::make_room(const fs::path& written) const {
  const std::vector<KeptRecording> all = recordings_in(folder_);
  double total = 0, removable = 0;  // bytes
  for (const KeptRecording& one : all) {
    total += static_cast<double>(one.bytes);
    if (one.folder != written) removable += static_cast<double>(one.bytes);
  }
  const double free = static_cast<double>(free_bytes_(folder_));
  const double above_total = total - 1e9 * limits_.max_total_gb, below_free = 1e9 * limits_.min_free_gb - free;
  double missing = std::max(above_total, below_free);
  if (missing > removable) {  // nothing is removed in vain
    return (above_total > removable
                ? "recordings take more than " + gb_text(limits_.max_total_gb) + " (server.max_recordings_gb)"
                : "less than " + gb_text(limits_.min_free_gb) +
                      " are free on the disk of recordings (server.min_free_disk_gb)") +
           ", and removing older ones would not suffice";
  }
  for (const KeptRecording& oldest : all) {
    if (missing <= 0) break;
    if (oldest.folder == written || !remove_recording(oldest.folder)) continue;
    missing -= static_cast<double>(oldest.bytes);
  }
  return "";
}

}  // namespace lumigraft::server
