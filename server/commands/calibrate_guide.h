#pragma once
// What a person with a board in hand needs to see while cameras are calibrated: the newest pictures with the corners
// that were found, where corners are still missing, and at the end the result or why there is none.
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

class CalibrateGuide {
 public:
  /// The colour camera and the fish-eye, as far as they are there.
  explicit CalibrateGuide(const std::array<std::optional<capture::CameraModel>, 2>& cameras);

  /// After each moment that `collector` looked at.
  void look(const capture::FrameSet& frame, const reconstruct::ViewSelector& collector);
  void calculating();
  void done(const std::string& report, const std::string& refusal);
  /// Whether every camera has seen the board often enough, and everywhere; after a refusal, some more often.
  bool covered() const;

  /// What was seen was refused, and looking goes on.
  void go_on(const std::string& refusal);
  /// Whether somebody pressed the page's button: what was seen is to be enough.
  bool finish_asked() const;

  /// For the web server: the page, calibrate.json, color.jpg, fisheye.jpg. Any thread.
  WebReply reply(std::string_view path);
  /// The same for what is asked to be done: finish.
  WebReply ask(std::string_view path);

 private:
  static constexpr int kEnoughViews = 15;
  static constexpr std::size_t kMoreAfterRefusal = 5;  ///< moments to be kept before it is tried again

  struct Camera {
    capture::CameraModel model;
    std::shared_ptr<const capture::Picture> picture;
    reconstruct::BoardView view;  ///< in it
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
  std::size_t moments_ = 0;  ///< that the collector has; it drops some
  std::size_t kept_ = 0;     ///< that were ever kept
  std::size_t wanted_ = 0;   ///< of those, since the newest refusal
  std::string report_, refusal_;
  JpegEncoder jpeg_{80};
};

}  // namespace lumigraft::server
