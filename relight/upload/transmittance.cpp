#include "relight/upload/transmittance.h"

#include <algorithm>

#include "relight/exhibit/bsdf_params.h"

namespace lumigraft::relight {
namespace {

bool passes(const Material& material) { return material.transmission > 0 && material.metallic < 1; }

/// Lengths in which a material absorbs, over those of the model: an override's are those of the room.
float attenuation_scale(const PlacedObject& object) {
  return object.material.attenuation_distance_m ? object.T_tag_model.linear().col(0).norm() : 1;
}

shader::Glass glass_of(const PlacedObject& object) {
  const auto& parts = object.stored->model->parts;
  const auto first =
      std::ranges::find_if(parts, [&](const Model::Part& part) { return passes(object.material.over(part.material)); });
  const Material material = object.material.over(first->material);
  const float scale = object.material.attenuation_distance_m ? 1 : object.T_tag_model.linear().col(0).norm();
  shader::Glass glass;
  glass.ior_refracts << material.ior, (material.thin_walled ? 0.0f : 1.0f), 0, 0;
  glass.absorption << (material.thin_walled ? Eigen::Array3f::Zero().eval() : absorption_of(material) / scale).matrix(),
      0;
  return glass;
}

}  // namespace

Eigen::Array3f transmittance_of(const Material& material, float chord_m) {
  if (!passes(material)) return Eigen::Array3f::Zero();
  const BsdfParams bsdf = bsdf_params_of(material.base_color.array(), material);
  const Eigen::Array3f mirrored = bsdf.f0 + (bsdf.f90 - bsdf.f0) / 21;  // cosine-weighted mean of Schlick's term
  const float under_coat = (1 - coat_share_evenly(bsdf.coat)) * under_sheen_evenly(bsdf);
  if (material.thin_walled) return bsdf.transmitted * ((1 - mirrored) * under_coat);
  const Eigen::Array3f left = (-absorption_of(material) * chord_m).exp();
  // The sum over reflections within.
  return bsdf.transmitted * bsdf.transmitted * (1 - mirrored) * (1 - mirrored) * left * under_coat /
         (1 - mirrored * left);
}

bool transmits(const PlacedObject& object) {
  return std::ranges::any_of(object.stored->model->parts,
                             [&](const Model::Part& part) { return passes(object.material.over(part.material)); });
}

std::vector<int> glass_numbers(const std::vector<PlacedObject>& objects) {
  std::vector<int> numbers;
  int last = 0;
  for (const PlacedObject& object : objects)
    numbers.push_back(transmits(object) ? last = std::min(last + 1, shader::kMaxGlass) : 0);
  return numbers;
}

void describe_glass(const std::vector<PlacedObject>& objects, shader::FrameParams& params) {
  const std::vector<int> numbers = glass_numbers(objects);
  for (shader::Glass& glass : params.glass) {
    glass.ior_refracts.setZero();
    glass.absorption.setZero();
  }
  Eigen::Array3f passed_m2 = Eigen::Array3f::Zero();
  float all_m2 = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const PlacedObject& object = objects[i];
    if (numbers[i] > 0) params.glass[numbers[i] - 1] = glass_of(object);
    const float scale = object.T_tag_model.linear().col(0).norm();
    const float chord_m = 4 * object.stored->volume_m3 / std::max(object.stored->area_m2, 1e-12f);  // Cauchy 1832
    for (std::size_t part = 0; part < object.stored->part_area_m2.size(); ++part) {
      const float area_m2 = scale * scale * object.stored->part_area_m2[part];
      const Material material = object.material.over(object.stored->model->parts[part].material);
      passed_m2 += area_m2 * transmittance_of(material, attenuation_scale(object) * chord_m);
      all_m2 += area_m2;
    }
  }
  params.blocked << (1 - passed_m2 / std::max(all_m2, 1e-12f)).matrix(), 0;
}

}  // namespace lumigraft::relight
