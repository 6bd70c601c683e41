#pragma once
// Selects pictures of a board for calibration: the board is still and at a new position.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "capture/camera/response.h"
#include "capture/frame.h"
#include "reconstruct/calibrate/camera.h"
#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/calibrate/time_offset.h"

namespace lumigraft::reconstruct {

/// Observations at one moment by the colour camera (0) and the fish-eye (1). Views may be empty.
struct BoardMoment {
  std::int64_t time_ns = 0;
  std::array<BoardPicture, 2> by_camera;
  std::array<BoardView, 2> room_tag;                 ///< the tag fixed in the room, in its own frame
  std::shared_ptr<const capture::DepthFrame> depth;  ///< unprocessed; null without depth
};

class ViewSelector {
 public:
  /// If set, `room_tag` is detected in addition to the board.
  ViewSelector(const Board& board, const std::optional<capture::Tag>& room_tag);

  struct Seen {
    bool kept = false;
    std::array<std::size_t, 2> corners{};
  };
  /// Processes the pictures of a moment; either camera's may be missing. Several fish-eye pictures are one exposure
  /// bracket, of which the one with the most board points is used.
  Seen add(std::int64_t time_ns, const capture::Frame* color, const capture::Response& color_response,
           const std::vector<std::shared_ptr<const capture::Frame>>& fisheye, const capture::Response& fisheye_response,
           const std::shared_ptr<const capture::DepthFrame>& depth = nullptr);

  /// Views of the last processed moment, selected or not.
  const std::array<BoardView, 2>& newest() const { return last_; }
  const BoardFinder& finder() const { return finder_; }
  /// What one camera (0, 1) saw of the room's tag, refined with its lens.
  std::vector<SeenPoints> room_tag(std::size_t camera, const capture::CameraModel& lens) const;
  const std::vector<BoardMoment>& moments() const { return moments_; }
  /// All recent views of the board by one camera (0, 1), still or moving.
  const std::vector<TimedView>& path(std::size_t camera) const { return paths_[camera]; }

 private:
  bool somewhere_new(const BoardMoment& moment) const;
  void thin_out();

  BoardFinder finder_;
  std::optional<BoardFinder> room_finder_;
  std::vector<BoardMoment> moments_;
  std::array<std::vector<TimedView>, 2> paths_;
  std::int64_t last_time_ns_ = 0;
  std::array<BoardView, 2> last_;  ///< of the previous moment, selected or not
  bool any_ = false;
  double apart_ = kCalibration.view_selection.min_apart;  ///< picture widths between board positions, at least
};

}  // namespace lumigraft::reconstruct
