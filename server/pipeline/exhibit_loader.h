#pragma once
// Loads the models of the exhibit and prepares them for rendering, one step at a time on a thread of its own; and
// replaces the exhibit by another once that is prepared.
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "reconstruct/scene_store.h"
#include "relight/exhibit/exhibit.h"
#include "server/metrics/metrics.h"
#include "server/pipeline/exhibit_state.h"
#include "server/pipeline/live_relighter.h"

namespace lumigraft::server {

class ExhibitLoader {
 public:
  struct Uses {
    ExhibitState& exhibit;
    LiveRelighter& relighter;
    reconstruct::SceneStore& store;  ///< for warnings
    Metrics& metrics;
  };

  /// `unloaded`: objects of the exhibit whose models are to be loaded, in this order.
  ExhibitLoader(const std::vector<relight::UnloadedObject>& unloaded, const Uses& uses)
      : uses_(uses), unloaded_(unloaded.rbegin(), unloaded.rend()) {}

  /// What is shown stays until all of it is prepared. Any thread.
  void replace(relight::Exhibit exhibit, ExhibitLimits limits);
  /// Loads, prepares or replaces; takes up to seconds. False if nothing is to be done. One thread.
  bool step();

 private:
  void load_next_model();
  bool prepare_model_of(const relight::Exhibit& shown);
  bool replace_exhibit();

  Uses uses_;
  std::vector<relight::UnloadedObject> unloaded_;  ///< in reverse
  std::vector<std::string> load_failures_;
  std::mutex next_mutex_;
  std::optional<std::pair<relight::Exhibit, ExhibitLimits>> next_;  ///< to be prepared and shown
};

}  // namespace lumigraft::server
