#include "server/bench/work.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "relight/objects/mesh_refine.h"
#include "relight/objects/mesh_simplify.h"
#include "server/bench/resize.h"

namespace lumigraft::server {
namespace {

void resize_picture(WorkCase& work, double factor) {
  server::resize_picture(factor, work.session.color.model, work.frame);
  work.amount = static_cast<double>(work.session.color.model.width) * work.session.color.model.height;
}

/// Subdivides every triangle into four; the shape stays.
std::shared_ptr<const relight::Model> subdivided(const relight::Model& model) {
  auto result = std::make_shared<relight::Model>(model);
  result->indices.clear();
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [entry, is_new] = middles.try_emplace(std::minmax(a, b), result->positions_m.size());
    if (is_new) relight::add_middle(*result, a, b);
    return entry->second;
  };
  for (std::size_t i = 0; i < model.indices.size(); i += 3) {
    const std::uint32_t a = model.indices[i], b = model.indices[i + 1], c = model.indices[i + 2];
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    result->indices.insert(result->indices.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
  }
  for (relight::Model::Part& part : result->parts) {
    part.first_index *= 4;
    part.index_count *= 4;
  }
  return result;
}

std::size_t triangles(const relight::Model& model) { return model.indices.size() / 3; }

double triangles(const relight::Exhibit& exhibit) {
  double sum = 0;
  for (const relight::VirtualObject& object : exhibit.objects) sum += static_cast<double>(triangles(*object.model));
  return sum;
}

/// Multiplies the number of triangles by 4 per step; negative steps divide.
void change_triangles(WorkCase& work, int steps) {
  for (relight::VirtualObject& object : work.exhibit.objects) {
    for (int i = 0; i < steps; ++i) object.model = subdivided(*object.model);
    if (steps < 0) {
      object.model = relight::simplify_model(*object.model, static_cast<int>(triangles(*object.model) >> (-2 * steps)));
    }
  }
  work.amount = triangles(work.exhibit);
}

/// Replaces the strongest lamp by `count` lamps around the exhibit's vertical axis with the same total power.
void spread_lamp(WorkCase& work, int count) {
  auto light = std::make_shared<reconstruct::Illumination>(*work.scene.illumination);
  reconstruct::PointLight lamp = light->lights.front();
  lamp.irradiance /= static_cast<float>(count);
  lamp.intensity /= static_cast<float>(count);
  light->lights.clear();
  const Eigen::Vector3f centre = work.exhibit.objects.front().position_m.cast<float>();
  for (int i = 0; i < count; ++i) {
    const Eigen::Matrix3f turn =
        Eigen::AngleAxisf(2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(count),
                          Eigen::Vector3f::UnitZ())
            .toRotationMatrix();
    reconstruct::PointLight one = lamp;
    one.id = i;
    one.direction = turn * lamp.direction;
    one.normal = turn * lamp.normal;
    one.position_m = centre + turn * (lamp.position_m - centre);
    light->lights.push_back(one);
  }
  work.scene.illumination = std::move(light);
  work.amount = count;
}

/// Radius around the vertical through `centre` that contains all objects.
double reach_m(const relight::Exhibit& exhibit, const Eigen::Vector3d& centre, double time_s) {
  double reach = 0;
  for (const relight::VirtualObject& object : exhibit.objects) {
    const Eigen::Affine3d T_tag_model = object.T_tag_model(time_s);
    for (const Eigen::Vector3f& p : object.model->positions_m) {
      const Eigen::Vector3d at = T_tag_model * p.cast<double>() - centre;
      reach = std::max(reach, at.head<2>().norm());
    }
  }
  return reach;
}

/// side² smaller copies of the exhibit on the same ground, covering about as much of the picture.
void multiply_objects(WorkCase& work, int side) {
  const double time_s = 1e-9 * static_cast<double>(work.frame.time_ns);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const relight::VirtualObject& object : work.exhibit.objects) {
    centre += object.T_tag_model(time_s).translation() / static_cast<double>(work.exhibit.objects.size());
  }
  const double cell_m = 2 * reach_m(work.exhibit, centre, time_s) / side;
  relight::Exhibit copies;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const Eigen::Vector3d middle = centre + cell_m * Eigen::Vector3d(x - 0.5 * (side - 1), y - 0.5 * (side - 1), 0);
      for (relight::VirtualObject object : work.exhibit.objects) {
        const Eigen::Affine3d T_tag_model = object.T_tag_model(time_s);
        object.name += "-" + std::to_string(y * side + x);
        object.position_m = middle + (T_tag_model.translation() - centre) / side;
        object.rotation = Eigen::Quaterniond(T_tag_model.rotation());
        object.scale /= side;
        object.origin_m.setZero();  // the translation has it
        object.motion.clear();
        copies.objects.push_back(std::move(object));
      }
    }
  }
  work.exhibit = std::move(copies);
  work.amount = static_cast<double>(work.exhibit.objects.size());
}

}  // namespace

std::vector<WorkCase> work_cases(const capture::Session& session, const BenchScene& scene,
                                 const relight::Exhibit& exhibit, const relight::Plan& plan) {
  const WorkCase base{"", 0, true, session, scene.frame, scene.scene, exhibit, plan};
  std::vector<WorkCase> cases;
  const auto add = [&](const char* work, bool is_base, const auto& change) {
    cases.push_back(base);
    cases.back().work = work;
    cases.back().base = is_base;
    change(cases.back());
  };
  for (const double factor : {0.5, 1.0, 2.0}) {
    add("pixels", factor == 1.0, [&](WorkCase& work) { resize_picture(work, factor); });
  }
  for (const int steps : {-2, -1, 0, 1}) {
    add("triangles", steps == 0, [&](WorkCase& work) { change_triangles(work, steps); });
  }
  for (const int volume : {32, 64, 128}) {
    add("voxels", volume == plan.volume, [&](WorkCase& work) {
      work.plan.volume = volume;
      work.amount = std::pow(volume, 3);
    });
  }
  if (scene.scene.illumination && !scene.scene.illumination->lights.empty()) {
    for (const int count : {1, 2, 4, 8}) {
      add("lights", false, [&](WorkCase& work) { spread_lamp(work, count); });
    }
  }
  for (const int side : {1, 2, 3}) {
    add("objects", side == 1, [&](WorkCase& work) { multiply_objects(work, side); });
  }
  for (const int bounces : {1, 2, 3, 4}) {
    add("bounces", bounces == plan.bounces, [&](WorkCase& work) {
      work.plan.bounces = bounces;
      work.amount = bounces;
    });
  }
  return cases;
}

}  // namespace lumigraft::server
