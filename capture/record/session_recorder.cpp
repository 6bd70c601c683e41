#include "capture/record/session_recorder.h"

#include <sstream>

#include "capture/error.h"
#include "capture/recorded/mkv_source.h"
#include "capture/session/config_override.h"
#include "capture/text_file.h"

namespace lumigraft::capture {
namespace {

namespace fs = std::filesystem;

constexpr std::array kTables = {"color", "depth", "fisheye"};

std::size_t at(Stream stream) { return static_cast<std::size_t>(stream); }

/// Empty if the session has no such camera.
std::optional<StreamSpec> spec_of(Stream stream, const Session& session) {
  const auto spec = [stream](const CameraModel& model, double exposure = 1.0) {
    return StreamSpec{.stream = stream, .width = model.width, .height = model.height, .exposure = exposure};
  };
  if (stream == Stream::color) return spec(session.color.model, session.color.exposure);
  if (stream == Stream::depth) return session.depth ? std::optional(spec(session.depth->model)) : std::nullopt;
  return session.fisheye ? std::optional(spec(session.fisheye->model, session.fisheye->exposure)) : std::nullopt;
}

/// Copies the keys of the calibration file into the session's own tables.
void inline_calibration(toml::table& root, const fs::path& folder) {
  const auto named = root["calibration"].value<std::string>();
  if (!named) return;
  const fs::path file = folder / *named;
  toml::table calibration = toml::parse_file(file.string());
  for (const char* name : kTables) {
    toml::table *lens = calibration[name].as_table(), *camera = root[name].as_table();
    if (lens == nullptr || camera == nullptr) continue;
    for (auto&& [key, value] : *lens) camera->insert_or_assign(key, value);
    const auto response = (*lens)["response"].value<std::string>();
    if (response && fs::is_regular_file(file.parent_path() / *response)) {
      camera->insert_or_assign("response", (file.parent_path() / *response).string());
    }
  }
}

toml::table parse(const SessionText& text) {
  try {
    toml::table root = toml::parse(text_with_overrides(text));
    inline_calibration(root, text.file.parent_path());
    return root;
  } catch (const toml::parse_error& e) {
    throw InputError(text.file.string() + ": " + std::string(e.description()));
  }
}

/// Copies the file that `key` of `table` names, and changes the key to the copy's name.
void copy_named_file(toml::table& table, std::string_view key, const std::string& new_stem, const fs::path& from,
                     const fs::path& to) {
  const auto named = table[key].value<std::string>();
  if (!named || !fs::is_regular_file(from / *named)) return;  // a word like "srgb"
  const std::string name = new_stem + fs::path(*named).extension().string();
  fs::copy_file(from / *named, to / name, fs::copy_options::overwrite_existing);
  table.insert_or_assign(key, name);
}

}  // namespace

SessionRecorder::SessionRecorder(const SessionText& text, const Session& session, fs::path folder, DepthCoding coding)
    : text_(text),
      name_(session.name),
      serials_{session.color.serial, session.depth ? session.depth->serial : "",
               session.fisheye ? session.fisheye->serial : ""},
      folder_(std::move(folder)) {
  make_out_folder(folder_);
  for (const Stream stream : kStreams) {
    if (const std::optional<StreamSpec> spec = spec_of(stream, session)) {
      const std::string file = std::string(kTables[at(stream)]) + ".mkv";
      streams_[at(stream)] = std::make_unique<StreamRecorder>(folder_ / file, *spec, coding);
    }
  }
  if (coding == DepthCoding::uncompressed) uncompressed_depth_ = spec_of(Stream::depth, session);
}

bool SessionRecorder::write(Stream stream, const SourceItem& item) {
  const bool kept = streams_[at(stream)]->write(item);
  if (kept && streams_[at(stream)]->frames() == 1) {
    const std::lock_guard lock(mutex_);
    seen_[at(stream)] = true;
    const auto* frame = std::get_if<Frame>(&item);
    if (stream == Stream::color && frame != nullptr) color_readout_s_ = frame->readout_s;
    if (seen_[at(Stream::color)]) write_session_text();
  }
  return kept;
}

void SessionRecorder::compress_depth(const std::stop_token& stop) {
  streams_ = {};
  const fs::path file = folder_ / "depth.mkv", partial = folder_ / "depth.mkv.partial";
  if (!uncompressed_depth_ || !seen_[at(Stream::depth)]) return;
  try {
    MkvSource from(file, *uncompressed_depth_);
    StreamRecorder to(partial, *uncompressed_depth_);
    while (const auto item = from.next(std::chrono::milliseconds(0))) {
      if (stop.stop_requested()) {
        fs::remove(partial);
        return;
      }
      to.write(*item);
    }
  } catch (...) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw;
  }
  fs::rename(partial, file);
}

/// Lists only streams with at least one frame, so that each of them opens. Replaces an earlier file atomically.
void SessionRecorder::write_session_text() {
  toml::table root = parse(text_);
  toml::table out{{"format", 1}, {"name", name_}};
  if (const auto about = root["about"].value<std::string>()) out.insert("about", *about);
  for (const Stream stream : kStreams) {
    const char* name = kTables[at(stream)];
    toml::table* table = root[name].as_table();
    if (table == nullptr || !seen_[at(stream)]) continue;
    if (!serials_[at(stream)].empty()) {
      table->insert("serial", serials_[at(stream)]);  // keeps a serial that the session states
    }
    // As the serial: what the session states is kept.
    if (stream == Stream::color && color_readout_s_) table->insert("readout_ms", 1e3 * *color_readout_s_);
    table->insert_or_assign("source", "mkv:" + std::string(name) + ".mkv");
    copy_named_file(*table, "response", std::string(name) + "-response", text_.file.parent_path(), folder_);
    out.insert(name, *table);
  }
  if (const toml::table* tag = root["tag"].as_table()) out.insert("tag", *tag);
  if (const toml::array* lamps = root["lamp"].as_array()) out.insert("lamp", *lamps);
  if (toml::array* surfaces = root["real_surface"].as_array()) {
    int number = 0;
    for (toml::node& surface : *surfaces) {
      copy_named_file(*surface.as_table(), "mesh", "real-surface-" + std::to_string(number++), text_.file.parent_path(),
                      folder_);
    }
    out.insert("real_surface", *surfaces);
  }
  std::ostringstream text;
  text << toml::toml_formatter(out, toml::toml_formatter::default_flags & ~toml::format_flags::indentation) << '\n';
  write_text(folder_ / "session.toml", text.str());
}

}  // namespace lumigraft::capture
