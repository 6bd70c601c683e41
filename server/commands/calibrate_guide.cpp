#include "server/commands/calibrate_guide.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "reconstruct/calibrate/parameters.h"
#include "server/commands/parameters.h"
#include "server/pipeline/json_text.h"
#include "server/stream/page.h"

namespace lumigraft::server {
namespace {

using Json = nlohmann::ordered_json;

void mark(capture::Image<std::uint8_t>& rgb, const Eigen::Vector2d& pixel) {
  const int x0 = static_cast<int>(std::lround(pixel.x())), y0 = static_cast<int>(std::lround(pixel.y()));
  const int arm = std::max(2, rgb.width / 160);
  for (int d = -arm; d <= arm; ++d) {
    for (const auto& [x, y] : {std::pair(x0 + d, y0), std::pair(x0, y0 + d)}) {
      if (x >= 0 && x < rgb.width && y >= 0 && y < rgb.height) {
        rgb.at(x, y, 0) = 60;
        rgb.at(x, y, 1) = 255;
        rgb.at(x, y, 2) = 60;
      }
    }
  }
}

}  // namespace

CalibrateGuide::CalibrateGuide(const std::array<std::optional<capture::CameraModel>, 2>& cameras) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (cameras[c]) {
      cameras_[c] = Camera();
      cameras_[c]->model = *cameras[c];
      cameras_[c]->coverage = reconstruct::coverage_of(*cameras[c], {});
    }
  }
}

void CalibrateGuide::add(const capture::FrameSet& frame, const reconstruct::ViewSelector& collector) {
  const std::lock_guard lock(mutex_);
  const bool more = collector.moments().size() != moments_;
  moments_ = collector.moments().size();
  kept_ += more ? 1 : 0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!cameras_[c]) continue;
    Camera& camera = *cameras_[c];
    const auto newest = c == 0 ? frame.color : frame.fisheye.empty() ? nullptr : frame.fisheye.back();
    if (newest && !newest->encoded.empty()) {
      camera.picture = newest;
      camera.view = collector.newest()[c];
    }
    if (more) {
      std::vector<Eigen::Vector2d> pixels;
      camera.views = 0;
      for (const reconstruct::BoardMoment& moment : collector.moments()) {
        camera.views += moment.by_camera[c].view.seen.empty() ? 0 : 1;
        for (const reconstruct::SeenPoints& seen : moment.by_camera[c].view.seen) {
          pixels.insert(pixels.end(), seen.pixels.begin(), seen.pixels.end());
        }
      }
      camera.coverage = reconstruct::coverage_of(camera.model, pixels);
    }
  }
}

void CalibrateGuide::calculating() {
  const std::lock_guard lock(mutex_);
  doing_ = "calculating";
}

void CalibrateGuide::done(const std::string& report, const std::string& refusal) {
  const std::lock_guard lock(mutex_);
  doing_ = refusal.empty() ? "done" : "refused";
  report_ = report;
  refusal_ = refusal;
}

bool CalibrateGuide::covered() const {
  const std::lock_guard lock(mutex_);
  return kept_ >= wanted_ && std::all_of(cameras_.begin(), cameras_.end(), [](const std::optional<Camera>& camera) {
           return !camera || (camera->views >= kCommands.enough_views && camera->coverage.missing().empty());
         });
}

void CalibrateGuide::go_on(const std::string& refusal) {
  const std::lock_guard lock(mutex_);
  finish_asked_ = false;
  doing_ = "looking";
  wanted_ = kept_ + kCommands.more_after_refusal;
  refusal_ = refusal + ". Go on.";
}

bool CalibrateGuide::finish_asked() const {
  const std::lock_guard lock(mutex_);
  return finish_asked_;
}

/// Whether every camera that saw the board has enough views for a result.
bool CalibrateGuide::can_finish() const {
  int max_views = 0;
  for (const std::optional<Camera>& camera : cameras_) {
    if (camera && camera->views > 0 && camera->views < reconstruct::kCalibration.min_views) return false;
    max_views = std::max(max_views, camera ? camera->views : 0);
  }
  return max_views >= reconstruct::kCalibration.min_views && !finish_asked_ && doing_ == std::string_view("looking");
}

std::string CalibrateGuide::json() const {
  Json json{{"doing", doing_},
            {"can_finish", can_finish()},
            {"cameras", Json::array()},
            {"report", report_},
            {"refusal", refusal_}};
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!cameras_[c]) continue;
    const Camera& camera = *cameras_[c];
    const reconstruct::Coverage& coverage = camera.coverage;
    const std::vector<bool> wanted(coverage.wanted.begin(), coverage.wanted.end());
    json["cameras"].push_back({{"name", kCameraNames[c]},
                               {"picture", c == 0 ? "color.jpg" : "fisheye.jpg"},
                               {"corners_now", camera.view.points()},
                               {"views", camera.views},
                               {"views_wanted", kCommands.enough_views},
                               {"rings", coverage.rings},
                               {"columns", coverage.columns},
                               {"rows", coverage.rows},
                               {"corners", coverage.corners},
                               {"wanted", wanted},
                               {"reached", coverage.reached()},
                               {"missing", coverage.missing()}});
  }
  return json_line(json);
}

WebReply CalibrateGuide::picture(std::size_t camera) {
  if (!cameras_[camera] || !cameras_[camera]->picture) return {503, "text/plain; charset=utf-8", "no picture yet\n"};
  capture::Image<std::uint8_t> rgb = cameras_[camera]->picture->encoded;
  for (const reconstruct::SeenPoints& seen : cameras_[camera]->view.seen) {
    for (const Eigen::Vector2d& pixel : seen.pixels) mark(rgb, pixel);
  }
  const std::vector<std::uint8_t> file = jpeg_.encode(rgb);
  return {200, "image/jpeg", std::string(file.begin(), file.end())};
}

WebReply CalibrateGuide::reply(std::string_view path) {
  const std::lock_guard lock(mutex_);
  if (path == "/calibrate.json") return {200, "application/json", json()};
  if (path == "/color.jpg" || path == "/fisheye.jpg") return picture(path == "/color.jpg" ? 0 : 1);
  return page_reply(path == "/" ? "/calibrate.html" : path);
}

WebReply CalibrateGuide::ask(std::string_view path) {
  const std::lock_guard lock(mutex_);
  if (path != "/finish") return {404, "text/plain; charset=utf-8", "no such request\n"};
  if (!can_finish()) {
    return {409, "text/plain; charset=utf-8",
            "too few views, allowed: at least " + std::to_string(reconstruct::kCalibration.min_views) +
                " of every camera\n"};
  }
  finish_asked_ = true;
  return {200, "text/plain; charset=utf-8", "calculating\n"};
}

}  // namespace lumigraft::server
