// Photons through transmissive objects.
#include "relight/tracing/photon_tracing.h"

#include "relight/tracing/lamps.h"
#include "tests/relight/reference/glass.h"

namespace lumigraft::test {
namespace {

/// Irradiance on a floor below sheets, over that without them.
Eigen::Array3d passed_by_sheets(const relight::Material& material, int sheets, const relight::ReferenceLamp& lamp) {
  std::vector<relight::ReferenceMesh> objects;
  for (int i = 0; i < sheets; ++i) objects.push_back(square(0.2f, 0.2f + 0.01f * static_cast<float>(i), material));
  const relight::Meshes real({square(2, 0, lambert(0.5f))}, nullptr), sheet(objects, nullptr);
  const std::vector<relight::ReferenceLamp> lamps = {lamp};
  const relight::PhotonScene scene{real, sheet, lamps, [](auto, const auto&, const auto&, float) { return 1.0f; }};
  EXPECT_TRUE(relight::has_photons(scene));
  const relight::PhotonMap map = relight::trace_photons(scene, 1 << 16, 7);
  Eigen::Array3d found = Eigen::Array3d::Zero();
  double all = 0;
  for (int i = -10; i <= 10; ++i) {
    for (int k = -10; k <= 10; ++k) {
      const Eigen::Vector3f p(0.01f * static_cast<float>(i), 0.01f * static_cast<float>(k), 0);
      found += map.irradiance(p, Eigen::Vector3f::UnitZ()).cast<double>();
      double irradiance = 0;
      for (std::uint32_t n = 0; n < 64; ++n) {
        relight::Sampler sampler(1, 0, n);
        const relight::LightSample s = relight::sample_lamp(lamp, p, sampler.two());
        irradiance += static_cast<double>(s.radiance[0] * s.w.z() / s.pdf) / 64;
      }
      all += irradiance;
    }
  }
  return found / all;
}

TEST(PhotonTracing, SheetsPassTheirShares) {
  relight::Material material = glass();
  material.thin_walled = true;
  material.base_color = {0.8f, 0.5f, 0.2f};
  for (const relight::ReferenceLamp& lamp :
       {bulb({0, 0, 0.8f}, 0.01f, 1000), bulb({0, 0, 1}, 0.1f, 10), round_panel({0, 0, 1}, 0.3f, 1)}) {
    for (const int sheets : {1, 2}) {
      const Eigen::Array3d passed = passed_by_sheets(material, sheets, lamp);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(passed[c], std::pow(static_cast<double>(material.base_color[c]) * 0.96, sheets), 0.02)
            << sheets << c;
    }
  }
}

}  // namespace
}  // namespace lumigraft::test
