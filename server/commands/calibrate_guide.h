#pragma once
// The page that guides a person who holds the board: the newest pictures with detected corners, regions that still lack
// corners, and finally the result or the rejection reason.
#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "reconstruct/calibrate/view_selection.h"
#include "server/stream/encode_jpeg.h"
#include "server/stream/web_server.h"

namespace lumigraft::server {

inline constexpr std::array kCameraNames = {"colour", "fish-eye"};

class CalibrateGuide {
 public:
  /// The colour camera and the fish-eye; either may be missing.
  explicit CalibrateGuide(const std::array<std::optional<capture::CameraModel>, 2>& cameras);

  /// Call after each moment that `collector` processed.
  void add(const capture::FrameSet& frame, const reconstruct::ViewSelector& collector);
  void calculating();
  void done(const std::string& report, const std::string& refusal);
  /// Whether every camera has enough views and full coverage; after a rejection, more views are required.
  bool covered() const;

  /// Shows that the calibration was rejected and that collection continues.
  void go_on(const std::string& refusal);
  /// Whether the page's button was pressed: calibrate with the views collected so far.
  bool finish_asked() const;

  /// Answers GET: the page, calibrate.json, color.jpg, fisheye.jpg. Thread-safe.
  WebReply reply(std::string_view path);
  /// Answers POST: finish. Thread-safe.
  WebReply ask(std::string_view path);

 private:
  struct Camera {
    capture::CameraModel model;
    std::shared_ptr<const capture::Frame> picture;
    reconstruct::BoardView view;  ///< in `picture`
    int views = 0;
    reconstruct::Coverage coverage;
  };

  std::string json() const;
  bool can_finish() const;
  WebReply picture(std::size_t camera);

  mutable std::mutex mutex_;
  std::array<std::optional<Camera>, 2> cameras_;
  const char* doing_ = "looking";
  bool finish_asked_ = false;
  std::size_t moments_ = 0;  ///< in the collector, which discards some
  std::size_t kept_ = 0;     ///< accepted in total
  std::size_t wanted_ = 0;   ///< required value of kept_ since the newest rejection
  std::string report_, refusal_;
  JpegEncoder jpeg_{80};
};

}  // namespace lumigraft::server
