#include "reconstruct/albedo/clipped_albedo.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/field/radiance_bound.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;
using Eigen::Vector3i;
using Voxel = std::pair<BrickKey, int>;  // brick, and index in it
constexpr const AlbedoParameters::Clipped& kClipped = kAlbedoParameters.clipped;

class Extension {
 public:
  Extension(const DistanceField& field, const MetalMask& metal, const IrradianceModel& room, const Illumination& light,
            BrickMap<AlbedoBrick>& bricks)
      : field_(field), metal_(metal), room_(room), light_(light), bricks_(bricks) {}

  void extend() {
    find_clipped();
    for (const Voxel& voxel : clipped_) {
      if (open_[voxel.first][static_cast<std::size_t>(voxel.second)] == 0) continue;
      const std::vector<Voxel> area = connected(voxel);
      if (static_cast<int>(area.size()) < kClipped.min_voxels) continue;
      if (const auto seen = seen_albedo(area)) write(area, estimate(area, *seen).matrix());
    }
    for (auto& [key, brick] : changed_) bricks_[key] = std::move(brick);
  }

 private:
  void find_clipped() {
    for (const auto& [key, brick] : field_.bricks) {
      if (!brick->color) continue;
      for (std::size_t i = 0; i < kBrickVoxels; ++i) {
        if (!radiance_is_bound(*brick, i) || !(brick->weight[i] > 0) ||
            std::abs(brick->distance_m[i]) >= field_.voxel_m ||
            metal_.contains(field_.voxel_m * voxel_in(key, static_cast<int>(i)).cast<float>()))
          continue;
        open_[key][i] = 1;
        clipped_.emplace_back(key, static_cast<int>(i));
      }
    }
  }

  std::vector<Voxel> connected(const Voxel& first) {
    std::vector<Voxel> area{first};
    open_[first.first][static_cast<std::size_t>(first.second)] = 0;
    for (std::size_t i = 0; i < area.size(); ++i) {
      const Vector3i centre = voxel_in(area[i].first, area[i].second);
      for (int side = 0; side < 6; ++side) {
        Vector3i next = centre;
        next[side >> 1] += (side & 1) != 0 ? 1 : -1;
        const Voxel voxel{brick_of(next), index_in_brick(next)};
        const auto brick = open_.find(voxel.first);
        if (brick == open_.end() || brick->second[static_cast<std::size_t>(voxel.second)] == 0) continue;
        brick->second[static_cast<std::size_t>(voxel.second)] = 0;
        area.push_back(voxel);
      }
    }
    return area;
  }

  /// What an area shows of its albedo.
  struct Seen {
    Array3f albedo;        ///< in channels that clip the largest lower bound
    std::bitset<3> known;  ///< channels that do not clip in most of the area
  };

  /// Of evenly chosen voxels, per channel: the median, above which are all that clip; else of the bounds the mean of
  /// the highest part, as single ones may be errors of the light.
  std::optional<Seen> seen_albedo(const std::vector<Voxel>& area) const {
    std::array<std::vector<float>, 3> bounds, ranked;
    const std::size_t step = area.size() / static_cast<std::size_t>(kClipped.voxels) + 1;
    for (std::size_t i = 0; i < area.size(); i += step) {
      const Vector3f position_m = field_.voxel_m * voxel_in(area[i].first, area[i].second).cast<float>();
      const std::optional<Vector3f> normal = field_.normal(position_m);
      if (!normal) continue;
      Vector3f irradiance = room_.gather(position_m, *normal, kClipped.gather_rays).irradiance;
      for (const PointLight& lamp : light_.lights) irradiance += lamp_irradiance(lamp, position_m, *normal).matrix();
      const auto voxel = static_cast<std::size_t>(area[i].second);
      const FieldBrick& brick = *field_.brick(area[i].first);
      const int clipped = brick.clipped_channels(voxel);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto k = static_cast<Eigen::Index>(c);
        bounds[c].push_back(std::numbers::pi_v<float> * brick.radiance(voxel)[k] /
                            std::max(irradiance[k], std::numeric_limits<float>::min()));
        ranked[c].push_back((clipped >> c & 1) != 0 ? std::numeric_limits<float>::infinity() : bounds[c].back());
      }
    }
    if (bounds[0].empty()) return std::nullopt;
    Seen seen;
    for (std::size_t c = 0; c < 3; ++c) {
      float albedo = median(ranked[c]);
      seen.known[c] = std::isfinite(albedo);
      if (!seen.known[c]) {
        const auto at = bounds[c].begin() +
                        static_cast<std::ptrdiff_t>(kClipped.quantile * static_cast<float>(bounds[c].size() - 1));
        std::nth_element(bounds[c].begin(), at, bounds[c].end());
        albedo = std::accumulate(at, bounds[c].end(), 0.0f) / static_cast<float>(bounds[c].end() - at);
      }
      seen.albedo[static_cast<Eigen::Index>(c)] = std::min(albedo, kClipped.max_albedo);
    }
    return seen;
  }

  /// Where light becomes less than what clips, or shadow falls on it, the surface continues with albedo that was
  /// solved; with its hue where some channels are known. Else the area ends where the material does, and the bound may
  /// be far below: of known channels the largest, as most of what is bright is grey or white; without one, albedo is as
  /// likely to be anywhere between the bound and white, of which the mean has the least error.
  Array3f estimate(const std::vector<Voxel>& area, const Seen& seen) const {
    std::array<std::vector<float>, 3> continued;
    int border = 0;
    for (const auto& [key, i] : area) {
      for (int side = 0; side < 6; ++side) {
        Vector3i next = voxel_in(key, i);
        next[side >> 1] += (side & 1) != 0 ? kClipped.beyond_voxels : -kClipped.beyond_voxels;
        const auto found = bricks_.find(brick_of(next));
        if (found == bricks_.end()) continue;
        const auto at = static_cast<std::size_t>(index_in_brick(next));
        if (!(found->second->sigma[at] > 0)) continue;
        ++border;
        const std::optional<Array3f> albedo = continuation(seen, found->second->albedo[at].array());
        for (int c = 0; albedo && c < 3; ++c) continued[static_cast<std::size_t>(c)].push_back((*albedo)[c]);
      }
    }
    const bool continues =
        border > 0 && static_cast<float>(continued[0].size()) >= kClipped.min_continued * static_cast<float>(border);
    Array3f albedo = seen.albedo;
    float brightest = 0;
    for (std::size_t c = 0; c < 3; ++c)
      if (seen.known[c]) brightest = std::max(brightest, seen.albedo[static_cast<Eigen::Index>(c)]);
    for (std::size_t c = 0; c < 3; ++c) {
      if (seen.known[c]) continue;
      float& of_channel = albedo[static_cast<Eigen::Index>(c)];
      const float otherwise = seen.known.any() ? brightest : 0.5f * (of_channel + kClipped.max_albedo);
      of_channel = std::max(of_channel, continues ? std::min(median(continued[c]), kClipped.max_albedo) : otherwise);
    }
    return albedo;
  }

  /// The area's albedo by that of a voxel beyond its border; none if that is of another material.
  static std::optional<Array3f> continuation(const Seen& seen, const Array3f& beyond) {
    if (seen.known.none()) {
      if ((beyond < kClipped.same_albedo * seen.albedo).any()) return std::nullopt;
      return beyond;
    }
    float most = 0, least = std::numeric_limits<float>::infinity(), sum = 0;
    for (Eigen::Index c = 0; c < 3; ++c) {
      if (!seen.known[static_cast<std::size_t>(c)]) continue;
      const float ratio = seen.albedo[c] / std::max(beyond[c], std::numeric_limits<float>::min());
      most = std::max(most, ratio);
      least = std::min(least, ratio);
      sum += std::log(ratio);
    }
    // Grain differs in brightness, another material in hue as well.
    if (least < kClipped.same_albedo * most || most < kClipped.same_grain || least > 1 / kClipped.same_grain)
      return std::nullopt;
    return std::exp(sum / static_cast<float>(seen.known.count())) * beyond;
  }

  void write(const std::vector<Voxel>& area, const Vector3f& albedo) {
    for (const auto& [key, i] : area) {
      std::shared_ptr<AlbedoBrick>& brick = changed_[key];
      if (!brick) {
        const auto before = bricks_.find(key);
        brick = before != bricks_.end() ? std::make_shared<AlbedoBrick>(*before->second) : unknown_brick();
      }
      brick->albedo[static_cast<std::size_t>(i)] = albedo;
      brick->sigma[static_cast<std::size_t>(i)] = kClipped.sigma;
    }
  }

  static std::shared_ptr<AlbedoBrick> unknown_brick() {
    auto brick = std::make_shared<AlbedoBrick>();
    brick->albedo.fill(Vector3f::Zero());
    brick->sigma.fill(-1);
    return brick;
  }

  const DistanceField& field_;
  const MetalMask& metal_;
  const IrradianceModel& room_;
  const Illumination& light_;
  BrickMap<AlbedoBrick>& bricks_;
  std::vector<Voxel> clipped_;
  std::unordered_map<BrickKey, std::array<char, kBrickVoxels>, BrickKeyHash> open_;  ///< 1: not in an area yet
  std::unordered_map<BrickKey, std::shared_ptr<AlbedoBrick>, BrickKeyHash> changed_;
};

}  // namespace

void extend_to_clipped(const DistanceField& field, const MetalMask& metal, const IrradianceModel& room,
                       const Illumination& light, BrickMap<AlbedoBrick>& bricks) {
  Extension(field, metal, room, light, bricks).extend();
}

}  // namespace lumigraft::reconstruct
