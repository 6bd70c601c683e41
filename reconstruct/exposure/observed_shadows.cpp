#include "reconstruct/exposure/observed_shadows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "reconstruct/exposure/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Matrix3f;
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
      seen_.push_back(place.parts[index].mean() > kShadows.min_part ? shadow_.projection(place.position_m)
                                                                    : std::nullopt);
      if (seen_.back()) box.extend(seen_.back()->head<2>());
    }
    if (box.isEmpty()) return;
    shadow_.min = box.min();
    shadow_.cell = std::max(box.sizes().maxCoeff() / (kCells - 1), std::numeric_limits<float>::min());
    nearest_ = capture::Image<float>(kCells, kCells, 1, std::numeric_limits<float>::infinity());
    std::vector<const ShadowedPlace*> nearest_places(nearest_.data.size(), nullptr);
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!seen_[i]) continue;
      float& nearest = nearest_.data[cell_of(*seen_[i])];
      if (seen_[i]->z() >= nearest) continue;
      nearest = seen_[i]->z();
      nearest_places[cell_of(*seen_[i])] = &places[i];
    }
    leave_out_hidden(places, nearest_places);
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
  bool lights(std::size_t place) const { return seen_[place].has_value(); }
  /// Surface behind other surface is in that one's shadow, always. `nearest`: to the lamp, by cell; null: none.
  void leave_out_hidden(const std::vector<ShadowedPlace>& places, const std::vector<const ShadowedPlace*>& nearest) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!seen_[i]) continue;
      const auto cell = static_cast<int>(cell_of(*seen_[i]));
      bool hidden = false;
      for (int y = std::max(cell / kCells - kShadows.nearest_reach, 0);
           y <= std::min(cell / kCells + kShadows.nearest_reach, kCells - 1); ++y)
        for (int x = std::max(cell % kCells - kShadows.nearest_reach, 0);
             x <= std::min(cell % kCells + kShadows.nearest_reach, kCells - 1); ++x)
          if (nearest_.at(x, y) < seen_[i]->z()) {
            const ShadowedPlace& other = *nearest[static_cast<std::size_t>(y * kCells + x)];
            hidden |= places[i].normal.dot(other.position_m - places[i].position_m) > kShadows.min_above_m;
          }
      if (hidden) seen_[i].reset();
    }
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

/// The direction in which what is higher is seen from the lamp; zero right above and below it.
Eigen::Vector2f upwards(const LampProjection& projection, const Eigen::Vector2f& at) {
  const Vector3f up = projection.axes.col(2);
  const Eigen::Vector2f direction = up.head<2>() - (projection.far ? 0.0f : up.z()) * at;
  return direction.stableNormalized();
}

/// Occluders are assumed to be vertical: beyond the places `open` is as where they end below. `weights`: of the places
/// in cells; `map`: with `open` filled.
void continue_upwards(const capture::Image<float>& weights, LampShadow& map) {
  capture::Image<float> empty(kCells, kCells, 1);
  for (std::size_t i = 0; i < weights.data.size(); ++i) empty.data[i] = weights.data[i] > 0 ? 0.0f : 1.0f;
  const capture::Image<float> unknown = min_around(empty);
  const auto known = [&](int x, int y) { return unknown.at(x, y) == 0; };
  capture::Image<float> continued = map.open;
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      if (known(x, y)) continue;
      Eigen::Vector2f cell(static_cast<float>(x), static_cast<float>(y));
      // A vertical line projects to a straight one.
      const Eigen::Vector2f higher =
          static_cast<float>(kShadows.nearest_reach) * upwards(map.projection, map.min + map.cell * cell);
      bool among_places = false;  // one step more: at their border what is filled is of the cells beyond, too
      for (int step = 0; step < kCells; ++step) {
        cell -= higher;
        const auto u = static_cast<int>(std::lround(cell.x())), v = static_cast<int>(std::lround(cell.y()));
        const bool inside = u >= 0 && v >= 0 && u < kCells && v < kCells;
        if (!inside || (among_places && !known(u, v))) break;
        if (!known(u, v)) continue;
        continued.at(x, y) = map.open.at(u, v);
        if (std::exchange(among_places, true)) break;
      }
    }
  map.open = std::move(continued);
}

std::optional<LampShadow> LampView::map() const {
  std::vector<Eigen::Vector2f> dark;
  for (const Sample& sample : samples_)
    if (sample.open < kShadows.max_open && sample.weight > kShadows.min_weight) dark.push_back(sample.at);
  if (dark.size() < kShadows.min_dark_places) return std::nullopt;
  Eigen::AlignedBox2f box = box_of_most(dark);
  LampShadow result = shadow_;
  const Eigen::Vector2f higher = kShadows.upwards * box.sizes().maxCoeff() * upwards(result.projection, box.center());
  box.extend(Eigen::AlignedBox2f(box.min() + higher, box.max() + higher));
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
  continue_upwards(weights, result);
  return result;
}

/// N, from places that are not in shadow.
Matrix3f covariance_of(const std::vector<ShadowedPlace>& places) {
  std::vector<float> hues;
  for (const ShadowedPlace& place : places) {
    const float mean = place.ratio.mean();
    if (mean < 1 - kShadows.min_darkening || mean > 1 + kShadows.min_darkening) continue;
    for (int c = 0; c < 3; ++c) hues.push_back(std::abs(place.ratio[c] - mean));
  }
  constexpr float kSigmas = 1.48f;  // of a Gaussian in its median deviation
  const float sigma =
      hues.empty() ? kShadows.sigma : std::clamp(kSigmas * median(hues), kShadows.min_hue_sigma, kShadows.sigma);
  return kShadows.sigma * kShadows.sigma * Matrix3f::Ones() + sigma * sigma * Matrix3f::Identity();
}

/// d_k of a place. `missing`: 1 - r; `noise`: N.
std::vector<float> hidden_fractions(const std::vector<Array3f>& parts, const std::vector<float>& priors,
                                    const Array3f& missing, const Matrix3f& noise) {
  Array3f rest = Array3f::Ones();
  for (const Array3f& part : parts) rest -= part;
  std::vector<float> hidden(parts.size(), 0);
  // A lamp cannot be hidden twice: what is beyond all of its light is of the others.
  std::vector<bool> whole(parts.size(), false);
  for (std::size_t round = 0; round < parts.size(); ++round) {
    const Vector3f of_rest = kShadows.rest_prior * rest.matrix();
    Matrix3f covariance = noise + of_rest * of_rest.transpose();
    Array3f left = missing;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const Vector3f of_lamp = priors[k] * parts[k].matrix();
      if (whole[k])
        left -= parts[k];
      else
        covariance += of_lamp * of_lamp.transpose();
    }
    const Vector3f weighted = covariance.inverse() * left.matrix();
    bool any = false;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (whole[k]) continue;
      hidden[k] = std::clamp(priors[k] * priors[k] * parts[k].matrix().dot(weighted), 0.0f, 1.0f);
      if (hidden[k] == 1) whole[k] = any = true;
    }
    if (!any) break;
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
    dark += place.ratio.mean() < 1 - kShadows.min_darkening;
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
  const Matrix3f noise = covariance_of(places);
  std::vector<float> priors(light.lights.size(), 0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const ShadowedPlace& place = places[i];
    for (const LampView& view : views) priors[view.index()] = view.prior(i);
    // Texture, gloss and the room's reflected light vary by the lower bound, and shadows are all of the upper one.
    const float darker = 1 - place.ratio.mean();
    const float shadow = std::clamp((darker - kShadows.sigma) / (kShadows.min_darkening - kShadows.sigma), 0.0f, 1.0f);
    const std::vector<float> hidden = hidden_fractions(place.parts, priors, shadow * (1 - place.ratio), noise);
    for (LampView& view : views) view.set_open(i, 1 - hidden[view.index()], place.parts[view.index()].mean());
  }
  auto result = std::make_shared<LampShadows>();
  for (const LampView& view : views)
    if (auto shadow = light.lights[view.index()].covered ? view.map() : std::nullopt)
      result->lamps.push_back(*std::move(shadow));
  return result->lamps.empty() ? nullptr : result;
}

}  // namespace lumigraft::reconstruct
