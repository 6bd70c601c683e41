#include "reconstruct/fusion.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <vector>

#include "capture/radiance.h"
#include "reconstruct/fusion_depth.h"

namespace lumigraft {
namespace {

// A picture that was fused already brings nothing new until the pose has moved by more than this.
constexpr double kSameTranslation_m = 2e-5;
constexpr double kSameRotation_rad = 2e-5;
// Radiance is kept this far from the surface, in voxels, so that trilinear sampling on the surface has neighbours.
constexpr float kRadianceBand_voxels = 1.5f;
// Rays that allocate bricks are this far apart at the least, as a share of a brick's edge.
constexpr double kAllocationStep = 0.2;

bool same_place(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() < kSameTranslation_m &&
         Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() < kSameRotation_rad;
}

}  // namespace

struct FusionStage::State {
  ColorCamera camera;
  FusionSettings settings;
  DepthRays rays;
  std::unordered_map<BrickKey, std::shared_ptr<FieldBrick>, BrickKeyHash> bricks;
  std::shared_ptr<const DistanceField> published;
  std::uint64_t version = 0;
  std::shared_ptr<const DepthPicture> last_depth;
  std::shared_ptr<const Picture> last_color;
  Eigen::Isometry3d last_pose = Eigen::Isometry3d::Identity();

  State(const Session& session, const FusionSettings& s)
      : camera(session.color), settings(s), rays(session.color.model) {}

  float voxel_m() const { return static_cast<float>(settings.voxel_m); }
  float truncation_m() const { return static_cast<float>(settings.truncation_voxels * settings.voxel_m); }

  bool seen_before(const FrameSet& frame, const Pose& pose) const {
    const auto same_depth = [&] {
      return last_depth && (last_depth == frame.depth || last_depth->depth_m.data == frame.depth->depth_m.data);
    };
    const auto same_color = [&] {
      return last_color && (last_color == frame.color || (last_color->encoded.data == frame.color->encoded.data &&
                                                          last_color->radiance.data == frame.color->radiance.data));
    };
    return published && same_place(pose.T_tag_camera, last_pose) && same_depth() && same_color();
  }

  /// Bricks that the truncation band of any depth pixel touches.
  void allocate(const Image<float>& depth_m, const Eigen::Isometry3f& T_tag_camera) {
    const float brick_m = kBrickEdge * voxel_m();
    const double pixels_a_metre = rays.model().fx;  // at 1 m
    const int stride = std::max(1, static_cast<int>(kAllocationStep * brick_m * pixels_a_metre / 1.5));
    const float step_m = 0.5f * brick_m;
    std::unordered_set<BrickKey, BrickKeyHash> touched;
    BrickKey last{};
    bool any = false;
    for (int v = 0; v < depth_m.height; v += stride) {
      for (int u = 0; u < depth_m.width; u += stride) {
        const float z = depth_m.at(u, v);
        if (z <= 0 || z > settings.far_m) continue;
        const Eigen::Vector3f ray = rays.at(u, v);
        const float length = ray.norm();
        for (float along = -truncation_m(); along <= truncation_m() + 1e-4f;
             along += std::min(step_m, truncation_m())) {
          const Eigen::Vector3f p = T_tag_camera * (ray * (z + along / length));
          // Voxel centres sit on integers, so a brick begins half a voxel before its first centre.
          const Eigen::Vector3f b = ((p.array() / voxel_m() + 0.5f) / kBrickEdge).floor();
          const BrickKey key{static_cast<int>(b.x()), static_cast<int>(b.y()), static_cast<int>(b.z())};
          if (any && key == last) continue;
          last = key;
          any = true;
          touched.insert(key);
        }
      }
    }
    for (const BrickKey& key : touched) {
      auto& brick = bricks[key];
      if (!brick) brick = std::make_shared<FieldBrick>();
    }
  }

  /// One measurement into every voxel of a brick. Returns false where no voxel saw anything.
  bool integrate(const BrickKey& key, std::shared_ptr<FieldBrick>& brick, const DepthMeasurement& depth,
                 const RadiancePicture& color, const Eigen::Isometry3f& T_camera_tag) {
    const float truncation = truncation_m();
    const float cap = static_cast<float>(settings.weight_cap);
    const Eigen::Vector3f step_x = T_camera_tag.linear().col(0) * voxel_m();
    FieldBrick* writable = nullptr;
    for (int z = 0; z < kBrickEdge; ++z) {
      for (int y = 0; y < kBrickEdge; ++y) {
        const Eigen::Vector3f first(static_cast<float>(kBrickEdge * key[0]),
                                    static_cast<float>(kBrickEdge * key[1] + y),
                                    static_cast<float>(kBrickEdge * key[2] + z));
        Eigen::Vector3f p = T_camera_tag * (first * voxel_m());
        for (int x = 0; x < kBrickEdge; ++x, p += step_x) {
          const auto seen = depth.along(p);
          if (!seen || seen->distance_m < -truncation) continue;
          if (writable == nullptr) {
            // A snapshot holds this brick: it stays as it is, and this field goes on with a copy.
            if (brick.use_count() > 1) brick = std::make_shared<FieldBrick>(*brick);
            writable = brick.get();
          }
          const auto i = static_cast<std::size_t>(x + kBrickEdge * (y + kBrickEdge * z));
          const float d = std::min(seen->distance_m, truncation);
          float& weight = writable->weight[i];
          float& distance = writable->distance_m[i];
          distance = (weight * distance + seen->weight * d) / (weight + seen->weight);
          weight = std::min(weight + seen->weight, cap);
          if (std::abs(seen->distance_m) > kRadianceBand_voxels * voxel_m() || !seen->on_surface) continue;
          if (color.clipped.at(seen->u, seen->v) != 0) continue;
          const Eigen::Map<const Eigen::Vector3f> radiance(
              &color.radiance.data[color.radiance.index(seen->u, seen->v)]);
          float& radiance_weight = writable->radiance_weight[i];
          const float w = seen->weight * seen->facing;
          writable->radiance[i] = (radiance_weight * writable->radiance[i] + w * radiance) / (radiance_weight + w);
          radiance_weight = std::min(radiance_weight + w, cap);
        }
      }
    }
    return writable != nullptr;
  }

  bool in_view(const BrickKey& key, const Eigen::Isometry3f& T_camera_tag) const {
    const float brick_m = kBrickEdge * voxel_m();
    const Eigen::Vector3f centre =
        (Eigen::Vector3f(static_cast<float>(key[0]), static_cast<float>(key[1]), static_cast<float>(key[2])).array() +
         0.5f) *
            brick_m -
        0.5f * voxel_m();
    const Eigen::Vector3f p = T_camera_tag * centre;
    const float radius = 0.87f * brick_m;
    return p.z() > -radius && p.z() < settings.far_m + radius + truncation_m() && rays.sees(p, radius);
  }
};

FusionStage::FusionStage(const Session& session, const FusionSettings& settings)
    : state_(std::make_unique<State>(session, settings)) {}
FusionStage::~FusionStage() = default;

std::shared_ptr<const DistanceField> FusionStage::fuse(const FrameSet& frame, const Pose& pose) {
  State& s = *state_;
  // A pose that was carried on without seeing the tag would smear the room.
  if (!frame.depth || !frame.color || pose.age_ns > 0 || s.seen_before(frame, pose)) return s.published;

  const Eigen::Isometry3f T_tag_camera = pose.T_tag_camera.cast<float>();
  const Eigen::Isometry3f T_camera_tag = pose.T_tag_camera.inverse().cast<float>();
  const RadiancePicture color = to_radiance(*frame.color, s.camera.response);
  const DepthMeasurement depth(frame.depth->depth_m, s.rays, static_cast<float>(s.settings.far_m), s.truncation_m());
  s.allocate(frame.depth->depth_m, T_tag_camera);
  bool changed = false;
  for (auto& [key, brick] : s.bricks) {
    if (s.in_view(key, T_camera_tag)) changed |= s.integrate(key, brick, depth, color, T_camera_tag);
  }
  s.last_depth = frame.depth;
  s.last_color = frame.color;
  s.last_pose = pose.T_tag_camera;
  if (!changed) return s.published;

  auto field = std::make_shared<DistanceField>();
  field->voxel_m = s.voxel_m();
  field->truncation_m = s.truncation_m();
  field->version = ++s.version;
  field->bricks.reserve(s.bricks.size());
  for (const auto& [key, brick] : s.bricks) field->bricks.emplace(key, brick);
  s.published = std::move(field);
  return s.published;
}

void FusionStage::reset() {
  State& s = *state_;
  s.bricks.clear();
  s.published.reset();
  s.last_depth.reset();
  s.last_color.reset();
}

}  // namespace lumigraft
