#include "reconstruct/light/light_change.h"

#include <algorithm>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// Irradiance at the probe per channel, as the columns of three vectors towards the lamp; zero for no lamp.
Eigen::Matrix3f irradiance_vectors(const PointLight* lamp) {
  return lamp ? Eigen::Matrix3f(lamp->direction * lamp->irradiance.transpose()) : Eigen::Matrix3f::Zero();
}

}  // namespace

double relative_change(const Illumination& now, const Illumination& before) {
  double change = 0, sum = 0;
  for (const PointLight& lamp : now.lights) {
    const PointLight* was = lamp_with_id(before.lights, lamp.id);
    const Eigen::Matrix3f a = irradiance_vectors(&lamp), b = irradiance_vectors(was);
    change += (a - b).colwise().norm().sum();
    sum += std::max(a.colwise().norm().sum(), b.colwise().norm().sum());
  }
  for (const PointLight& lamp : before.lights) {
    if (lamp_with_id(now.lights, lamp.id)) continue;
    change += lamp.irradiance.sum();
    sum += lamp.irradiance.sum();
  }
  constexpr int kAxes = 6;
  for (int i = 0; i < kAxes; ++i) {
    const Vector3f normal = (i < 3 ? 1.0f : -1.0f) * Vector3f::Unit(i % 3);
    const Vector3f a = sh_irradiance(now.environment_sh, normal), b = sh_irradiance(before.environment_sh, normal);
    change += (a - b).cwiseAbs().sum() / kAxes;
    sum += std::max(a.sum(), b.sum()) / kAxes;
  }
  return sum > 0 ? change / sum : 0;
}

}  // namespace lumigraft::reconstruct
