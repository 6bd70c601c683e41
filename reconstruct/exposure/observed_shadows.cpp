#include "reconstruct/exposure/observed_shadows.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/exposure/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const ExposureParameters::Shadows& kShadows = kExposure.shadows;
constexpr int kCells = kShadows.cells;

/// The visible fraction of a lamp at a place.
struct Sample {
  Eigen::Vector2f at;  ///< projected
  float open, weight;
};

/// Encloses most of these points.
Eigen::AlignedBox2f box_of_most(const std::vector<Eigen::Vector2f>& points) {
  Eigen::AlignedBox2f box;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<float> sorted;
    for (const Eigen::Vector2f& p : points) sorted.push_back(p[axis]);
    std::sort(sorted.begin(), sorted.end());
    const auto cut = static_cast<std::size_t>(kShadows.outlier_fraction * static_cast<float>(sorted.size()));
    box.min()[axis] = sorted[cut];
    box.max()[axis] = sorted[sorted.size() - 1 - cut];
  }
  return box;
}

/// The smallest value of the cells around; places are farther apart than cells.
capture::Image<float> min_around(const capture::Image<float>& image) {
  capture::Image<float> rows = image, result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int u = std::max(x - kShadows.nearest_reach, 0); u <= std::min(x + kShadows.nearest_reach, image.width - 1);
           ++u)
        rows.at(x, y) = std::min(rows.at(x, y), image.at(u, y));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int v = std::max(y - kShadows.nearest_reach, 0); v <= std::min(y + kShadows.nearest_reach, image.height - 1);
           ++v)
        result.at(x, y) = std::min(result.at(x, y), rows.at(x, v));
  return result;
}

LampProjection projection_of(const PointLight& lamp, const Vector3f& towards_m) {
  LampProjection result;
  result.far = !lamp.distance_known;
  if (lamp.distance_known) result.origin_m = lamp.position_m;
  const Vector3f along = lamp.distance_known ? (towards_m - lamp.position_m).normalized() : (-lamp.direction).eval();
  const Vector3f across = along.unitOrthogonal();
  result.axes << across.transpose(), along.cross(across).transpose(), along.transpose();
  return result;
}

/// The view of one lamp.
class LampView {
 public:
  LampView(const PointLight& lamp, std::size_t index, const std::vector<ShadowedPlace>& places,
           const Vector3f& centre_m)
      : index_(index), shadow_{.lamp = lamp.id, .projection = projection_of(lamp, centre_m), .open = {}} {
    Eigen::AlignedBox2f box;
    for (const ShadowedPlace& place : places) {
      seen_.push_back(place.parts[index] > kShadows.min_part ? shadow_.projection(place.position_m) : std::nullopt);
      if (seen_.back()) box.extend(seen_.back()->head<2>());
    }
    if (box.isEmpty()) return;
    shadow_.min = box.min();
    shadow_.cell = std::max(box.sizes().maxCoeff() / (kCells - 1), std::numeric_limits<float>::min());
    nearest_ = capture::Image<float>(kCells, kCells, 1, std::numeric_limits<float>::infinity());
    for (const auto& at : seen_) {
      if (!at) continue;
      float& nearest = nearest_.data[cell_of(*at)];
      nearest = std::min(nearest, at->z());
    }
    nearest_ = min_around(nearest_);
    // A lamp that is covered from the fish-eye is more probably hidden elsewhere, too.
    const float other = lamp.covered ? kShadows.covered_prior : kShadows.other_prior;
    prior_ = capture::Image<float>(kCells, kCells, 1, other);
  }

  /// Lamps behind what moved are probably hidden by it, or by what is next to it.
  void add_moved(const std::vector<Vector3f>& moved_m) {
    if (prior_.empty()) return;
    const auto cell = [&](float x, float min) {
      return static_cast<int>(std::clamp(std::round((x - min) / shadow_.cell), 0.0f, kCells - 1.0f));
    };
    for (const Vector3f& p_m : moved_m) {
      const auto at = shadow_.projection(p_m);
      if (!at) continue;
      const float reach = kShadows.moved_reach_m / (shadow_.projection.far ? 1 : at->z());
      const Eigen::Vector2f last = shadow_.min.array() + shadow_.cell * (kCells - 1);
      if ((at->head<2>().array() + reach < shadow_.min.array()).any() ||
          (at->head<2>().array() - reach > last.array()).any())
        continue;
      for (int y = cell(at->y() - reach, shadow_.min.y()); y <= cell(at->y() + reach, shadow_.min.y()); ++y)
        for (int x = cell(at->x() - reach, shadow_.min.x()); x <= cell(at->x() + reach, shadow_.min.x()); ++x)
          if (nearest_.at(x, y) > at->z()) prior_.at(x, y) = 1;
    }
  }

  /// w_k of a place; 0 where the lamp does not light it.
  float prior(std::size_t place) const { return lights(place) ? prior_.data[cell_of(*seen_[place])] : 0; }

  void set_open(std::size_t place, float open, float part) {
    if (!lights(place)) return;
    samples_.push_back({seen_[place]->head<2>(), open, part * part / (part * part + kShadows.sigma * kShadows.sigma)});
  }

  /// Of the part of space with shadows; empty if there is none.
  std::optional<LampShadow> map() const;
  std::size_t index() const { return index_; }

 private:
  std::size_t cell_of(const Vector3f& at) const {
    const auto x = static_cast<std::size_t>(std::lround((at.x() - shadow_.min.x()) / shadow_.cell)),
               y = static_cast<std::size_t>(std::lround((at.y() - shadow_.min.y()) / shadow_.cell));
    return y * kCells + x;
  }
  /// Surface behind other surface is in that one's shadow, always.
  bool lights(std::size_t place) const {
    return seen_[place] && seen_[place]->z() <= kShadows.max_behind * nearest_.data[cell_of(*seen_[place])];
  }

  std::size_t index_;
  LampShadow shadow_;
  std::vector<std::optional<Vector3f>> seen_;  ///< places, projected; empty if the lamp does not light them
  capture::Image<float> nearest_, prior_;
  std::vector<Sample> samples_;
};

/// Fills what has no samples from around, from coarser to finer maps (push-pull; Gortler et al. 1996). `sums`: weighted
/// values, `weights`: at most 1 is used.
capture::Image<float> filled(const capture::Image<float>& sums, const capture::Image<float>& weights) {
  capture::Image<float> result(sums.width, sums.height, 1, 1);
  capture::Image<float> coarse;
  if (sums.width > 1) {
    capture::Image<float> half_sums(sums.width / 2, sums.height / 2, 1), half_weights = half_sums;
    for (int y = 0; y < half_sums.height; ++y)
      for (int x = 0; x < half_sums.width; ++x)
        for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
          half_sums.at(x, y) += sums.at(2 * x + dx, 2 * y + dy);
          half_weights.at(x, y) += weights.at(2 * x + dx, 2 * y + dy);
        }
    coarse = filled(half_sums, half_weights);
  }
  for (int y = 0; y < sums.height; ++y)
    for (int x = 0; x < sums.width; ++x) {
      const float weight = weights.at(x, y), own = weight > 0 ? sums.at(x, y) / weight : 1,
                  sure = std::min(weight, 1.0f);
      result.at(x, y) = sure * own + (1 - sure) * (coarse.empty() ? 1 : coarse.at(x / 2, y / 2));
    }
  return result;
}

/// Mean of 3 × 3 cells.
capture::Image<float> blurred(const capture::Image<float>& image) {
  capture::Image<float> result(image.width, image.height, 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      float sum = 0;
      for (int v = std::max(y - 1, 0); v <= std::min(y + 1, image.height - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, image.width - 1); ++u) sum += image.at(u, v);
      result.at(x, y) = sum;
    }
  return result;
}

std::optional<LampShadow> LampView::map() const {
  std::vector<Eigen::Vector2f> dark;
  for (const Sample& sample : samples_)
    if (sample.open < kShadows.max_open && sample.weight > kShadows.min_weight) dark.push_back(sample.at);
  if (dark.size() < kShadows.min_dark_places) return std::nullopt;
  const Eigen::AlignedBox2f box = box_of_most(dark);
  LampShadow result = shadow_;
  const float edge = (1 + 2 * kShadows.margin) * std::max(box.sizes().maxCoeff(), std::numeric_limits<float>::min());
  result.min = box.center().array() - edge / 2;
  result.cell = edge / (kCells - 1);
  capture::Image<float> sums(kCells, kCells, 1), weights = sums;
  for (const Sample& sample : samples_) {
    const Eigen::Vector2f at = (sample.at - result.min) / result.cell;
    if (!(at.array() > -0.5f).all() || !(at.array() < kCells - 0.5f).all()) continue;
    const int x = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
    sums.at(x, y) += sample.weight * sample.open;
    weights.at(x, y) += sample.weight;
  }
  result.open = filled(blurred(sums), blurred(weights));
  return result;
}

/// d_k of a place. `missing`: 1 - r.
std::vector<float> hidden_fractions(const std::vector<float>& parts, const std::vector<float>& priors, float missing) {
  float sure = kShadows.sigma * kShadows.sigma;
  float rest = 1;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    sure += std::pow(priors[k] * parts[k], 2.0f);
    rest -= parts[k];
  }
  sure += std::pow(kShadows.rest_prior * rest, 2.0f);
  std::vector<float> hidden(parts.size(), 0);
  // A lamp cannot be hidden twice: what is beyond all of its light is of the others.
  float left = missing;
  std::vector<bool> whole(parts.size(), false);
  for (std::size_t round = 0; round < parts.size(); ++round) {
    bool any = false;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (whole[k]) continue;
      hidden[k] = priors[k] * priors[k] * parts[k] * left / sure;
      if (hidden[k] < 1) continue;
      hidden[k] = 1;
      whole[k] = any = true;
    }
    if (!any) break;
    left = missing;
    sure = kShadows.sigma * kShadows.sigma + std::pow(kShadows.rest_prior * rest, 2.0f);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (whole[k])
        left -= parts[k];
      else
        sure += std::pow(priors[k] * parts[k], 2.0f);
    }
    left = std::max(left, 0.0f);
  }
  return hidden;
}

}  // namespace

std::shared_ptr<const LampShadows> observe_shadows(const std::vector<ShadowedPlace>& places,
                                                   const std::vector<Eigen::Vector3f>& moved_m,
                                                   const Illumination& light) {
  std::size_t dark = 0;
  Vector3f centre_m = Vector3f::Zero();
  for (const ShadowedPlace& place : places) {
    dark += place.ratio < 1 - kShadows.min_darkening;
    centre_m += place.position_m / static_cast<float>(places.size());
  }
  const auto is_covered = [](const PointLight& lamp) { return lamp.covered; };
  if (std::none_of(light.lights.begin(), light.lights.end(), is_covered) || places.size() < kExposure.min_matches ||
      static_cast<float>(dark) < kShadows.min_dark_fraction * static_cast<float>(places.size()))
    return nullptr;
  std::vector<LampView> views;
  for (std::size_t k = 0; k < light.lights.size(); ++k) {
    if (light.lights[k].visibility == PointLight::Visibility::dark) continue;
    views.emplace_back(light.lights[k], k, places, centre_m);
    views.back().add_moved(moved_m);
  }
  std::vector<float> priors(light.lights.size(), 0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const ShadowedPlace& place = places[i];
    for (const LampView& view : views) priors[view.index()] = view.prior(i);
    // Texture, gloss and the room's reflected light vary by the lower bound, and shadows are all of the upper one.
    const float darker = 1 - place.ratio;
    const float missing =
        darker * std::clamp((darker - kShadows.sigma) / (kShadows.min_darkening - kShadows.sigma), 0.0f, 1.0f);
    const std::vector<float> hidden = hidden_fractions(place.parts, priors, missing);
    for (LampView& view : views) view.set_open(i, 1 - hidden[view.index()], place.parts[view.index()]);
  }
  auto result = std::make_shared<LampShadows>();
  for (const LampView& view : views)
    if (auto shadow = light.lights[view.index()].covered ? view.map() : std::nullopt)
      result->lamps.push_back(*std::move(shadow));
  return result->lamps.empty() ? nullptr : result;
}

}  // namespace lumigraft::reconstruct
