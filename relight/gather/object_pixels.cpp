#include "relight/gather/object_pixels.h"

#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "relight/gather/low_res_view.h"
#include "relight/gather/object_rays.h"
#include "relight/gather/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr int kMaxRays = RayFan::kMaxRays;  // per pixel
constexpr float kNoNoise = -1;
constexpr std::uint32_t kLightSeed = 22;

/// All rays of a pixel.
struct TracedRays {
  std::uint32_t some = 0;
  std::array<Vector3f, kMaxRays> w;
  std::array<MeshHit, kMaxRays> hits;
  std::array<SurfaceHit, kMaxRays> surfaces;
};

/// Arrays are per pixel of the window, unless noted.
class ObjectView {
 public:
  ObjectView(const DeltaLight& light, const std::vector<const LightSource*>& sources, const RoomPixels& room,
             const CameraRays& eye, const CurrentDepth& depth, const SeenRadiance& seen, const GatherQuality& detail,
             float step_radiance, std::vector<GBufferPixel> memory)
      : light_(light),
        sources_(sources),
        eye_(eye),
        seen_(seen),
        detail_(detail),
        step_radiance_(step_radiance),
        rays_(light.objects().meshes(), light.room().meshes(), RoomDepth{room}, eye, depth, detail),
        window_(rays_.window()),
        model_(eye.camera.model),
        first_(std::move(memory)) {
    first_.resize(static_cast<std::size_t>(window_.width) * static_cast<std::size_t>(window_.height));
    variance_.assign(first_.size(), kNoNoise);
    model_.width = window_.width;
    model_.height = window_.height;
  }

  ObjectPixels see() {
    if (first_.empty()) return {};
    rays_.find();
    for_each_index(window_.height, kRows, [&](int v) { find_surfaces(v); });
    if (detail_.on_object > 1) blocks_.emplace(first_, model_, detail_.on_object);
    open_ = open_to_lamps(light_, sources_, blocks_ ? blocks_->seen() : first_, blocks_ ? blocks_->camera() : model_,
                          detail_);
    const capture::Image<float> empty(window_.width, window_.height, 1);
    ObjectPixels out{{window_.left, window_.top, capture::Image<float>(window_.width, window_.height, 3), empty, empty},
                     {}};
    for_each_index(window_.height, 1, [&](int v) {
      for (const PixelHits& found : rays_.row(v)) shade(v, found, 1, out);
    });
    if (detail_.mirror_rounds > 1) add_mirrored(out);
    out.surfaces = std::move(first_);
    return out;
  }

 private:
  struct RoomDepth {
    const RoomPixels& room;
    float operator()(int u, int v) const {
      const GBufferPixel& pixel = room.at(u, v);
      return pixel.known ? pixel.depth_m : std::numeric_limits<float>::infinity();
    }
  };

  std::size_t index(int u, int v) const { return rays_.index(u, v); }
  void find_surfaces(int v) {
    for (int u = 0; u < window_.width; ++u) first_[index(u, v)].known = false;
    for (const PixelHits& found : rays_.row(v)) {
      if (!found.some) continue;
      const std::size_t k = found.first();
      first_[index(found.u, v)] = seen_by(found.u, v, static_cast<int>(k), found.w[k], found.hits[k]);
    }
  }

  /// At one of so many rays of a pixel, over the part of the pixel in which no other of them is.
  SurfaceHit surface_at(int u, int v, int ray, int rays, const Vector3f& w, const MeshHit& hit) const {
    const Meshes& meshes = light_.objects().meshes();
    if (!meshes.textured(hit)) return meshes.surface(hit, w);
    const int across = 1 << (std::bit_width(static_cast<unsigned>(rays)) - 1) / 2;
    const Eigen::Vector2f parts(across, rays / across);
    const auto at = [&](float x, float y) { return rays_.ray_at(u, v, {x, y}); };
    const Eigen::Vector2f centre =
        rays == 1
            ? Eigen::Vector2f(0.5f, 0.5f)
            : Eigen::Vector2f((rays_.within(u, v, ray).cwiseProduct(parts).array().floor() + 0.5f) / parts.array());
    RayCell cell;
    cell.to_centre = at(centre.x(), centre.y()) - w;
    cell.edges.col(0) = (at(1, 0.5f) - at(0, 0.5f)) / parts.x();
    cell.edges.col(1) = (at(0.5f, 1) - at(0.5f, 0)) / parts.y();
    return meshes.surface(hit, w, cell);
  }

  /// The next object along a camera ray that the room does not hide.
  std::optional<MeshHit> next_layer(int u, int v, const Vector3f& w, float beyond_m) const {
    const auto next = light_.objects().meshes().hit_beyond(beyond_m, rays_.eye_m(), w);
    if (next && rays_.may_hide(u, v, next->t_m) && light_.room().meshes().blocked(rays_.eye_m(), w, next->t_m))
      return std::nullopt;
    return next;
  }

  GBufferPixel seen_by(int u, int v, int ray, const Vector3f& w, const MeshHit& hit) const {
    GBufferPixel pixel{
        .known = true, .surface = surface_at(u, v, ray, detail_.inside, w, hit), .w = w, .depth_m = hit.t_m};
    pixel.albedo = pixel.surface.bsdf.diffuse;
    return pixel;
  }

  /// More reflected rays where those of a pixel and its neighbours were too few: what one pixel's happen to miss,
  /// others' find.
  void add_mirrored(ObjectPixels& out) {
    const std::vector<float> variance = variance_;
    for_each_index(window_.height, 1, [&](int v) {
      for (const PixelHits& found : rays_.row(v)) {
        if (variance[index(found.u, v)] == kNoNoise) continue;
        float sum = 0;
        int count = 0;
        for (int y = std::max(v - 1, 0); y <= std::min(v + 1, window_.height - 1); ++y) {
          for (int x = std::max(found.u - 1, 0); x <= std::min(found.u + 1, window_.width - 1); ++x) {
            const float near = variance[index(x, y)];
            if (near == kNoNoise) continue;
            sum += near;
            ++count;
          }
        }
        const float times = sum / (static_cast<float>(count) * step_radiance_ * step_radiance_);
        if (!(times > 1)) continue;  // not NaN either
        shade(v, found, static_cast<int>(std::ceil(std::min(times, static_cast<float>(detail_.mirror_rounds)))), out);
      }
    });
  }

  /// Samples of what a pixel's surfaces mirror and transmit.
  struct MirroredSamples {
    Rgb sum = Rgb::Zero(), squares = Rgb::Zero();
    float count = 0;

    void add(const Rgb& sample) {
      sum += sample;
      squares += sample.square();
      ++count;
    }
    float variance_of_mean() const {
      return count > 1 ? (squares / count - (sum / count).square()).maxCoeff() / (count - 1) : kNoNoise;
    }
  };

  /// `rounds`: times as many rays are mirrored as at first.
  void shade(int v, const PixelHits& found, int rounds, ObjectPixels& out) {
    TracedRays traced;
    traced.some = found.some;
    GBufferPixel first = first_[index(found.u, v)];
    bool edge = detail_.inside == 1 ? rays_.is_edge(found.u, v) : std::popcount(found.some) < detail_.inside;
    for (std::size_t k = 0; k < static_cast<std::size_t>(detail_.inside); ++k) {
      if (!(found.some >> k & 1)) continue;
      traced.w[k] = found.w[k];
      traced.hits[k] = found.hits[k];
      traced.surfaces[k] = k == found.first()
                               ? first.surface
                               : surface_at(found.u, v, static_cast<int>(k), detail_.inside, found.w[k], found.hits[k]);
      edge |= !goes_on(first, traced.surfaces[k]);
    }
    int rays = detail_.inside;
    if (edge) {
      rays_.trace(v, std::span(&found.u, 1), rays, detail_.at_edges - rays,
                  [&](std::size_t, int ray, const Vector3f& w, const MeshHit& hit) {
                    const auto k = static_cast<std::size_t>(ray);
                    traced.some |= 1u << ray;
                    traced.w[k] = w;
                    traced.hits[k] = hit;
                    traced.surfaces[k] = surface_at(found.u, v, ray, detail_.at_edges, w, hit);
                    if (!first.known) first = seen_by(found.u, v, 0, w, hit);
                  });
      rays = detail_.at_edges;
    }
    Rgb sum = Rgb::Zero();
    float covered = 0;
    MirroredSamples samples;
    for (int k = 0; k < rays; ++k) {
      if (!(traced.some >> k & 1)) continue;
      const auto i = static_cast<std::size_t>(k);
      Sampler sampler(kLightSeed, static_cast<std::uint32_t>(index(found.u, v)), static_cast<std::uint32_t>(k));
      const auto seen = [&](const MeshHit& hit, const SurfaceHit& surface) -> Rgb {
        if (surface.unlit) return surface.emission;
        return radiance(traced.w[i], hit, surface, lit(surface, found.u, v, k, goes_on(first, surface)), sampler,
                        (edge ? 1 : detail_.mirrored) * rounds, samples);
      };
      float open = 1;  // what the layers so far leave of the ray
      const auto add = [&](const MeshHit& hit, const SurfaceHit& surface) {
        if (surface.opacity > 0) sum += open * surface.opacity * seen(hit, surface);
        open *= 1 - surface.opacity;
      };
      add(traced.hits[i], traced.surfaces[i]);
      for (MeshHit hit = traced.hits[i]; open > kGather.least_open;) {
        const auto next = next_layer(found.u, v, traced.w[i], hit.t_m);
        if (!next) break;
        add(hit = *next, surface_at(found.u, v, k, rays, traced.w[i], *next));
      }
      covered += open > kGather.least_open ? 1 - open : 1;
    }
    variance_[index(found.u, v)] = samples.variance_of_mean();
    set_at(out.radiance, index(found.u, v), sum / static_cast<float>(rays));
    out.coverage.data[index(found.u, v)] = covered / static_cast<float>(rays);
    if (first.known) out.distance_m.data[index(found.u, v)] = first.depth_m;
  }

  bool goes_on(const GBufferPixel& first, const SurfaceHit& surface) const {
    const float pixel_m = first.depth_m / static_cast<float>(eye_.camera.model.fx);
    return std::abs(first.surface.face.dot(surface.position_m - first.surface.position_m)) <
               kGather.shared_off_plane_px * pixel_m &&
           first.surface.normal.dot(surface.normal) > kGather.shared_cosine;
  }

  /// Irradiance of lamps and of objects that emit, over π.
  Rgb lit(const SurfaceHit& surface, int u, int v, int ray, bool uses_shadow_of_pixel) const {
    Rgb sum = Rgb::Zero();
    const BlockMix mix = blocks_ ? blocks_->mix(u, v, surface) : BlockMix{};
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      if (const auto open = open_to(i, mix, u, v, uses_shadow_of_pixel)) {
        if (*open > 0) sum += *open / kPi * sources_[i]->irradiance(surface);
        continue;
      }
      // Where shadows are sharp, each ray uses its own small set of points.
      const std::size_t lamp = i < light_.room().lamps().size() ? i : DeltaLight::kNoLamp;
      ShadowRayPacket fan = sources_[i]->from(surface, (4 * (v & 3) + (u & 3) + ray) % LightSource::kSets);
      fan.rays.some &= 0xfu << (4 * (ray & 3));
      const std::uint32_t own = fan.rays.some;
      std::uint32_t open = own & ~light_.objects().meshes().blocked(fan.rays);
      fan.rays.some = open;
      open &= ~light_.behind_room(fan.rays, lamp);
      float arrives = 0, all = 0;
      for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
        if (own >> k & 1) all += fan.weight[k];
        if (open >> k & 1) arrives += fan.weight[k];
      }
      // Without a point above the surface nothing is known of what occludes.
      const float visible = all > 0 ? arrives / all : 1;
      sum += std::min(visible, light_.open(lamp, surface.position_m)) / kPi * sources_[i]->irradiance(surface);
    }
    return sum;
  }

  /// Visibility of a source shared by the surfaces of a pixel, if they share it.
  std::optional<float> open_to(std::size_t source, const BlockMix& mix, int u, int v, bool uses_shadow_of_pixel) const {
    if (!blocks_) {
      const LampVisibility& visibility = open_[source][index(u, v)];
      return uses_shadow_of_pixel && visibility.holds_near ? std::optional(visibility.open) : std::nullopt;
    }
    if (mix.empty()) return std::nullopt;
    return blocks_->mixed(mix, [&](std::size_t block) { return open_[source][block].open; });
  }

  Rgb radiance(const Vector3f& w, const MeshHit& hit, const SurfaceHit& surface, const Rgb& lamps, Sampler& sampler,
               int mirror_rays, MirroredSamples& samples) const {
    const Rgb arriving =
        (light_.objects().irradiance(hit, surface.face).indirect + light_.caustic(surface.position_m, surface.face)) /
        kPi;
    const Rgb sum = surface.emission + diffuse_under(surface, w) * (arriving + lamps);
    if (!surface.bsdf.mirrors()) return sum;
    if (surface.bsdf.transmits()) return sum + by_interface(w, surface, sampler, mirror_rays, samples);
    const PathVertex lobe(mirror_of(surface), w);
    Rgb mirrored = Rgb::Zero();
    for (int k = 0; k < mirror_rays; ++k) {
      const Rgb sample = light_.mirrored_by_object(lobe, sampler, kGather.mirrors, true);
      samples.add(sample);
      mirrored += sample;
    }
    return sum + mirrored / static_cast<float>(mirror_rays);
  }

  /// Reflection and transmission, each by so many rays: chosen at random, the rare one were noisy.
  Rgb by_interface(const Vector3f& w, const SurfaceHit& surface, Sampler& sampler, int rays,
                   MirroredSamples& samples) const {
    SampledRay ray;
    ray.from_m = rays_.eye_m();
    ray.w = w;
    ray.pdf = std::numeric_limits<float>::infinity();  // of a camera's ray, which no lamp sample competes with
    ray.seen = &seen_;
    ray.of_camera = true;
    // Of a narrow lobe the pixel's own rays are enough.
    if (surface.bsdf.alpha < kGather.narrow_alpha) rays = std::min(rays, kMaxInside / detail_.inside);
    Rgb sum = Rgb::Zero();
    for (int k = 0; k < rays; ++k) {
      Rgb sample = Rgb::Zero();
      for (const Lobes lobe : {Lobes::reflection, Lobes::transmission})
        sample += light_.by_interface(ray, surface, lobe, sampler, kGather.mirrors);
      samples.add(sample);
      sum += sample;
    }
    return sum / static_cast<float>(rays);
  }

  const DeltaLight& light_;
  const std::vector<const LightSource*>& sources_;
  const CameraRays& eye_;
  const SeenRadiance& seen_;
  GatherQuality detail_;
  float step_radiance_;
  ObjectRays<RoomDepth> rays_;
  PixelWindow window_;
  capture::CameraModel model_;       ///< of the window; only its size and focal lengths are valid
  std::vector<GBufferPixel> first_;  ///< the first hit among a pixel's rays
  std::vector<float> variance_;      ///< of the mean of what is mirrored, in the noisiest channel; kNoNoise: nothing is
  std::optional<LowResView> blocks_;
  std::vector<std::vector<LampVisibility>> open_;  ///< by source, then pixel or block
};

}  // namespace

ObjectPixels trace_objects(const DeltaLight& light, const std::vector<const LightSource*>& sources,
                           const RoomPixels& room, const CameraRays& eye, const CurrentDepth& depth,
                           const SeenRadiance& seen, const GatherQuality& detail, float step_radiance,
                           ObjectPixels last) {
  return ObjectView(light, sources, room, eye, depth, seen, detail, step_radiance, std::move(last.surfaces)).see();
}

}  // namespace lumigraft::relight
