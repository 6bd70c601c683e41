#include "reconstruct/calibrate/view_selection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "reconstruct/calibrate/pictures.h"
#include "reconstruct/pose/gray_regions.h"

namespace lumigraft::reconstruct {
namespace {

constexpr auto& kViews = kCalibration.view_selection;

/// Mean image motion in pixels of the points in both views; infinite where fewer than half are in both.
double moved_px(const BoardView& a, const BoardView& b) {
  double sum = 0;
  std::size_t both = 0, i = 0, j = 0;
  while (i < a.seen.size() && j < b.seen.size()) {  // sorted by place
    if (a.seen[i].place == b.seen[j].place) {
      sum += (a.seen[i].pixels[0] - b.seen[j].pixels[0]).norm();
      ++both;
      ++i;
      ++j;
    } else {
      ++(a.seen[i].place < b.seen[j].place ? i : j);
    }
  }
  if (both == 0 || 2 * both < std::max(a.seen.size(), b.seen.size())) return std::numeric_limits<double>::infinity();
  return sum / static_cast<double>(both);
}

/// Discards the light of clipped paper.
void forget_clipped_paper(const capture::Frame& picture, BoardView& view) {
  if (picture.encoded.empty()) return;
  for (SeenPoints& seen : view.seen) {
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& pixel : seen.pixels) box.extend(pixel);
    const Eigen::Vector2i low = box.min().cast<int>().cwiseMax(0);
    int clipped = 0, all = 0;
    for (int v = low.y(); v <= box.max().y() && v < picture.encoded.height; ++v)
      for (int u = low.x(); u <= box.max().x() && u < picture.encoded.width; ++u, ++all) {
        const std::uint8_t* rgb = &picture.encoded.data[picture.encoded.index(u, v)];
        clipped += std::max({rgb[0], rgb[1], rgb[2]}) >= kViews.clipped_code;
      }
    if (clipped > kViews.max_clipped_fraction * all) seen.paper = 0;
  }
}

struct Detected {
  BoardPicture picture;
  BoardView room_tag;
};

Detected found(const BoardFinder& finder, const std::optional<BoardFinder>& room_finder, const capture::Frame& picture,
               const capture::Response& response) {
  Detected result;
  BoardPicture& board = result.picture;
  board.light = linear_light(picture, response);
  const float gain = picture.encoded.empty() ? detector_gain(picture.radiance) : 1.0f;
  const auto grey = detector_codes(picture, {0, 0, board.light.width, board.light.height}, gain);
  board.view = finder.find(grey, board.light);
  forget_clipped_paper(picture, board.view);
  if (room_finder) result.room_tag = room_finder->find(grey, board.light);
  return result;
}

/// A board with this tag only; its frame is the tag's.
Board board_of(const capture::Tag& tag) {
  Board board;
  board.family = tag.family;
  board.first_id = tag.id;
  board.rows = board.columns = 1;
  board.size_m = tag.size_m;
  return board;
}

}  // namespace

ViewSelector::ViewSelector(const Board& board, const std::optional<capture::Tag>& room_tag) : finder_(board) {
  if (room_tag) room_finder_.emplace(board_of(*room_tag));
}

std::vector<SeenPoints> ViewSelector::room_tag(std::size_t camera, const capture::CameraModel& lens) const {
  std::vector<SeenPoints> all;
  for (const BoardMoment& moment : moments_) {
    if (moment.room_tag[camera].seen.empty()) continue;
    const BoardView again = room_finder_->again(moment.room_tag[camera], moment.by_camera[camera].light, lens);
    all.insert(all.end(), again.seen.begin(), again.seen.end());
  }
  return all;
}

bool ViewSelector::somewhere_new(const BoardMoment& moment) const {
  for (std::size_t c = 0; c < moment.by_camera.size(); ++c) {
    const BoardPicture& now = moment.by_camera[c];
    if (now.view.seen.empty()) continue;
    const bool known = std::any_of(moments_.begin(), moments_.end(), [&](const BoardMoment& kept) {
      return moved_px(kept.by_camera[c].view, now.view) < apart_ * now.light.width;
    });
    if (!known) return true;
  }
  return false;
}

/// Increases the minimum distance between board positions until half of the moments are removed.
void ViewSelector::thin_out() {
  while (2 * moments_.size() > kViews.max_moments) {
    apart_ *= kViews.apart_step;
    std::vector<BoardMoment> all = std::move(moments_);
    moments_.clear();
    for (BoardMoment& moment : all)
      if (somewhere_new(moment)) moments_.push_back(std::move(moment));
  }
}

ViewSelector::Seen ViewSelector::add(std::int64_t time_ns, const capture::Frame* color,
                                     const capture::Response& color_response,
                                     const std::vector<std::shared_ptr<const capture::Frame>>& fisheye,
                                     const capture::Response& fisheye_response,
                                     const std::shared_ptr<const capture::DepthFrame>& depth) {
  const double passed_s = 1e-9 * static_cast<double>(time_ns - last_time_ns_);
  Seen seen;
  if (any_ && passed_s >= 0 && passed_s < kViews.min_interval_s) return seen;
  BoardMoment moment;
  moment.time_ns = time_ns;
  moment.depth = depth;
  const auto take = [&](std::size_t camera, Detected one) {
    BoardPicture& best = moment.by_camera[camera];
    if (!best.light.empty() && one.picture.view.seen.size() <= best.view.seen.size()) return;
    best = std::move(one.picture);
    moment.room_tag[camera] = std::move(one.room_tag);
  };
  if (color != nullptr) take(0, found(finder_, room_finder_, *color, color_response));
  for (const auto& picture : fisheye) take(1, found(finder_, room_finder_, *picture, fisheye_response));
  bool moving = false;
  for (std::size_t c = 0; c < 2; ++c) {
    const BoardPicture& now = moment.by_camera[c];
    seen.corners[c] = now.view.points();
    const double moved = moved_px(last_[c], now.view);
    moving |= any_ && passed_s > 0 && passed_s < kViews.max_gap_s && seen.corners[c] > 0 &&
              moved > kViews.max_still_speed * passed_s * now.light.width;
    last_[c] = now.view;
    if (seen.corners[c] == 0) continue;
    std::vector<TimedView>& path = paths_[c];
    if (path.size() == kViews.max_path_views) path.erase(path.begin(), path.begin() + kViews.max_path_views / 4);
    path.push_back({c == 0 ? color->stamp.time_ns : fisheye.front()->stamp.time_ns, now.view});
  }
  any_ = true;
  last_time_ns_ = time_ns;
  if (!moving && somewhere_new(moment)) {
    seen.kept = true;
    moments_.push_back(std::move(moment));
    if (moments_.size() > kViews.max_moments) thin_out();
  }
  return seen;
}

}  // namespace lumigraft::reconstruct
