#include "server/commands/calibrate.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "capture/error.h"
#include "capture/formats/picture_file.h"
#include "capture/formats/picture_list.h"
#include "capture/message_text.h"
#include "capture/source.h"
#include "capture/sync/depth_registration.h"
#include "capture/sync/pairing_reader.h"
#include "capture/text_file.h"
#include "reconstruct/calibrate/board.h"
#include "reconstruct/calibrate/depth.h"
#include "reconstruct/calibrate/extrinsics.h"
#include "reconstruct/calibrate/initial_guess.h"
#include "reconstruct/calibrate/pictures.h"
#include "reconstruct/calibrate/response.h"
#include "reconstruct/calibrate/time_offset.h"
#include "reconstruct/calibrate/view_selection.h"
#include "reconstruct/calibrate/vignetting.h"
#include "server/commands/calibrate_guide.h"
#include "server/commands/calibrate_text.h"
#include "server/commands/parameters.h"
#include "server/pipeline/listener_config.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Camera models and serial numbers known before calibration.
struct Input {
  std::array<std::optional<capture::CameraModel>, 2> cameras;  // colour, fish-eye
  std::array<std::string, 2> serials;
};

reconstruct::Board board_in(const fs::path& file) {
  const capture::ConfigTable root = capture::ConfigTable::load(file);
  const reconstruct::Board board = reconstruct::read_board(root);
  root.finish();
  return board;
}

void draw_board(const reconstruct::Board& board, const fs::path& file) {
  std::ofstream out(file);
  reconstruct::write_board_svg(out, board);
  out.close();
  capture::refuse_if(!out, "--draw: " + file.string() + " cannot be written");
}

void say_view(std::ostream& report, std::size_t number, const reconstruct::ViewSelector::Seen& seen) {
  report << "view " << number << ":";
  for (std::size_t c = 0; c < 2; ++c) {
    if (seen.corners[c] > 0) report << ' ' << kCameraNames[c] << ' ' << seen.corners[c] << " corners";
  }
  report << std::endl;  // flush: a person waits for it
}

Input cameras_of(const capture::Session& session) {
  Input input;
  input.cameras[0] = session.color.model;
  input.serials[0] = session.color.serial;
  if (session.fisheye) {
    input.cameras[1] = session.fisheye->model;
    input.serials[1] = session.fisheye->serial;
  }
  return input;
}

/// Opens raw frames: no time offset applied to the fish-eye, depth on its own pixels.
std::unique_ptr<capture::FrameReader> open_raw_frames(capture::Session raw, capture::PairedSources& sources) {
  if (raw.fisheye) raw.fisheye->time_offset_s = 0;
  sources = capture::open_sources(raw);
  if (raw.depth) raw.depth->registered = true;
  return std::make_unique<capture::RegisteredFrames>(raw, std::make_unique<capture::PairingReader>(sources));
}

/// Processes frames until the recording or the time limit ends; true when the guide has enough views before.
bool read_views(capture::FrameReader& reader, const std::function<bool()>& late, const capture::Session& session,
                const std::atomic<bool>& interrupted, reconstruct::ViewSelector& collector, CalibrateGuide* guide,
                std::ostream& report) {
  while (!interrupted && !reader.finished() && !(reader.live() && late())) {
    if (guide != nullptr && (guide->finish_asked() || (reader.live() && guide->covered()))) return true;
    const std::optional<capture::FrameSet> frame = reader.next(kCommands.tick);
    if (!frame) continue;
    const capture::Response none = capture::Response::srgb();
    const auto seen = collector.add(frame->time_ns, frame->color.get(), session.color.response, frame->fisheye,
                                    session.fisheye ? session.fisheye->response : none, frame->depth);
    if (guide != nullptr) guide->add(*frame, collector);
    if (seen.kept && reader.live()) say_view(report, collector.moments().size(), seen);
  }
  return false;
}

/// Checks that all pictures of a camera have the size of the first.
void check_size(const capture::Frame& picture, const fs::path& file, std::optional<capture::CameraModel>& camera,
                bool fisheye, std::optional<double> fov_degrees) {
  if (!camera) {
    camera.emplace();
    camera->kind = fisheye ? capture::CameraModel::Kind::kannala_brandt : capture::CameraModel::Kind::pinhole;
    camera->width = picture.encoded.width;
    camera->height = picture.encoded.height;
    camera->fov_rad = fisheye && fov_degrees ? *fov_degrees * std::numbers::pi / 180 : 0;
  }
  capture::refuse_if(
      camera->width != picture.encoded.width || camera->height != picture.encoded.height,
      file.string() + capture::formatted(": found %dx%d pixels, allowed: %dx%d as the pictures before it",
                                         picture.encoded.width, picture.encoded.height, camera->width, camera->height));
}

Input read_folder_views(const CalibrateCommand& command, const std::atomic<bool>& interrupted,
                        reconstruct::ViewSelector& collector) {
  std::map<std::string, std::array<fs::path, 2>> moments;  // by file name
  for (std::size_t c = 0; c < 2; ++c) {
    const fs::path& folder = c == 0 ? command.color : command.fisheye;
    if (folder.empty()) continue;
    for (const fs::path& file : reconstruct::picture_files(folder)) moments[file.stem().string()][c] = file;
  }
  Input input;
  std::int64_t time_ns = 0;
  for (const auto& [name, files] : moments) {
    if (interrupted) break;
    std::array<std::shared_ptr<const capture::Frame>, 2> pictures;
    for (std::size_t c = 0; c < 2; ++c) {
      if (!files[c].empty()) {
        auto picture = std::make_shared<capture::Frame>(reconstruct::read_any_picture(files[c]));
        check_size(*picture, files[c], input.cameras[c], c == 1, command.fov_degrees);
        picture->stamp.time_ns = time_ns;
        pictures[c] = std::move(picture);
      }
    }
    std::vector<std::shared_ptr<const capture::Frame>> fisheye;
    if (pictures[1]) fisheye.push_back(pictures[1]);
    collector.add(time_ns, pictures[0].get(), capture::Response::srgb(), fisheye, capture::Response::srgb());
    time_ns += 1'000'000'000;  // one second apart: separate views, no motion
  }
  return input;
}

/// The room's tag, unless its number is also on the board.
std::optional<capture::Tag> room_tag_of(const capture::Session& session, const reconstruct::Board& board) {
  const bool on_board = session.tag.family == board.family && session.tag.id >= board.first_id &&
                        session.tag.id < board.first_id + board.tags();
  return on_board || !session.tag.present() ? std::nullopt : std::optional(session.tag);
}

/// Calibrates a camera; `views` gets its views by moment, refined with the lens.
CalibratedCamera calibrated(const capture::CameraModel& camera, const reconstruct::ViewSelector& collector,
                            std::size_t c, std::vector<reconstruct::BoardView>& views, std::ostream& report) {
  std::vector<reconstruct::BoardPicture> pictures;
  for (const reconstruct::BoardMoment& moment : collector.moments()) pictures.push_back(moment.by_camera[c]);
  const reconstruct::CameraCalibration found = reconstruct::calibrate_camera(camera, collector.finder(), pictures);
  write_calibration_report(report, kCameraNames[c], found);
  if (!found.refusal.empty()) {
    throw std::runtime_error(std::string("calibration refused: ") + kCameraNames[c] + ": " + found.refusal);
  }
  for (reconstruct::BoardPicture& picture : pictures) views.push_back(std::move(picture.view));
  return {found, {}};
}

bool saw_board(const reconstruct::ViewSelector& collector, std::size_t camera) {
  return std::ranges::any_of(collector.moments(), [&](const reconstruct::BoardMoment& moment) {
    return !moment.by_camera[camera].view.seen.empty();
  });
}

using Cameras = std::array<std::optional<CalibratedCamera>, 2>;
using Views = std::array<std::vector<reconstruct::BoardView>, 2>;

/// Pose and time offset of the fish-eye relative to the colour camera.
std::optional<Eigen::Isometry3d> find_extrinsics(const reconstruct::ViewSelector& collector,
                                                 const reconstruct::Board& board, const Cameras& cameras,
                                                 const Views& views, CalibratedRest& rest, std::ostream& report) {
  if (!cameras[0] || !cameras[1] || board.tags() == 0) {  // a chessboard is symmetric under half a turn
    return std::nullopt;
  }
  const capture::CameraModel &color = cameras[0]->calibration.model, &fisheye = cameras[1]->calibration.model;
  const reconstruct::ExtrinsicsCalibration extrinsics =
      reconstruct::calibrate_extrinsics(color, fisheye, views[0], views[1]);
  write_extrinsics_report(report, extrinsics);
  if (!extrinsics.refusal.empty()) return std::nullopt;
  const reconstruct::TimeOffsetCalibration time =
      reconstruct::calibrate_time(color, fisheye, extrinsics.T_second_first, collector.path(0), collector.path(1));
  write_time_report(report, time);
  if (time.refusal.empty()) rest.time_offset_s = time.offset_s;
  return extrinsics.T_second_first;
}

/// Pose of the fish-eye in the room, from the room's tag.
std::optional<Eigen::Isometry3d> find_room_tag(const reconstruct::ViewSelector& collector, const Cameras& cameras,
                                               const std::optional<Eigen::Isometry3d>& T_fisheye_color,
                                               std::ostream& report) {
  if (!cameras[1]) return std::nullopt;
  std::array<std::vector<reconstruct::SeenPoints>, 2> seen;
  for (std::size_t c = 0; c < 2; ++c) {
    if (cameras[c]) seen[c] = collector.room_tag(c, cameras[c]->calibration.model);
  }
  const capture::CameraModel& fisheye = cameras[1]->calibration.model;
  const reconstruct::RoomTagPose place =
      reconstruct::place_room_tag(cameras[0] ? cameras[0]->calibration.model : fisheye, fisheye, T_fisheye_color, seen);
  if (!place.refusal.empty()) {
    report << "the room's tag: not placed: " << place.refusal << '\n';
    return std::nullopt;
  }
  report << "the room's tag: placed by " << place.pictures << " pictures\n";
  return place.T_camera_tag.inverse();
}

std::optional<capture::Vignetting> find_vignetting(const std::string& name, const CalibratedCamera& camera,
                                                   const std::vector<reconstruct::BoardView>& views,
                                                   std::ostream& report) {
  const capture::CameraModel& model = camera.calibration.model;
  const reconstruct::VignettingCalibration found =
      reconstruct::calibrate_vignetting(reconstruct::white_of(views, model), capture::corner_angle_rad(model));
  write_vignetting_report(report, name, found);
  return found.refusal.empty() ? std::optional(found.vignetting) : std::nullopt;
}

/// Pose relative to the colour camera of a depth camera that does not register its depth itself.
std::optional<CalibratedRest::Depth> find_depth(const capture::DepthCamera& depth, const CalibratedCamera& color,
                                                const reconstruct::ViewSelector& collector,
                                                const reconstruct::Board& board,
                                                const std::vector<reconstruct::BoardView>& color_views,
                                                std::ostream& report) {
  std::vector<reconstruct::BoardDepthView> views;
  for (std::size_t i = 0; i < color_views.size(); ++i) {
    const auto& picture = collector.moments()[i].depth;
    const auto pose = picture ? reconstruct::refined_pose(color_views[i], color.calibration.model) : std::nullopt;
    if (pose) views.push_back({&picture->depth_m, *pose});
  }
  const reconstruct::DepthCalibration found =
      reconstruct::calibrate_depth(depth.model, depth.T_color_depth, board, views);
  write_depth_report(report, found);
  if (!found.refusal.empty()) return std::nullopt;
  const reconstruct::DepthNoiseCalibration noise =
      reconstruct::measure_depth_noise(depth.model, depth.principle, found.T_color_depth, board, views);
  write_depth_noise_report(report, depth.principle, noise);
  return CalibratedRest::Depth{depth.model.width, depth.model.height, depth.serial, found.T_color_depth, noise.scale};
}

void find_response(const CalibrateCommand& command, std::ostream& report) {
  std::vector<reconstruct::ExposedPicture> pictures;
  for (const capture::ListedPicture& listed :
       capture::read_picture_list(command.sweep, {.exposures = true, .brackets = true})) {
    const std::string where = command.sweep.string() + ":" + std::to_string(listed.line) + ": ";
    capture::refuse_if(!listed.exposure, where + "found no exposure, allowed: \"time path exposure\" in every line");
    capture::with_error_context(where + listed.name, [&] {
      pictures.push_back({*listed.exposure, capture::read_encoded(listed.path)});
    });
  }
  const reconstruct::ResponseCalibration found = reconstruct::calibrate_response(pictures);
  if (!found.refusal.empty()) throw std::runtime_error("calibration refused: response: " + found.refusal);
  std::ostringstream text;
  reconstruct::write_response_file(text, found);
  capture::write_text(command.out, text.str());
  report << "response: " << pictures.size() << " pictures, code values " << found.darkest << " to " << found.brightest
         << " at two exposures or more\nwritten to " << command.out.string() << '\n';
}

/// Calibrates and writes the result. `session` is null for folders.
void conclude(const CalibrateCommand& command, const reconstruct::Board& board, const capture::Session* session,
              const Input& input, const reconstruct::ViewSelector& collector, std::ostream& report) {
  Cameras cameras;
  Views views;
  for (std::size_t c = 0; c < 2; ++c) {
    if (input.cameras[c] && saw_board(collector, c)) {
      cameras[c] = calibrated(*input.cameras[c], collector, c, views[c], report);
      cameras[c]->serial = input.serials[c];
    } else if (input.cameras[c]) {
      report << kCameraNames[c] << ": saw no board\n";
    }
  }
  if (!cameras[0] && !cameras[1]) {
    throw std::runtime_error("calibration refused: no picture shows the board of " + command.board.string());
  }
  CalibratedRest rest;
  const auto T_fisheye_color = find_extrinsics(collector, board, cameras, views, rest, report);
  rest.T_tag_fisheye = find_room_tag(collector, cameras, T_fisheye_color, report);
  for (std::size_t c = 0; c < 2 && board.tags() > 0; ++c)
    if (cameras[c]) rest.vignetting[c] = find_vignetting(kCameraNames[c], *cameras[c], views[c], report);
  if (session != nullptr && session->depth && !session->depth->registered && cameras[0] && board.tags() > 0) {
    rest.depth = find_depth(*session->depth, *cameras[0], collector, board, views[0], report);
  }
  std::ostringstream text;
  write_calibration_file(text, cameras[0], cameras[1], rest);
  capture::write_text(command.out, text.str());
  report << "written to " << command.out.string() << '\n';
}

/// Collects views, calibrates and writes the result. `guide` is null without a page.
void find_lenses_in(const capture::Session& session, const CalibrateCommand& command, const reconstruct::Board& board,
                    const std::atomic<bool>& interrupted, CalibrateGuide* guide, std::ostream& report) {
  reconstruct::ViewSelector collector(board, room_tag_of(session, board));
  capture::PairedSources sources;
  const std::unique_ptr<capture::FrameReader> reader = open_raw_frames(session, sources);
  const auto late = [&command, begin = Clock::now()] {
    return command.seconds && std::chrono::duration<double>(Clock::now() - begin).count() >= *command.seconds;
  };
  for (;;) {
    const bool may_go_on = read_views(*reader, late, session, interrupted, collector, guide, report);
    if (guide != nullptr) guide->calculating();
    std::ostringstream found;
    try {
      capture::Session named = session;
      capture::take_serials(named, sources);
      conclude(command, board, &named, cameras_of(named), collector, found);
      report << found.str();
      return;
    } catch (const std::runtime_error& e) {
      if (interrupted || !may_go_on) {
        report << found.str();
        throw;
      }
      guide->go_on(e.what());
    }
  }
}

/// Like find_lenses_in, with the guide page, which is served until interrupted.
void find_lenses_guided(const CalibrateCommand& command, const reconstruct::Board& board,
                        const capture::Session& session, const std::atomic<bool>& interrupted, std::ostream& report) {
  ListenerSettings listener = listener_at(command.listen, "--listen");
  listener.permissions = Permissions::all();
  CalibrateGuide guide(cameras_of(session).cameras);
  EncoderDemand demand;
  Metrics metrics;
  WebHandlers handlers;
  handlers.get = [&guide](std::string_view path) { return guide.reply(path); };
  handlers.post = [&guide](std::string_view path) { return guide.ask(path); };
  handlers.hello = [](Permissions) { return std::string("{}"); };
  handlers.state = [] { return std::string("{}"); };
  handlers.change_object = [](const ObjectCommand&) { return std::optional<std::string>("found no objects here"); };
  handlers.playback = [](const PlaybackCommand&) { return std::optional<std::string>("found nothing to play here"); };
  handlers.record = [](bool) { return std::optional<std::string>("found no recording here"); };
  WebServer web({.listeners = {listener}}, std::move(handlers), demand, metrics);
  web.start();
  report << "guiding on " << listener.url(web.port()) << " until interrupted" << std::endl;
  std::ostringstream found;
  std::exception_ptr failure;
  std::string refusal;
  try {
    find_lenses_in(session, command, board, interrupted, &guide, found);
  } catch (const std::exception& e) {
    failure = std::current_exception();
    refusal = e.what();
  }
  report << found.str() << std::flush;
  guide.done(found.str(), refusal);
  while (!interrupted) std::this_thread::sleep_for(kCommands.tick);
  web.stop();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace

void run_calibrate(const CalibrateCommand& command, const std::atomic<bool>& interrupted, std::ostream& report) {
  if (!command.sweep.empty()) {
    find_response(command, report);
    return;
  }
  const reconstruct::Board board = board_in(command.board);
  if (!command.draw.empty()) {
    draw_board(board, command.draw);
    report << "drawn to " << command.draw.string() << ": print it at its own size, without scaling\n";
  }
  if (command.out.empty()) return;
  if (!command.color.empty() || !command.fisheye.empty()) {
    reconstruct::ViewSelector collector(board, std::nullopt);
    const Input input = read_folder_views(command, interrupted, collector);
    conclude(command, board, nullptr, input, collector, report);
    return;
  }
  const capture::Session session = read_service(command.files, interactive_plan()).session;
  if (command.listen.empty()) {
    find_lenses_in(session, command, board, interrupted, nullptr, report);
  } else {
    find_lenses_guided(command, board, session, interrupted, report);
  }
}

}  // namespace lumigraft::server
