#include "server/stream/viewer_hub.h"

#include <algorithm>
#include <chrono>

#include "server/stream/parameters.h"

namespace lumigraft::server {

void ViewerHub::add(std::shared_ptr<Viewer> viewer) {
  viewers_.insert(std::move(viewer));
  metrics_.viewers(static_cast<int>(viewers_.size()));
}

void ViewerHub::remove(const std::shared_ptr<Viewer>& viewer) {
  if (viewers_.erase(viewer) > 0) {
    metrics_.viewers(static_cast<int>(viewers_.size()));
    count_demand();
  }
}

void ViewerHub::count_demand() {
  demand_.h264 = static_cast<int>(std::ranges::count(viewers_, Codec::h264, &Viewer::codec));
  demand_.jpeg = static_cast<int>(std::ranges::count(viewers_, Codec::jpeg, &Viewer::codec));
}

void ViewerHub::publish(const std::shared_ptr<const StreamMessage>& message) {
  if (message->header.kind == StreamKind::config) {
    config_ = message;
  } else {
    capture_times_ns_.emplace_back(message->header.sequence, message->header.capture_time_ns);
    if (capture_times_ns_.size() > kStream.remembered_frames) capture_times_ns_.pop_front();
  }
  for (const auto& viewer : std::set(viewers_)) {  // a copy: offer() may remove a viewer
    viewer->offer(message);
  }
}

void ViewerHub::publish_text(const std::string& kind, const std::string& text) {
  for (const auto& viewer : std::set(viewers_)) viewer->offer_text(kind, text);
}

void ViewerHub::close_all() {
  for (const auto& viewer : std::set(viewers_)) viewer->close_all();
}

void ViewerHub::acknowledged(std::uint32_t sequence) {
  for (const auto& [known, capture_time_ns] : capture_times_ns_) {
    if (known == sequence) {
      const auto now = std::chrono::system_clock::now().time_since_epoch();
      const auto now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
      metrics_.time("capture_to_ack", 1e-9 * static_cast<double>(now_ns - capture_time_ns));
      return;
    }
  }
}

}  // namespace lumigraft::server
