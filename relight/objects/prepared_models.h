#pragma once
// What a renderer computes once per model, which takes up to seconds: on a thread of its own, so that no frame waits.
#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// Any thread; `prepare_next` on one at a time. A model whose preparation throws is not tried again while an object has
/// it.
template <typename Prepared>
class PreparedModels {
 public:
  using Model = std::shared_ptr<const relight::Model>;
  using Make = std::shared_ptr<const Prepared> (*)(const Model&);
  explicit PreparedModels(Make make) : make_(make) {}

  /// Null if the model is not prepared.
  std::shared_ptr<const Prepared> find(const Model& model) const {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(known_, model, &Known::first);
    return found == known_.end() ? nullptr : found->second;
  }

  /// Whether a model of the exhibit is not prepared.
  bool wants(const Exhibit& exhibit) const {
    return std::ranges::any_of(exhibit.objects, [&](const VirtualObject& o) { return o.model && !tried(o.model); });
  }

  /// Prepares one model: a visible object's before those of hidden ones, so that showing these is as fast. Forgets
  /// models that no object has any more.
  void prepare_next(const Exhibit& exhibit) {
    const auto used = [&](const Known& known) {
      return std::ranges::find(exhibit.objects, known.first, &VirtualObject::model) != exhibit.objects.end();
    };
    {
      const std::lock_guard lock(mutex_);
      std::erase_if(known_, [&](const Known& known) { return !used(known); });
    }
    for (const bool visible : {true, false}) {
      for (const VirtualObject& object : exhibit.objects) {
        if (object.visible != visible || !object.model || tried(object.model)) continue;
        set(object.model, nullptr);  // until it is made
        set(object.model, make_(object.model));
        return;
      }
    }
  }

 private:
  using Known = std::pair<Model, std::shared_ptr<const Prepared>>;

  bool tried(const Model& model) const {
    const std::lock_guard lock(mutex_);
    return std::ranges::find(known_, model, &Known::first) != known_.end();
  }
  void set(const Model& model, std::shared_ptr<const Prepared> prepared) {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(known_, model, &Known::first);
    if (found == known_.end())
      known_.emplace_back(model, std::move(prepared));
    else
      found->second = std::move(prepared);
  }

  Make make_;
  mutable std::mutex mutex_;
  std::vector<Known> known_;
};

/// The exhibit without visible objects whose models are not prepared, which `preparing` names.
template <typename Prepared>
Exhibit only_prepared(Exhibit exhibit, const PreparedModels<Prepared>& models, std::vector<std::string>* preparing) {
  for (VirtualObject& object : exhibit.objects) {
    if (!object.visible || !object.model || models.find(object.model)) continue;
    object.visible = false;
    preparing->push_back(object.name);
  }
  return exhibit;
}

}  // namespace lumigraft::relight
