#include "reconstruct/field/masked_field.h"

namespace lumigraft::reconstruct {

void SurfaceMask::add(const SurfaceMask& other) {
  for (const auto& [key, voxels] : other.fine) fine[key] |= voxels;
  for (const auto& [key, voxels] : other.coarse) coarse[key] |= voxels;
}

void MaskedField::apply(DistanceField& field, const SurfaceMask::Voxels& voxels, Cache& cache) {
  std::erase_if(cache, [&](const auto& entry) { return !voxels.contains(entry.first); });
  for (const auto& [key, masked] : voxels) {
    const auto brick = field.bricks.find(key);
    if (brick == field.bricks.end()) continue;
    Masked& known = cache[key];
    if (known.before != brick->second) {
      auto without = std::make_shared<FieldBrick>(*brick->second);
      BrickColor* color = without->color ? &without->own_color() : nullptr;
      for (std::size_t i = 0; i < kBrickVoxels; ++i) {
        if (!masked[i]) continue;
        without->weight[i] = without->distance_m[i] = 0;
        if (color) color->weight[i] = 0;
      }
      known = {brick->second, std::move(without)};
    }
    field.bricks[key] = known.after;
  }
}

std::shared_ptr<const DistanceField> MaskedField::without(const std::shared_ptr<const DistanceField>& field,
                                                          const std::shared_ptr<const SurfaceMask>& mask) {
  if (!field || !mask || mask->empty()) return field;
  if (field == field_ && mask == mask_) return result_;
  if (mask != mask_) {
    ++version_;
    fine_.clear();
    coarse_.clear();
  }
  auto result = std::make_shared<DistanceField>(*field);
  result->occluders_version = version_;
  apply(*result, mask->fine, fine_);
  if (field->coarse && !mask->coarse.empty()) {
    auto coarse = std::make_shared<DistanceField>(*field->coarse);
    apply(*coarse, mask->coarse, coarse_);
    result->coarse = std::move(coarse);
  }
  field_ = field;
  mask_ = mask;
  result_ = std::move(result);
  return result_;
}

}  // namespace lumigraft::reconstruct
