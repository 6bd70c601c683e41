#pragma once
// Draws the maps that are asked for, as JPEG files, one at a time.
#include <cstdint>
#include <memory>
#include <optional>

#include "capture/camera/camera_model.h"
#include "capture/source.h"
#include "reconstruct/scene.h"
#include "server/maps/draw_map.h"
#include "server/maps/map_board.h"
#include "server/maps/parameters.h"
#include "server/metrics/metrics.h"
#include "server/stream/encode_jpeg.h"

namespace lumigraft::server {

class MapDrawer {
 public:
  /// What maps are drawn from.
  struct Newest {
    std::shared_ptr<const capture::Frame> camera;  ///< null before the first picture
    std::shared_ptr<const capture::Image<std::uint8_t>> shown;
    reconstruct::Scene scene;  ///< with its pose
    std::uint32_t sequence = 0;
  };

  MapDrawer(const capture::CameraModel& lens, Metrics& metrics) : lens_(lens), metrics_(metrics) {}

  /// As MapBoard::ask. Any thread.
  std::optional<MapPicture> ask(MapKind kind, MapBoard::Clock::time_point now) { return board_.ask(kind, now); }
  /// The map that is to be drawn now. Any thread.
  std::optional<MapKind> due(MapBoard::Clock::time_point now) const { return board_.due(now); }
  /// One thread.
  void draw(MapKind kind, Newest newest);

 private:
  const capture::CameraModel& lens_;
  Metrics& metrics_;
  MapBoard board_;
  SeenSurface seen_surface_;
  JpegEncoder encoder_{kMaps.jpeg_quality};
};

}  // namespace lumigraft::server
