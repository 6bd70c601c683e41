// Delta final gathering compared with path tracing of the same reconstructed room.
#include <cmath>
#include <cstdio>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {
namespace {

struct Off {
  double change, object;  ///< RMS of the difference over RMS of the reference's
};

Off off_the_reference(const ClosedScene& scene, const capture::Session& session) {
  relight::Plan traced, gathered;
  traced.method = "reference";
  traced.samples = 512;
  gathered.method = "rays";
  gathered.trace_scale = 1;
  gathered.rays = 64;
  relight::ReferenceRenderer reference(session);
  relight::RayRenderer rays(session);
  const relight::RelitPicture wanted = scene.relit(reference, traced), found = scene.relit(rays, gathered);
  double off = 0, all = 0, off_object = 0, all_object = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const float covered = wanted.maps->mask.at(u, v);
      if (covered == 0 && found.maps->mask.at(u, v) == 0) {
        for (int c = 0; c < 3; ++c) {
          off += std::pow(found.maps->delta.at(u, v, c) - wanted.maps->delta.at(u, v, c), 2);
          all += std::pow(wanted.maps->delta.at(u, v, c), 2);
        }
      } else if (covered == 1) {
        off_object += std::pow(picture_radiance(found, u, v) - picture_radiance(wanted, u, v), 2);
        all_object += std::pow(picture_radiance(wanted, u, v), 2);
      }
    }
  }
  return {std::sqrt(off / all), std::sqrt(off_object / all_object)};
}

/// A block on a floor, between a round lamp and a flat one.
ClosedScene block_on_floor() {
  ClosedScene scene;
  scene.width = 64;
  scene.height = 48;
  scene.focal_px = 55;
  scene.eye_m = {0, -0.6f, 0.4f};
  scene.look_at_m = {0, 0, 0.03f};
  scene.sky = 0.15f;
  reconstruct::PointLight panel = lamp_at({-0.3f, 0.1f, 0.5f}, 0.08f, 0.12f);
  panel.flat = true;
  panel.direction = (panel.position_m - Eigen::Vector3f(0, 0, 0.3f)).normalized();  // from the probe
  panel.normal = Eigen::Vector3f(0.3f, -0.1f, -0.5f).normalized();
  scene.lamps = {lamp_at({0.3f, 0.2f, 0.5f}, 0.04f, 0.1f), panel};
  scene.radiance = [lamps = scene.lamps](const Eigen::Vector3f& p) {
    float e = 0.15f * 3.14159265f;
    for (const reconstruct::PointLight& lamp : lamps)
      e += irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
    return 0.5f / 3.14159265f * e;
  };
  scene.exhibit.objects = {box_object({-0.06f, -0.06f, 0}, {0.06f, 0.06f, 0.12f}, 0.7f)};
  return scene;
}

TEST(RaysReference, MattObject) {
  const ClosedScene scene = block_on_floor();
  const Off off = off_the_reference(scene, scene.session());
  std::printf("matt: change off by %.3f, object by %.3f\n", off.change, off.object);
  EXPECT_LT(off.change, 0.07);
  EXPECT_LT(off.object, 0.03);
}

TEST(RaysReference, TwoObjectsThatShine) {
  ClosedScene scene = block_on_floor();
  relight::Material metal{Eigen::Vector3f(0.9f, 0.6f, 0.3f), 1, 0.3f, 1},
      varnish{Eigen::Vector3f(0.3f, 0.1f, 0.5f), 0, 0.4f, 1};
  scene.exhibit.objects[0].material = metal;
  scene.exhibit.objects.push_back(sphere_object(0.05f, {0.13f, -0.06f, 0.05f}, 0.5f));
  scene.exhibit.objects[1].material = varnish;
  const Off off = off_the_reference(scene, scene.session());
  std::printf("shining: change off by %.3f, objects by %.3f\n", off.change, off.object);
  EXPECT_LT(off.change, 0.15);  // half of it is noise of the metal's light on the floor
  EXPECT_LT(off.object, 0.06);
}

TEST(RaysReference, OnAKnownGlossyPlate) {
  TemporaryFolder folder;
  ClosedScene scene = block_on_floor();
  capture::Session session = scene.session();
  session.tag.size_m = 0.01;
  capture::RealSurface plate;
  plate.mesh =
      folder.write("plate.ply",
                   "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                   "element face 2\nproperty list uchar int vertex_indices\nend_header\n-0.4 -0.4 0\n0.4 -0.4 0\n"
                   "0.4 0.4 0\n-0.4 0.4 0\n3 0 1 2\n3 0 2 3\n");
  for (const float metallic : {1.0f, 0.0f}) {
    plate.metallic = metallic;
    plate.roughness = 0.35f;
    plate.specular = 1;
    plate.base_color.setConstant(metallic > 0 ? 0.9f : 0.4f);
    session.real_surfaces = {plate};
    const Off off = off_the_reference(scene, session);
    std::printf("on a plate, metallic %.0f: change off by %.3f, object by %.3f\n", metallic, off.change, off.object);
    EXPECT_LT(off.change, 0.09) << metallic;
    EXPECT_LT(off.object, 0.04) << metallic;
  }
}

}  // namespace
}  // namespace lumigraft::test
