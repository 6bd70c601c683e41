#include "reconstruct/shading/surface_samples.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

namespace lumigraft::reconstruct {
namespace {

constexpr float kFinestCellVoxels = 2.0f;
constexpr float kMostOfWhite = 0.6f;    // that a print's ink, blurred, sends back
constexpr float kLeastOfWhite = 0.75f;  // of white: the brighter half of what is told of the print
constexpr float kTagThickness_m = 0.015f;
constexpr std::size_t kLeastSloped = 8;  // points of a patch whose slope of light is looked for
constexpr float kSmooth = 0.95f;         // length of a patch's mean normal

/// Cells double at one and at two metres from the tag: what is far is seen coarsely, and matters less.
int level_at(const Eigen::Vector3f& position) {
  const float squared = position.squaredNorm();
  return squared < 1 ? 0 : squared < 4 ? 1 : 2;
}

std::vector<SurfacePoint> surface_points(const DistanceField& field, const FieldRays& rays, const MetalMask& metal) {
  std::vector<BrickKey> keys;
  for (const auto& [key, brick] : field.bricks) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  std::vector<SurfacePoint> points;
  for (const BrickKey& key : keys) {
    const std::vector<SurfacePoint> own = points_in(field, key, rays, metal);
    points.insert(points.end(), own.begin(), own.end());
  }
  return points;
}

bool on_paper(const Eigen::Vector3f& p, double tag_size_m, float margin_m) {
  // With the white rim, one cell of eight wide.
  const float reach_m = static_cast<float>(0.5 * tag_size_m * 10 / 8) + margin_m;
  return std::abs(p.x()) < reach_m && std::abs(p.y()) < reach_m && std::abs(p.z()) < kTagThickness_m + margin_m;
}

}  // namespace

bool on_surface(const FieldBrick& brick, int index, float voxel_m) {
  const float distance = brick.distance_m[index];
  // Half a voxel either way: on a plane along the axes one layer of voxels.
  return brick.weight[index] > 0 && brick.radiance_weight[index] > 0 && distance <= 0.5f * voxel_m &&
         distance > -0.5f * voxel_m;
}

std::vector<SurfacePoint> points_in(const DistanceField& field, const BrickKey& key, const FieldRays& rays,
                                    const MetalMask& metal) {
  std::vector<SurfacePoint> points;
  const FieldBrick& brick = *field.brick(key);
  for (int index = 0; index < kBrickVoxels; ++index) {
    if (!on_surface(brick, index, field.voxel_m)) continue;
    const Eigen::Vector3i voxel(key[0] * kBrickEdge + (index & 7), key[1] * kBrickEdge + ((index >> 3) & 7),
                                key[2] * kBrickEdge + (index >> 6));
    SurfacePoint point;
    point.normal = rays.normal_at(voxel);
    if (point.normal.isZero()) continue;
    point.brick = key;
    point.index = index;
    point.position = voxel.cast<float>() * field.voxel_m - brick.distance_m[index] * point.normal;
    point.radiance = brick.radiance[index];
    if (!point.radiance.allFinite() || point.radiance.minCoeff() < 0) continue;
    point.metal = metal.contains(point.position);
    points.push_back(point);
  }
  return points;
}

SampleCell cell_of(const SurfacePoint& point, float sample_m) {
  int axis = 0;
  point.normal.cwiseAbs().maxCoeff(&axis);
  const int level = level_at(point.position);
  const Eigen::Vector3f at = (point.position / (sample_m * static_cast<float>(1 << level))).array().floor();
  return {level, int(at.x()), int(at.y()), int(at.z()), 2 * axis + (point.normal[axis] > 0)};
}

SurfaceSample patch(const std::vector<SurfacePoint>& points, const std::vector<int>& members, const SampleCell& cell,
                    float sample_m) {
  SurfaceSample sample;
  sample.size_m = sample_m * static_cast<float>(1 << std::get<0>(cell));
  Eigen::Vector3f middle = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero(), radiance = middle;
  double log_sum = 0, log_squares = 0;
  for (const int i : members) {
    middle += points[i].position;
    normal += points[i].normal;
    radiance += points[i].radiance;
    const double l = std::log(std::max(points[i].radiance.mean(), 1e-6f));
    log_sum += l;
    log_squares += l * l;
  }
  const float count = static_cast<float>(members.size());
  middle /= count;
  sample.radiance = radiance / count;
  // Light that falls off over the patch is no texture: what a slope of it explains does not count.
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  Eigen::Matrix3d places = Eigen::Matrix3d::Identity() * 1e-8;
  for (const int i : members) {
    const Eigen::Vector3d off = (points[i].position - middle).cast<double>();
    along += off * (std::log(std::max(points[i].radiance.mean(), 1e-6f)) - log_sum / count) / count;
    places += off * off.transpose() / count;
  }
  const double explained = members.size() < kLeastSloped ? 0 : along.dot(places.inverse() * along);
  const double variance = log_squares / count - std::pow(log_sum / count, 2);
  sample.spread = static_cast<float>(std::sqrt(std::max(0.0, variance)));
  sample.texture = static_cast<float>(std::sqrt(std::max(0.0, variance - explained)));
  sample.usable = normal.norm() > kSmooth * count;
  const int nearest = *std::min_element(members.begin(), members.end(), [&](int a, int b) {
    return (points[a].position - middle).squaredNorm() < (points[b].position - middle).squaredNorm();
  });
  sample.position = points[nearest].position;
  sample.normal = normal.norm() > 0 ? normal.normalized().eval() : points[nearest].normal;
  return sample;
}

bool on_tag(const SurfaceSample& sample, double tag_size_m) {
  return on_paper(sample.position, tag_size_m, 0.5f * sample.size_m);
}

std::optional<SurfaceSample> tag_paper(const std::vector<SurfacePoint>& points, double tag_size_m) {
  std::vector<int> on_tag;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (on_paper(points[i].position, tag_size_m, 0) && points[i].normal.z() > 0.9f)
      on_tag.push_back(static_cast<int>(i));
  }
  if (on_tag.size() < 40) return std::nullopt;
  // About half of it is white; blur makes most of that grey, and noise lifts the very brightest.
  const auto radiance_sum = [&](int i) { return points[static_cast<std::size_t>(i)].radiance.sum(); };
  std::sort(on_tag.begin(), on_tag.end(), [&](int a, int b) {
    const float la = radiance_sum(a), lb = radiance_sum(b);
    return la != lb ? la > lb : a < b;
  });
  const auto first = on_tag.begin() + static_cast<std::ptrdiff_t>(on_tag.size() / 20);
  const auto last = on_tag.begin() + static_cast<std::ptrdiff_t>(on_tag.size() / 5);
  const auto black = on_tag.end() - 1 - static_cast<std::ptrdiff_t>(on_tag.size() / 10);
  if (radiance_sum(*black) > kMostOfWhite * radiance_sum(*last)) return std::nullopt;  // no print: something covers it
  // White that clips is not fused: then what is left of it is grey.
  const auto third = on_tag.begin() + static_cast<std::ptrdiff_t>(on_tag.size() * 7 / 20);
  if (radiance_sum(*third) < kLeastOfWhite * radiance_sum(*last)) return std::nullopt;
  SurfaceSample paper = patch(points, std::vector<int>(first, last), {}, 0);
  paper.position = Eigen::Vector3f::Zero();
  paper.normal = Eigen::Vector3f::UnitZ();
  paper.usable = true;
  return paper;
}

Surface find_surface(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, int most_samples,
                     float least_m) {
  Surface surface;
  surface.points = surface_points(field, rays, metal);
  surface.sample_m = std::max(kFinestCellVoxels * field.voxel_m, least_m);
  std::map<SampleCell, std::vector<int>> cells;
  for (;;) {
    cells.clear();
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
      if (!surface.points[i].metal) cells[cell_of(surface.points[i], surface.sample_m)].push_back(static_cast<int>(i));
    }
    if (static_cast<int>(cells.size()) <= most_samples) break;
    // Cells on surfaces fall with the square of their edge.
    surface.sample_m *= std::max(1.05f, std::sqrt(static_cast<float>(cells.size()) / most_samples));
  }
  for (const auto& [key, members] : cells) {
    for (const int i : members) surface.points[i].sample = static_cast<int>(surface.samples.size());
    surface.samples.push_back(patch(surface.points, members, key, surface.sample_m));
    surface.cells.push_back(key);
  }
  return surface;
}

}  // namespace lumigraft::reconstruct
