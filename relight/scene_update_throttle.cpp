#include "relight/scene_update_throttle.h"

#include <algorithm>
#include <cstdint>

#include "relight/parameters.h"

namespace lumigraft::relight {
namespace {

/// Fraction of the bricks of `now` that differ from those of `before`. Bricks are immutable: the same pointer means
/// unchanged.
template <typename Field>
double changed_fraction(const std::shared_ptr<const Field>& before, const std::shared_ptr<const Field>& now) {
  if (!now || before == now) return 0;
  if (!before) return 1;
  const auto changed = std::count_if(now->bricks.begin(), now->bricks.end(), [&](const auto& entry) {
    const auto found = before->bricks.find(entry.first);
    return found == before->bricks.end() || found->second != entry.second;
  });
  return static_cast<double>(changed) / static_cast<double>(std::max<std::size_t>(now->bricks.size(), 1));
}

}  // namespace

void SceneUpdateThrottle::follow(const reconstruct::Scene& scene) {
  const std::uint64_t now = scene.field->version;
  const bool again = !field_ || now < field_->version;
  const std::uint64_t behind = again ? 0 : now - field_->version;
  const bool other_occluders = !field_ || scene.field->occluders_version != field_->occluders_version;
  const bool due = again || other_occluders || behind >= kRelight.max_behind_few_changed ||
                   (behind >= std::clamp<std::uint64_t>(field_->version / 4, 1, kRelight.max_behind) &&
                    changed_fraction(field_, scene.field) > kRelight.few_changed) ||
                   changed_fraction(albedo_, scene.albedo) > kRelight.few_changed;
  if (!due) return;
  field_ = scene.field;
  albedo_ = scene.albedo;
}

}  // namespace lumigraft::relight
