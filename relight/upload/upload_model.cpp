#include "relight/upload/upload_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "capture/camera/srgb.h"
#include "relight/animation/pose.h"
#include "relight/exhibit/bsdf_params.h"
#include "relight/objects/mesh_refine.h"
#include "relight/objects/mesh_simplify.h"
#include "relight/objects/model_surface.h"
#include "relight/objects/posed_model.h"
#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

std::uint8_t to_byte(float x) { return static_cast<std::uint8_t>(std::clamp(x, 0.0f, 1.0f) * 255.0f + 0.5f); }

/// Points distributed over all triangles, each for at most `sample_area_m2` of area.
std::vector<float> surface_samples(const Model& model, double sample_area_m2) {
  std::vector<float> samples;
  const bool emits =
      std::ranges::any_of(model.parts, [](const Model::Part& p) { return p.material.emission.maxCoeff() > 0; });
  const ModelSurface surface(model, /*mips=*/false);
  for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
    const std::uint32_t* v = &model.indices[t];
    const Eigen::Vector3f &a = model.positions_m[v[0]], &b = model.positions_m[v[1]], &c = model.positions_m[v[2]];
    const float area = 0.5f * (b - a).cross(c - a).norm();
    if (!(area > 0)) continue;
    // A triangle divided into k² equal ones, a sample at each centroid.
    const int k = std::clamp(static_cast<int>(std::ceil(std::sqrt(area / sample_area_m2))), 1, 256);
    for (int i = 0; i < k; ++i) {
      for (int j = 0; j < 2 * (k - i) - 1; ++j) {
        const float u = (static_cast<float>(i) + (j % 2 == 0 ? 1.0f : 2.0f) / 3) / static_cast<float>(k);
        const float w = (static_cast<float>(j / 2) + (j % 2 == 0 ? 1.0f : 2.0f) / 3) / static_cast<float>(k);
        const Eigen::Vector3f p = a + u * (b - a) + w * (c - a);
        const Eigen::Vector3f n = (1 - u - w) * model.normals[v[0]] + u * model.normals[v[1]] + w * model.normals[v[2]];
        const ModelPoint point{static_cast<std::uint32_t>(t / 3), {1 - u - w, u, w}, 0};
        Eigen::Vector3f e = Eigen::Vector3f::Zero();
        if (emits) {
          const Material material = surface.at(point, {}).material;
          e = (1 - coat_share_evenly(material.clearcoat)) * material.emission;
        }
        samples.insert(samples.end(), {p.x(), p.y(), p.z(), area / static_cast<float>(k * k), n.x(), n.y(), n.z(), 0,
                                       e.x(), e.y(), e.z(), 0});
      }
    }
  }
  return samples;
}

double surface_area_m2(const Model& model) {
  double sum = 0;
  for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
    const Eigen::Vector3f& a = model.positions_m[model.indices[t]];
    const Eigen::Vector3f ab = model.positions_m[model.indices[t + 1]] - a,
                          ac = model.positions_m[model.indices[t + 2]] - a;
    sum += 0.5 * ab.cross(ac).norm();
  }
  return sum;
}

/// Subdivides so that no edge is longer than those of even_triangles equal triangles of the same total area.
std::shared_ptr<const Model> evenly_divided(const Model& model) {
  Eigen::AlignedBox3f box;
  for (const auto& p : model.positions_m) box.extend(p);
  const double edge_m = std::sqrt(surface_area_m2(model) / (kUpload.even_triangles * std::sqrt(3.0) / 4));
  const float min_edge_m = box.diagonal().norm() / 200;  // for models of nearly zero area
  return refine_model(model, std::max(static_cast<float>(edge_m), min_edge_m));
}

/// Of a closed surface (Gauss).
double volume_m3(const Model& model) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < model.indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
      return model.positions_m[model.indices[i + k]].cast<double>();
    };
    sum += corner(0).dot(corner(1).cross(corner(2))) / 6;
  }
  return std::abs(sum);
}

double part_area_m2(const Model& model, const Model::Part& part) {
  double sum = 0;
  for (std::size_t i = part.first_index; i + 2 < part.first_index + std::size_t{part.index_count}; i += 3) {
    const auto corner = [&](std::size_t k) -> const Eigen::Vector3f& {
      return model.positions_m[model.indices[i + k]];
    };
    sum += static_cast<double>((corner(1) - corner(0)).cross(corner(2) - corner(0)).norm()) / 2;
  }
  return sum;
}

/// RGBA per voxel: the reflectance of its surface for uniform incident light.
std::vector<std::uint8_t> reflectances(const ObjectField& field, const Model& model) {
  std::vector<std::uint8_t> texels(field.base_color.size() * 4, 255);
  for (std::size_t i = 0; i < field.base_color.size(); ++i) {
    Material material = model.parts[field.part[i]].material;
    material.metallic = field.metallic[i];
    const BsdfParams bsdf = bsdf_params_of(field.base_color[i], material);
    const Eigen::Array3f reflectance = reflectance_evenly(bsdf);
    for (int c = 0; c < 3; ++c) texels[4 * i + static_cast<std::size_t>(c)] = to_byte(reflectance[c]);
  }
  return texels;
}

std::array<std::uint8_t, 4> encoded(const Eigen::Vector3f& mean, Texels texels) {
  if (texels == Texels::srgb) {
    const auto code = [](float light) { return capture::srgb_table().code(light); };
    return {code(mean.x()), code(mean.y()), code(mean.z()), 255};
  }
  if (texels == Texels::linear) return {to_byte(mean.x()), to_byte(mean.y()), to_byte(mean.z()), 255};
  const Eigen::Vector3f n = (Eigen::Vector3f::Ones() + mean.stableNormalized()) / 2;
  return {to_byte(n.x()), to_byte(n.y()), to_byte(n.z()), to_byte(std::sqrt(std::max(1 - mean.norm(), 0.0f)))};
}

std::vector<std::vector<std::uint8_t>> mip_levels(const TexturePicture& picture, Texels texels) {
  std::vector<std::vector<std::uint8_t>> levels(1);
  levels[0].reserve(picture->data.size() / 3 * 4);
  const std::uint8_t alpha = texels == Texels::normals ? 0 : 255;
  for (std::size_t i = 0; i < picture->data.size(); i += 3) {
    levels[0].insert(levels[0].end(), {picture->data[i], picture->data[i + 1], picture->data[i + 2], alpha});
  }
  const Texture texture(picture, texels, /*mips=*/true);
  for (const capture::Image<float>& mip : texture.mips()) {
    std::vector<std::uint8_t>& level = levels.emplace_back();
    for (std::size_t i = 0; i < mip.data.size(); i += 3) {
      const auto texel = encoded(Eigen::Map<const Eigen::Vector3f>(&mip.data[i]), texels);
      level.insert(level.end(), texel.begin(), texel.end());
    }
  }
  return levels;
}

void add_surface(UploadModel& made) {
  const Model& model = *made.full;
  made.sphere = bounding_sphere(model.positions_m);
  const double area_m2 = surface_area_m2(model);
  made.area_m2 = static_cast<float>(area_m2);
  made.volume_m3 = static_cast<float>(volume_m3(model));
  made.part_area_m2.clear();
  for (const Model::Part& part : model.parts)
    made.part_area_m2.push_back(static_cast<float>(part_area_m2(model, part)));
  made.samples = surface_samples(model, area_m2 / kUpload.samples);
  for (std::size_t i = 0; i < made.samples.size(); i += kSampleFloats) {
    const float* sample = &made.samples[i];
    made.mean_emission += sample[3] / made.area_m2 * Eigen::Vector3f(sample[8], sample[9], sample[10]);
  }
}

void add_field(UploadModel& made, int field_voxels) {
  const auto field = compute_object_field(*made.full, field_voxels);
  made.grid = field->size;
  made.grid_origin_m = field->origin_m;
  made.grid_voxel_m = field->voxel_m;
  made.distances_m = full_distances(*field);
  made.reflectances = reflectances(*field, *made.full);
}

/// That of the largest of the poses at evenly spaced times.
float largest_radius_m(const Rig& rig, std::size_t animation) {
  float radius_m = 0;
  for (int i = 0; i < kUpload.animation_poses; ++i) {
    const double time_s = rig.animations[animation].length_s * i / kUpload.animation_poses;
    radius_m = std::max(radius_m, bounding_sphere(skinned(rig, pose_at(rig, animation, time_s)).positions_m).radius_m);
  }
  return radius_m;
}

}  // namespace

std::shared_ptr<const UploadModel> make_upload_model(const std::shared_ptr<const Model>& whole) {
  const std::shared_ptr<const Model>& model = without_blending(whole);
  auto made = std::make_shared<UploadModel>();
  made->full = model;
  made->simple = evenly_divided(*simplify_model(*model, kUpload.simple_triangles));
  made->closed = is_closed(*made->simple);
  made->rough = simplify_model(*model, kUpload.rough_triangles);
  for (const Model::Part& part : model->parts) {
    for (const TextureUse use : std::span(kTextureUses).first<kDeviceTextureUses>()) {
      const Model::TextureSlot& slot = slot_of(part, use);
      if (!has_picture(slot)) continue;
      auto& levels = made->textures[{slot.picture.get(), texels_of(use)}];
      if (levels.empty()) levels = mip_levels(slot.picture, texels_of(use));
    }
  }
  add_surface(*made);
  add_field(*made, kUpload.field_voxels);
  for (std::size_t i = 0; model->rig && i < model->rig->animations.size(); ++i)
    made->animation_radii_m.push_back(largest_radius_m(*model->rig, i));
  return made;
}

std::shared_ptr<const UploadModel> posed_upload_model(const UploadModel& at_rest, const RigPose& pose) {
  const PosedVertices vertices = skinned(*at_rest.full->rig, pose);
  auto made = std::make_shared<UploadModel>();
  made->full = posed_model(*at_rest.full, vertices);
  made->simple = posed_model(*at_rest.simple, vertices);
  made->closed = at_rest.closed;
  made->rough = posed_model(*at_rest.rough, vertices);
  add_surface(*made);
  return made;
}

std::shared_ptr<const UploadModel> with_field(const UploadModel& posed) {
  auto made = std::make_shared<UploadModel>(posed);
  add_field(*made, kUpload.posed_field_voxels);
  return made;
}

}  // namespace lumigraft::relight
