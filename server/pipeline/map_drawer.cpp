#include "server/pipeline/map_drawer.h"

#include <utility>
#include <vector>

#include "server/pipeline/camera_picture.h"

namespace lumigraft::server {

void MapDrawer::draw(MapKind kind, Newest newest) {
  std::optional<capture::Image<std::uint8_t>> map;
  if (newest.camera) {
    const StageTimer timer(metrics_, "maps");
    MapSource source;
    source.shown = std::move(newest.shown);
    source.scene = std::move(newest.scene);
    source.camera = camera_picture(*newest.camera);
    source.lens = lens_;
    map = draw_map(kind, source, seen_surface_);
  }
  if (!map) {
    board_.skip(kind, MapBoard::Clock::now());
    return;
  }
  const std::vector<std::uint8_t> jpeg = encoder_.encode(*map);
  board_.put(kind, {{jpeg.begin(), jpeg.end()}, newest.sequence}, MapBoard::Clock::now());
}

}  // namespace lumigraft::server
