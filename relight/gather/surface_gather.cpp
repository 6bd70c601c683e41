#include "relight/gather/surface_gather.h"

#include "relight/gather/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {

using Eigen::Vector3f;

namespace {

SurfaceHit white_at(const Vector3f& position_m, const Vector3f& normal) {
  SurfaceHit s;
  s.position_m = position_m;
  s.face = s.normal = normal;
  return white_surface(s);
}

PathVertex white_vertex(const Vector3f& position_m, const Vector3f& normal) {
  return PathVertex(white_at(position_m, normal), -normal);
}

/// `gather(vertex, sampler, ray)`: one sample of the irradiance over π.
template <typename Gather>
std::vector<Rgb> at_places(const RayObjects& objects, int samples, std::uint32_t seed, const UpdateSubset& turn,
                           const std::vector<Rgb>& kept, Gather gather) {
  std::vector<Rgb> found = kept;
  for_each_index(static_cast<int>(found.size()), kGather.probe_block, [&](int i) {
    if (!turn.is_of(i) && objects.has_light(i)) return;
    const auto& place = objects.places()[static_cast<std::size_t>(i)];
    const PathVertex vertex = white_vertex(place.position_m, place.normal);
    Rgb sum = Rgb::Zero();
    for (int k = 0; k < samples; ++k) {
      Sampler sampler(seed, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k));
      sum += gather(vertex, sampler, static_cast<std::size_t>(i) * samples + k);
    }
    found[static_cast<std::size_t>(i)] = sum * (kPi / static_cast<float>(samples));
  });
  return found;
}

}  // namespace

void gather_lamps(const DeltaLight& light, int samples, std::uint32_t seed, const UpdateSubset& turn,
                  RayObjects& objects) {
  std::vector<Rgb> found = at_places(objects, samples, seed, turn, objects.direct(),
                                     [&](const PathVertex& v, Sampler& s, std::size_t) { return light.lit(v, s); });
  for_each_index(static_cast<int>(found.size()), kGather.probe_block, [&](int i) {
    if (!turn.is_of(i) && objects.has_light(i)) return;
    const auto& place = objects.places()[static_cast<std::size_t>(i)];
    found[static_cast<std::size_t>(i)] += light.caustic(place.position_m, place.normal);
  });
  if (!objects.emitters().empty()) {
    for_each_index(static_cast<int>(found.size()), kGather.probe_block, [&](int i) {
      if (!turn.is_of(i) && objects.has_light(i)) return;
      const auto& place = objects.places()[static_cast<std::size_t>(i)];
      found[static_cast<std::size_t>(i)] +=
          light.lit_by_points(white_at(place.position_m, place.normal), i % LightSource::kSets);
    });
  }
  objects.set_direct(std::move(found));
}

void gather_objects(const DeltaLight& light, int rays, int bounces, std::uint32_t seed, const UpdateSubset& turn,
                    RayObjects& objects) {
  const std::size_t per_place = static_cast<std::size_t>(rays);
  std::vector<const Rgb*> ends(objects.places().size() * per_place, nullptr);
  const std::vector<Rgb> first = at_places(
      objects, rays, seed, turn, objects.indirect(), [&](const PathVertex& vertex, Sampler& sampler, std::size_t ray) {
        const Vector3f w = vertex.sample(sampler);
        const float solid_angle_sr = 1 / (static_cast<float>(rays) * vertex.pdf(w));
        const SampledRay sent{vertex.leave(w), w, 0, solid_angle_sr, kPi * vertex.pdf(w)};
        return light.with_objects_unless(sent, sampler, kGather.mirrors, &ends[ray]);
      });
  for (int bounce = 0; bounce < bounces; ++bounce) {
    std::vector<Rgb> all = first;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (ends[i]) all[i / per_place] += *ends[i] * (kPi / static_cast<float>(rays));
    }
    objects.set_indirect(std::move(all));
  }
}

void gather_cells(const DeltaLight& light, const std::vector<ChangeRegion>& places, int rays, std::uint32_t seed,
                  const UpdateSubset& turn, IrradianceChangeCache& cells) {
  std::vector<Rgb> found = cells.irradiance;
  for_each_index(static_cast<int>(found.size()), kGather.probe_block, [&](int i) {
    if (!turn.is_of(i)) return;
    const Patch& cell = cells.cells()[static_cast<std::size_t>(i)];
    PathVertex vertex = white_vertex(cell.position_m, cell.normal);
    vertex.aim_at(places);
    found[static_cast<std::size_t>(i)] =
        changed_irradiance(light, vertex, {rays, rays}, seed, static_cast<std::uint32_t>(i), nullptr) +
        light.lit_by_points(white_at(cell.position_m, cell.normal), i % LightSource::kSets);
  });
  cells.irradiance = std::move(found);
}

Rgb changed_radiance(const DeltaLight& light, const PathVertex& vertex, Sampler& sampler, float* to_object_m) {
  const auto towards = [&](const Vector3f& w) -> Rgb {
    const float pdf = vertex.pdf(w) + vertex.aim_pdf(w);
    const Rgb response = vertex.response(w);
    if (!(response.maxCoeff() > 0 && pdf > 0)) return Rgb::Zero();
    const SampledRay ray{.from_m = vertex.leave(w), .w = w, .pdf = pdf, .of_camera = true};
    return light.change(ray, sampler, kGather.mirrors, to_object_m) * response / pdf;
  };
  Rgb sum = towards(vertex.sample(sampler)) + light.change_of_lamps(vertex, sampler);
  if (vertex.has_aim()) sum += towards(vertex.aim(sampler));
  return sum;
}

Rgb changed_irradiance(const DeltaLight& light, const PathVertex& vertex, const RayCounts& rays, std::uint32_t seed,
                       std::uint32_t place, float* to_object_m) {
  const int aimed = vertex.has_aim() ? rays.aimed : 0;
  Rgb sum = Rgb::Zero();
  for (int k = 0; k < rays.hemisphere + aimed; ++k) {
    const bool aim = k >= rays.hemisphere;
    Sampler sampler(seed, 2 * place + aim, static_cast<std::uint32_t>(aim ? k - rays.hemisphere : k));
    const Vector3f w = aim ? vertex.aim(sampler) : vertex.sample(sampler);
    // The balance heuristic of both strategies (Veach & Guibas 1995). A white vertex reflects all channels equally.
    const float pdf =
        static_cast<float>(rays.hemisphere) * vertex.pdf(w) + static_cast<float>(aimed) * vertex.aim_pdf(w);
    const float weight = vertex.response(w)[0] / pdf;
    if (weight > 0)
      sum += weight *
             light.change({vertex.leave(w), w, 0, 1 / pdf, kPi * vertex.pdf(w)}, sampler, kGather.mirrors, to_object_m);
  }
  return sum * kPi;
}

}  // namespace lumigraft::relight
