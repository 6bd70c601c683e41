#include "relight/rays/ray_renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "capture/response.h"
#include "relight/approximations.h"
#include "relight/camera_upload.h"
#include "relight/rays/gather_grid.h"
#include "relight/rays/object_pixels.h"
#include "relight/rays/pixel_holes.h"
#include "relight/rays/ray_light.h"
#include "relight/reference/scene_of.h"

namespace lumigraft {
namespace {

constexpr int kLeastStep = 2, kMostStep = 4;  // pixels, between those that shadows are looked for at first
constexpr std::uint32_t kPixelSeed = 4, kGlossSeed = 5;

class Clock {
 public:
  explicit Clock(std::vector<gpu::PassTime>& passes) : passes_(passes) {}
  void done(const char* pass) {
    const auto now = std::chrono::steady_clock::now();
    passes_.push_back({pass, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
  }

 private:
  std::vector<gpu::PassTime>& passes_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

std::string what_is_missing(const Scene& scene, const std::vector<ReferenceMesh>& objects) {
  if (objects.empty()) return "no visible object";
  if (!scene.pose) return "no pose";
  if (!scene.illumination) return "no light is known yet";
  if (!scene.field) return "no geometry is known yet";
  return {};
}

Rgb pixel(const Image<float>& image, std::size_t i) {
  return {image.data[3 * i], image.data[3 * i + 1], image.data[3 * i + 2]};
}

}  // namespace

struct RayRenderer::State {
  Session session;
  std::vector<KnownSurface> known;
  CameraUpload camera;
  rays::RayLight light;

  // The room, and what it was made of.
  std::shared_ptr<const rays::RayRoom> room;
  std::vector<rays::LampPoints> lamps;
  Scene made_of;

  // What the last camera saw.
  rays::PixelRays pixel_rays;
  Eigen::Matrix4f T_tag_camera = Eigen::Matrix4f::Zero();
  std::shared_ptr<const rays::RayRoom> seen_room;
  int trace_scale = 0;
  std::vector<rays::PixelSurface> seen;
  Image<float> change;  ///< 3 channels, L_Δ of real pixels, W/sr/m²
  rays::ObjectPixels objects;

  explicit State(const Session& s)
      : session(s), known(known_surfaces(s.real_surfaces)), camera(s.color), pixel_rays(s.color.model) {}

  void follow(const Scene& scene) {
    if (room && made_of.field == scene.field && made_of.albedo == scene.albedo &&
        made_of.enclosure == scene.enclosure && made_of.illumination == scene.illumination)
      return;
    room = std::make_shared<const rays::RayRoom>(scene, known, static_cast<float>(session.tag.size_m));
    lamps = rays::lamp_points_of(*room);
    made_of = scene;
  }

  void see(const Eigen::Isometry3f& T, const Image<float>& radiance, const Plan& plan, Clock& clock) {
    const rays::Eye eye{pixel_rays, {session.color.model, T}};
    const CameraModel& model = eye.camera.model;
    if (T_tag_camera != T.matrix() || seen_room != room) {
      seen = rays::see_room(*room, eye, radiance);
      rays::fill_holes(eye.camera, radiance, camera.exposure(), seen);
      T_tag_camera = T.matrix();
      seen_room = room;
      clock.done("pixels");
    }
    const int step = std::clamp(plan.trace_scale, kLeastStep, kMostStep);
    const std::vector<Rgb> hidden = rays::hidden_by_objects(light.light(), lamps, seen, model, step);
    clock.done("shadows");
    const rays::GatherSettings how{plan.trace_scale, plan.rays, kPixelSeed};
    const std::vector<Rgb> indirect = rays::gather_pixels(light.light(), light.places(), seen, model, how);
    clock.done("gather");
    change = Image<float>(radiance.width, radiance.height, 3);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (!seen[i].known || seen[i].glossy) continue;
      const Rgb delta = seen[i].albedo / reference::kPi * (indirect[i] - hidden[i]);
      for (std::size_t c = 0; c < 3; ++c) change.data[3 * i + c] = delta[static_cast<Eigen::Index>(c)];
    }
    if (!known.empty()) {
      const std::vector<Rgb> gloss =
          rays::gather_gloss(light.light(), light.places(), seen, model, {how.scale, how.rays, kGlossSeed});
      for (std::size_t i = 0; i < seen.size(); ++i) {
        if (!seen[i].glossy) continue;
        for (std::size_t c = 0; c < 3; ++c) change.data[3 * i + c] = gloss[i][static_cast<Eigen::Index>(c)];
      }
      clock.done("gloss");
    }
    objects = rays::see_objects(light.light(), lamps, seen, eye, step);
    clock.done("object pixels");
    trace_scale = plan.trace_scale;
  }

  std::shared_ptr<const RelightMaps> maps() const {
    auto maps = std::make_shared<RelightMaps>();
    maps->mask = objects.coverage;
    maps->delta = change;
    maps->albedo = maps->normals = Image<float>(change.width, change.height, 3);
    maps->depth_m = Image<float>(change.width, change.height, 1);
    const Eigen::Vector3f eye_m = T_tag_camera.topRightCorner<3, 1>(), forward = T_tag_camera.block<3, 1>(0, 2);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      // Where an object shows, the maps say what it is.
      const rays::PixelSurface& p = objects.coverage.data[i] < 0.5f ? seen[i] : objects.surfaces[i];
      if (!p.known) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        maps->albedo.data[3 * i + c] = p.albedo[static_cast<Eigen::Index>(c)];
        maps->normals.data[3 * i + c] = p.surface.normal[static_cast<Eigen::Index>(c)];
      }
      maps->depth_m.data[i] = forward.dot(p.surface.position_m - eye_m);
    }
    return maps;
  }

  /// Camera picture plus change where it shows the room, virtual radiance where it shows an object (thesis eq. 3.4).
  void compose(const Image<float>& radiance, Image<std::uint8_t>& picture) const {
    for (std::size_t i = 0; i < objects.coverage.data.size(); ++i) {
      const float coverage = objects.coverage.data[i];
      const Rgb before = pixel(radiance, i), delta = pixel(change, i).max(-before), object = pixel(objects.radiance, i);
      if (coverage == 0 && delta.isZero(0) && camera.codes_are_srgb()) continue;
      const Rgb light_now = (1 - coverage) * (before + delta) + object;
      if (!light_now.allFinite()) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const float code = linear_to_srgb(camera.exposure() * light_now[static_cast<Eigen::Index>(c)]);
        picture.data[3 * i + c] = static_cast<std::uint8_t>(std::lround(255 * code));
      }
    }
  }
};

RayRenderer::RayRenderer(const Session& session) : state_(std::make_unique<State>(session)) {}
RayRenderer::~RayRenderer() = default;

RelitPicture RayRenderer::relight(const FrameSet& frame, const Scene& scene, const Exhibit& exhibit, const Plan& plan,
                                  bool with_maps) {
  State& s = *state_;
  RelitPicture result;
  result.plan = plan;
  s.camera.take(frame.color);
  result.srgb = s.camera.coded();
  const std::vector<ReferenceMesh> objects = reference_objects_of(exhibit, static_cast<double>(frame.time_ns) * 1e-9);
  if (const std::string missing = what_is_missing(scene, objects); !missing.empty()) {
    result.warnings.push_back("relight: " + missing + ", the camera picture passes through");
    result.passed_through = true;
    return result;
  }
  for (const VirtualObject& object : exhibit.objects) {
    if (const auto line = left_out(object); line && object.visible) result.warnings.push_back("relight: " + *line);
  }
  Clock clock(result.passes);
  s.follow(scene);
  const bool lit_anew = s.light.follow(s.room, objects, plan, [&](const char* pass) { clock.done(pass); });
  const Image<float> radiance = s.camera.radiance();
  const Eigen::Isometry3f T_tag_camera = scene.pose->T_tag_camera.cast<float>();
  if (lit_anew || s.T_tag_camera != T_tag_camera.matrix() || s.trace_scale != plan.trace_scale) {
    s.see(T_tag_camera, radiance, plan, clock);
  }
  s.compose(radiance, result.srgb);
  if (with_maps) result.maps = s.maps();
  return result;
}

}  // namespace lumigraft
