#include "reconstruct/shading/surface_samples.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const ShadingParameters::Samples& kSamples = kShadingParameters.samples;
constexpr const ShadingParameters::TagPaper& kPaper = kShadingParameters.tag_paper;

/// Level of a cell's size: far surface is measured more coarsely and matters less.
int level_at(const Eigen::Vector3f& position) {
  const float squared = position.squaredNorm();
  return squared < kSamples.finest_m2 ? 0 : squared < kSamples.fine_m2 ? 1 : 2;
}

std::vector<SurfacePoint> surface_points(const DistanceField& field, const FieldRays& rays, const MetalMask& metal) {
  std::vector<SurfacePoint> points;
  for (const BrickKey& key : sorted_keys(field.bricks)) {
    const std::vector<SurfacePoint> own = points_in(field, key, rays, metal);
    points.insert(points.end(), own.begin(), own.end());
  }
  return points;
}

bool on_paper(const Eigen::Vector3f& p, double print_edge_m, float margin_m) {
  const float reach_m = static_cast<float>(0.5 * print_edge_m) + margin_m;
  return print_edge_m > 0 && std::abs(p.x()) < reach_m && std::abs(p.y()) < reach_m &&
         std::abs(p.z()) < kPaper.thickness_m + margin_m;
}

}  // namespace

bool on_surface(const FieldBrick& brick, int index, float voxel_m) {
  const float distance = brick.distance_m[index];
  // Half a voxel either way: one layer of voxels on an axis-aligned plane.
  return brick.weight[index] > 0 && brick.radiance_weight(static_cast<std::size_t>(index)) > 0 &&
         distance <= 0.5f * voxel_m && distance > -0.5f * voxel_m;
}

std::vector<SurfacePoint> points_in(const DistanceField& field, const BrickKey& key, const FieldRays& rays,
                                    const MetalMask& metal) {
  std::vector<SurfacePoint> points;
  const FieldBrick& brick = *field.brick(key);
  if (!brick.color) return points;
  for (int index = 0; index < kBrickVoxels; ++index) {
    if (!on_surface(brick, index, field.voxel_m)) continue;
    const Eigen::Vector3i voxel = voxel_in(key, index);
    SurfacePoint point;
    point.normal = rays.normal_at(voxel);
    if (point.normal.isZero()) continue;
    point.brick = key;
    point.index = index;
    point.position = voxel.cast<float>() * field.voxel_m - brick.distance_m[index] * point.normal;
    point.radiance = brick.radiance(static_cast<std::size_t>(index));
    if (!point.radiance.allFinite() || point.radiance.minCoeff() < 0) continue;
    point.weight = brick.weight[index];
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
  // A slope of light over the patch is not texture: the variance that it explains does not count.
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second_moments = Eigen::Matrix3d::Identity() * 1e-8;
  for (const int i : members) {
    const Eigen::Vector3d off = (points[i].position - middle).cast<double>();
    along += off * (std::log(std::max(points[i].radiance.mean(), 1e-6f)) - log_sum / count) / count;
    second_moments += off * off.transpose() / count;
  }
  const double explained = members.size() < kSamples.min_slope_points ? 0 : along.dot(second_moments.inverse() * along);
  const double variance = log_squares / count - std::pow(log_sum / count, 2);
  sample.spread = static_cast<float>(std::sqrt(std::max(0.0, variance)));
  sample.texture = static_cast<float>(std::sqrt(std::max(0.0, variance - explained)));
  sample.usable = normal.norm() > kSamples.min_normal_length * count;
  const int nearest = *std::min_element(members.begin(), members.end(), [&](int a, int b) {
    return (points[a].position - middle).squaredNorm() < (points[b].position - middle).squaredNorm();
  });
  sample.position = points[nearest].position;
  sample.normal = normal.norm() > 0 ? normal.normalized().eval() : points[nearest].normal;
  return sample;
}

std::vector<std::vector<int>> neighbours(const std::vector<SurfaceSample>& samples) {
  std::vector<std::vector<int>> result(samples.size());
  std::vector<std::pair<float, int>> near;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    near.clear();
    const float reach = kSamples.neighbour_reach * samples[i].size_m;
    for (std::size_t j = 0; j < samples.size(); ++j) {
      const float squared = (samples[i].position - samples[j].position).squaredNorm();
      if (i == j || squared > reach * reach) continue;
      if (samples[i].normal.dot(samples[j].normal) < kSamples.same_orientation) continue;
      near.emplace_back(squared, static_cast<int>(j));
    }
    const auto count = std::min<std::ptrdiff_t>(kSamples.neighbours, static_cast<std::ptrdiff_t>(near.size()));
    std::partial_sort(near.begin(), near.begin() + count, near.end());
    for (std::ptrdiff_t k = 0; k < count; ++k) result[i].push_back(near[static_cast<std::size_t>(k)].second);
  }
  return result;
}

bool on_tag_print(const SurfaceSample& sample, double print_edge_m) {
  return on_paper(sample.position, print_edge_m, 0.5f * sample.size_m);
}

std::optional<SurfaceSample> tag_paper(const std::vector<SurfacePoint>& points, double print_edge_m) {
  std::vector<int> print;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (on_paper(points[i].position, print_edge_m, 0) && points[i].normal.z() > kPaper.min_normal_z)
      print.push_back(static_cast<int>(i));
  }
  if (print.size() < kPaper.min_points) return std::nullopt;
  const auto radiance_sum = [&](int i) { return points[static_cast<std::size_t>(i)].radiance.sum(); };
  std::sort(print.begin(), print.end(), [&](int a, int b) {
    const float la = radiance_sum(a), lb = radiance_sum(b);
    return la != lb ? la > lb : a < b;
  });
  const auto first = print.begin() + static_cast<std::ptrdiff_t>(print.size() / kPaper.first_rank);
  const auto last = print.begin() + static_cast<std::ptrdiff_t>(print.size() / kPaper.last_rank);
  const auto black = print.end() - 1 - static_cast<std::ptrdiff_t>(print.size() / kPaper.black_rank);
  if (radiance_sum(*black) > kPaper.max_black_ratio * radiance_sum(*last)) return std::nullopt;
  const auto still_white = print.begin() + static_cast<std::ptrdiff_t>(print.size() * kPaper.check_20ths / 20);
  if (radiance_sum(*still_white) < kPaper.min_white_ratio * radiance_sum(*last)) return std::nullopt;
  SurfaceSample paper = patch(points, std::vector<int>(first, last), {}, 0);
  paper.position = Eigen::Vector3f::Zero();
  paper.normal = Eigen::Vector3f::UnitZ();
  paper.usable = true;
  return paper;
}

Surface find_surface(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, int max_samples,
                     float min_cell_m) {
  Surface surface;
  surface.points = surface_points(field, rays, metal);
  surface.sample_m = std::max(kSamples.min_cell_voxels * field.voxel_m, min_cell_m);
  std::map<SampleCell, std::vector<int>> cells;
  for (;;) {
    cells.clear();
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
      if (!surface.points[i].metal) cells[cell_of(surface.points[i], surface.sample_m)].push_back(static_cast<int>(i));
    }
    if (static_cast<int>(cells.size()) <= max_samples) break;
    // The number of cells on surfaces is proportional to 1/edge².
    surface.sample_m *= std::max(kSamples.min_cell_growth, std::sqrt(static_cast<float>(cells.size()) / max_samples));
  }
  for (const auto& [key, members] : cells) {
    for (const int i : members) surface.points[i].sample = static_cast<int>(surface.samples.size());
    surface.samples.push_back(patch(surface.points, members, key, surface.sample_m));
    surface.cells.push_back(key);
  }
  return surface;
}

}  // namespace lumigraft::reconstruct
