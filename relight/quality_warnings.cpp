#include "relight/quality_warnings.h"

#include "capture/message_text.h"
#include "relight/parameters.h"
#include "relight/upload/transmittance.h"

namespace lumigraft::relight {
namespace {

std::string quoted(const VirtualObject& object) { return "object \"" + object.name + "\""; }

/// Of materials that a volume's and a pixel's surface here cannot express; empty if nothing.
std::string simplified(const VirtualObject& object) {
  bool sheen = false, anisotropy = false, coat = false, specular = false;
  for (const Model::Part& part : object.model->parts) {
    const Material material = object.material.over(part.material);
    sheen = sheen || material.sheen_color.maxCoeff() > 0;
    anisotropy = anisotropy || material.anisotropy > 0;
    coat = coat || (material.clearcoat > 0 && (part.clearcoat_normal_texture.picture || part.normal_texture.picture));
    specular = specular || (material.specular_color != Eigen::Vector3f::Ones() ||
                            (material.transmission == 0 && material.ior > 1.5f));
  }
  std::vector<std::string> features;
  if (sheen) features.emplace_back("sheen as a matt colour");
  if (anisotropy) features.emplace_back("anisotropic roughness as the same in all directions");
  if (coat) features.emplace_back("clearcoat with the normals of what it covers");
  if (specular) features.emplace_back("specular reflection without colour and at most that of the index 1.5");
  if (!object.model->blended.empty())
    features.emplace_back("alphaMode BLEND cut at one half (" + object.model->blended + ")");
  if (features.empty()) return {};
  return quoted(object) + " is drawn with " + capture::listed(features) +
         "; plan.method = rays draws what its file asks for";
}

}  // namespace

std::string what_is_missing(const reconstruct::Scene& scene, bool any_object, const std::vector<std::string>& preparing,
                            bool room_given) {
  if (!any_object) return preparing.empty() ? "no visible object" : being_prepared(preparing);
  if (!scene.pose) return "no pose";
  if (!room_given && !scene.illumination) return "no light is known yet";
  if (!room_given && !scene.field) return "no geometry is known yet";
  return {};
}

std::string being_prepared(const std::vector<std::string>& preparing) {
  std::string text;
  for (const std::string& name : preparing) text += (text.empty() ? "object \"" : ", object \"") + name + "\"";
  return text + (preparing.size() == 1 ? " is" : " are") + " being prepared";
}

void pass_through(const std::string& why, RelitPicture* result) {
  result->warnings.push_back("relight: " + why + ", the camera picture passes through");
  result->passed_through = true;
}

std::vector<std::string> left_out(const VirtualObject& object) {
  std::vector<std::string> lines;
  if (!object.model) return lines;
  if (const std::size_t n = object.model->unusable_triangles; n > 0) {
    lines.push_back(quoted(object) + ": " + std::to_string(n) +
                    " triangles without area or finite position are omitted");
  }
  if (const auto& features = object.model->not_drawn; !features.empty())
    lines.push_back(quoted(object) + " is drawn without " + capture::listed(features));
  return lines;
}

void warn_of_objects(const Exhibit& exhibit, const std::vector<std::string>& preparing, RelitPicture* result) {
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.visible) continue;
    for (const std::string& line : left_out(object)) result->warnings.push_back("relight: " + line);
  }
  if (!preparing.empty()) result->warnings.push_back("relight: " + being_prepared(preparing));
}

std::vector<std::string> quality_warnings(const Exhibit& exhibit, const std::vector<PlacedObject>& objects,
                                          const Placement& placement, const reconstruct::Scene& scene) {
  std::vector<std::string> lines;
  const Eigen::Vector3f eye_m = scene.pose->T_tag_camera.translation().cast<float>();
  std::size_t i = 0;
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.model || !object.visible) continue;
    const Eigen::AlignedBox3f& box = objects.at(i).bounds.box;
    if (const std::string& why = objects.at(i++).stored->why_simple; !why.empty()) {
      lines.push_back(quoted(object) + " is rendered with fewer triangles: " + why);
    }
    for (const std::string& line : left_out(object)) lines.push_back(line);
    if (const std::string line = simplified(object); !line.empty()) lines.push_back(line);
    if (transmits(objects.at(i - 1))) {
      lines.push_back(
          quoted(object) +
          " is transmissive: shadows keep the light that passes in the mean of all objects, and caustics are "
          "left out; plan.method = rays has both");
    }
    const float voxels = box.sizes().maxCoeff() / placement.cascade[0].w();
    if (voxels < kRelight.min_object_voxels) {
      lines.push_back(quoted(object) + " is " + capture::formatted("%.2g", voxels) +
                      " voxels long, because objects are far apart: its light on nearby surfaces is coarse");
    }
    if (box.contains(eye_m)) {
      lines.push_back("the camera is within the bounds of " + quoted(object) +
                      ": surfaces nearer than 2 cm are not rendered");
    }
    for (const reconstruct::PointLight& lamp : scene.illumination->lights) {
      if (!lamp.distance_known || !box.contains(lamp.position_m)) continue;
      lines.push_back("lamp " + std::to_string(lamp.id) + " is within the bounds of " + quoted(object) +
                      ": shadows of its light are computed from voxels");
    }
  }
  return lines;
}

}  // namespace lumigraft::relight
