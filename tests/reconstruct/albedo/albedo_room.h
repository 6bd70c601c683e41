#pragma once
// A synthetic room whose distances and radiance are known in closed form, for tests of albedo.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

constexpr float kTestPi = std::numbers::pi_v<float>;

struct TestBox {
  Eigen::Vector3f low, high;

  /// Positive outside (an upper bound past edges, exact at faces), negative inside.
  float distance(const Eigen::Vector3f& p) const {
    const Eigen::Vector3f centre = 0.5f * (low + high), half = 0.5f * (high - low);
    const Eigen::Vector3f q = (p - centre).cwiseAbs() - half;
    return q.cwiseMax(0.0f).norm() + std::min(q.maxCoeff(), 0.0f);
  }
  bool blocks(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const {
    float enter = 0, leave = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const float way = to[axis] - from[axis];
      const float a = (low[axis] - from[axis]) / way, b = (high[axis] - from[axis]) / way;
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter < leave;
  }
  /// Distance along a ray from outside, unit direction, to the surface; infinity if it passes by.
  float along(const Eigen::Vector3f& from, const Eigen::Vector3f& direction) const {
    constexpr float kNone = std::numeric_limits<float>::infinity();
    float enter = 0, leave = kNone;
    for (int axis = 0; axis < 3; ++axis) {
      const float a = low[axis] - from[axis], b = high[axis] - from[axis], step = direction[axis];
      if (step == 0 && (a > 0 || b < 0)) return kNone;
      if (step == 0) continue;
      enter = std::max(enter, std::min(a / step, b / step));
      leave = std::min(leave, std::max(a / step, b / step));
    }
    return enter < leave ? enter : kNone;
  }
};

struct TestLamp {
  Eigen::Vector3f position, intensity;  ///< intensity: along the normal if flat
  float radius = 0.05f;
  bool flat = false;
  Eigen::Vector3f normal = -Eigen::Vector3f::UnitZ();
  float focus = 1;  ///< if flat: exponent of the cosine of its emission

  bool panel() const { return flat && focus == 1; }
  /// Irradiance without occlusion: of a panel from all of its disk, else from the centre.
  Eigen::Vector3f irradiance(const Eigen::Vector3f& point, const Eigen::Vector3f& n) const {
    const int points = panel() ? 16 : 1;
    const Eigen::Vector3f x = normal.unitOrthogonal(), y = normal.cross(x);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int i = 0; i < points; ++i) {
      const float r = panel() ? radius * std::sqrt((i + 0.5f) / points) : 0, phi = 2.39996323f * i;
      const Eigen::Vector3f way = position + r * (std::cos(phi) * x + std::sin(phi) * y) - point,
                            direction = way.normalized();
      const float emission = flat ? std::pow(std::max(0.0f, -normal.dot(direction)), focus) : 1.0f;
      sum += std::max(0.0f, n.dot(direction)) * emission / (points * way.squaredNorm()) * intensity;
    }
    return sum;
  }
  /// Of the disk with its solid angle.
  float angular_radius_rad(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f way = point - position;
    if (!panel()) return std::asin(radius / way.norm());
    const float squared = radius * radius * normal.dot(way.normalized()) / way.squaredNorm();
    return std::acos(1 - squared / 2);
  }
};

/// A floor z = 0 within a square, boxes on it, point lamps, and uniform ambient light without occlusion. Few and dark
/// boxes, or little ambient light, keep the error small.
struct TestRoom {
  float half_m = 0.6f;
  std::vector<TestBox> boxes;
  std::vector<TestLamp> lamps;
  Eigen::Vector3f ambient = Eigen::Vector3f::Zero();  ///< radiance
  Eigen::Vector3f probe{-0.2f, 0.05f, 0.03f};
  std::function<Eigen::Vector3f(const Eigen::Vector3f&)> albedo = [](const Eigen::Vector3f&) {
    return Eigen::Vector3f(0.5f, 0.4f, 0.3f);
  };
  std::function<bool(const Eigen::Vector3f&)> seen = [](const Eigen::Vector3f&) { return true; };

  float distance(const Eigen::Vector3f& p) const {
    float d = p.z();
    for (const TestBox& box : boxes) d = std::min(d, box.distance(p));
    return d;
  }
  /// Distance along a ray of unit direction to the first surface; infinity if there is none.
  float along(const Eigen::Vector3f& from, const Eigen::Vector3f& direction) const {
    float nearest = direction.z() < 0 ? -from.z() / direction.z() : std::numeric_limits<float>::infinity();
    for (const TestBox& box : boxes) nearest = std::min(nearest, box.along(from, direction));
    return nearest;
  }
  Eigen::Vector3f normal(const Eigen::Vector3f& p) const {
    constexpr float h = 1e-3f;
    Eigen::Vector3f g;
    for (int i = 0; i < 3; ++i) {
      g[i] = distance(p + h * Eigen::Vector3f::Unit(i)) - distance(p - h * Eigen::Vector3f::Unit(i));
    }
    return g.normalized();
  }
  bool lit(const TestLamp& lamp, const Eigen::Vector3f& p, const Eigen::Vector3f& n) const {
    return std::none_of(boxes.begin(), boxes.end(),
                        [&](const TestBox& box) { return box.blocks(p + 1e-3f * n, lamp.position); });
  }
  Eigen::Vector3f irradiance(const Eigen::Vector3f& p, const Eigen::Vector3f& n) const {
    Eigen::Vector3f sum = kTestPi * ambient;
    for (const TestLamp& lamp : lamps) {
      if (lit(lamp, p, n)) sum += lamp.irradiance(p, n);
    }
    return sum;
  }

  DistanceField field() const {
    DistanceField field;
    field.version = 1;
    const int reach = static_cast<int>(std::ceil(half_m / (8 * field.voxel_m)));
    for (int a = -reach; a < reach; ++a) {
      for (int b = -reach; b < reach; ++b) {
        for (int c = -1; c < 10; ++c) {
          auto brick = std::make_shared<FieldBrick>();
          BrickColor& color = brick->own_color();
          bool any = false;
          for (int i = 0; i < kBrickVoxels; ++i) {
            const Eigen::Vector3f p =
                field.voxel_m * Eigen::Vector3f(8.0f * a + (i & 7), 8.0f * b + ((i >> 3) & 7), 8.0f * c + (i >> 6));
            const float d = distance(p);
            if (std::abs(d) > field.truncation_m || !seen(p)) continue;
            any = true;
            brick->distance_m[i] = d;
            brick->weight[i] = 1;
            const Eigen::Vector3f n = normal(p), on = p - d * n;
            color.radiance[i] = albedo(on).cwiseProduct(irradiance(on, n)) / kTestPi;
            color.weight[i] = 1;
          }
          if (any) field.bricks[{a, b, c}] = brick;
        }
      }
    }
    return field;
  }

  /// The result of a perfect fish-eye at the probe: lamps without distances.
  Illumination illumination() const {
    Illumination result;
    result.version = 1;
    result.probe_position_m = probe;
    for (const TestLamp& lamp : lamps) {
      PointLight light;
      light.id = static_cast<int>(result.lights.size());
      const Eigen::Vector3f way = lamp.position - probe;
      light.direction = way.normalized();
      light.irradiance = lamp.irradiance(probe, light.direction);
      light.angular_radius_rad = lamp.angular_radius_rad(probe);
      light.squareness = lamp.flat ? 0.43f : 0.0f;
      result.lights.push_back(light);
    }
    result.environment.radiance = capture::Image<float>(128, 64, 3);
    for (std::size_t i = 0; i < result.environment.radiance.data.size(); ++i) {
      result.environment.radiance.data[i] = ambient[static_cast<Eigen::Index>(i % 3)];
    }
    result.environment_sh.fill(Eigen::Vector3f::Zero());
    result.environment_sh[0] = ambient * std::sqrt(4 * kTestPi);
    return result;
  }
};

/// Albedo and sigma at a point's nearest voxel; sigma -1 if there is no brick.
template <typename Field>
std::pair<Eigen::Vector3f, float> albedo_at(const Field& field, const Eigen::Vector3f& position) {
  const Eigen::Vector3f rounded = (position / field.voxel_m).array().round();
  const Eigen::Vector3i v = rounded.template cast<int>();
  const auto brick = field.bricks.find({v.x() >> 3, v.y() >> 3, v.z() >> 3});
  if (brick == field.bricks.end()) return {Eigen::Vector3f::Zero(), -1.0f};
  const int i = (v.x() & 7) + 8 * ((v.y() & 7) + 8 * (v.z() & 7));
  return {brick->second->albedo[i], brick->second->sigma[i]};
}

}  // namespace lumigraft::reconstruct
