#include "reconstruct/light/split.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "reconstruct/light/lamp_regions.h"
#include "reconstruct/light/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LightParameters::Split& kSplit = kLightParameters.split;

struct Source {
  std::vector<PixelEnergy> pixels;
  bool clipped = false;
  int region = -1;

  Eigen::Vector3f energy() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const PixelEnergy& p : pixels) sum += p.energy.cast<double>();
    return sum.cast<float>();
  }
};

class Splitter {
 public:
  Splitter(const capture::Image<float>& radiance, const capture::Image<std::uint8_t>& clipped, const FisheyeView& view,
           int max_lamps)
      : clipped_(clipped),
        view_(view),
        max_lamps_(max_lamps),
        residual_(radiance),
        level_(view.solid_angle_sr.size()),
        white_(level_.size()) {
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      if (!view.sees(pixel)) continue;
      for (int c = 0; c < 3; ++c) {
        float& value = residual_.data[3 * std::size_t{pixel} + c];
        if (!std::isfinite(value) || value < 0) value = 0;
      }
      level_[pixel] = colour(pixel).mean();
      white_[pixel] =
          clipped.data[pixel] && colour(pixel).minCoeff() > kSplit.min_white_ratio * colour(pixel).maxCoeff();
      flux_ += double(level_[pixel]) * view.solid_angle_sr[pixel];
      solid_angle_ += view.solid_angle_sr[pixel];
    }
  }

  LightSplit split() {
    std::vector<Source> sources = compact_sources();
    add_glow(sources);
    LightSplit result;
    for (const Source& source : strong_enough(std::move(sources))) result.lamps.push_back(lamp(source));
    std::stable_sort(result.lamps.begin(), result.lamps.end(),
                     [](const SplitLamp& a, const SplitLamp& b) { return a.irradiance.sum() > b.irradiance.sum(); });
    result.residual = std::move(residual_);
    return result;
  }

 private:
  Eigen::Vector3f colour(std::uint32_t pixel) const {
    return Eigen::Map<const Eigen::Vector3f>(&residual_.data[3 * std::size_t{pixel}]);
  }

  float median_level(const Pixels& pixels) const {
    std::vector<float> levels;
    for (const std::uint32_t pixel : pixels) levels.push_back(level_[pixel]);
    return median(levels);
  }

  /// Finds lamps from the brightest pixel down and removes each from `residual_` before it searches for the next.
  std::vector<Source> compact_sources() {
    std::vector<Source> sources;
    Pixels in_view;
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      if (view_.sees(pixel)) in_view.push_back(pixel);
    }
    const float floor = kSplit.floor_over_median * median_level(in_view);
    // A white surface at the probe reflects at most flux / π: nothing below a multiple of that is taken for a lamp,
    // unless it is clipped and its radiance a lower bound.
    const float dimmest =
        std::max(floor, kSplit.min_over_white * static_cast<float>(flux_) / std::numbers::pi_v<float>);
    std::vector<float> search = level_;
    std::erase_if(in_view, [&](std::uint32_t pixel) {
      return search[pixel] <= 0 || (search[pixel] < dimmest && !clipped_.data[pixel]);
    });
    std::stable_sort(in_view.begin(), in_view.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return search[a] > search[b]; });
    int others = 0;
    for (const std::uint32_t peak : in_view) {
      if (search[peak] <= 0) continue;  // part of a region
      const bool clipped = clipped_.data[peak] != 0;
      Pixels region = search[peak] >= dimmest ? stable_region(search, view_, peak, floor) : Pixels{};
      bool is_lamp = !region.empty() && contrast(region) >= kSplit.min_contrast;
      if (!is_lamp && clipped) {
        region = connected_region(clipped_.data, view_, peak);
        is_lamp = sharply_clipped(region);
        if (!is_lamp && white_[peak]) {  // the sun, or a lamp in front of a wall that clips in one channel
          Pixels core = connected_region(white_, view_, peak);
          is_lamp = sharply_clipped(core, kSplit.min_white_px);
          if (is_lamp) region = std::move(core);
        }
      }
      if (is_lamp) is_lamp = extent_rad(region) <= kSplit.max_extent_rad;
      if (region.empty()) region.push_back(peak);
      if (is_lamp) {
        Source source = remove_lamp(region);
        for (const PixelEnergy& p : source.pixels) search[p.pixel] = 0;
        sources.push_back(std::move(source));
      }
      for (const std::uint32_t pixel : region) search[pixel] = 0;
      if (!is_lamp && ++others >= kSplit.max_other_peaks) break;
    }
    return cut_wide(std::move(sources));
  }

  /// Cuts regions wider than one lamp; their parts share a region.
  std::vector<Source> cut_wide(std::vector<Source> sources) {
    std::vector<Source> parts;
    for (Source& source : sources) {
      const float ratio = extent_rad(source.pixels) / kSplit.max_piece_extent_rad;
      const int count = ratio > 1 ? static_cast<int>(std::ceil(std::pow(ratio, 2.0f))) : 1;
      const int region = count > 1 ? regions_++ : -1;
      for (auto& pixels : variance_cut(std::move(source.pixels), view_, std::min(count, max_lamps_))) {
        parts.push_back({std::move(pixels), source.clipped, region});
      }
    }
    return parts;
  }

  float contrast(const Pixels& region) const {
    double level = 0;
    for (const std::uint32_t pixel : region) level += level_[pixel];
    const Pixels ring = ring_around(region, view_, kSplit.edge_px, kSplit.surround_px);
    if (ring.empty()) return 0;
    return static_cast<float>(level / region.size()) / std::max(median_level(ring), 1e-12f);
  }

  /// Whether a clipped region may be as bright as a lamp. A surface lit just enough to clip does not clip in all
  /// channels: the one that measures it shows its contrast.
  bool may_be_bright(const Pixels& region) const {
    const auto median_of_darkest = [&](const Pixels& pixels) {
      std::vector<float> levels;
      for (const std::uint32_t pixel : pixels) levels.push_back(colour(pixel).minCoeff());
      return median(levels);
    };
    const auto measured = std::count_if(region.begin(), region.end(), [&](std::uint32_t pixel) {
      return colour(pixel).minCoeff() < kSplit.max_measured_ratio * colour(pixel).maxCoeff();
    });
    if (2 * measured <= static_cast<std::ptrdiff_t>(region.size())) return true;
    const Pixels ring = ring_around(region, view_, kSplit.edge_px, kSplit.surround_px);
    return !ring.empty() && median_of_darkest(region) >= kSplit.min_contrast * median_of_darkest(ring);
  }

  /// Whether a clipped region is the image of a lamp: its edge is sharp almost all around. The radiance of a lit
  /// surface fades gradually, and its texture gives the clipped part a ragged outline.
  bool sharply_clipped(const Pixels& region, std::size_t min_px = kSplit.min_clipped_px) const {
    if (region.size() < min_px || !may_be_bright(region)) return false;
    const RegionShape shape = shape_of(region, view_);
    if (shape.filled < kSplit.min_filled || shape.outline > kSplit.max_outline_ratio) return false;
    if (contrast(region) <
        (region.size() < kSplit.min_clipped_px ? kSplit.min_small_contrast : kSplit.min_clipped_contrast))
      return false;
    double level = 0;
    std::size_t at_end = 0;
    for (const std::uint32_t pixel : region) {
      level += level_[pixel];
      at_end += at_end_of_view(pixel);
    }
    level /= region.size();
    const Pixels ring = ring_around(region, view_, kSplit.edge_px, kSplit.edge_px + 1);
    const auto darker = std::count_if(ring.begin(), ring.end(),
                                      [&](std::uint32_t pixel) { return level_[pixel] < kSplit.edge_ratio * level; });
    return at_end * 10 < kSplit.max_view_end_tenths * region.size() && !ring.empty() &&
           darker * 10 >= kSplit.min_darker_tenths * static_cast<std::ptrdiff_t>(ring.size());
  }

  bool at_end_of_view(std::uint32_t pixel) const {
    const std::uint32_t width = view_.width, x = pixel % width, y = pixel / width;
    return x == 0 || y == 0 || x + 1 == width || y + 1 == static_cast<std::uint32_t>(view_.height) ||
           !view_.sees(pixel - 1) || !view_.sees(pixel + 1) || !view_.sees(pixel - width) || !view_.sees(pixel + width);
  }

  template <typename Items>
  float extent_rad(const Items& items) const {
    double weight = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    for (const auto& item : items) {
      const double w = view_.solid_angle_sr[index(item)];
      weight += w;
      first += w * view_.direction[index(item)].template cast<double>();
    }
    return static_cast<float>(std::sqrt(std::max(0.0, 1 - (first / weight).squaredNorm())));
  }
  static std::uint32_t index(std::uint32_t pixel) { return pixel; }
  static std::uint32_t index(const PixelEnergy& pixel) { return pixel.pixel; }

  /// Fills the region and its blurred border from the ring around it (weights 1/distance²); returns the energy above.
  Source remove_lamp(const Pixels& region) {
    Source source;
    Pixels hole = region;
    const Pixels border = ring_around(region, view_, 0, kSplit.edge_px);
    hole.insert(hole.end(), border.begin(), border.end());
    Pixels ring = ring_around(region, view_, kSplit.edge_px, kSplit.surround_px);
    // Another lamp close by is not background.
    const float max_level = 2 * median_level(ring);
    std::erase_if(ring, [&](std::uint32_t pixel) { return level_[pixel] > max_level; });
    std::vector<Eigen::Vector3f> around;
    for (const std::uint32_t pixel : ring) around.push_back(colour(pixel));
    for (const std::uint32_t pixel : hole) {
      Eigen::Vector3f fill = Eigen::Vector3f::Zero();
      float weights = 0;
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const float w = 1 / (view_.direction[ring[i]] - view_.direction[pixel]).squaredNorm();
        fill += w * around[i];
        weights += w;
      }
      if (weights > 0) fill /= weights;
      fill = fill.cwiseMin(colour(pixel));
      source.pixels.push_back({pixel, (colour(pixel) - fill) * view_.solid_angle_sr[pixel]});
      source.clipped |= clipped_.data[pixel] != 0;
      for (int c = 0; c < 3; ++c) residual_.data[3 * std::size_t{pixel} + c] = fill[c];
      level_[pixel] = fill.mean();
    }
    return source;
  }

  /// The residual may still be concentrated: a bright sky around the sun, a lit curtain. If the excess above a multiple
  /// of its mean radiance has enough of the image's energy, the excess is cut into lamps.
  void add_glow(std::vector<Source>& sources) {
    double residual_flux = 0, glow_flux = 0;
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      residual_flux += double(level_[pixel]) * view_.solid_angle_sr[pixel];
    }
    const float limit = static_cast<float>(kSplit.glow_over_mean * residual_flux / std::max(solid_angle_, 1e-12));
    std::vector<PixelEnergy> glow;
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      if (!view_.sees(pixel) || level_[pixel] <= limit) continue;
      const float fraction = 1 - limit / level_[pixel];
      glow.push_back({pixel, fraction * view_.solid_angle_sr[pixel] * colour(pixel)});
      glow_flux += glow.back().energy.mean();
    }
    const int left = max_lamps_ - static_cast<int>(sources.size());
    if (glow.empty() || glow_flux < kSplit.min_glow_fraction * flux_ || left <= 0) return;
    for (const PixelEnergy& p : glow) add_to_residual(p, -1);
    const int parts =
        std::min(left, 1 + static_cast<int>(std::pow(extent_rad(glow) / kSplit.max_piece_extent_rad, 2.0f)));
    // A window too wide for one lamp is still one object: its parts share a region.
    const int region = is_connected(glow, glow_flux) ? regions_ : -1;
    for (auto& pixels : variance_cut(std::move(glow), view_, parts)) {
      sources.push_back({std::move(pixels), false, region});
    }
  }

  /// Whether nearly all energy of the glow lies in the connected part around its peak.
  bool is_connected(const std::vector<PixelEnergy>& glow, double flux) const {
    const auto energy = [](const PixelEnergy& p) { return p.energy.mean(); };
    const auto peak =
        std::max_element(glow.begin(), glow.end(), [&](const auto& a, const auto& b) { return energy(a) < energy(b); });
    std::vector<std::uint8_t> mask(level_.size()), joined(level_.size());
    for (const PixelEnergy& p : glow) mask[p.pixel] = 1;
    for (const std::uint32_t pixel : connected_region(mask, view_, peak->pixel)) joined[pixel] = 1;
    double within = 0;
    for (const PixelEnergy& p : glow) within += joined[p.pixel] ? energy(p) : 0;
    return within > kSplit.min_connected_fraction * flux;
  }

  void add_to_residual(const PixelEnergy& p, float sign) {
    for (int c = 0; c < 3; ++c) {
      residual_.data[3 * std::size_t{p.pixel} + c] += sign * p.energy[c] / view_.solid_angle_sr[p.pixel];
    }
  }

  /// The sources with enough energy, at most `max_lamps_`; the others are added back to the residual.
  std::vector<Source> strong_enough(std::vector<Source> sources) {
    std::stable_sort(sources.begin(), sources.end(),
                     [](const Source& a, const Source& b) { return a.energy().sum() > b.energy().sum(); });
    double all = 0;
    for (const Source& source : sources) all += source.energy().mean();
    std::size_t kept = 0;
    for (; kept < sources.size() && static_cast<int>(kept) < max_lamps_; ++kept) {
      const double energy = sources[kept].energy().mean();
      // The true energy of a clipped lamp is unknown: it stays even if little of it was measured.
      if (sources[kept].clipped) continue;
      if (energy < kSplit.min_energy_fraction * all || energy < 0.5f * kSplit.min_energy_fraction * flux_) break;
    }
    for (std::size_t i = kept; i < sources.size(); ++i) {
      for (const PixelEnergy& p : sources[i].pixels) add_to_residual(p, 1);
    }
    sources.resize(kept);
    return sources;
  }

  SplitLamp lamp(const Source& source) const {
    SplitLamp result;
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    double energy = 0, energy_squared = 0;  // ∫L and ∫L²
    for (const PixelEnergy& p : source.pixels) {
      const double e = p.energy.mean();
      direction += e * view_.direction[p.pixel].cast<double>();
      energy += e;
      energy_squared += e * e / view_.solid_angle_sr[p.pixel];
    }
    result.direction = direction.normalized().cast<float>();
    result.irradiance = source.energy();
    // (∫L)² / ∫L² is the solid angle of a uniform lamp; a blurred border does not change it.
    result.solid_angle_sr = static_cast<float>(energy * energy / std::max(energy_squared, 1e-30));
    result.clipped = source.clipped;
    set_outline(source, result);
    result.region = source.region;
    return result;
  }

  void set_outline(const Source& source, SplitLamp& lamp) const {
    const Eigen::Vector3f& centre = lamp.direction;
    const Eigen::Vector3f x = centre.unitOrthogonal(), y = centre.cross(x);
    std::vector<Eigen::Vector2d> points;
    std::vector<double> weights;
    double total = 0;
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const PixelEnergy& p : source.pixels) {
      const Eigen::Vector3f& d = view_.direction[p.pixel];
      points.emplace_back(d.dot(x) / d.dot(centre), d.dot(y) / d.dot(centre));
      weights.push_back(p.energy.mean());
      spread += weights.back() * points.back() * points.back().transpose();
      total += weights.back();
    }
    spread /= std::max(total, 1e-30);
    if (!(spread.determinant() > 1e-20)) return;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(spread);
    const Eigen::Matrix2d whiten = eigen.operatorInverseSqrt();
    std::complex<double> fourth = 0;
    double length = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2d w = whiten * points[i];
      const std::complex<double> z(w.x(), w.y());
      fourth += weights[i] * z * z * z * z;
      length += weights[i] * std::norm(z) * std::norm(z);
    }
    lamp.squareness = static_cast<float>(std::abs(fourth) / length);
    // The symmetric root changes continuously, also where the axes of a square or a disk are undetermined.
    const double scale = std::sqrt(lamp.solid_angle_sr / (std::numbers::pi * std::sqrt(spread.determinant())));
    const Eigen::Matrix2f half_axes = (scale * eigen.operatorSqrt()).cast<float>();
    lamp.outline_u = half_axes(0, 0) * x + half_axes(1, 0) * y;
    lamp.outline_v = half_axes(0, 1) * x + half_axes(1, 1) * y;
  }

  const capture::Image<std::uint8_t>& clipped_;
  const FisheyeView& view_;
  int max_lamps_;
  int regions_ = 0;  ///< that were cut
  capture::Image<float> residual_;
  std::vector<float> level_;         ///< mean of the channels of residual_
  std::vector<std::uint8_t> white_;  ///< clipped in all channels
  double flux_ = 0;                  ///< ∫ level dω of the image
  double solid_angle_ = 0;
};

}  // namespace

LightSplit split_lamps(const capture::Image<float>& radiance, const capture::Image<std::uint8_t>& clipped,
                       const FisheyeView& view, int max_lamps) {
  return Splitter(radiance, clipped, view, max_lamps).split();
}

}  // namespace lumigraft::reconstruct
