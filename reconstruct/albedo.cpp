#include "reconstruct/albedo.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "reconstruct/albedo_bricks.h"
#include "reconstruct/albedo_irradiance.h"
#include "reconstruct/albedo_lamps.h"
#include "reconstruct/albedo_points.h"
#include "reconstruct/albedo_rays.h"
#include "reconstruct/albedo_reflections.h"
#include "reconstruct/albedo_samples.h"
#include "reconstruct/albedo_solve.h"

namespace lumigraft {
namespace {

constexpr int kSamples = 2500;
constexpr int kGatherRays = 64;
constexpr float kMostMetal = 0.1f;        ///< share of what a sample sees that may be metal
constexpr double kGrown = 1.25;           ///< when so much more surface is known, lamps are searched from nothing
constexpr float kKnownSigma = 0.25f;      ///< of log distance; beyond it the distance counts as unknown
constexpr float kFarthestKnown_m = 7.5f;  ///< the search ends at 8 m: there a lamp is as good as infinitely far

std::vector<PointLight> placed(const Illumination& illumination, const std::vector<LampEstimate>& estimates) {
  std::vector<PointLight> lights = illumination.lights;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LampEstimate& estimate = estimates[i];
    PointLight& light = lights[i];
    light.irradiance = light.irradiance.cwiseProduct(estimate.gain);
    light.distance_known = estimate.log_sigma < kKnownSigma && estimate.distance_m < kFarthestKnown_m;
    if (!light.distance_known) continue;
    light.position_m = illumination.probe_position_m + estimate.distance_m * light.direction;
    light.intensity = light.irradiance * estimate.distance_m * estimate.distance_m;
    light.radius_m = estimate.distance_m * std::tan(light.angular_radius_rad);
    light.flat = estimate.flat;
    light.normal = estimate.normal;
  }
  return lights;
}

std::string distance_warning(const std::vector<PointLight>& lights) {
  const auto unknown =
      std::count_if(lights.begin(), lights.end(), [](const PointLight& l) { return !l.distance_known; });
  if (unknown == 0) return "";
  return std::to_string(unknown) + (unknown == 1 ? " lamp is" : " lamps are") +
         " taken as infinitely far: the room's shading does not tell the distance";
}

}  // namespace

struct AlbedoStage::State {
  explicit State(const Session& session) : metal(session), tag_size_m(session.tag.size_m) {}

  MetalSurfaces metal;
  double tag_size_m;
  std::uint64_t version = 0;
  bool solved = false;
  std::uint64_t field_version = 0, illumination_version = 0;
  Result last;
  std::map<int, LampEstimate> estimates;  ///< by the lamp's id
  std::size_t searched_points = 0;        ///< how much surface was known when lamps were last searched from nothing
};

AlbedoStage::AlbedoStage(const Session& session) : state_(std::make_unique<State>(session)) {}
AlbedoStage::~AlbedoStage() = default;

void AlbedoStage::reset() {
  state_->solved = false;
  state_->last = {};
  state_->estimates.clear();
}

AlbedoStage::Result AlbedoStage::solve(const DistanceField& field, const Illumination& illumination) {
  State& s = *state_;
  if (s.solved && s.field_version == field.version && s.illumination_version == illumination.version) return s.last;

  const FieldRays rays(field);
  auto lit = std::make_shared<Illumination>(without_reflections(illumination, field, rays));
  Surface surface = find_surface(field, rays, s.metal, kSamples);
  const RoomLight room(field, rays, s.metal, *lit);
  std::vector<Eigen::Vector3f> gathered;
  for (SurfaceSample& sample : surface.samples) {
    const RoomLight::Gathered light = room.gather(sample.position, sample.normal, kGatherRays);
    gathered.push_back(light.irradiance);
    sample.usable = sample.usable && light.metal_share < kMostMetal;
  }
  if (surface.points.size() > kGrown * s.searched_points) {
    s.estimates.clear();
    s.searched_points = surface.points.size();
  }
  std::vector<std::optional<LampEstimate>> before;
  for (const PointLight& light : lit->lights) {
    const auto known = s.estimates.find(light.id);
    before.push_back(known == s.estimates.end() ? std::nullopt : std::optional(known->second));
  }
  const std::vector<LampEstimate> estimates =
      locate_lamps(room, *lit, surface.samples, gathered, tag_paper(surface.points, s.tag_size_m), before);
  s.estimates.clear();
  for (std::size_t i = 0; i < estimates.size(); ++i) s.estimates[lit->lights[i].id] = estimates[i];
  lit->lights = placed(*lit, estimates);

  const LitSurface points(surface, room, *lit, gathered);
  const std::vector<SampleAlbedo> albedo =
      solve_albedo(surface.samples, points.sample_light(), points.neighbours(), points.dark());
  auto result = std::make_shared<AlbedoField>();
  result->voxel_m = field.voxel_m;
  result->version = ++s.version;
  result->bricks = albedo_bricks(surface.points, points.albedo(albedo));

  s.last = {result, lit, {}};
  if (const std::string warning = distance_warning(lit->lights); !warning.empty()) s.last.warnings.push_back(warning);
  s.solved = true;
  s.field_version = field.version;
  s.illumination_version = illumination.version;
  return s.last;
}

}  // namespace lumigraft
