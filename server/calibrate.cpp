#include "server/calibrate.h"

#include <chrono>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "capture/error.h"
#include "capture/source.h"
#include "reconstruct/calibrate_board.h"
#include "reconstruct/calibrate_collect.h"
#include "reconstruct/calibrate_folder.h"
#include "server/calibrate_text.h"

namespace lumigraft {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTick{50};
constexpr std::array kNames = {"colour", "fish-eye"};

/// What is known of the cameras before, and what they saw.
struct Input {
  std::array<std::optional<CameraModel>, 2> cameras;
  std::array<std::string, 2> serials;
};

Board board_in(const fs::path& file) {
  const ConfigTable root = ConfigTable::load(file);
  const Board board = read_board(root);
  root.finish();
  return board;
}

void draw_board(const Board& board, const fs::path& file) {
  std::ofstream out(file);
  write_board_svg(out, board);
  out.close();
  if (!out) {
    throw InputError("--draw: " + file.string() + " cannot be written");
  }
}

void say_view(std::ostream& report, std::size_t number, const BoardCollector::Seen& seen) {
  report << "view " << number << ":";
  for (std::size_t c = 0; c < 2; ++c) {
    if (seen.corners[c] > 0) {
      report << ' ' << kNames[c] << ' ' << seen.corners[c] << " corners";
    }
  }
  report << std::endl;  // a person with a board in hand waits for it
}

Input look_through_session(const CalibrateCommand& command, const std::atomic<bool>& interrupted,
                           BoardCollector& collector, std::ostream& report) {
  const ServiceInput service = read_service(command.files, interactive_plan());
  const Session& session = service.session;
  Input input;
  input.cameras[0] = session.color.model;
  input.serials[0] = session.color.serial;
  if (session.fisheye) {
    input.cameras[1] = session.fisheye->model;
    input.serials[1] = session.fisheye->serial;
  }
  const std::unique_ptr<FrameReader> reader = open_frames(session);
  const Clock::time_point begin = Clock::now();
  const auto over = [&] {
    return reader->live() && command.seconds &&
           std::chrono::duration<double>(Clock::now() - begin).count() >= *command.seconds;
  };
  while (!interrupted && !reader->finished() && !over()) {
    const std::optional<FrameSet> frame = reader->next(kTick);
    if (!frame) {
      continue;
    }
    const Response none = Response::srgb();
    const auto seen = collector.look(frame->time_ns, frame->color.get(), session.color.response, frame->fisheye,
                                     session.fisheye ? session.fisheye->response : none);
    if (seen.kept && reader->live()) {
      say_view(report, collector.moments().size(), seen);
    }
  }
  return input;
}

/// Every picture of one camera has the size of the first.
void check_size(const Picture& picture, const fs::path& file, std::optional<CameraModel>& camera, bool fisheye,
                std::optional<double> fov_degrees) {
  if (!camera) {
    camera.emplace();
    camera->kind = fisheye ? CameraModel::Kind::kannala_brandt : CameraModel::Kind::pinhole;
    camera->width = picture.encoded.width;
    camera->height = picture.encoded.height;
    camera->fov_rad = fisheye && fov_degrees ? *fov_degrees * std::numbers::pi / 180 : 0;
  }
  if (camera->width != picture.encoded.width || camera->height != picture.encoded.height) {
    throw InputError(file.string() + ": found " + std::to_string(picture.encoded.width) + "x" +
                     std::to_string(picture.encoded.height) + " pixels, allowed: " + std::to_string(camera->width) +
                     "x" + std::to_string(camera->height) + " as the pictures before it");
  }
}

Input look_through_folders(const CalibrateCommand& command, const std::atomic<bool>& interrupted,
                           BoardCollector& collector) {
  std::map<std::string, std::array<fs::path, 2>> moments;  // by the pictures' name
  for (std::size_t c = 0; c < 2; ++c) {
    const fs::path& folder = c == 0 ? command.color : command.fisheye;
    if (folder.empty()) {
      continue;
    }
    for (const fs::path& file : picture_files(folder)) {
      moments[file.stem().string()][c] = file;
    }
  }
  Input input;
  std::int64_t time_ns = 0;
  for (const auto& [name, files] : moments) {
    if (interrupted) {
      break;
    }
    std::array<std::shared_ptr<const Picture>, 2> pictures;
    for (std::size_t c = 0; c < 2; ++c) {
      if (!files[c].empty()) {
        pictures[c] = std::make_shared<Picture>(read_any_picture(files[c]));
        check_size(*pictures[c], files[c], input.cameras[c], c == 1, command.fov_degrees);
      }
    }
    std::vector<std::shared_ptr<const Picture>> fisheye;
    if (pictures[1]) {
      fisheye.push_back(pictures[1]);
    }
    collector.look(time_ns, pictures[0].get(), Response::srgb(), fisheye, Response::srgb());
    time_ns += 1'000'000'000;  // each a picture of its own
  }
  return input;
}

std::vector<BoardPicture> pictures_of(const BoardCollector& collector, std::size_t camera) {
  std::vector<BoardPicture> pictures;
  for (const BoardMoment& moment : collector.moments()) {
    if (!moment.by_camera[camera].view.seen.empty()) {
      pictures.push_back(moment.by_camera[camera]);
    }
  }
  return pictures;
}

/// The file appears whole or not at all.
void write_whole(const fs::path& file, const std::string& text) {
  const fs::path partial = file.string() + ".partial";
  std::ofstream out(partial);
  out << text;
  out.close();
  if (!out) {
    throw std::runtime_error(partial.string() + ": cannot be written");
  }
  fs::rename(partial, file);
}

}  // namespace

void run_calibrate(const CalibrateCommand& command, const std::atomic<bool>& interrupted, std::ostream& report) {
  const Board board = board_in(command.board);
  if (!command.draw.empty()) {
    draw_board(board, command.draw);
    report << "drawn to " << command.draw.string() << ": print it at its own size, without scaling\n";
  }
  if (command.out.empty()) {
    return;
  }
  BoardCollector collector(board);
  const bool folders = !command.color.empty() || !command.fisheye.empty();
  const Input input = folders ? look_through_folders(command, interrupted, collector)
                              : look_through_session(command, interrupted, collector, report);
  std::array<std::optional<CalibratedCamera>, 2> calibrated;
  for (std::size_t c = 0; c < 2; ++c) {
    std::vector<BoardPicture> pictures = pictures_of(collector, c);
    if (!input.cameras[c] || pictures.empty()) {
      if (input.cameras[c]) {
        report << kNames[c] << ": saw no board\n";
      }
      continue;
    }
    const CameraCalibration found = calibrate_camera(*input.cameras[c], collector.finder(), pictures);
    write_calibration_report(report, kNames[c], found);
    if (!found.refusal.empty()) {
      throw std::runtime_error(std::string("calibration refused: ") + kNames[c] + ": " + found.refusal);
    }
    calibrated[c] = CalibratedCamera{found, input.serials[c]};
  }
  if (!calibrated[0] && !calibrated[1]) {
    throw std::runtime_error("calibration refused: no picture shows the board of " + command.board.string());
  }
  std::ostringstream text;
  write_calibration_file(text, calibrated[0], calibrated[1]);
  write_whole(command.out, text.str());
  report << "written to " << command.out.string() << '\n';
}

}  // namespace lumigraft
