#include "reconstruct/calibrate/board_detection.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "reconstruct/calibrate/parameters.h"

namespace lumigraft::reconstruct {

BoardFinder::BoardFinder(const Board& board) : board_(board) {
  if (board_.kind == Board::Kind::tags) finder_ = std::make_unique<TagFinder>(board_.tag_list());
}

SeenPoints BoardFinder::tag(int tag, const PrintCorners& corners) const {
  const auto corners_m = board_.corners_m(tag);
  const Eigen::Matrix<double, 8, 8> all = corners.covariance + kCalibration.unmodelled_px * kCalibration.unmodelled_px *
                                                                   Eigen::Matrix<double, 8, 8>::Identity();
  SeenPoints seen;
  seen.place = tag;
  seen.points_m.assign(corners_m.begin(), corners_m.end());
  seen.pixels.assign(corners.pixels.begin(), corners.pixels.end());
  seen.paper = corners.paper;
  seen.whitening = all.llt().matrixL().solve(Eigen::MatrixXd::Identity(8, 8));
  return seen;
}

BoardView BoardFinder::find(const capture::Image<std::uint8_t>& grey,
                            const capture::Image<std::uint16_t>& light) const {
  if (!finder_) return find_chessboard(grey);
  std::vector<TagSighting> sightings = finder_->find(grey, 1);
  std::stable_sort(sightings.begin(), sightings.end(),
                   [](const TagSighting& a, const TagSighting& b) { return a.id < b.id; });
  BoardView view;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const auto same = [&](std::size_t j) { return j < sightings.size() && sightings[j].id == sightings[i].id; };
    if ((i > 0 && same(i - 1)) || same(i + 1)) continue;  // duplicate numbers: at least one tag is not on the board
    const int index = sightings[i].id - board_.first_id;
    const auto corners =
        print_corners(light, finder_->pattern(static_cast<std::size_t>(index)), sightings[i].corners, nullptr);
    if (corners) view.seen.push_back(tag(index, *corners));
  }
  return view;
}

BoardView BoardFinder::again(const BoardView& view, const capture::Image<std::uint16_t>& light,
                             const capture::CameraModel& camera) const {
  if (!finder_) return view;
  BoardView result;
  for (const SeenPoints& seen : view.seen) {
    const TagCorners start = {seen.pixels[0], seen.pixels[1], seen.pixels[2], seen.pixels[3]};
    const auto corners = print_corners(light, finder_->pattern(static_cast<std::size_t>(seen.place)), start, &camera);
    if (!corners) continue;
    result.seen.push_back(tag(seen.place, *corners));
    if (!(seen.paper > 0)) result.seen.back().paper = 0;
  }
  return result;
}

BoardView BoardFinder::find_chessboard(const capture::Image<std::uint8_t>& grey) const {
  const cv::Mat picture(grey.height, grey.width, CV_8UC1, const_cast<std::uint8_t*>(grey.data.data()));
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(picture, {board_.columns, board_.rows}, corners)) return {};
  // The window of the subpixel search must not reach the next corner.
  float nearest = 1e9f;
  const auto columns = static_cast<std::size_t>(board_.columns);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i % columns != 0) nearest = std::min(nearest, static_cast<float>(cv::norm(corners[i] - corners[i - 1])));
    if (i >= columns) nearest = std::min(nearest, static_cast<float>(cv::norm(corners[i] - corners[i - columns])));
  }
  const int window = std::clamp(static_cast<int>(nearest / 3), 2, 6);
  cv::cornerSubPix(picture, corners, {window, window}, {-1, -1},
                   {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3});
  BoardView view;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    SeenPoints& seen = view.seen.emplace_back();
    seen.place = static_cast<int>(i);
    seen.points_m = {board_.place_m(seen.place)};
    seen.pixels = {{corners[i].x, corners[i].y}};
    seen.whitening = Eigen::Matrix2d::Identity();
  }
  return view;
}

}  // namespace lumigraft::reconstruct
