#include "reconstruct/room/enclosure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kLeastPoints = 100;                   // of all, for a room to be worth closing
constexpr std::size_t kMostPoints = 4000;                   // looked at
constexpr std::size_t kSeeds = 160;                         // tried as a side's place
constexpr float kOnSide_m = 0.025f, kOnSideShare = 0.005f;  // so far from the plane, and by so much of the way to it
constexpr float kAlike = 0.95f;                             // cosine of the normals of points on the same side
constexpr float kApart = 0.85f;                             // and of different sides, at most
constexpr float kLeastShare = 0.03f;                        // of the points, on a side
constexpr float kMostBehind = 0.01f;                        // of the points, behind a side
constexpr float kFacing = 0.75f;                            // cosine: a side stands for the directions around its own
constexpr float kStraight = 0.94f;                          // cosine: a lamp shines straight away from a side
constexpr float kGuess = 0.5f;                              // of the way to the farthest thing known, beyond it
constexpr float kSame_m = 0.02f, kSameCosine = 0.9995f;     // moved by noise
constexpr float kSameGuess = 0.1f;                          // of the room's half: a guess may be off as far

struct Known {
  std::vector<RoomPoint> points;
  std::vector<Vector3f> inside_m;
  Vector3f from_m;  // the fish-eye

  float tolerance(const Vector3f& p) const { return kOnSide_m + kOnSideShare * (p - from_m).norm(); }
  bool on(const Enclosure::Side& side, const RoomPoint& p) const {
    return p.normal.dot(side.normal) > kAlike &&
           std::abs(side.normal.dot(p.position_m) + side.offset_m) < tolerance(p.position_m);
  }
  bool behind(const Enclosure::Side& side, const Vector3f& p) const {
    return side.normal.dot(p) + side.offset_m < -2 * tolerance(p);
  }
};

/// The plane through the points on `side`, by their mean place and mean normal.
std::size_t settle(Enclosure::Side& side, const Known& known, const std::vector<bool>& taken) {
  std::size_t count = 0;
  for (int round = 0; round < 3; ++round) {
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
  return static_cast<float>(behind) <= kMostBehind * static_cast<float>(known.points.size());
}

/// Largest first.
std::vector<Enclosure::Side> measured_sides(const Known& known) {
  std::vector<Enclosure::Side> sides;
  std::vector<bool> taken(known.points.size(), false);
  const std::size_t step = std::max<std::size_t>(known.points.size() / kSeeds, 1);
  while (sides.size() < kMostSides / 2) {
    Enclosure::Side best;
    std::size_t most = 0;
    for (std::size_t seed = 0; seed < known.points.size(); seed += step) {
      const RoomPoint& p = known.points[seed];
      const bool told = taken[seed] || std::any_of(sides.begin(), sides.end(), [&](const Enclosure::Side& s) {
                          return s.normal.dot(p.normal) > kApart;
                        });
      if (told) continue;
      Enclosure::Side side{p.normal, -p.normal.dot(p.position_m), true};
      const std::size_t count = settle(side, known, taken);
      if (count > most && encloses(side, known)) {
        best = side;
        most = count;
      }
    }
    if (static_cast<float>(most) < kLeastShare * static_cast<float>(known.points.size())) break;
    for (std::size_t i = 0; i < known.points.size(); ++i) taken[i] = taken[i] || known.on(best, known.points[i]);
    sides.push_back(best);
  }
  return sides;
}

/// Three axes at right angles: the largest side's normal, the next one's that stands on it, and the third.
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

/// A side across `outward`, beyond everything known.
Enclosure::Side beyond(const Vector3f& outward, const Known& known, const Illumination& light) {
  std::vector<float> reach;
  for (const RoomPoint& p : known.points) reach.push_back(outward.dot(p.position_m));
  const auto nearly_all = reach.end() - 1 - static_cast<std::ptrdiff_t>(kMostBehind * static_cast<float>(reach.size()));
  std::nth_element(reach.begin(), nearly_all, reach.end());
  float farthest = *nearly_all, lamp_at = -1e9f;
  for (const Vector3f& p : known.inside_m) farthest = std::max(farthest, outward.dot(p));
  for (const PointLight& lamp : light.lights) {
    const bool straight = lamp.distance_known && lamp.flat && lamp.normal.dot(outward) < -kStraight;
    if (straight) lamp_at = std::max(lamp_at, outward.dot(lamp.position_m));
  }
  if (lamp_at >= farthest - kOnSide_m) return {-outward, lamp_at, true};
  return {-outward, farthest + kGuess * (farthest - outward.dot(known.from_m)), false};
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
  std::vector<BrickKey> keys;
  keys.reserve(field.bricks.size());
  for (const auto& [key, brick] : field.bricks) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  constexpr int half = kBrickEdge / 2;
  constexpr Simd4 kAlong = {0, 1, 2, 3};
  const float per_voxel = 1 / field.voxel_m;
  std::vector<RoomPoint> points;
  for (const BrickKey& key : keys) {
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
      const float whole = sum_of(weights);
      if (whole == 0) continue;
      const Vector3f middle(static_cast<float>(corner.x()) + sum_of(sum_x) / whole, sum_of(sum_y) / whole,
                            sum_of(sum_z) / whole);
      const Vector3f place_m =
          field.voxel_m * (kBrickEdge * Eigen::Vector3i(key[0], key[1], key[2]).cast<float>() + middle);
      if (const auto normal = field.normal(place_m)) points.push_back({place_m, *normal});
    }
  }
  return points;
}

std::optional<Enclosure> close_room(const std::vector<RoomPoint>& points, const Illumination& light,
                                    const std::vector<Vector3f>& inside_m) {
  if (points.size() < kLeastPoints) return std::nullopt;
  Known known{{}, inside_m, light.probe_position_m};
  const std::size_t step = (points.size() + kMostPoints - 1) / kMostPoints;
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
    const bool closed = std::any_of(room.sides.begin(), room.sides.end(),
                                    [&](const Enclosure::Side& s) { return s.normal.dot(outward) < -kFacing; });
    if (!closed) others.push_back(beyond(outward, known, light));
  }
  std::stable_partition(others.begin(), others.end(), [](const Enclosure::Side& s) { return s.measured; });
  room.sides.insert(room.sides.end(), others.begin(), others.end());

  room.middle_m = known.from_m;
  for (const Vector3f& axis : axes) {
    const auto ahead = room.leave(room.middle_m, axis), back = room.leave(room.middle_m, -axis);
    if (ahead && back) room.middle_m += 0.5f * (ahead->distance_m - back->distance_m) * axis;
  }
  return room;
}

std::shared_ptr<const Enclosure> EnclosureStage::close(const DistanceField& field, const Illumination& light) {
  return close(field, room_points(field), light);
}

std::shared_ptr<const Enclosure> EnclosureStage::close(const DistanceField& field, const std::vector<RoomPoint>& points,
                                                       const Illumination& light) {
  const std::optional<Enclosure> now = close_room(points, light, field.seen_from_m);
  const auto stays = [&](const Enclosure::Side& a, const Enclosure::Side& b) {
    const float half_m = b.normal.dot(last_->middle_m) + b.offset_m;
    return a.measured == b.measured && a.normal.dot(b.normal) > kSameCosine &&
           std::abs(a.offset_m - b.offset_m) < (a.measured ? kSame_m : kSameGuess * half_m);
  };
  const bool same =
      now && last_ && std::equal(now->sides.begin(), now->sides.end(), last_->sides.begin(), last_->sides.end(), stays);
  if (!same) last_ = now ? std::make_shared<const Enclosure>(*now) : nullptr;
  return last_;
}

}  // namespace lumigraft::reconstruct
