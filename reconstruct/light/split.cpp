#include "reconstruct/light/split.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "reconstruct/light/lamp_regions.h"
#include "reconstruct/light/variance_cut.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kMostPeaks = 64;
constexpr int kEdgePx = 2;                 ///< how far a lamp's blurred border reaches beyond its outline
constexpr int kSurroundPx = 5;             ///< the ring beyond the border that tells what surrounds it
constexpr float kContrast = 4.0f;          ///< a lamp's mean level over that of its surroundings
constexpr float kClippedContrast = 1.15f;  ///< where the level is a lower bound
constexpr float kWidestRad = 0.35f;        ///< RMS extent; a disk's is its radius / √2
constexpr float kWideRad = 0.16f;          ///< RMS extent beyond which one lamp is cut into several
constexpr float kLeastShare = 0.01f;       ///< of the lamps' energy, and half of it of the whole picture's
constexpr float kWhite = 0.99f;            ///< channels that are so much alike and clipped all are
constexpr double kOneThing = 0.9;          ///< of a glow's energy, in one piece of it
constexpr std::size_t kLeastClippedPx = 5;
constexpr std::size_t kLeastWhitePx = 2;  ///< where all channels clip: the sun is not much wider than a pixel;
constexpr float kSmallContrast = 1.5f;    ///< and so small a region must be so much above what is around it
constexpr double kRaggedest = 3;  ///< a clipped region's outline over that of a disk of its area; one ten times as long
                                  ///< as wide has 2.5, pixels of a slanting edge counted as they are

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
        rest_(radiance),
        level_(view.solid_angle_sr.size()),
        white_(level_.size()) {
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      if (!view.sees(pixel)) continue;
      for (int c = 0; c < 3; ++c) {
        float& value = rest_.data[3 * std::size_t{pixel} + c];
        if (!std::isfinite(value) || value < 0) value = 0;
      }
      level_[pixel] = colour(pixel).mean();
      white_[pixel] = clipped.data[pixel] && colour(pixel).minCoeff() > kWhite * colour(pixel).maxCoeff();
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
                     [](const Lamp& a, const Lamp& b) { return a.irradiance.sum() > b.irradiance.sum(); });
    result.rest = std::move(rest_);
    return result;
  }

 private:
  Eigen::Vector3f colour(std::uint32_t pixel) const {
    return Eigen::Map<const Eigen::Vector3f>(&rest_.data[3 * std::size_t{pixel}]);
  }

  float median_level(const Pixels& pixels) const {
    std::vector<float> levels;
    for (const std::uint32_t pixel : pixels) levels.push_back(level_[pixel]);
    if (levels.empty()) return 0;
    const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
    std::nth_element(levels.begin(), middle, levels.end());
    return *middle;
  }

  /// Lamps one by one from the brightest pixel down; each is taken out of `rest_` before the next is looked for.
  std::vector<Source> compact_sources() {
    std::vector<Source> sources;
    Pixels seen;
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      if (view_.sees(pixel)) seen.push_back(pixel);
    }
    const float floor = 1.5f * median_level(seen);
    // A white surface at the probe reflects at most flux / π: nothing below twice that is taken for a lamp, unless it
    // is clipped and its level says little.
    const float dimmest = std::max(floor, 2 * static_cast<float>(flux_) / kPi);
    std::vector<float> search = level_;
    for (int peaks = 0; peaks < kMostPeaks; ++peaks) {
      const auto peak = static_cast<std::uint32_t>(std::max_element(search.begin(), search.end()) - search.begin());
      const bool clipped = clipped_.data[peak] != 0;
      if (search[peak] <= 0 || (search[peak] < dimmest && !clipped)) break;
      Pixels region = search[peak] >= dimmest ? stable_region(search, view_, peak, floor) : Pixels{};
      bool is_lamp = !region.empty() && contrast(region) >= kContrast;
      if (!is_lamp && clipped) {
        region = connected_region(clipped_.data, view_, peak);
        is_lamp = sharply_clipped(region);
        if (!is_lamp && white_[peak]) {  // the sun, or before a wall of which a channel clips too
          Pixels core = connected_region(white_, view_, peak);
          is_lamp = sharply_clipped(core, kLeastWhitePx);
          if (is_lamp) region = std::move(core);
        }
      }
      if (is_lamp) is_lamp = extent_rad(region) <= kWidestRad;
      if (region.empty()) region.push_back(peak);
      if (is_lamp) {
        Source source = take_out(region);
        for (const PixelEnergy& p : source.pixels) search[p.pixel] = 0;
        sources.push_back(std::move(source));
      }
      for (const std::uint32_t pixel : region) search[pixel] = 0;
    }
    std::vector<Source> parts;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      const float extent = extent_rad(sources[i].pixels);
      const int count = extent > kWideRad ? static_cast<int>(std::ceil(std::pow(extent / kWideRad, 2.0f))) : 1;
      for (auto& pixels : variance_cut(std::move(sources[i].pixels), view_, std::min(count, max_lamps_))) {
        parts.push_back({std::move(pixels), sources[i].clipped, count > 1 ? static_cast<int>(i) : -1});
      }
    }
    return parts;
  }

  float contrast(const Pixels& region) const {
    double level = 0;
    for (const std::uint32_t pixel : region) level += level_[pixel];
    const Pixels ring = ring_around(region, view_, kEdgePx, kSurroundPx);
    if (ring.empty()) return 0;
    return static_cast<float>(level / region.size()) / std::max(median_level(ring), 1e-12f);
  }

  /// A clipped region is a lamp's picture where its edge is sharp almost all around; a lit surface fades, and where its
  /// texture makes it clip here and not there its outline is ragged.
  bool sharply_clipped(const Pixels& region, std::size_t least_px = kLeastClippedPx) const {
    if (region.size() < least_px || roundness(region, view_) < 0.1f) return false;
    const auto outline = static_cast<double>(ring_around(region, view_, 0, 1).size());
    if (outline > kRaggedest * std::sqrt(4 * std::numbers::pi * static_cast<double>(region.size()))) return false;
    if (contrast(region) < (region.size() < kLeastClippedPx ? kSmallContrast : kClippedContrast)) return false;
    double level = 0;
    std::size_t at_end = 0;
    for (const std::uint32_t pixel : region) {
      level += level_[pixel];
      at_end += at_end_of_view(pixel);
    }
    level /= region.size();
    const Pixels ring = ring_around(region, view_, kEdgePx, kEdgePx + 1);
    const auto darker =
        std::count_if(ring.begin(), ring.end(), [&](std::uint32_t pixel) { return level_[pixel] < 0.8 * level; });
    return at_end * 10 < region.size() && !ring.empty() && darker * 10 >= 7 * static_cast<std::ptrdiff_t>(ring.size());
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

  /// Fills the region and its blurred border from the ring around (weights 1/distance²) and returns what was above.
  Source take_out(const Pixels& region) {
    Source source;
    Pixels hole = region;
    const Pixels border = ring_around(region, view_, 0, kEdgePx);
    hole.insert(hole.end(), border.begin(), border.end());
    Pixels ring = ring_around(region, view_, kEdgePx, kSurroundPx);
    // Another lamp close by is no background.
    const float brightest = 2 * median_level(ring);
    std::erase_if(ring, [&](std::uint32_t pixel) { return level_[pixel] > brightest; });
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
      for (int c = 0; c < 3; ++c) rest_.data[3 * std::size_t{pixel} + c] = fill[c];
      level_[pixel] = fill.mean();
    }
    return source;
  }

  /// What is left may still be concentrated: a bright sky beside the sun, a lit curtain. Where a fifth of the picture's
  /// energy stands above four times the mean of the rest, that excess is cut into lamps too.
  void add_glow(std::vector<Source>& sources) {
    double rest_flux = 0, glow_flux = 0;
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      rest_flux += double(level_[pixel]) * view_.solid_angle_sr[pixel];
    }
    const float limit = static_cast<float>(4 * rest_flux / std::max(solid_angle_, 1e-12));
    std::vector<PixelEnergy> glow;
    for (std::uint32_t pixel = 0; pixel < level_.size(); ++pixel) {
      if (!view_.sees(pixel) || level_[pixel] <= limit) continue;
      const float share = 1 - limit / level_[pixel];
      glow.push_back({pixel, share * view_.solid_angle_sr[pixel] * colour(pixel)});
      glow_flux += glow.back().energy.mean();
    }
    const int left = max_lamps_ - static_cast<int>(sources.size());
    if (glow_flux < 0.2 * flux_ || left <= 0) return;
    for (const PixelEnergy& p : glow) give(p, -1);
    const int parts = std::min(left, 1 + static_cast<int>(std::pow(extent_rad(glow) / kWideRad, 2.0f)));
    // A window too wide for a lamp is one thing all the same.
    const int region = is_one(glow, glow_flux) ? kMostPeaks : -1;
    for (auto& pixels : variance_cut(std::move(glow), view_, parts)) {
      sources.push_back({std::move(pixels), false, region});
    }
  }

  /// Whether nearly all of it hangs together.
  bool is_one(const std::vector<PixelEnergy>& glow, double flux) const {
    const auto energy = [](const PixelEnergy& p) { return p.energy.mean(); };
    const auto peak =
        std::max_element(glow.begin(), glow.end(), [&](const auto& a, const auto& b) { return energy(a) < energy(b); });
    std::vector<std::uint8_t> mask(level_.size()), joined(level_.size());
    for (const PixelEnergy& p : glow) mask[p.pixel] = 1;
    for (const std::uint32_t pixel : connected_region(mask, view_, peak->pixel)) joined[pixel] = 1;
    double within = 0;
    for (const PixelEnergy& p : glow) within += joined[p.pixel] ? energy(p) : 0;
    return within > kOneThing * flux;
  }

  void give(const PixelEnergy& p, float sign) {
    for (int c = 0; c < 3; ++c) {
      rest_.data[3 * std::size_t{p.pixel} + c] += sign * p.energy[c] / view_.solid_angle_sr[p.pixel];
    }
  }

  /// Those that carry enough energy, at most `max_lamps_`; the others go back into the rest.
  std::vector<Source> strong_enough(std::vector<Source> sources) {
    std::stable_sort(sources.begin(), sources.end(),
                     [](const Source& a, const Source& b) { return a.energy().sum() > b.energy().sum(); });
    double all = 0;
    for (const Source& source : sources) all += source.energy().mean();
    std::size_t kept = 0;
    for (; kept < sources.size() && static_cast<int>(kept) < max_lamps_; ++kept) {
      const double energy = sources[kept].energy().mean();
      // A clipped lamp's true energy is unknown: it stays however little is left of it.
      if (sources[kept].clipped) continue;
      if (energy < kLeastShare * all || energy < 0.5f * kLeastShare * flux_) break;
    }
    for (std::size_t i = kept; i < sources.size(); ++i) {
      for (const PixelEnergy& p : sources[i].pixels) give(p, 1);
    }
    sources.resize(kept);
    return sources;
  }

  Lamp lamp(const Source& source) const {
    Lamp result;
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    double energy = 0, energy_squared = 0;  // the second per solid angle
    for (const PixelEnergy& p : source.pixels) {
      const double e = p.energy.mean();
      direction += e * view_.direction[p.pixel].cast<double>();
      energy += e;
      energy_squared += e * e / view_.solid_angle_sr[p.pixel];
    }
    result.direction = direction.normalized().cast<float>();
    result.irradiance = source.energy();
    // (∫L)² / ∫L²: the solid angle of a uniform lamp, and where the border is blurred that of its outline.
    result.solid_angle_sr = static_cast<float>(energy * energy / std::max(energy_squared, 1e-30));
    result.clipped = source.clipped;
    result.squareness = squareness(source, result.direction);
    result.region = source.region;
    return result;
  }

  float squareness(const Source& source, const Eigen::Vector3f& centre) const {
    const Eigen::Vector3f x = centre.unitOrthogonal(), y = centre.cross(x);
    std::vector<Eigen::Vector2d> places;
    std::vector<double> weights;
    double total = 0;
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const PixelEnergy& p : source.pixels) {
      const Eigen::Vector3f& d = view_.direction[p.pixel];
      places.emplace_back(d.dot(x) / d.dot(centre), d.dot(y) / d.dot(centre));
      weights.push_back(p.energy.mean());
      spread += weights.back() * places.back() * places.back().transpose();
      total += weights.back();
    }
    spread /= std::max(total, 1e-30);
    if (!(spread.determinant() > 1e-20)) return 0;
    const Eigen::Matrix2d whiten = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).operatorInverseSqrt();
    std::complex<double> fourth = 0;
    double length = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector2d w = whiten * places[i];
      const std::complex<double> z(w.x(), w.y());
      fourth += weights[i] * z * z * z * z;
      length += weights[i] * std::norm(z) * std::norm(z);
    }
    return static_cast<float>(std::abs(fourth) / length);
  }

  const capture::Image<std::uint8_t>& clipped_;
  const FisheyeView& view_;
  int max_lamps_;
  capture::Image<float> rest_;
  std::vector<float> level_;         ///< mean of the channels of rest_
  std::vector<std::uint8_t> white_;  ///< clipped in all channels
  double flux_ = 0;                  ///< ∫ level dω of the whole picture
  double solid_angle_ = 0;
};

}  // namespace

LightSplit split_lamps(const capture::Image<float>& radiance, const capture::Image<std::uint8_t>& clipped,
                       const FisheyeView& view, int max_lamps) {
  return Splitter(radiance, clipped, view, max_lamps).split();
}

}  // namespace lumigraft::reconstruct
