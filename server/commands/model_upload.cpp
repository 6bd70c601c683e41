#include "server/commands/model_upload.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <utility>

#include "capture/error.h"
#include "capture/text_file.h"
#include "relight/exhibit/exhibit.h"
#include "server/commands/exhibit_text.h"
#include "server/commands/parameters.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".glb";

WebReply refused(unsigned status, const std::string& why) { return {.status = status, .body = why + "\n"}; }

WebReply other_name() {
  return refused(400, "found a file name of other characters, allowed: up to " +
                          std::to_string(kCommands.max_model_name) + " letters, digits, - and _, then .glb");
}

/// Letters, digits, - and _, then .glb: a name that needs no quotes and leaves no folder.
bool allowed_name(std::string_view name) {
  if (!name.ends_with(kExtension)) return false;
  name.remove_suffix(kExtension.size());
  return !name.empty() && name.size() <= kCommands.max_model_name &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; });
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string megabytes(std::uint64_t bytes) { return std::to_string((bytes + (1 << 20) - 1) >> 20) + " MB"; }

/// What is wrong without the folders of this machine, for a page.
std::string without_folder(std::string text, const fs::path& file) {
  const std::string path = file.string();
  for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path)) text.erase(at, path.size());
  return text.starts_with(": ") ? text.substr(2) : text;
}

std::string object_text(std::string_view name) {
  const std::string plain(name.substr(0, name.size() - kExtension.size()));
  return "\n[[object]]  # uploaded on the page\nname = \"" + plain + "\"\nmodel = \"models/" + std::string(name) +
         "\"\non = \"table\"\n";
}

}  // namespace

ModelUpload::ModelUpload(fs::path exhibit, double max_mb, double min_free_gb, Reload reload)
    : exhibit_(std::move(exhibit)),
      max_bytes_(static_cast<std::uint64_t>(max_mb * (1 << 20))),
      min_free_bytes_(static_cast<std::uint64_t>(min_free_gb * 1e9)),
      reload_(std::move(reload)) {}

std::variant<UploadHandlers::Place, WebReply> ModelUpload::begin(std::string_view name,
                                                                 std::optional<std::uint64_t> bytes) const {
  if (exhibit_.empty()) return refused(409, "found no exhibit file to which a model could be added");
  if (!allowed_name(name)) return other_name();
  if (bytes.value_or(0) > max_bytes_)
    return refused(413, "found a model of " + megabytes(*bytes) + ", allowed: at most " + megabytes(max_bytes_) +
                            " (server.max_upload_mb)");
  std::error_code error;
  fs::create_directories(folder(), error);
  if (fs::exists(folder() / name, error))
    return refused(409, "found a model of this name, allowed: a name that is not there yet");
  const fs::space_info space = fs::space(folder(), error);
  if (error) return refused(507, "the folder of the exhibit cannot be written");
  if (space.available < bytes.value_or(0) + min_free_bytes_)
    return refused(507, "found " + megabytes(space.available) + " of free disk, allowed: what leaves " +
                            megabytes(min_free_bytes_) + " to others (server.min_free_disk_gb)");
  const fs::path file = folder() / ("." + std::string(name) + "." + std::to_string(::getpid()) + ".partial");
  fs::remove(file, error);
  return UploadHandlers::Place{file, max_bytes_};
}

WebReply ModelUpload::received(const fs::path& file, std::string_view name) const {
  const fs::path model = folder() / name;
  const std::string before = text_of(exhibit_);
  bool added = false;
  try {
    fs::rename(file, model);
    relight::load_model(model, 'y');
    capture::write_text(exhibit_, before + object_text(name));
    added = true;
    reload_();
    std::fprintf(stderr, "lumigraft: %s was uploaded, and added to %s\n", model.c_str(), exhibit_.c_str());
    return {.status = 201, .body = "added\n"};
  } catch (const std::exception& e) {
    std::fprintf(stderr, "lumigraft: the model %s is not added: %s\n", std::string(name).c_str(), e.what());
    std::error_code ignored;
    fs::remove(model, ignored);
    if (added) capture::write_text(exhibit_, before);
    return refused(422, "the model is not added: " + without_folder(without_folder(e.what(), model), exhibit_));
  }
}

WebReply ModelUpload::remove(std::string_view name) const {
  if (!allowed_name(name)) return other_name();
  const fs::path model = folder() / name;
  std::error_code error;
  if (exhibit_.empty() || !fs::is_regular_file(model, error))
    return refused(404, "found no model of this name, allowed: one that was uploaded");
  const fs::path moved = folder() / ("." + std::string(name) + ".removed");  // so that what else needs it shows
  const std::string before = text_of(exhibit_);
  bool changed = false;
  try {
    const std::string after = without_objects_of(before, "models/" + std::string(name));
    fs::rename(model, moved);
    capture::write_text(exhibit_, after);
    changed = true;
    reload_();
    fs::remove(moved, error);
    std::fprintf(stderr, "lumigraft: %s was removed, and its objects from %s\n", model.c_str(), exhibit_.c_str());
    return {.status = 200, .body = "removed\n"};
  } catch (const std::exception& e) {
    std::fprintf(stderr, "lumigraft: the model %s is not removed: %s\n", std::string(name).c_str(), e.what());
    if (fs::exists(moved, error)) fs::rename(moved, model, error);
    if (changed) capture::write_text(exhibit_, before);
    return refused(422, "the model is not removed: " + without_folder(without_folder(e.what(), model), exhibit_));
  }
}

}  // namespace lumigraft::server
