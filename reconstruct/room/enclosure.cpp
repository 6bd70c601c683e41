#include "reconstruct/room/enclosure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruct/math/simd4.h"
#include "reconstruct/room/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const RoomParameters::Enclosure& kEnclosure = kRoomParameters.enclosure;

struct Known {
  std::vector<RoomPoint> points;
  std::vector<Vector3f> inside_m;
  Vector3f probe_m;

  float tolerance(const Vector3f& p) const {
    return kEnclosure.plane_tolerance_m + kEnclosure.plane_tolerance_ratio * (p - probe_m).norm();
  }
  bool on(const Enclosure::Side& side, const RoomPoint& p) const {
    return p.normal.dot(side.normal) > kEnclosure.same_plane_cosine &&
           std::abs(side.normal.dot(p.position_m) + side.offset_m) < tolerance(p.position_m);
  }
  bool behind(const Enclosure::Side& side, const Vector3f& p) const {
    return side.normal.dot(p) + side.offset_m < -2 * tolerance(p);
  }
};

/// Fits `side` to the points on it by their mean position and mean normal; returns their number.
std::size_t fit_side(Enclosure::Side& side, const Known& known, const std::vector<bool>& taken) {
  std::size_t count = 0;
  for (int round = 0; round < kEnclosure.fit_rounds; ++round) {
    Vector3f normal = Vector3f::Zero(), middle = Vector3f::Zero();
    count = 0;
    for (std::size_t i = 0; i < known.points.size(); ++i) {
      if (taken[i] || !known.on(side, known.points[i])) continue;
      normal += known.points[i].normal;
      middle += known.points[i].position_m;
      ++count;
    }
    if (count == 0) return 0;
    side.normal = normal.normalized();
    side.offset_m = -side.normal.dot(middle / static_cast<float>(count));
  }
  return count;
}

bool encloses(const Enclosure::Side& side, const Known& known) {
  if (std::any_of(known.inside_m.begin(), known.inside_m.end(),
                  [&](const Vector3f& p) { return known.behind(side, p); })) {
    return false;
  }
  const auto behind = std::count_if(known.points.begin(), known.points.end(),
                                    [&](const RoomPoint& p) { return known.behind(side, p.position_m); });
  return static_cast<float>(behind) <= kEnclosure.max_fraction_behind * static_cast<float>(known.points.size());
}

/// Planes with many points and almost none behind them, largest first.
std::vector<Enclosure::Side> measured_sides(const Known& known) {
  std::vector<Enclosure::Side> sides;
  std::vector<bool> taken(known.points.size(), false);
  const std::size_t step = std::max<std::size_t>(known.points.size() / kEnclosure.seeds, 1);
  while (sides.size() < kMaxSides / 2) {
    Enclosure::Side best;
    std::size_t best_count = 0;
    for (std::size_t seed = 0; seed < known.points.size(); seed += step) {
      const RoomPoint& p = known.points[seed];
      const bool skip = taken[seed] || std::any_of(sides.begin(), sides.end(), [&](const Enclosure::Side& s) {
                          return s.normal.dot(p.normal) > kEnclosure.other_side_cosine;
                        });
      if (skip) continue;
      Enclosure::Side side{p.normal, -p.normal.dot(p.position_m), true};
      const std::size_t count = fit_side(side, known, taken);
      if (count > best_count && encloses(side, known)) {
        best = side;
        best_count = count;
      }
    }
    if (static_cast<float>(best_count) < kEnclosure.min_fraction_on_side * static_cast<float>(known.points.size()))
      break;
    for (std::size_t i = 0; i < known.points.size(); ++i) taken[i] = taken[i] || known.on(best, known.points[i]);
    sides.push_back(best);
  }
  return sides;
}

/// Orthogonal axes: the largest side's normal, the next normal that is nearly orthogonal to it, and their product.
std::array<Vector3f, 3> axes_of(const std::vector<Enclosure::Side>& sides) {
  const Vector3f x = sides.front().normal;
  Vector3f y = x.unitOrthogonal();
  for (const Enclosure::Side& side : sides) {
    if (std::abs(side.normal.dot(x)) > 0.5f) continue;
    y = (side.normal - side.normal.dot(x) * x).normalized();
    break;
  }
  return {x, y, x.cross(y)};
}

/// A side orthogonal to `outward`, through a lamp mounted in it or beyond everything known.
Enclosure::Side guess_side(const Vector3f& outward, const Known& known, const Illumination& light) {
  std::vector<float> reach;
  for (const RoomPoint& p : known.points) reach.push_back(outward.dot(p.position_m));
  const auto nearly_all =
      reach.end() - 1 - static_cast<std::ptrdiff_t>(kEnclosure.max_fraction_behind * static_cast<float>(reach.size()));
  std::nth_element(reach.begin(), nearly_all, reach.end());
  float farthest = *nearly_all, lamp_at = -1e9f;
  for (const Vector3f& p : known.inside_m) farthest = std::max(farthest, outward.dot(p));
  for (const PointLight& lamp : light.lights) {
    const bool mounted = lamp.distance_known && lamp.flat && lamp.normal.dot(outward) < -kEnclosure.lamp_on_side_cosine;
    if (mounted) lamp_at = std::max(lamp_at, outward.dot(lamp.position_m));
  }
  if (lamp_at >= farthest - kEnclosure.plane_tolerance_m) return {-outward, lamp_at, true};
  return {-outward, farthest + kEnclosure.guess_ratio * (farthest - outward.dot(known.probe_m)), false};
}

}  // namespace

std::optional<Enclosure::Exit> Enclosure::leave(const Vector3f& from_m, const Vector3f& direction) const {
  std::optional<Exit> exit;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const float fall = -sides[i].normal.dot(direction);
    if (fall < 1e-4f) continue;
    const float distance_m = std::max(sides[i].normal.dot(from_m) + sides[i].offset_m, 0.0f) / fall;
    if (!exit || distance_m < exit->distance_m) exit = Exit{distance_m, i};
  }
  return exit;
}

std::vector<RoomPoint> room_points(const DistanceField& field) {
  constexpr int half = kBrickEdge / 2;
  constexpr Simd4 kAlong = {0, 1, 2, 3};
  const float per_voxel = 1 / field.voxel_m;
  std::vector<RoomPoint> points;
  for (const BrickKey& key : sorted_keys(field.bricks)) {
    const FieldBrick& brick = *field.bricks.at(key);
    for (int eighth = 0; eighth < 8; ++eighth) {
      const Eigen::Vector3i corner = half * Eigen::Vector3i(eighth & 1, eighth >> 1 & 1, eighth >> 2);
      Simd4 weights{}, sum_x{}, sum_y{}, sum_z{};
      for (int row = 0; row < half * half; ++row) {
        const int y = corner.y() + row % half, z = corner.z() + row / half;
        const auto k = static_cast<std::size_t>(corner.x() + kBrickEdge * (y + kBrickEdge * z));
        const Simd4 near = 1 - abs(load(&brick.distance_m[k])) * per_voxel;
        const Simd4 weight = select((load(&brick.weight[k]) > 0) & (near > 0), near, Simd4{});
        weights += weight;
        sum_x += weight * kAlong;
        sum_y += weight * static_cast<float>(y);
        sum_z += weight * static_cast<float>(z);
      }
      const float sum = sum_of(weights);
      if (sum == 0) continue;
      const Vector3f middle(static_cast<float>(corner.x()) + sum_of(sum_x) / sum, sum_of(sum_y) / sum,
                            sum_of(sum_z) / sum);
      const Vector3f position_m = field.voxel_m * (first_voxel(key).cast<float>() + middle);
      if (const auto normal = field.normal(position_m)) points.push_back({position_m, *normal});
    }
  }
  if (!field.coarse) return points;
  for (const RoomPoint& far : room_points(*field.coarse))
    if (!field.has_brick_at(far.position_m)) points.push_back(far);
  return points;
}

std::optional<Enclosure> close_room(const std::vector<RoomPoint>& points, const Illumination& light,
                                    const std::vector<Vector3f>& inside_m) {
  if (points.size() < kEnclosure.min_points) return std::nullopt;
  Known known{{}, inside_m, light.probe_position_m};
  const std::size_t step = (points.size() + kEnclosure.max_points - 1) / kEnclosure.max_points;
  for (std::size_t i = 0; i < points.size(); i += step) known.points.push_back(points[i]);
  known.inside_m.push_back(light.probe_position_m);
  for (const PointLight& lamp : light.lights) {
    if (lamp.distance_known) known.inside_m.push_back(lamp.position_m);
  }

  Enclosure room;
  room.sides = measured_sides(known);
  if (room.sides.empty()) return std::nullopt;
  const std::array<Vector3f, 3> axes = axes_of(room.sides);
  std::vector<Enclosure::Side> others;
  for (int i = 0; i < 6; ++i) {
    const Vector3f outward = (i % 2 ? -1.0f : 1.0f) * axes[static_cast<std::size_t>(i / 2)];
    const bool closed = std::any_of(room.sides.begin(), room.sides.end(), [&](const Enclosure::Side& s) {
      return s.normal.dot(outward) < -kEnclosure.covers_cosine;
    });
    if (!closed) others.push_back(guess_side(outward, known, light));
  }
  std::stable_partition(others.begin(), others.end(), [](const Enclosure::Side& s) { return s.measured; });
  room.sides.insert(room.sides.end(), others.begin(), others.end());

  room.middle_m = known.probe_m;
  for (const Vector3f& axis : axes) {
    const auto ahead = room.leave(room.middle_m, axis), back = room.leave(room.middle_m, -axis);
    if (ahead && back) room.middle_m += 0.5f * (ahead->distance_m - back->distance_m) * axis;
  }
  return room;
}

std::shared_ptr<const Enclosure> EnclosureStage::close(const DistanceField& field, const std::vector<RoomPoint>& points,
                                                       const Illumination& light) {
  const std::optional<Enclosure> now = close_room(points, light, field.seen_from_m);
  const auto stays = [&](const Enclosure::Side& a, const Enclosure::Side& b) {
    const float half_m = b.normal.dot(last_->middle_m) + b.offset_m;
    return a.measured == b.measured && a.normal.dot(b.normal) > kEnclosure.same_normal_cosine &&
           std::abs(a.offset_m - b.offset_m) <
               (a.measured ? kEnclosure.same_offset_m : kEnclosure.same_guess_ratio * half_m);
  };
  const bool same =
      now && last_ && std::equal(now->sides.begin(), now->sides.end(), last_->sides.begin(), last_->sides.end(), stays);
  if (!same) last_ = now ? std::make_shared<const Enclosure>(*now) : nullptr;
  return last_;
}

}  // namespace lumigraft::reconstruct
