#include "reconstruct/gloss.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "reconstruct/enclosure.h"
#include "reconstruct/fusion_colour.h"
#include "reconstruct/fusion_pixels.h"

namespace lumigraft {
namespace {

using Eigen::Vector3f;

constexpr float kDegree = std::numbers::pi_v<float> / 180;
// Rings around a lamp's reflection, from the lamp's edge on. Normals of fused surfaces are off by up to 4°.
constexpr std::array kRings = {6 * kDegree, 16 * kDegree, 40 * kDegree};
constexpr std::size_t kFar = kRings.size();                                    // beyond all of them
constexpr int kLeastMiddleViews = 3, kLeastNextViews = 2, kLeastFarViews = 3;  // that tell a ring's brightness
constexpr float kDielectric = 0.04f;  // reflectance of what is polished but no metal
constexpr float kVisible = 0.2f;      // of the brightness beside it: a reflection that is seen
constexpr float kExcess = 0.15f;      // of the brightness far off: what noise and poses may bring
constexpr float kSigmas = 3;
constexpr float kNarrow = 0.1f;  // of the excess in the middle: it does not reach into the next ring
constexpr float kMoved_m = 0.01f, kTurned = 0.015f;  // of the camera: a new view
constexpr float kSamePlace_m = 0.006f;               // of a cell's surface between looks at the field
constexpr float kFacing = 0.25f;                     // least cosine to the camera, and to a lamp
constexpr int kLooksOfAField = 12;                   // until its places are taken anew
constexpr std::size_t kLampTurns = 4;                // of that, until a place is asked anew which lamps shine on it
constexpr int kLooksOfAVerdict = 4;                  // until what was seen is judged again
constexpr float kSmooth = 0.9f;                      // cosine of neighbouring places' normals on one surface
constexpr float kSameColour = 0.12f;                 // of the albedo of one: between neighbours
constexpr float kSameLight = 0.1f;                   // of its sum: brightnesses can be compared

struct Ring {
  float sum = 0, squares = 0, least = 1e30f, most = 0;
  int views = 0;

  void add(float brightness) {
    ++views;
    sum += brightness;
    squares += brightness * brightness;
    least = std::min(least, brightness);
    most = std::max(most, brightness);
  }
  float mean() const { return views > 0 ? sum / static_cast<float>(views) : 0; }
  float sigma() const {
    if (views < 2) return 0;
    return std::sqrt(std::max(0.0f, squares / static_cast<float>(views) - mean() * mean()));
  }
};

struct Cell {
  BrickKey key;
  Vector3f place_m, normal;
  std::array<Ring, kFar + 1> rings;
  std::uint32_t asked = 0, lit = 0;  ///< by lamp: whether it was looked up that it shines here, and whether it does
  std::optional<Vector3f> albedo{};  ///< around it; empty where that is not known
  bool coloured = false;             ///< it was looked up
};

Gloss judge(const Cell& cell) {
  const Ring &middle = cell.rings[0], &next = cell.rings[1], &far = cell.rings[kFar];
  if (far.views < kLeastFarViews) return Gloss::unknown;
  const float beside = far.mean(), noise = std::max(kExcess * beside, kSigmas * far.sigma());
  // A narrow reflection may be missed by all views but one.
  if (std::max(middle.most, next.most) < beside + noise)
    return middle.views >= kLeastMiddleViews ? Gloss::matt : Gloss::unknown;
  const float excess = middle.most - beside;
  if (middle.views == 0 || excess < 2 * noise) return Gloss::unknown;
  const bool narrow = next.views >= kLeastNextViews && next.least < beside + std::max(kNarrow * excess, noise);
  return narrow && excess > 5 * noise ? Gloss::mirror : Gloss::glossy;
}

BrickKey key_of(const Vector3f& position_m, float cell_m) {
  return {static_cast<int>(std::floor(position_m.x() / cell_m)), static_cast<int>(std::floor(position_m.y() / cell_m)),
          static_cast<int>(std::floor(position_m.z() / cell_m))};
}

/// Mean of what is known around a place.
std::optional<Vector3f> albedo_near(const AlbedoField& field, const Vector3f& position_m) {
  Vector3f sum = Vector3f::Zero();
  int count = 0;
  for (int i = 0; i < 27; ++i) {
    const Vector3f way(static_cast<float>(i % 3 - 1), static_cast<float>(i / 3 % 3 - 1), static_cast<float>(i / 9 - 1));
    const Vector3f at = position_m / field.voxel_m + way;
    const std::array voxel = {static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())),
                              static_cast<int>(std::lround(at.z()))};
    const auto brick = field.bricks.find({voxel[0] >> 3, voxel[1] >> 3, voxel[2] >> 3});
    if (brick == field.bricks.end()) continue;
    const auto k =
        static_cast<std::size_t>((voxel[0] & 7) + kBrickEdge * ((voxel[1] & 7) + kBrickEdge * (voxel[2] & 7)));
    if (brick->second->sigma[k] < 0) continue;
    sum += brick->second->albedo[k];
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / static_cast<float>(count);
}

float angle(const Vector3f& a, const Vector3f& b) { return std::acos(std::clamp(a.dot(b), -1.0f, 1.0f)); }

}  // namespace

Gloss GlossField::at(const Vector3f& position_m) const {
  const auto found = cells.find(key_of(position_m, cell_m));
  return found == cells.end() ? Gloss::unknown : found->second;
}

float GlossField::glossy_share() const {
  const auto glossy = std::count_if(cells.begin(), cells.end(), [](const auto& c) { return c.second != Gloss::matt; });
  return surface_cells > 0 ? static_cast<float>(glossy) / static_cast<float>(surface_cells) : 0;
}

float GlossField::known_share() const {
  return surface_cells > 0 ? static_cast<float>(cells.size()) / static_cast<float>(surface_cells) : 0;
}

struct GlossStage::State {
  explicit State(const Session& session) : camera(session.color.model), map(camera), response(session.color.response) {}

  CameraModel camera;
  PixelMap map;
  Response response;
  std::vector<Cell> cells;
  std::unordered_map<BrickKey, std::size_t, BrickKeyHash> places;  ///< in `cells`
  std::vector<Gloss> verdicts;                                     ///< by cell, as last published, before they spread
  float cell_m = 0.032f;
  std::uint64_t field_version = 0;
  std::uint64_t albedo_version = 0;  ///< one more than its own; 0 = none
  std::size_t turn = 0;              ///< of taking places
  int looks = 0, seen = 0;
  std::vector<Vector3f> lamps;  ///< places, of those in `asked` and `lit`
  Vector3f light = Vector3f::Zero();
  std::optional<Eigen::Isometry3d> T_tag_camera;
  std::shared_ptr<const GlossField> last;

  bool moved(const Eigen::Isometry3d& now) const {
    return !T_tag_camera || (now.translation() - T_tag_camera->translation()).norm() > kMoved_m ||
           (now.linear() - T_tag_camera->linear()).norm() > kTurned;
  }

  /// Cells of the surface as it is now; what was seen of those that stayed is kept.
  void take_places(const DistanceField& field) {
    cell_m = 4 * field.voxel_m;
    std::vector<Cell> now;
    std::unordered_map<BrickKey, std::size_t, BrickKeyHash> now_at;
    for (const RoomPoint& p : room_points(field)) {
      const BrickKey key = key_of(p.position_m, cell_m);
      if (!now_at.try_emplace(key, now.size()).second) continue;
      const auto before = places.find(key);
      if (before != places.end() && (cells[before->second].place_m - p.position_m).norm() < kSamePlace_m) {
        Cell& kept = now.emplace_back(cells[before->second]);
        kept.normal = p.normal;
        if ((BrickKeyHash{}(key) + turn) % kLampTurns == 0) kept.asked = kept.lit = 0;
      } else {
        now.push_back(Cell{key, p.position_m, p.normal, {}, 0, 0, {}, false});
      }
    }
    cells = std::move(now);
    places = std::move(now_at);
    verdicts.clear();
    ++turn;
    field_version = field.version;
    looks = 0;
  }

  /// Other light makes other brightnesses.
  void follow_light(const Illumination& illumination) {
    Vector3f sum = illumination.remainder_sh[0];
    std::vector<Vector3f> now;
    for (const PointLight& lamp : illumination.lights) {
      sum += lamp.irradiance;
      now.push_back(lamp.distance_known ? lamp.position_m : Vector3f::Zero());
    }
    const bool same = lamps.size() == now.size() &&
                      std::equal(lamps.begin(), lamps.end(), now.begin(), [](const Vector3f& a, const Vector3f& b) {
                        return (a - b).norm() < 0.05f * (1 + a.norm());
                      });
    if ((sum - light).norm() > kSameLight * light.norm()) {
      for (Cell& cell : cells) cell.rings = {};
      light = sum;
    }
    if (same) return;
    lamps = std::move(now);
    for (Cell& cell : cells) cell.asked = cell.lit = 0;
  }

  bool shines_on(Cell& cell, std::size_t lamp, const Vector3f& towards, float distance_m, const DistanceField& field) {
    const std::uint32_t bit = 1u << (lamp % 32);
    if (!(cell.asked & bit)) {
      cell.asked |= bit;
      const Vector3f from = cell.place_m + 2 * field.voxel_m * cell.normal;
      if (!field.raycast(from, towards, 0, distance_m - 0.1f)) cell.lit |= bit;
    }
    return cell.lit & bit;
  }

  /// The ring around the nearest reflection of a lamp that the place would show; empty where none would.
  std::optional<std::size_t> ring(Cell& cell, const Vector3f& to_camera, float brightness,
                                  const Illumination& illumination, const DistanceField& field) {
    const Vector3f mirrored = 2 * cell.normal.dot(to_camera) * cell.normal - to_camera;
    std::optional<std::size_t> nearest;
    for (std::size_t i = 0; i < illumination.lights.size() && i < 32; ++i) {
      const PointLight& lamp = illumination.lights[i];
      if (!lamp.distance_known) continue;
      const Vector3f way = lamp.position_m - cell.place_m;
      const float distance_m = way.norm();
      const Vector3f towards = way / distance_m;
      if (cell.normal.dot(towards) < kFacing) continue;
      const float solid_angle_sr =
          std::numbers::pi_v<float> * lamp.radius_m * lamp.radius_m / (distance_m * distance_m);
      const float radiance =
          lamp.intensity.mean() * lamp.emission(-towards) / (distance_m * distance_m) / std::max(solid_angle_sr, 1e-9f);
      if (kDielectric * radiance < kVisible * brightness) continue;
      if (!shines_on(cell, i, towards, distance_m, field)) continue;
      const float off = std::max(0.0f, angle(mirrored, towards) - std::atan(lamp.radius_m / distance_m));
      const auto at = static_cast<std::size_t>(std::upper_bound(kRings.begin(), kRings.end(), off) - kRings.begin());
      nearest = std::min(nearest.value_or(kFar), at);
    }
    return nearest;
  }

  void see(const FrameSet& frame, const Eigen::Isometry3d& T, const DistanceField& field,
           const Illumination& illumination) {
    const ColourReader colour(frame.color.get(), response, camera.width, camera.height);
    const Image<float>& depth_m = frame.depth->depth_m;
    if (!colour || depth_m.width != camera.width || depth_m.height != camera.height) return;
    const Eigen::Isometry3f T_camera_tag = T.inverse().cast<float>();
    const Vector3f from = T.translation().cast<float>();
    for (Cell& cell : cells) {
      const Vector3f to_camera = (from - cell.place_m).normalized();
      if (cell.normal.dot(to_camera) < kFacing) continue;
      const Vector3f p = T_camera_tag * cell.place_m;
      if (p.z() < 0.1f) continue;
      const Eigen::Vector2f pixel = map.pixel(p.x() / p.z(), p.y() / p.z());
      constexpr float kRim = 2;
      if (!(pixel.x() >= kRim && pixel.y() >= kRim && pixel.x() <= static_cast<float>(camera.width - 1) - kRim &&
            pixel.y() <= static_cast<float>(camera.height - 1) - kRim))
        continue;
      const auto u = static_cast<int>(pixel.x() + 0.5f), v = static_cast<int>(pixel.y() + 0.5f);
      if (std::abs(depth_m.at(u, v) - p.z()) > 0.01f + 0.01f * p.z()) continue;  // something else stands before it
      float brightness = 0;                                                      // of what is clipped its lower bound
      for (int i = 0; i < 9; ++i) {
        Four radiance{};
        colour.read(static_cast<float>(u + i % 3 - 1), static_cast<float>(v + i / 3 - 1), true, radiance);
        brightness += (radiance[0] + radiance[1] + radiance[2]) / 27;
      }
      const float beside = cell.rings[kFar].views > 0 ? cell.rings[kFar].mean() : brightness;
      if (const auto at = ring(cell, to_camera, beside, illumination, field)) cell.rings[*at].add(brightness);
    }
  }

  /// What a place tells holds for the surface it lies on: as far as neighbours face the same way in the same colour.
  void spread(std::unordered_map<BrickKey, Gloss, BrickKeyHash>& told, const AlbedoField& albedo) {
    const auto colour = [&](Cell& cell) -> const std::optional<Vector3f>& {
      if (!cell.coloured) cell.albedo = albedo_near(albedo, cell.place_m);
      cell.coloured = true;
      return cell.albedo;
    };
    std::vector<BrickKey> front;
    for (const auto& [key, gloss] : told) front.push_back(key);
    std::sort(front.begin(), front.end());  // the same on every run
    while (!front.empty()) {
      std::vector<BrickKey> next;
      for (const BrickKey& key : front) {
        Cell& cell = cells[places.at(key)];
        const auto& own = colour(cell);
        if (!own) continue;
        for (int i = 0; i < 27; ++i) {
          const BrickKey beside{key[0] + i % 3 - 1, key[1] + i / 3 % 3 - 1, key[2] + i / 9 - 1};
          const auto other = places.find(beside);
          if (other == places.end() || told.contains(beside)) continue;
          Cell& its_cell = cells[other->second];
          if (its_cell.normal.dot(cell.normal) < kSmooth) continue;
          const auto& its = colour(its_cell);
          if (!its || (*its - *own).norm() > kSameColour * own->norm()) continue;
          told.emplace(beside, told.at(key));
          next.push_back(beside);
        }
      }
      front = std::move(next);
    }
  }

  void publish(const AlbedoField* albedo) {
    std::vector<Gloss> judged(cells.size());
    std::transform(cells.begin(), cells.end(), judged.begin(), judge);
    const std::uint64_t version = albedo ? albedo->version + 1 : 0;
    if (!cells.empty() && judged == verdicts && version == albedo_version) return;
    verdicts = judged;
    if (version != albedo_version) {
      for (Cell& cell : cells) cell.coloured = false;
      albedo_version = version;
    }
    auto now = std::make_shared<GlossField>();
    now->cell_m = cell_m;
    now->surface_cells = cells.size();
    for (std::size_t i = 0; i < cells.size(); ++i)
      if (judged[i] != Gloss::unknown) now->cells.emplace(cells[i].key, judged[i]);
    if (albedo) spread(now->cells, *albedo);
    if (!last || now->cells != last->cells || now->surface_cells != last->surface_cells) last = std::move(now);
  }
};

GlossStage::GlossStage(const Session& session) : state_(std::make_unique<State>(session)) {}

GlossStage::~GlossStage() = default;

std::shared_ptr<const GlossField> GlossStage::look(const FrameSet& frame, const Pose& pose, const DistanceField& field,
                                                   const Illumination& light, const AlbedoField* albedo) {
  State& s = *state_;
  const bool known =
      std::any_of(light.lights.begin(), light.lights.end(), [](const PointLight& lamp) { return lamp.distance_known; });
  if (!known || !frame.color || !frame.depth || pose.age_ns != 0 || !s.moved(pose.T_tag_camera)) return s.last;
  s.follow_light(light);
  if (s.cells.empty() || (s.field_version != field.version && ++s.looks >= kLooksOfAField)) s.take_places(field);
  s.T_tag_camera = pose.T_tag_camera;
  s.see(frame, pose.T_tag_camera, field, light);
  if (++s.seen % kLooksOfAVerdict == 0) s.publish(albedo);
  return s.last;
}

}  // namespace lumigraft
