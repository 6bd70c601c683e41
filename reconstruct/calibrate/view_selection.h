#pragma once
// Which pictures of a board are worth keeping: those that show it still, and somewhere new.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "capture/camera/response.h"
#include "capture/frame.h"
#include "reconstruct/calibrate/camera.h"
#include "reconstruct/calibrate/time_offset.h"

namespace lumigraft::reconstruct {

/// What was seen at one moment by the colour camera (0) and the fish-eye (1). Views may be empty.
struct BoardMoment {
  std::int64_t time_ns = 0;
  std::array<BoardPicture, 2> by_camera;
  std::array<BoardView, 2> room_tag;                   ///< the tag that hangs in the room, in its own frame
  std::shared_ptr<const capture::DepthPicture> depth;  ///< as it came; null where there is none
};

class ViewSelector {
 public:
  /// `room_tag` is looked for beside the board where it is there.
  ViewSelector(const Board& board, const std::optional<capture::Tag>& room_tag);

  struct Seen {
    bool kept = false;
    std::array<std::size_t, 2> corners{};
  };
  /// Looks at the pictures of a moment; either may be null. Several fish-eye pictures are one bracket, of which the one
  /// that shows most of the board counts.
  Seen look(std::int64_t time_ns, const capture::Picture* color, const capture::Response& color_response,
            const std::vector<std::shared_ptr<const capture::Picture>>& fisheye,
            const capture::Response& fisheye_response,
            const std::shared_ptr<const capture::DepthPicture>& depth = nullptr);

  /// What the moment shows that was looked at last, kept or not.
  const std::array<BoardView, 2>& newest() const { return last_; }
  const BoardFinder& finder() const { return finder_; }
  /// What one camera (0, 1) saw of the room's tag, measured again through its lens.
  std::vector<SeenPoints> room_tag(std::size_t camera, const capture::CameraModel& lens) const;
  const std::vector<BoardMoment>& moments() const { return moments_; }
  /// What one camera (0, 1) saw of the board at all times that were looked at, moving or not: the newest of them.
  const std::vector<TimedView>& path(std::size_t camera) const { return paths_[camera]; }

  static constexpr std::size_t kMost = 60;

 private:
  bool somewhere_new(const BoardMoment& moment) const;
  void thin_out();

  BoardFinder finder_;
  std::optional<BoardFinder> room_finder_;
  std::vector<BoardMoment> moments_;
  std::array<std::vector<TimedView>, 2> paths_;
  std::int64_t last_time_ns_ = 0;
  std::array<BoardView, 2> last_;  ///< at the moment before, kept or not
  bool any_ = false;
  double apart_ = 0.04;  ///< of the picture's width: how far the board must have moved to be somewhere new
};

}  // namespace lumigraft::reconstruct
