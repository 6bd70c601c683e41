#pragma once
// What the GPU holds of a model (object_store.h), computed without the GPU.
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "relight/exhibit/exhibit.h"
#include "relight/objects/distance_field.h"
#include "relight/objects/placement.h"
#include "relight/objects/prepared_models.h"
#include "relight/objects/texture.h"

namespace lumigraft::relight {

constexpr int kSampleFloats = 12;

struct UploadModel {
  std::shared_ptr<const Model> full, simple, rough;  ///< see StoredModel
  bool closed = false;                               ///< of `simple`
  BoundingSphere sphere;
  std::vector<float> samples;  ///< kSampleFloats each, see StoredModel
  float area_m2 = 0;
  float volume_m3 = 0;  ///< of a closed surface
  std::vector<float> part_area_m2;
  Eigen::Vector3f mean_emission = Eigen::Vector3f::Zero();  ///< over that
  std::array<int, 3> grid{};                                ///< voxels
  Eigen::Vector3f grid_origin_m = Eigen::Vector3f::Zero();
  float grid_voxel_m = 0;
  std::vector<float> distances_m;
  std::vector<std::uint8_t> reflectances;  ///< RGBA per voxel
  std::vector<float> animation_radii_m;    ///< by animation: that of the largest sphere of its poses, model frame
  /// The textures of the model's parts: RGBA of each mip level, encoded as their pictures. Of normals, A is the square
  /// root of what their mean length lacks.
  std::map<std::pair<const capture::Image<std::uint8_t>*, Texels>, std::vector<std::vector<std::uint8_t>>> textures;
};
using UploadModels = PreparedModels<UploadModel>;

/// What devices draw of a model: blended materials are cut.
inline const std::shared_ptr<const Model>& without_blending(const std::shared_ptr<const Model>& model) {
  return model->cut ? model->cut : model;
}

/// Takes up to seconds.
std::shared_ptr<const UploadModel> make_upload_model(const std::shared_ptr<const Model>& whole);
/// The same model in a pose, without its field and what all poses share: textures and the extent of its animations.
std::shared_ptr<const UploadModel> posed_upload_model(const UploadModel& at_rest, const RigPose& pose);
/// With the field, which takes tenths of a second; it is coarser, posed_field_voxels.
std::shared_ptr<const UploadModel> with_field(const UploadModel& posed);

}  // namespace lumigraft::relight
