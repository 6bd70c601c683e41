#include "server/commands/tum.h"

#include <unistd.h>

#include <cmath>

#include "capture/error.h"
#include "capture/formats/picture_file.h"
#include "capture/formats/picture_list.h"
#include "capture/formats/picture_writer.h"
#include "capture/message_text.h"
#include "capture/sync/pairing_reader.h"
#include "capture/text_file.h"
#include "server/commands/record.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;
constexpr double kCountsPerMetre = 5000.0;

std::string seconds_text(std::int64_t time_ns) {
  const std::lldiv_t time = std::lldiv(time_ns, 1'000'000'000);
  return capture::formatted("%lld.%09lld", time.quot, time.rem);
}

/// Session keys that neither kind of recording contains. The lens is the TUM benchmark's for registered pictures of its
/// first kind of camera, scaled to the width.
std::string session_text(const std::string& name, const std::string& color, const std::string& depth, int width,
                         int height, double unit_m) {
  const double f = 525.0 * width / 640.0;
  std::string text = capture::formatted(
      "format = 1\nname = \"%s\"\n\n[color]\nsource = \"%s\"\nwidth = %d\nheight = %d\nfx = %f\nfy = %f\n"
      "cx = %f\ncy = %f\nexposure = 1.0\n",
      name.c_str(), color.c_str(), width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1));
  if (!depth.empty()) {
    text += capture::formatted("\n[depth]\nsource = \"%s\"\nunit_m = %.6f\nregistered = true\n", depth.c_str(), unit_m);
  }
  return text + "\n[tag]\nid = 0\nsize_m = 0.16\n";
}

/// Copies a stream's list and pictures from `from` to `out`, with lumigraft's file names.
std::size_t copy_stream(const fs::path& from, const fs::path& out, const std::string& name,
                        const std::atomic<bool>& interrupted) {
  const std::vector<capture::ListedPicture> pictures = capture::read_picture_list(from, {});
  fs::create_directories(out / name);
  std::string list = "# timestamp_s path\n";
  std::size_t count = 0;
  for (const capture::ListedPicture& picture : pictures) {
    if (interrupted) throw std::runtime_error("interrupted, " + out.string() + " is not whole");
    const std::string to = name + capture::formatted("/%06zu", count++) + picture.path.extension().string();
    std::error_code error;
    fs::copy_file(picture.path, out / to, error);
    capture::refuse_if(error.value() != 0, from.string() + ":" + std::to_string(picture.line) + ": " + picture.name +
                                               ": " + error.message());
    list += seconds_text(picture.time_ns) + " " + to + "\n";
  }
  capture::write_text(out / (name + ".txt"), list);
  return count;
}

void import_tum(const ImportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report) {
  const fs::path rgb = command.from / "rgb.txt", depth = command.from / "depth.txt";
  const capture::PictureHeader first = capture::read_picture_header(capture::read_picture_list(rgb, {}).front().path);
  capture::make_out_folder(command.out);
  const bool with_depth = fs::exists(depth);
  const std::size_t colors = copy_stream(rgb, command.out, "color", interrupted);
  const std::size_t depths = with_depth ? copy_stream(depth, command.out, "depth", interrupted) : 0;
  const std::string name = fs::absolute(command.from).lexically_normal().filename().string();
  const fs::path session = command.out / "session.toml";
  capture::write_text(session, session_text(name, "images:color.txt", with_depth ? "images:depth.txt" : "", first.width,
                                            first.height, 1.0 / kCountsPerMetre));
  capture::write_text(session, capture::text_with_overrides({session, command.overrides}));
  capture::open_frames(capture::read_session(capture::ConfigTable::load(session)));  // reports errors in it now
  report << "imported to " << command.out.string() << ":\n  colour: " << colors << " pictures\n  depth: " << depths
         << " pictures\n";
}

void import_oni(const ImportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report) {
  const fs::path file = fs::absolute(command.from);
  const fs::path text = fs::temp_directory_path() / ("lumigraft-import-" + std::to_string(::getpid()) + ".toml");
  const std::string source = "oni:" + file.string();
  capture::write_text(text, session_text(file.stem().string(), source, source, 640, 480, 0.001));
  const ServiceFiles files{.config = text, .session = {}, .exhibit = {}, .overrides = command.overrides};
  try {
    run_record({.files = files, .out = command.out, .seconds = std::nullopt}, interrupted, report);
  } catch (...) {
    fs::remove(text);
    throw;
  }
  fs::remove(text);
}

/// An exported stream: its folder's name, the text of its list, and its number of pictures.
struct TumStream {
  std::string name, list;
  std::uint64_t pictures = 0;

  /// Adds a picture to the list; returns its file's name. `columns` follow the name.
  std::string add(const capture::Stamp& stamp, const std::string& suffix = "", const std::string& columns = "") {
    const std::string time = seconds_text(stamp.time_ns), file = name + "/" + time + suffix + ".png";
    list += time + " " + file + columns + "\n";
    ++pictures;
    return file;
  }
};

/// Depth in TUM's units. Depth beyond their 13.1 m counts as not measured.
capture::Image<std::uint16_t> counts_of(const capture::Image<float>& depth_m, std::uint64_t& too_far) {
  capture::Image<std::uint16_t> counts(depth_m.width, depth_m.height, 1);
  for (std::size_t i = 0; i < counts.data.size(); ++i) {
    const double value = std::round(kCountsPerMetre * static_cast<double>(depth_m.data[i]));
    const bool fits = value <= 65535.0;
    counts.data[i] = fits ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
    too_far += fits ? 0 : 1;
  }
  return counts;
}

}  // namespace

void run_import(const ImportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report) {
  if (fs::is_regular_file(command.from / "rgb.txt")) {
    import_tum(command, interrupted, report);
  } else if (fs::is_regular_file(command.from) && command.from.extension() == ".oni") {
    import_oni(command, interrupted, report);
  } else {
    throw capture::InputError(command.from.string() +
                              ": found neither, allowed: a TUM folder (rgb.txt) or an .oni file");
  }
}

void run_export(const ExportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report) {
  const ServiceFiles files{.config = {}, .session = command.session, .exhibit = {}, .overrides = command.overrides};
  const capture::Session session = read_service(files, interactive_plan()).session;
  const std::unique_ptr<capture::FrameReader> frames = capture::open_frames(session);
  capture::refuse_if(frames->live(), "export: " + session.name + " has live cameras, allowed: a recorded session");
  capture::make_out_folder(command.out);
  const capture::CameraModel& lens = session.color.model;
  TumStream rgb{"rgb", capture::formatted("# timestamp filename\n# fx %.9g fy %.9g cx %.9g cy %.9g\n", lens.fx, lens.fy,
                                          lens.cx, lens.cy)};
  TumStream depth{"depth", "# timestamp filename\n"}, fisheye{"fisheye", "# timestamp filename exposure\n"};
  std::uint64_t radiance = 0, too_far = 0, warnings = 0;
  for (const TumStream& stream : {rgb, depth, fisheye}) fs::create_directory(command.out / stream.name);
  while (const std::optional<capture::FrameSet> frame = frames->next(std::chrono::seconds(10))) {
    if (interrupted) break;
    warnings += frame->warnings.size();
    if (frame->color->encoded.empty()) {
      ++radiance;
    } else {
      capture::write_png(command.out / rgb.add(frame->color->stamp), frame->color->encoded);
    }
    if (frame->depth) {
      capture::write_png(command.out / depth.add(frame->depth->stamp), counts_of(frame->depth->depth_m, too_far));
    }
    for (std::size_t i = 0; i < frame->fisheye.size(); ++i) {
      const capture::Frame& picture = *frame->fisheye[i];
      if (picture.encoded.empty()) {
        ++radiance;
        continue;
      }
      const std::string suffix = i > 0 ? "-" + std::to_string(i) : "";
      const std::string exposure = capture::formatted(" %.9g", picture.exposure);
      capture::write_png(command.out / fisheye.add(picture.stamp, suffix, exposure), picture.encoded);
    }
  }
  capture::write_text(command.out / "rgb.txt", rgb.list);
  capture::write_text(command.out / "depth.txt", depth.list);
  if (fisheye.pictures > 0) {
    capture::write_text(command.out / "fisheye.txt", fisheye.list);
  } else {
    fs::remove(command.out / "fisheye");
  }
  report << "exported to " << command.out.string() << ":\n  colour: " << rgb.pictures
         << " pictures\n  depth: " << depth.pictures << " pictures\n  fish-eye: " << fisheye.pictures << " pictures\n";
  if (radiance > 0) report << "  left out: " << radiance << " pictures of radiance, since PNG holds none\n";
  if (too_far > 0) report << "  depth beyond 13.1 m, which counts of 1/5000 m cannot say: " << too_far << " pixels\n";
  if (warnings > 0) report << "  warnings of the recording, as of lost pictures: " << warnings << "\n";
  if (rgb.pictures == 0) throw std::runtime_error("no colour picture came: " + command.out.string() + " holds none");
}

}  // namespace lumigraft::server
