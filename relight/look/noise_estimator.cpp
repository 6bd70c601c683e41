#include "relight/look/noise_estimator.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "capture/camera/srgb.h"
#include "relight/look/parameters.h"
#include "relight/tracing/parallel_for.h"
#include "relight/tracing/sampler.h"

namespace lumigraft::relight {
namespace {

constexpr int kEdge = NoiseSpectrum::kEdge;
constexpr std::size_t kPixels = std::size_t{kEdge} * kEdge;
constexpr auto kLevels = static_cast<std::size_t>(256 / kLook.level_codes);
constexpr std::uint32_t kPatchSeed = 31;
constexpr int kPlaceBlock = 12;  // patches per thread at a time

/// Variance around the plane that fits best.
float variance_off_plane(const NoiseSpectrum::Patch& values) {
  float sum = 0, by_x = 0, by_y = 0, squares = 0;
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      const float value = values[static_cast<std::size_t>(v * kEdge + u)];
      sum += value;
      by_x += (static_cast<float>(u) - 0.5f * (kEdge - 1)) * value;
      by_y += (static_cast<float>(v) - 0.5f * (kEdge - 1)) * value;
      squares += value * value;
    }
  }
  constexpr float kSpread = kPixels * (kEdge * kEdge - 1) / 12.0f;  // sum of squares of the centred coordinate
  return (squares - sum * sum / kPixels - (by_x * by_x + by_y * by_y) / kSpread) / (kPixels - 3);
}

float quantile(std::vector<float> values, float fraction) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<float>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Slope of the sRGB curve in pixel values per linear value.
float slope_at(float code) {
  const float s = std::clamp(code / 255, 0.0f, 1.0f);
  return 255 * (s <= 0.04045f ? 12.92f : 1.055f / 2.4f * std::pow((s + 0.055f) / 1.055f, -1.4f));
}

/// In the middle of a level.
float code_of(std::size_t level) { return (static_cast<float>(level) + 0.5f) * static_cast<float>(kLook.level_codes); }

}  // namespace

NoiseEstimator::NoiseEstimator() : last_variances_(kLevels) { levels_.fill(std::vector<Level>(kLevels)); }

std::optional<NoiseEstimator::Patch> NoiseEstimator::patch_at(const Picture& a, const Picture& b,
                                                              const Eigen::Vector2i& at,
                                                              const Eigen::Vector2i& before) {
  Patch patch;
  for (std::size_t c = 0; c < 3; ++c) {
    NoiseSpectrum::Patch shared;
    int sum = 0;
    float sum_of_noise = 0;
    for (int v = 0; v < kEdge; ++v) {
      for (int u = 0; u < kEdge; ++u) {
        const int x = a.at(at.x() + u, at.y() + v, static_cast<int>(c)),
                  y = b.at(before.x() + u, before.y() + v, static_cast<int>(c));
        const auto i = static_cast<std::size_t>(v * kEdge + u);
        shared[i] = static_cast<float>(x + y) * std::numbers::sqrt2_v<float> / 2;
        patch.noise[c][i] = static_cast<float>(x - y) * std::numbers::sqrt2_v<float> / 2;
        sum += x + y;
        sum_of_noise += patch.noise[c][i];
        patch.clipped[c] = patch.clipped[c] || std::max(x, y) == 255 || std::min(x, y) == 0;
      }
    }
    patch.level[c] = static_cast<float>(sum) / (2 * kPixels);
    const float noise = variance_off_plane(patch.noise[c]);
    if (variance_off_plane(shared) > noise * (1 + kLook.texture) + kLook.rounding) return std::nullopt;
    float squares = 0;
    for (float& value : patch.noise[c]) {
      value -= sum_of_noise / kPixels;
      squares += value * value;
    }
    patch.variance[c] = squares / kPixels;
  }
  return patch;
}

void NoiseEstimator::take(std::shared_ptr<const Picture> picture, const Viewpoint& from) {
  if (!last_.empty() && last_.back().picture == picture) return;
  if (!last_.empty() &&
      (last_.back().picture->width != picture->width || last_.back().picture->height != picture->height)) {
    last_.clear();
    forget();
  }
  last_.push_back({std::move(picture), from.T_tag_camera});
  if (last_.size() > static_cast<std::size_t>(kLook.lag) + 1) last_.pop_front();
  ++frames_;
  const Picture &now = *last_.back().picture, &before = *last_.front().picture;
  if (last_.size() < 2 || now.width < kEdge || now.height < kEdge) return;
  const Eigen::Array2i room(now.width - kEdge, now.height - kEdge);
  std::vector<Eigen::Array2i> places;
  Sampler place(kPatchSeed, static_cast<std::uint32_t>(frames_), 0);
  for (int i = 0; i < kLook.tried; ++i) {
    const Eigen::Vector2f at = place.two();
    places.emplace_back((at.array() * (room + 1).cast<float>()).cast<int>());
  }
  std::vector<std::optional<Patch>> found(places.size());
  for_each_index(places.size(), kPlaceBlock, [&](std::size_t i) {
    const auto shift = shift_px(from, last_.front().T_tag_camera, places[i] + kEdge / 2);
    if (!shift) return;
    const Eigen::Array2d there = places[i].cast<double>() + shift->array().round();
    if ((there < 0).any() || (there > room.cast<double>()).any()) return;
    found[i] = patch_at(now, before, places[i], there.cast<int>());
  });
  std::vector<Patch> patches;
  for (const std::optional<Patch>& patch : found) {
    if (patch) patches.push_back(*patch);
  }
  if (gain_changed(patches)) forget();
  std::erase_if(patches, [&](const Patch& patch) { return shows_motion(patch); });
  std::size_t remembered = 0;
  for (const std::deque<float>& of_level : last_variances_) remembered += of_level.size();
  if (remembered < static_cast<std::size_t>(kLook.change_patches)) return;  // too few to tell motion from noise
  if (patches.size() > static_cast<std::size_t>(kLook.used)) patches.resize(static_cast<std::size_t>(kLook.used));
  const float kept = std::exp(-1 / kLook.frames);
  spectrum_.decay(kept);
  for (std::vector<Level>& of_channel : levels_) {
    for (Level& level : of_channel) {
      level.weight *= kept;
      level.variance *= kept;
    }
  }
  for (const Patch& patch : patches) count(patch);
  rebuild();
}

void NoiseEstimator::count(const Patch& patch) {
  for (std::size_t c = 0; c < 3; ++c) {
    if (patch.clipped[c]) continue;
    Level& level = levels_[c][static_cast<std::size_t>(patch.level[c]) / static_cast<std::size_t>(kLook.level_codes)];
    level.weight += 1;
    level.variance += patch.variance[c];
  }
  if (patch.clipped[0] || patch.clipped[1] || patch.clipped[2]) return;
  spectrum_.add(patch.noise);
  ++patches_;
}

/// Whether it varies more than those patches that vary least, of its level or of others: in linear light the variance
/// is a x + b, which from one level to a higher one increases at most as the levels do.
bool NoiseEstimator::shows_motion(const Patch& patch) {
  const float code = (patch.level[0] + patch.level[1] + patch.level[2]) / 3, slope = slope_at(code);
  const float variance = patch.mean_variance() / (slope * slope);
  std::deque<float>& of_level = last_variances_[static_cast<std::size_t>(code) / kLook.level_codes];
  of_level.push_back(variance);
  if (of_level.size() > static_cast<std::size_t>(kLook.remembered)) of_level.pop_front();
  float least = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < kLevels; ++i) {
    const std::deque<float>& other = last_variances_[i];
    if (other.empty()) continue;
    const float brighter = capture::srgb_to_linear(code / 255) / capture::srgb_to_linear(code_of(i) / 255);
    least = std::min(least, std::max(brighter, 1.0f) * quantile({other.begin(), other.end()}, kLook.least));
  }
  return variance > kLook.max_to_least * least;
}

bool NoiseEstimator::gain_changed(const std::vector<Patch>& patches) {
  if (!model_) return false;
  for (const Patch& patch : patches) {
    if (patch.clipped[0] || patch.clipped[1] || patch.clipped[2]) continue;
    float known = kLook.rounding;
    for (std::size_t c = 0; c < 3; ++c) known += model_->variance[c][static_cast<std::size_t>(patch.level[c])] / 3;
    ratios_.push_back((patch.mean_variance() + kLook.rounding) / (known + kLook.rounding));
  }
  if (ratios_.size() < static_cast<std::size_t>(kLook.change_patches)) return false;
  const std::vector<float> ratios = std::exchange(ratios_, {});
  return quantile(ratios, kLook.least) > kLook.max_change || quantile(ratios, 0.5f) < 1 / kLook.max_change;
}

/// The last model serves until the next is known.
void NoiseEstimator::forget() {
  for (std::vector<Level>& of_channel : levels_) of_channel.assign(kLevels, {});
  spectrum_ = {};
  for (std::deque<float>& of_level : last_variances_) of_level.clear();
  ratios_.clear();
  patches_ = tile_patches_ = 0;
  tile_.reset();
}

void NoiseEstimator::rebuild() {
  if (patches_ < kLook.first_patches || spectrum_.empty()) return;
  if (!tile_ || patches_ >= std::min(2 * tile_patches_, tile_patches_ + kLook.tile_patches)) {
    tile_ = spectrum_.tile();
    tile_patches_ = patches_;
  }
  const Eigen::Array3f missing = spectrum_.missing_variance();
  auto model = std::make_shared<NoiseModel>();
  for (std::size_t c = 0; c < 3; ++c) model->variance[c] = curve(c, missing[static_cast<Eigen::Index>(c)]);
  model->tile = tile_;
  model_ = std::move(model);
}

/// Measured levels, linear between, drawn towards a x + b in linear light: shot and read noise (Foi et al. 2008).
std::array<float, 256> NoiseEstimator::curve(std::size_t channel, float missing) const {
  const std::vector<Level>& levels = levels_[channel];
  std::vector<float> measured(levels.size());
  Eigen::Matrix2f normal = Eigen::Matrix2f::Zero();
  Eigen::Vector2f right = Eigen::Vector2f::Zero();
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (!(levels[i].weight > 0)) continue;
    measured[i] = std::max(missing * levels[i].variance / levels[i].weight - kLook.rounding, 0.0f);
    const float slope = slope_at(code_of(i)), linear = capture::srgb_to_linear(code_of(i) / 255);
    // Errors of a variance are proportional to it.
    const float weight = std::sqrt(levels[i].weight) / (measured[i] + kLook.rounding);
    const Eigen::Vector2f row = weight * slope * slope * Eigen::Vector2f(linear, 1);
    normal += row * row.transpose();
    right += row * (weight * measured[i]);
  }
  Eigen::Vector2f shot_read(normal(0, 0) > 0 ? std::max(right[0] / normal(0, 0), 0.0f) : 0, 0);
  if (normal.determinant() > 1e-4f * normal(0, 0) * normal(1, 1)) {
    const Eigen::Vector2f both = normal.inverse() * right;
    if (both.minCoeff() >= 0) {
      shot_read = both;
    } else if (both[0] < 0) {
      shot_read = {0, std::max(right[1] / normal(1, 1), 0.0f)};
    }
  }
  const auto fitted = [&](float code) {
    const float slope = slope_at(code);
    return slope * slope * (shot_read[0] * capture::srgb_to_linear(code / 255) + shot_read[1]);
  };
  // Measured over fitted, so that the curve between levels is smooth.
  std::vector<float> ratio(levels.size(), 1.0f);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const float model = fitted(code_of(i));
    if (!(levels[i].weight > 0) || !(model > 0)) continue;
    ratio[i] = (levels[i].weight * measured[i] / model + kLook.few_patches) / (levels[i].weight + kLook.few_patches);
  }
  std::array<float, 256> variance{};
  for (std::size_t code = 0; code < 255; ++code) {
    const float at = std::clamp((static_cast<float>(code) + 0.5f) / static_cast<float>(kLook.level_codes) - 0.5f, 0.0f,
                                static_cast<float>(ratio.size() - 1));
    const auto low = static_cast<std::size_t>(at), high = std::min(low + 1, ratio.size() - 1);
    const float part = at - static_cast<float>(low);
    variance[code] = ((1 - part) * ratio[low] + part * ratio[high]) * fitted(static_cast<float>(code));
  }
  return variance;
}

}  // namespace lumigraft::relight
