#include "reconstruct/kept_room/brick_codec.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "capture/error.h"
#include "capture/message_text.h"
#include "reconstruct/albedo/kept_albedo.h"
#include "reconstruct/albedo/parameters.h"
#include "reconstruct/kept_room/parameters.h"

namespace lumigraft::reconstruct {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are stored as they are in memory");

constexpr const KeptRoomParameters::File& kSteps = kKeptRoom.file;
constexpr std::size_t kKey_bytes = sizeof(BrickKey);
constexpr std::size_t kFieldPlanes = 2, kAlbedoPlanes = 4;  // numbers of a voxel

using Plane = std::array<std::uint16_t, kBrickVoxels>;
template <std::size_t planes>
using Planes = std::array<Plane, planes>;

/// Upper half of a float, rounded: 8 bits of mantissa (bfloat16). Positive numbers stay positive.
std::uint16_t upper_half(float value) {
  return static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(value) + 0x8000u) >> 16);
}
float from_upper_half(std::uint16_t half) { return std::bit_cast<float>(std::uint32_t{half} << 16); }

std::uint16_t steps_of(float value, int steps) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * static_cast<float>(steps)));
}

Planes<kFieldPlanes> planes_of(const FieldBrick& brick, float truncation_m) {
  Planes<kFieldPlanes> planes{};
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    planes[0][i] = steps_of(0.5f + 0.5f * brick.distance_m[i] / truncation_m, 2 * kSteps.distance_steps);
    planes[1][i] = upper_half(std::max(brick.weight[i], 0.0f));
  }
  return planes;
}

/// Sigma is 0 where unknown, else one more than its steps.
Planes<kAlbedoPlanes> planes_of(const AlbedoBrick& brick, float common_error) {
  Planes<kAlbedoPlanes> planes{};
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (!(brick.sigma[i] >= 0)) continue;
    const float sigma = sigma_later({brick.albedo[i], brick.sigma[i]}, common_error);
    if (!(sigma <= kAlbedoParameters.solver.max_sigma)) continue;
    for (std::size_t c = 0; c < 3; ++c)
      planes[c][i] = steps_of(brick.albedo[i][static_cast<Eigen::Index>(c)], kSteps.albedo_steps);
    planes[3][i] = static_cast<std::uint16_t>(1 + steps_of(sigma, kSteps.albedo_steps));
  }
  return planes;
}

[[noreturn]] void refuse_voxel(const char* what, const BrickKey& key, std::size_t voxel) {
  throw capture::InputError(
      capture::formatted("brick %d %d %d, voxel %zu: found %s", key[0], key[1], key[2], voxel, what));
}

std::shared_ptr<const FieldBrick> field_brick(const BrickKey& key, const Planes<kFieldPlanes>& planes,
                                              float truncation_m) {
  auto brick = std::make_shared<FieldBrick>();
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (planes[0][i] > 2 * kSteps.distance_steps)
      refuse_voxel("a distance beyond the truncation distance, allowed: within it", key, i);
    const float weight = from_upper_half(planes[1][i]);
    if (!std::isfinite(weight) || std::signbit(weight))
      refuse_voxel("a weight that is negative or not finite, allowed: 0 or more", key, i);
    brick->distance_m[i] =
        truncation_m * (static_cast<float>(planes[0][i]) / static_cast<float>(kSteps.distance_steps) - 1);
    brick->weight[i] = weight;
  }
  return brick;
}

std::shared_ptr<const AlbedoBrick> albedo_brick(const BrickKey& key, const Planes<kAlbedoPlanes>& planes) {
  constexpr float kStep = 1 / static_cast<float>(kSteps.albedo_steps);
  auto brick = std::make_shared<AlbedoBrick>();
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (std::max({planes[0][i], planes[1][i], planes[2][i]}) > kSteps.albedo_steps ||
        planes[3][i] > kSteps.albedo_steps + 1)
      refuse_voxel("an albedo or sigma above 1, allowed: 0 to 1", key, i);
    brick->albedo[i] = kStep * Eigen::Vector3f(planes[0][i], planes[1][i], planes[2][i]);
    brick->sigma[i] = planes[3][i] == 0 ? -1 : kStep * static_cast<float>(planes[3][i] - 1);
  }
  return brick;
}

/// Differences with the sign in the lowest bit: small ones have an upper byte of 0.
std::uint16_t folded(std::uint16_t difference) {
  const auto value = static_cast<std::int16_t>(difference);
  return static_cast<std::uint16_t>((static_cast<unsigned>(value) << 1) ^ static_cast<unsigned>(value >> 15));
}
std::uint16_t unfolded(std::uint16_t value) { return static_cast<std::uint16_t>((value >> 1) ^ (~(value & 1u) + 1u)); }

/// Deflates the keys and planes of bricks.
template <std::size_t planes, typename Brick>
Bytes deflated(const KeyedBricks<Brick>& bricks, float parameter) {
  const std::size_t voxels = bricks.size() * kBrickVoxels;
  Bytes raw(bricks.size() * kKey_bytes + 2 * planes * voxels);
  std::array<std::uint16_t, planes> before{};
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    std::memcpy(&raw[b * kKey_bytes], bricks[b].first.data(), kKey_bytes);
    const Planes<planes> numbers = planes_of(*bricks[b].second, parameter);
    for (std::size_t p = 0; p < planes; ++p) {
      std::uint8_t* low = &raw[bricks.size() * kKey_bytes + 2 * p * voxels + b * kBrickVoxels];
      for (std::size_t i = 0; i < kBrickVoxels; ++i) {
        const std::uint16_t value =
            folded(static_cast<std::uint16_t>(numbers[p][i] - std::exchange(before[p], numbers[p][i])));
        low[i] = static_cast<std::uint8_t>(value & 0xff);
        low[voxels + i] = static_cast<std::uint8_t>(value >> 8);
      }
    }
  }
  uLongf size = compressBound(raw.size());
  Bytes result(size);
  if (compress2(result.data(), &size, raw.data(), raw.size(), Z_BEST_SPEED) != Z_OK)
    throw std::runtime_error("bricks cannot be compressed, there is no memory");
  result.resize(size);
  return result;
}

/// `make(key, planes)` makes a brick.
template <std::size_t planes, typename Brick, typename Make>
KeyedBricks<Brick> inflated(std::span<const std::uint8_t> bytes, std::size_t count, const Make& make) {
  const std::size_t voxels = count * kBrickVoxels;
  Bytes raw(count * kKey_bytes + 2 * planes * voxels);
  uLongf size = raw.size();
  if (uncompress(raw.data(), &size, bytes.data(), bytes.size()) != Z_OK || size != raw.size())
    throw capture::InputError(capture::formatted("found bytes that do not inflate to %zu bricks", count));
  KeyedBricks<Brick> result;
  std::array<std::uint16_t, planes> value{};
  Planes<planes> numbers{};
  for (std::size_t b = 0; b < count; ++b) {
    BrickKey key{};
    std::memcpy(key.data(), &raw[b * kKey_bytes], kKey_bytes);
    for (const int k : key)
      if (k < -kSteps.max_coordinate || k > kSteps.max_coordinate)
        throw capture::InputError(capture::formatted("found a brick at %d, allowed: -%d to %d", k,
                                                     kSteps.max_coordinate, kSteps.max_coordinate));
    for (std::size_t p = 0; p < planes; ++p) {
      const std::uint8_t* low = &raw[count * kKey_bytes + 2 * p * voxels + b * kBrickVoxels];
      for (std::size_t i = 0; i < kBrickVoxels; ++i) {
        const auto stored = static_cast<std::uint16_t>(low[i] | low[voxels + i] << 8);
        numbers[p][i] = value[p] = static_cast<std::uint16_t>(value[p] + unfolded(stored));
      }
    }
    result.emplace_back(key, make(key, numbers));
  }
  return result;
}

}  // namespace

Bytes encode_bricks(const KeyedBricks<FieldBrick>& bricks, float truncation_m) {
  return deflated<kFieldPlanes>(bricks, truncation_m);
}

Bytes encode_bricks(const KeyedBricks<AlbedoBrick>& bricks, float common_error) {
  return deflated<kAlbedoPlanes>(bricks, common_error);
}

KeyedBricks<FieldBrick> decode_field_bricks(std::span<const std::uint8_t> bytes, std::size_t count,
                                            float truncation_m) {
  return inflated<kFieldPlanes, FieldBrick>(
      bytes, count, [&](const BrickKey& key, const auto& planes) { return field_brick(key, planes, truncation_m); });
}

KeyedBricks<AlbedoBrick> decode_albedo_bricks(std::span<const std::uint8_t> bytes, std::size_t count) {
  return inflated<kAlbedoPlanes, AlbedoBrick>(
      bytes, count, [](const BrickKey& key, const auto& planes) { return albedo_brick(key, planes); });
}

}  // namespace lumigraft::reconstruct
