#include "reconstruct/exposure/color_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "capture/camera/radiance.h"
#include "capture/message_text.h"
#include "reconstruct/exposure/direct_irradiance.h"
#include "reconstruct/exposure/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/pose/depth_points.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

/// A piece of surface: its radiance in earlier frames.
struct Cell {
  Vector3f position_m = Vector3f::Zero();  ///< tag frame
  Vector3f normal = Vector3f::Zero();
  Array3f radiance = Array3f::Zero();         ///< W/sr/m², under `light`
  std::shared_ptr<const Illumination> light;  ///< null: unknown
  int observations = 0;
  int contradictions = 0;  ///< in a row
  std::uint64_t last_seen = 0;
};

/// Three coordinates and the axis next to the normal.
using CellKey = std::array<int, 4>;
struct CellKeyHash {
  std::size_t operator()(const CellKey& k) const {
    return BrickKeyHash()(BrickKey{k[0], k[1], k[2]}) ^ static_cast<std::size_t>(k[3]) * 50331653u;
  }
};

/// A place of this frame.
struct Place {
  CellKey key{};
  Vector3f position_m, normal;
  Array3f radiance;  ///< at gain 1
};

CellKey key_of(const Vector3f& position_m, const Vector3f& normal) {
  const Eigen::Vector3i at = (position_m / kExposure.cell_m).array().floor().cast<int>();
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return {at.x(), at.y(), at.z(), 2 * axis + (normal[axis] < 0 ? 1 : 0)};
}

/// Mean radiance of 3 × 3 pixels at gain 1; empty where one of them is dark, clipped or outside.
std::optional<Array3f> radiance_at(const capture::Frame& color, const capture::Response& response, int u, int v) {
  const bool linear = !color.radiance.empty();
  const int width = linear ? color.radiance.width : color.encoded.width;
  const int height = linear ? color.radiance.height : color.encoded.height;
  if (u < 1 || v < 1 || u + 1 >= width || v + 1 >= height) return std::nullopt;
  Array3f sum = Array3f::Zero();
  for (int y = v - 1; y <= v + 1; ++y)
    for (int x = u - 1; x <= u + 1; ++x)
      for (int c = 0; c < 3; ++c) {
        if (linear) {
          const float value = color.radiance.at(x, y, c);
          if (!std::isfinite(value) || value <= 0) return std::nullopt;
          sum[c] += value;
          continue;
        }
        const std::uint8_t code = color.encoded.at(x, y, c);
        if (code < kExposure.min_code || code >= capture::kFullScale) return std::nullopt;
        sum[c] += static_cast<float>(response.to_linear(code, c) / color.exposure);
      }
  return Array3f(sum / 9);
}

std::string gain_warning(const Array3f& gain) {
  const Array3f logs = gain.log();
  const float level = logs.mean(), hue = (logs - level).abs().maxCoeff();
  if (std::abs(level) < kExposure.warning_log && hue < kExposure.hue_warning_log) return "";
  return capture::formatted(
      "the colour camera changed its exposure or white balance: its frames are %.2f, %.2f, %.2f times as bright (red, "
      "green, blue) as at first; the difference is compensated",
      gain[0], gain[1], gain[2]);
}

}  // namespace

struct ColorGainStage::State {
  State(const capture::Session& session) : response(session.color.response), sampler(session.color.model) {}

  std::vector<Place> places_of(const capture::FrameSet& frame, const Eigen::Isometry3f& T_tag_camera) const;
  std::optional<Array3f> predicted(const Cell& cell, const std::shared_ptr<const Illumination>& light) const;
  std::optional<Array3f> measured(const std::vector<Place>& places,
                                  const std::shared_ptr<const Illumination>& light) const;
  void follow(const Array3f& log_gain, const Array3f& sigma);
  void learn(const std::vector<Place>& places, const std::shared_ptr<const Illumination>& light);
  void forget_oldest();

  capture::Response response;
  DepthSampler sampler;
  std::unordered_map<CellKey, Cell, CellKeyHash> cells;
  Array3f gain = Array3f::Ones();
  std::uint64_t frames = 0;
};

std::vector<Place> ColorGainStage::State::places_of(const capture::FrameSet& frame,
                                                    const Eigen::Isometry3f& T_tag_camera) const {
  std::vector<Place> places;
  const DepthGrid grid = sampler.sample(frame.depth->depth_m);
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c) {
      const DepthGrid::Point& point = grid.at(c, r);
      if (point.normal.isZero()) continue;
      const auto radiance =
          radiance_at(*frame.color, response, grid.step * c + grid.step / 2, grid.step * r + grid.step / 2);
      if (!radiance) continue;
      const Vector3f position_m = T_tag_camera * point.position, normal = T_tag_camera.linear() * point.normal;
      places.push_back({key_of(position_m, normal), position_m, normal, *radiance});
    }
  return places;
}

/// Radiance of a cell under the present light; empty if its irradiance changed by more than max_light_change.
std::optional<Array3f> ColorGainStage::State::predicted(const Cell& cell,
                                                        const std::shared_ptr<const Illumination>& light) const {
  if (!light || !cell.light || light->version == cell.light->version) return cell.radiance;
  const Array3f then = unoccluded_irradiance(*cell.light, cell.position_m, cell.normal);
  const Array3f now = unoccluded_irradiance(*light, cell.position_m, cell.normal);
  if (!(then.minCoeff() > 0) || !(now.minCoeff() > 0)) return std::nullopt;
  const Array3f ratio = now / then;
  if (ratio.maxCoeff() > kExposure.max_light_change || ratio.minCoeff() < 1 / kExposure.max_light_change)
    return std::nullopt;
  return Array3f(cell.radiance * ratio);
}

/// Median log gain of the places; empty if too few places match or agree.
std::optional<Array3f> ColorGainStage::State::measured(const std::vector<Place>& places,
                                                       const std::shared_ptr<const Illumination>& light) const {
  std::array<std::vector<float>, 3> logs;
  for (const Place& place : places) {
    const auto cell = cells.find(place.key);
    if (cell == cells.end()) continue;
    const std::optional<Array3f> expected = predicted(cell->second, light);
    if (!expected) continue;
    const Array3f log_ratio = (place.radiance / *expected).log();
    for (int c = 0; c < 3; ++c) logs[static_cast<std::size_t>(c)].push_back(log_ratio[c]);
  }
  if (logs[0].size() < kExposure.min_matches) return std::nullopt;
  Array3f middle;
  for (int c = 0; c < 3; ++c) {
    std::vector<float>& values = logs[static_cast<std::size_t>(c)];
    middle[c] = median(values);
    const auto inliers = std::count_if(values.begin(), values.end(),
                                       [&](float value) { return std::abs(value - middle[c]) < kExposure.inlier_log; });
    if (static_cast<float>(inliers) < kExposure.min_inlier_fraction * static_cast<float>(values.size()))
      return std::nullopt;
  }
  return middle;
}

/// Changes within the noise are ignored: renderers reuse results as long as the gain is equal.
void ColorGainStage::State::follow(const Array3f& log_gain, const Array3f& sigma) {
  const Array3f step = (log_gain - gain.log()).abs();
  if ((step > (kExposure.step_sigmas * sigma).max(kExposure.min_log_step)).any()) gain = log_gain.exp();
}

void ColorGainStage::State::learn(const std::vector<Place>& places, const std::shared_ptr<const Illumination>& light) {
  for (const Place& place : places) {
    Cell& cell = cells[place.key];
    const Array3f radiance = place.radiance / gain;
    cell.last_seen = frames;
    const std::optional<Array3f> expected = cell.observations == 0 ? std::nullopt : predicted(cell, light);
    if (expected && ((radiance / *expected).log().abs() < kExposure.inlier_log).all()) {
      cell.observations = std::min(cell.observations + 1, kExposure.max_average);
      cell.radiance *= (1 + (radiance / *expected - 1) / static_cast<float>(cell.observations));
      cell.contradictions = 0;
    } else if (cell.observations == 0 || ++cell.contradictions >= kExposure.replaced_after) {
      cell = {place.position_m, place.normal, radiance, light, 1, 0, frames};
    }
  }
  if (cells.size() > kExposure.max_cells) forget_oldest();
}

/// Drops cells that were observed less recently than the median.
void ColorGainStage::State::forget_oldest() {
  std::vector<std::uint64_t> seen;
  seen.reserve(cells.size());
  for (const auto& [key, cell] : cells) seen.push_back(cell.last_seen);
  const std::uint64_t middle = median(seen);
  std::erase_if(cells, [&](const auto& entry) { return entry.second.last_seen < middle; });
}

ColorGainStage::ColorGainStage(const capture::Session& session) : state_(std::make_unique<State>(session)) {}

ColorGainStage::~ColorGainStage() = default;

ColorGainStage::Result ColorGainStage::estimate(const capture::FrameSet& frame, const std::optional<Pose>& pose,
                                                std::shared_ptr<const Illumination> light) {
  State& s = *state_;
  if (frame.color && frame.depth && pose && pose->age_ns == 0) {
    ++s.frames;
    const std::vector<Place> places = s.places_of(frame, pose->T_tag_camera.cast<float>());
    const std::optional<Array3f> log_gain = s.measured(places, light);
    if (log_gain) {
      const float count = std::max(1.0f, static_cast<float>(places.size()) / kExposure.independent_matches);
      s.follow(*log_gain, Array3f::Constant(kExposure.texture_log_sigma / std::sqrt(count)));
    }
    s.learn(places, light);
  }
  Result result{s.gain, {}};
  if (std::string warning = gain_warning(s.gain); !warning.empty()) result.warnings.push_back(std::move(warning));
  return result;
}

}  // namespace lumigraft::reconstruct
