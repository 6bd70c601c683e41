#include "relight/gather/delta_light.h"

#include <algorithm>
#include <limits>

#include "relight/gather/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {

using Eigen::Vector3f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Rgb diffuse_under(const SurfaceHit& surface, const Vector3f& w) {
  const BsdfParams& bsdf = surface.bsdf;
  if (!bsdf.mirrors()) return bsdf.diffuse;
  const float cos_out = -surface.normal.dot(w);
  return bsdf.diffuse * under_layer_evenly(bsdf, cos_out) *
         (under_sheen_evenly(bsdf, cos_out) * (1 - coat_share(bsdf, -w)));
}

SurfaceHit white_surface(SurfaceHit surface) {
  surface.bsdf = {};
  surface.bsdf.diffuse.setOnes();
  return surface;
}

SurfaceHit mirror_of(SurfaceHit surface) {
  surface.bsdf.diffuse.setZero();
  return surface;
}

std::optional<MeshHit> DeltaLight::in_room(const SampledRay& ray) const {
  return room_.meshes().hit(ray.from_m, ray.w, kInfinity);
}

std::optional<MeshHit> DeltaLight::on_objects(const SampledRay& ray, const std::optional<MeshHit>& room) const {
  return objects_.meshes().hit(ray.from_m, ray.w, room ? room->t_m : kInfinity);
}

void DeltaLight::set_shadows(std::shared_ptr<const reconstruct::LampShadows> shadows) {
  shadows_ = std::move(shadows);
  of_lamps_.clear();
  if (!shadows_) return;
  for (const reconstruct::PointLight& lamp : room_.illumination()->lights) of_lamps_.push_back(shadows_->of(lamp.id));
}

Rgb DeltaLight::lamps_along(const SampledRay& ray, float near_m, float far_m) const {
  Rgb sum = Rgb::Zero();
  if (!(ray.pdf > 0)) return sum;
  for (std::size_t i = 0; i < room_.lamps().size(); ++i) {
    const ReferenceLamp& lamp = room_.lamps()[i];
    const std::optional<float> t_m = lamp_hit(lamp, ray.from_m, ray.w);
    if (!t_m || *t_m < near_m || *t_m > far_m) continue;
    sum += lamp_radiance(lamp, ray.from_m, ray.w) *
           (open(i, ray.from_m) * balanced(ray.pdf, lamp_pdf(lamp, ray.from_m, ray.w)));
  }
  return sum;
}

bool DeltaLight::blocked_by_room(const Vector3f& from_m, const Vector3f& w, float limit_m, std::size_t lamp) const {
  if (behind_other_lamp(room_.lamps(), lamp, from_m, w, limit_m)) return true;
  const bool by_room = room_.meshes().blocked(from_m, w, limit_m);
  return moved_ ? moved_->blocked(room_.meshes(), from_m, w, limit_m, by_room) : by_room;
}

template <typename Counts>
Rgb DeltaLight::lamps(const PathVertex& vertex, Sampler& sampler, Counts counts) const {
  Rgb sum = Rgb::Zero();
  for (std::size_t i = 0; i < room_.lamps().size(); ++i) {
    const Vector3f from_m = vertex.leave_to(room_.lamps()[i].centre_m);
    const LightSample s = sample_lamp(room_.lamps()[i], from_m, sampler.two());
    if (!(s.pdf > 0) || s.radiance.maxCoeff() <= 0) continue;
    const Rgb f = vertex.response(s.w);
    if (f.maxCoeff() <= 0 || !counts(from_m, s.w, before_lamp_body_m(room_.lamps()[i], s.distance_m), i)) continue;
    // Only rays of specular surfaces can hit lamps.
    const float weight = vertex.mirrors() ? balanced(s.pdf, vertex.pdf(s.w) + vertex.aim_pdf(s.w)) : 1;
    sum += f * s.radiance * (open(i, from_m) * weight / s.pdf);
  }
  return sum;
}

Rgb DeltaLight::lit(const PathVertex& vertex, Sampler& sampler) const {
  const auto open = [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
    return !objects_.meshes().blocked(from, w, limit) && !blocked_by_room(from, w, limit, lamp);
  };
  return lamps(vertex, sampler, open) + lit_by_objects(vertex, sampler);
}

Rgb DeltaLight::change_of_lamps(const PathVertex& vertex, Sampler& sampler) const {
  const Rgb hidden =
      lamps(vertex, sampler, [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
        return objects_.meshes().blocked(from, w, limit) && !blocked_by_room(from, w, limit, lamp);
      });
  return lit_by_objects(vertex, sampler) - hidden;
}

Rgb DeltaLight::lit_by_objects(const PathVertex& vertex, Sampler& sampler) const {
  if (objects_.emitters().empty() || !vertex.mirrors()) return Rgb::Zero();
  Vector3f from_m = vertex.leave();
  const LightSample s = objects_.emitters().sample(from_m, sampler.two());
  if (!(s.pdf > 0)) return Rgb::Zero();
  if (vertex.transmits()) from_m = vertex.leave(s.w);
  const Rgb f = vertex.response(s.w);
  const float limit_m = s.distance_m - kTracing.before_lamp_m;
  if (f.maxCoeff() <= 0 || objects_.meshes().blocked(from_m, s.w, limit_m) ||
      blocked_by_room(from_m, s.w, limit_m, kNoLamp))
    return Rgb::Zero();
  return f * s.radiance * (balanced(s.pdf, vertex.pdf(s.w) + vertex.aim_pdf(s.w)) / s.pdf);
}

Rgb DeltaLight::lit_by_points(const SurfaceHit& surface, int set) const {
  Rgb sum = Rgb::Zero();
  for (const EmitterSampleSet& emitter : objects_.emitter_samples()) {
    ShadowRayPacket fan = emitter.from(surface, set);
    // Next to a large object few points face the surface.
    for (int k = 1; !(fan.all > 0) && k < LightSource::kSets; ++k)
      fan = emitter.from(surface, (set + k) % LightSource::kSets);
    if (!(fan.all > 0)) continue;
    fan.rays.some &= ~objects_.meshes().blocked(fan.rays);
    fan.rays.some &= ~behind_room(fan.rays, kNoLamp);
    float arrives = 0;
    for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
      if (fan.rays.some >> k & 1) arrives += fan.weight[k];
    }
    if (arrives > 0) sum += arrives / fan.all * emitter.irradiance(surface);
  }
  return sum;
}

Rgb DeltaLight::emitted(const SampledRay& ray, const MeshHit& hit) const {
  const Emitters& emitters = objects_.emitters();
  if (emitters.empty() || !emitters.emits(hit.mesh)) return Rgb::Zero();
  if (!ray.by_interface && !(ray.pdf > 0 || ray.cosine > 0)) return Rgb::Zero();
  const SurfaceHit surface = objects_.meshes().surface(hit, ray.w);
  if (surface.unlit) return Rgb::Zero();
  if (ray.by_interface) return surface.emission;
  const float fraction = ray.cosine > 0 ? EmitterSampleSet::fraction_of_ray(ray.cosine, emitters.point_pdf(hit, ray.w))
                                        : balanced(ray.pdf, emitters.pdf(hit, ray.w));
  return fraction * surface.emission;
}

std::uint32_t DeltaLight::behind_room(const RayFan& fan, std::size_t lamp) const {
  std::uint32_t behind = room_.meshes().blocked(fan);
  if (moved_) behind = moved_->blocked(room_.meshes(), fan, behind);
  for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
    if (!((fan.some & ~behind) >> k & 1)) continue;
    if (behind_other_lamp(room_.lamps(), lamp, fan.from_m, fan.w[k], fan.limit_m[k])) behind |= 1u << k;
  }
  return behind;
}

float DeltaLight::open_from(std::size_t lamp, const Vector3f& p_m, const Vector3f& w, float distance_m) const {
  const float limit_m = before_lamp_body_m(room_.lamps()[lamp], distance_m);
  return blocked_by_room(p_m, w, limit_m, lamp) ? 0 : open(lamp, p_m);
}

std::optional<SampledRay> DeltaLight::sent_on(const PathVertex& vertex, Sampler& sampler, Rgb* throughput) const {
  SampledRay ray;
  ray.w = vertex.sample(sampler);
  ray.from_m = vertex.leave(ray.w);
  ray.pdf = vertex.pdf(ray.w);
  *throughput = vertex.response(ray.w) / std::max(ray.pdf, std::numeric_limits<float>::min());
  if (!(throughput->maxCoeff() > 0 && throughput->allFinite())) return std::nullopt;
  return ray;
}

bool DeltaLight::may_hide(std::size_t lamp, const Vector3f& p_m) const {
  const ReferenceLamp& l = room_.lamps()[lamp];
  const Vector3f to = l.centre_m - p_m;
  const float along = std::clamp((sphere_.centre_m - p_m).dot(to) / to.squaredNorm(), 0.0f, 1.0f);
  return (p_m + along * to - sphere_.centre_m).norm() <= sphere_.radius_m + lamp_reach_m(l);
}

Rgb DeltaLight::hidden_from(const Vector3f& p_m, const Vector3f& normal, Sampler& sampler) const {
  Rgb sum = Rgb::Zero();
  for (std::size_t i = 0; i < room_.lamps().size(); ++i) {
    if (!may_hide(i, p_m)) continue;
    const LightSample s = sample_lamp(room_.lamps()[i], p_m, sampler.two());
    const float cosine = normal.dot(s.w), limit = before_lamp_body_m(room_.lamps()[i], s.distance_m);
    if (!(s.pdf > 0) || cosine <= 0 || s.radiance.maxCoeff() <= 0) continue;
    if (!objects_.meshes().blocked(p_m, s.w, limit) || blocked_by_room(p_m, s.w, limit, i)) continue;
    sum += s.radiance * (open(i, p_m) * cosine / s.pdf);
  }
  return sum;
}

Rgb DeltaLight::mirrored_by_object(const PathVertex& lobe, Sampler& sampler, int mirrors, bool of_camera) const {
  Rgb sum = lit(lobe, sampler), throughput;
  if (auto next = sent_on(lobe, sampler, &throughput)) {
    next->of_camera = of_camera;
    sum += throughput * with_objects(*next, sampler, mirrors - 1);
  }
  return sum;
}

Rgb DeltaLight::by_interface(const SampledRay& ray, SurfaceHit surface, Lobes lobes, Sampler& sampler,
                             int mirrors) const {
  if (ray.interfaces >= kGather.max_interfaces) return Rgb::Zero();
  if (ray.seen && lobes == Lobes::interface && ray.interfaces < kGather.split_interfaces) {
    return by_interface(ray, surface, Lobes::reflection, sampler, mirrors) +
           by_interface(ray, surface, Lobes::transmission, sampler, mirrors);
  }
  surface.bsdf.lobes = lobes;
  const PathVertex vertex(surface, ray.w);
  const bool of_lamps = ray.pdf > 0;
  Rgb sum = of_lamps ? lit(vertex, sampler) : Rgb::Zero(), throughput;
  std::optional<SampledRay> next = sent_on(vertex, sampler, &throughput);
  if (!next) return sum;
  if (!of_lamps) next->pdf = 0;
  next->by_interface = !of_lamps;
  next->interfaces = ray.interfaces + 1;
  next->absorption = vertex.absorption(next->w, ray.absorption);
  next->seen = ray.seen;
  next->of_camera = ray.of_camera;
  return sum + throughput * within_medium(*next, sampler, mirrors);
}

Rgb DeltaLight::arriving_before(const SampledRay& ray, float near_m, const std::optional<MeshHit>& room,
                                Sampler& sampler, int mirrors) const {
  const bool ends = room && room_.meshes().hides(*room);
  return lamps_along(ray, near_m, ends ? room->t_m : kInfinity) +
         (room ? left_before(ray, *room, sampler, mirrors) : room_.sky().radiance(ray.w));
}

Rgb DeltaLight::left_before(const SampledRay& ray, const MeshHit& hit, Sampler& sampler, int mirrors) const {
  if (const RoomFacet* facet = room_.facet(hit)) {
    const Vector3f p_m = ray.from_m + hit.t_m * ray.w;
    if (ray.seen) {
      if (const auto now = ray.seen->at(p_m)) return *now;
    }
    const Rgb before = room_.before(*facet, p_m, ray.w);
    return light_change_ && facet->fused && !RayRoom::ends_behind(*facet, ray.w)
               ? (before * light_change_->at(p_m)).eval()
               : before;
  }
  const RealPoint point = room_.point(hit, ray.w);
  if (point.is_even()) return point.before;
  const PathVertex vertex(point.surface, ray.w);
  Rgb sum = lamps(vertex, sampler, [&](const Vector3f& from, const Vector3f& to, float limit, std::size_t lamp) {
    return !blocked_by_room(from, to, limit, lamp);
  });
  Rgb throughput;
  if (mirrors > 0) {
    if (const auto next = sent_on(vertex, sampler, &throughput))
      sum += throughput * before(*next, sampler, mirrors - 1);
  }
  return sum;
}

void DeltaLight::set_photons(std::shared_ptr<const PhotonMap> photons) {
  photons_ = std::move(photons);
  const std::vector<Patch>& cells = cells_.cells();
  caustic_of_cells_.resize(cells.size());
  for_each_index(cells.size(), kGather.probe_block,
                 [&](std::size_t i) { caustic_of_cells_[i] = caustic(cells[i].position_m, cells[i].normal); });
}

Rgb DeltaLight::change_in_cell(const SampledRay& ray, const Vector3f& p_m, const Vector3f& normal) const {
  if (ray.seen) return cells_.at(p_m, normal) + caustic(p_m, normal);
  const int cell = cells_.cell_at(p_m, normal);
  if (cell < 0) return Rgb::Zero();
  const auto i = static_cast<std::size_t>(cell);
  return caustic_of_cells_.empty() ? cells_.irradiance[i] : (cells_.irradiance[i] + caustic_of_cells_[i]).eval();
}

Rgb DeltaLight::left_change(const SampledRay& ray, const MeshHit& hit, Sampler& sampler, int mirrors) const {
  if (const RoomFacet* facet = room_.facet(hit)) {
    if (facet->albedo.maxCoeff() <= 0) return Rgb::Zero();
    const Vector3f normal = facet->normal.dot(ray.w) < 0 ? facet->normal : (-facet->normal).eval();
    const Vector3f p = ray.from_m + hit.t_m * ray.w;
    return facet->albedo / kPi *
           (change_in_cell(ray, p, normal) - hidden_from(p + kGather.lift_m * normal, normal, sampler));
  }
  const RealPoint point = room_.point(hit, ray.w);
  const PathVertex vertex(point.surface, ray.w);
  Rgb sum = change_of_lamps(vertex, sampler);
  if (point.is_even()) {
    const Vector3f &p_m = point.surface.position_m, &face = point.surface.face;
    return sum + point.surface.bsdf.diffuse / kPi * (cells_.at(p_m, face) + caustic(p_m, face));
  }
  Rgb throughput;
  if (mirrors > 0) {
    if (auto next = sent_on(vertex, sampler, &throughput)) {
      next->of_camera = ray.of_camera;
      sum += throughput * change(*next, sampler, mirrors - 1);
    }
  }
  return sum;
}

const Rgb* DeltaLight::even_radiance(const SampledRay& ray, const MeshHit& hit) const {
  return ray.of_camera && objects_.is_unlit(hit) ? nullptr : objects_.even_radiance(hit, ray.w);
}

Rgb DeltaLight::left_object(const SampledRay& ray, const MeshHit& hit, Sampler& sampler, int mirrors) const {
  if (const Rgb* even = even_radiance(ray, hit)) return *even;
  const SurfaceHit surface = objects_.meshes().surface_within(hit, ray.w, ray.solid_angle_sr);
  if (surface.unlit && ray.of_camera) return surface.emission;
  const RayObjects::Irradiance e = objects_.irradiance(hit, surface.face);
  const BsdfParams& bsdf = surface.bsdf;
  const Rgb sum = diffuse_under(surface, ray.w) / kPi * (e.direct + e.indirect);
  if (bsdf.transmits()) return sum + by_interface(ray, surface, Lobes::interface, sampler, mirrors);
  if (photons_ && !(ray.pdf > 0) && objects_.reflects_photons(hit)) {
    // Of a matt surface's ray: photons bring it the lamps' light.
    if (mirrors == 0) return sum + reflectance_ahead(bsdf) / kPi * e.indirect;
    return sum + by_interface(ray, mirror_of(surface), Lobes::interface, sampler, mirrors - 1);
  }
  if (mirrors == 0) return sum + reflectance_ahead(bsdf) / kPi * (e.direct + e.indirect);
  return sum + mirrored_by_object(PathVertex(mirror_of(surface), ray.w), sampler, mirrors, ray.of_camera);
}

Rgb DeltaLight::before(const SampledRay& ray, Sampler& sampler, int mirrors) const {
  return arriving_before(ray, 0, in_room(ray), sampler, mirrors);
}

Rgb DeltaLight::change(const SampledRay& ray, Sampler& sampler, int mirrors, float* to_object_m) const {
  const std::optional<MeshHit> room = in_room(ray);
  if (const auto object = on_objects(ray, room)) {
    if (to_object_m) *to_object_m = std::min(*to_object_m, object->t_m);
    return emitted(ray, *object) + left_object(ray, *object, sampler, mirrors) -
           arriving_before(ray, object->t_m, room, sampler, mirrors);
  }
  if (!room) return Rgb::Zero();  // the sky, equal in both scenes
  return left_change(ray, *room, sampler, mirrors);
}

Rgb DeltaLight::with_objects_unless(const SampledRay& ray, Sampler& sampler, int mirrors, const Rgb** end) const {
  const std::optional<MeshHit> room = in_room(ray);
  if (const auto object = on_objects(ray, room)) {
    *end = even_radiance(ray, *object);
    const Rgb nearer = lamps_along(ray, 0, object->t_m) + emitted(ray, *object);
    return *end ? nearer : (nearer + left_object(ray, *object, sampler, mirrors)).eval();
  }
  const Rgb before = arriving_before(ray, 0, room, sampler, mirrors);
  return room ? (before + left_change(ray, *room, sampler, mirrors)).eval() : before;
}

Rgb DeltaLight::with_objects(const SampledRay& ray, Sampler& sampler, int mirrors) const {
  const Rgb* end = nullptr;
  const Rgb light = with_objects_unless(ray, sampler, mirrors, &end);
  return end ? (light + *end).eval() : light;
}

Rgb DeltaLight::within_medium(const SampledRay& ray, Sampler& sampler, int mirrors) const {
  if (ray.absorption.isZero(0)) return with_objects(ray, sampler, mirrors);
  const std::optional<MeshHit> room = in_room(ray), object = on_objects(ray, room);
  if (!room && !object) return Rgb::Zero();  // a medium without an end
  const float t_m = object ? object->t_m : room->t_m;
  return (-ray.absorption * t_m).exp() * with_objects(ray, sampler, mirrors);
}

}  // namespace lumigraft::relight
