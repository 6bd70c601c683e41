// A known lamp over a plane.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kAlbedo = 0.5f;

/// A plane under one lamp and no other light: radiance ρ/π · I cos θ / d² (Lambert 1760).
ClosedScene plane_under(const reconstruct::PointLight& lamp) {
  ClosedScene scene;
  scene.albedo = kAlbedo;
  scene.sky = 0;
  scene.lamps = {lamp};
  scene.radiance = [lamp](const Eigen::Vector3f& p) {
    return kAlbedo / std::numbers::pi_v<float> * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
  };
  return scene;
}

/// Visible points of the plane outside the object, each with its area of the plane.
template <typename Visit>
void for_each_plane_pixel(const ClosedScene& scene, const relight::RelitPicture& picture, const Visit& visit) {
  const Eigen::Vector3f forward = (scene.look_at_m - scene.eye_m).normalized();
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v), to = p - scene.eye_m;
      // A pixel covers z³ / (f² d cos), z along the camera's axis: its solid angle projected onto the plane.
      const float z = forward.dot(to), f = static_cast<float>(scene.focal_px);
      const float area_m2 = z * z * z / (f * f * -to.z());
      visit(u, v, p, area_m2, picture.maps->mask.at(u, v) > 0);
    }
  }
}

class ClosedLamp : public ClosedTest {};
ON_BOTH_DEVICES(ClosedLamp);

// A black ball occludes the lamp completely where it intersects the path to the lamp, and nothing elsewhere. In total
// it removes the flux that the lamp sends into the ball's cone: Φ = 2π I (1 - cos α), sin α = r / d.
TEST_P(ClosedLamp, BlackBallTakesItsShadowAndNothingElse) {
  const reconstruct::PointLight lamp = lamp_at({0.1f, 0.5f, 1.0f}, 0.002f, 1);
  const Eigen::Vector3f centre(0, 0, 0.2f);
  const float radius = 0.1f;
  ClosedScene scene = plane_under(lamp);
  scene.exhibit.objects = {sphere_object(radius, centre, 0)};
  scene.eye_m = {0, -0.9f, 0.9f};
  const relight::RelitPicture picture = relit(scene, careful_plan(64, 1));

  double taken_W = 0, worst_in_shadow = 0, worst_in_light = 0;
  int in_shadow = 0, in_light = 0;
  for_each_plane_pixel(scene, picture, [&](int u, int v, const Eigen::Vector3f& p, float area_m2, bool object) {
    const Eigen::Vector3f w = (lamp.position_m - p).normalized();
    const float past_m = (centre - p).cross(w).norm() - radius;
    const float before = scene.radiance(p), delta = picture.maps->delta.at(u, v);
    EXPECT_FALSE(object && past_m < 0.02f) << "the ball hides its shadow from the camera";
    if (object) return;
    taken_W -= std::numbers::pi_v<float> / kAlbedo * delta * area_m2;
    // A voxel of the ball's distances is 3.5 mm, and the facets of its shape stay within 0.3 mm.
    if (past_m < -0.005f) {
      ++in_shadow;
      worst_in_shadow = std::max(worst_in_shadow, std::abs(delta / before + 1.0));
    } else if (past_m > 0.005f) {
      ++in_light;
      worst_in_light = std::max(worst_in_light, std::abs(delta / before + 0.0));
    }
  });
  EXPECT_GT(in_shadow, 100);
  EXPECT_GT(in_light, 4000);
  EXPECT_LT(worst_in_shadow, 0.005);
  EXPECT_LT(worst_in_light, 0.001);
  const double sine = radius / (lamp.position_m - centre).norm();
  const double sent_W = 2 * std::numbers::pi_v<float> * (1 - std::sqrt(1 - sine * sine));
  EXPECT_NEAR(taken_W, sent_W, 0.01 * sent_W);  // 200 pixels, of which the outline's 50 are right within a fifth
}

// Visible fraction of a lamp, as a disk, past two boxes; by 500 rays.
float open_fraction(const reconstruct::PointLight& lamp, const Eigen::Vector3f& p,
                    const std::vector<Eigen::AlignedBox3f>& boxes) {
  const Eigen::Vector3f axis = (lamp.position_m - p).normalized(), x = axis.unitOrthogonal(), y = axis.cross(x);
  constexpr int rays = 500;
  int open = 0;
  for (int i = 0; i < rays; ++i) {
    const float r = lamp.radius_m * std::sqrt((static_cast<float>(i) + 0.5f) / rays);
    const float phi = 2.39996323f * static_cast<float>(i);
    const Eigen::Vector3f to = lamp.position_m + r * (std::cos(phi) * x + std::sin(phi) * y) - p;
    bool hit = false;
    for (const auto& box : boxes) {
      const Eigen::Array3f a = (box.min() - p).array() / to.array(), b = (box.max() - p).array() / to.array();
      const float enter = a.min(b).maxCoeff(), leave = a.max(b).minCoeff();
      hit = hit || (enter < leave && leave > 1e-4f && enter < 1);
    }
    open += !hit;
  }
  return static_cast<float>(open) / rays;
}

// A wide lamp past a column on a plate: most of their common bounding box is air, which must transmit light at every
// volume size. Reference: the lamp's visible fraction by rays.
TEST_P(ClosedLamp, PenumbraOfAWideLampIsItsOccludedFraction) {
  const reconstruct::PointLight lamp = lamp_at({-0.15f, -0.05f, 1.1f}, 0.13f, 1);
  const std::vector<Eigen::AlignedBox3f> boxes{
      {Eigen::Vector3f(-0.16f, -0.16f, 0), Eigen::Vector3f(0.16f, 0.16f, 0.04f)},
      {Eigen::Vector3f(-0.16f, 0.08f, 0.04f), Eigen::Vector3f(-0.08f, 0.16f, 0.4f)}};
  ClosedScene scene = plane_under(lamp);
  scene.eye_m = {0.4f, 0.9f, 0.9f};
  scene.look_at_m = {0.05f, 0.2f, 0};
  for (const auto& box : boxes) scene.exhibit.objects.push_back(box_object(box.min(), box.max(), 0));
  for (const int volume : {64, 128}) {
    SCOPED_TRACE(volume);
    const relight::RelitPicture picture = relit(scene, careful_plan(volume, 1));
    double squares = 0, worst_in_light = 0;
    int pixels = 0, half_shadow = 0;
    for_each_plane_pixel(scene, picture, [&](int u, int v, const Eigen::Vector3f& p, float, bool object) {
      if (object) return;
      const double lost = -picture.maps->delta.at(u, v) / scene.radiance(p), truth = 1 - open_fraction(lamp, p, boxes);
      ++pixels;
      half_shadow += truth > 0.1 && truth < 0.9;
      squares += (lost - truth) * (lost - truth);
      if (truth == 0) worst_in_light = std::max(worst_in_light, lost);
    });
    EXPECT_GT(half_shadow, 100);
    EXPECT_LT(std::sqrt(squares / pixels), 0.02);
    EXPECT_LT(worst_in_light, 0.05);
  }
}

// A panel is a Lambertian emitter: the flux that a ball removes includes the cosine at the panel.
TEST_P(ClosedLamp, PanelShinesWithItsCosine) {
  reconstruct::PointLight lamp = lamp_at({0.5f, 0.3f, 0.8f}, 0.01f, 1);
  lamp.direction = (lamp.position_m - Eigen::Vector3f(0, 0, 0.3f)).normalized();  // from the probe
  lamp.flat = true;
  lamp.normal = Eigen::Vector3f(-0.9f, 0.3f, -0.4f).normalized();
  const Eigen::Vector3f centre(0, 0, 0.25f);
  constexpr float radius = 0.1f;
  ClosedScene scene = plane_under(lamp);
  scene.exhibit.objects = {sphere_object(radius, centre, 0)};
  scene.eye_m = {0.2f, -0.9f, 0.9f};
  const relight::RelitPicture picture = relit(scene, careful_plan(64, 1));
  int in_shadow = 0;
  for_each_plane_pixel(scene, picture, [&](int u, int v, const Eigen::Vector3f& p, float, bool object) {
    const float past_m = (centre - p).cross((lamp.position_m - p).normalized()).norm() - radius;
    if (object || past_m > -0.02f) return;
    ++in_shadow;
    const float before = scene.radiance(p);
    EXPECT_NEAR(picture.maps->delta.at(u, v), -before, 0.02f * before) << u << ' ' << v;
  });
  EXPECT_GT(in_shadow, 100);
}

// A sheet a tenth of a voxel thick, which voxels cannot represent: it still occludes the lamp completely, and its
// penumbra has the width of the lamp projected through its edge.
TEST_P(ClosedLamp, SheetThinnerThanAVoxelCastsAFullShadow) {
  const reconstruct::PointLight lamp = lamp_at({0, 0.3f, 0.9f}, 0.04f, 1);
  constexpr float half_m = 0.2f, height_m = 0.35f;
  ClosedScene scene = plane_under(lamp);
  scene.exhibit.objects = {box_object({-half_m, -half_m, height_m}, {half_m, half_m, height_m + 4e-4f}, 0)};
  scene.eye_m = {0, -0.8f, 0.3f};
  scene.look_at_m = {0, -0.15f, 0};
  for (const int trace_scale : {1, 2, 4}) {
    relight::Plan plan = careful_plan(64, 1);
    plan.trace_scale = trace_scale;
    const relight::RelitPicture picture = relit(scene, plan);
    int in_shadow = 0, in_light = 0;
    for_each_plane_pixel(scene, picture, [&](int u, int v, const Eigen::Vector3f& p, float area_m2, bool object) {
      if (object) return;
      // Intersection of the line to the lamp's centre with the sheet's plane, and the offset for the lamp's rim.
      const Eigen::Vector3f on_sheet = p + (lamp.position_m - p) * (height_m / lamp.position_m.z());
      const float inside_m = half_m - on_sheet.head<2>().cwiseAbs().maxCoeff();
      const float rim_m = lamp.radius_m * height_m / lamp.position_m.z();
      const float before = scene.radiance(p), delta = picture.maps->delta.at(u, v);
      // Light is traced at one pixel of 2 × 2 at the coarsest, and pixels are longer than wide here.
      const float texel_m = 0.005f + 3 * std::sqrt(area_m2);
      if (inside_m > rim_m + texel_m) {
        ++in_shadow;
        EXPECT_NEAR(delta, -before, 0.02f * before) << u << ' ' << v << " at 1/" << trace_scale;
      } else if (inside_m < -rim_m - texel_m) {
        ++in_light;
        EXPECT_NEAR(delta, 0, 0.02f * before) << u << ' ' << v << " at 1/" << trace_scale;
      }
    });
    EXPECT_GT(in_shadow, 100);
    EXPECT_GT(in_light, 1000);
  }
}

// Light adds up: a lamp in as many parts as are drawn, at one place.
TEST_P(ClosedLamp, AsManyPartsOfALampAsAreDrawnLookLikeIt) {
  const reconstruct::PointLight whole = lamp_at({0.1f, 0.5f, 1.0f}, 0.001f, 1);  // no penumbra
  ClosedScene scene = plane_under(whole);
  scene.width = 96;
  scene.height = 72;
  scene.focal_px = 78;
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.2f}, 0.8f)};
  const int parts = relight::Plan().max_lights;
  for (const relight::Plan& plan : {careful_plan(), live_plan(64)}) {
    scene.lamps = {whole};
    const auto of_whole = relit(scene, plan).srgb;
    reconstruct::PointLight part = whole;
    part.irradiance /= static_cast<float>(parts);
    part.intensity /= static_cast<float>(parts);
    scene.lamps.assign(static_cast<std::size_t>(parts), part);
    const auto of_parts = relit(scene, plan).srgb;
    int worst_codes = 0;
    double sum = 0;
    for (std::size_t i = 0; i < of_whole.data.size(); ++i) {
      const int codes = std::abs(of_whole.data[i] - of_parts.data[i]);
      worst_codes = std::max(worst_codes, codes);
      sum += codes;
    }
    EXPECT_LE(worst_codes, 12) << plan.trace_scale << ": a texel at the shadow's edge";
    EXPECT_LT(sum / static_cast<double>(of_whole.data.size()), 0.02) << plan.trace_scale;
  }
}

}  // namespace
}  // namespace lumigraft::test
