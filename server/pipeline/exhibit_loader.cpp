#include "server/pipeline/exhibit_loader.h"

#include "capture/error.h"

namespace lumigraft::server {

void ExhibitLoader::replace(relight::Exhibit exhibit, ExhibitLimits limits) {
  const std::lock_guard lock(next_mutex_);
  next_ = {std::move(exhibit), std::move(limits)};
}

bool ExhibitLoader::step() {
  if (replace_exhibit()) return true;
  if (!unloaded_.empty()) {
    load_next_model();
    return true;
  }
  return prepare_model_of(*uses_.exhibit.newest());
}

/// A model that cannot be loaded leaves its object away, and a warning for as long as the service runs.
void ExhibitLoader::load_next_model() {
  const relight::UnloadedObject object = std::move(unloaded_.back());
  unloaded_.pop_back();
  const auto warn = [&](const std::string& line) {
    std::vector<std::string> lines = load_failures_;
    if (!line.empty()) lines.push_back(line);
    uses_.store.publish_warnings("loading", std::move(lines));
  };
  const StageTimer timer(uses_.metrics, "load model");
  int reported_percent = -1;
  try {
    uses_.exhibit.give_model(object.index, object.load([&](float done) {
      const int percent = static_cast<int>(100 * done);
      if (percent != std::exchange(reported_percent, percent))
        warn("object \"" + object.name + "\" is being loaded: " + std::to_string(percent) + " %");
    }));
  } catch (const capture::InputError& error) {
    load_failures_.push_back("object \"" + object.name + "\" is left out: " + error.what());
  }
  warn("");
}

/// False if all are prepared.
bool ExhibitLoader::prepare_model_of(const relight::Exhibit& shown) {
  if (!uses_.relighter.wants_models(shown)) return false;
  const StageTimer timer(uses_.metrics, "models");
  uses_.relighter.prepare_model(shown);
  uses_.store.publish_warnings("models stage", {});
  return true;
}

/// One step towards the next exhibit. False if there is none.
bool ExhibitLoader::replace_exhibit() {
  const std::lock_guard lock(next_mutex_);
  if (!next_) return false;
  relight::Exhibit both = *uses_.exhibit.newest();  // what is shown stays prepared
  both.objects.insert(both.objects.end(), next_->first.objects.begin(), next_->first.objects.end());
  if (prepare_model_of(both)) return true;
  unloaded_.clear();  // they belong to the exhibit before
  load_failures_.clear();
  uses_.store.publish_warnings("loading", {});
  uses_.exhibit.replace(std::move(next_->first), std::move(next_->second));
  next_.reset();
  return true;
}

}  // namespace lumigraft::server
