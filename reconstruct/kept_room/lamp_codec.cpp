#include "reconstruct/kept_room/lamp_codec.h"

#include <cmath>
#include <cstring>

#include "capture/error.h"
#include "capture/message_text.h"

namespace lumigraft::reconstruct {
namespace {

struct StoredLamp {
  float position_m[3] = {}, radius_m = 0, distance_log_sigma = 0;
  std::uint32_t flags = 0;
};
static_assert(sizeof(StoredLamp) == 24);
constexpr std::uint32_t kFlat = 1, kBeam = 2;

}  // namespace

std::vector<std::uint8_t> encode_lamps(const std::vector<KeptLamp>& lamps) {
  std::vector<std::uint8_t> bytes(lamps.size() * sizeof(StoredLamp));
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const KeptLamp& lamp = lamps[i];
    const StoredLamp stored{{lamp.position_m.x(), lamp.position_m.y(), lamp.position_m.z()},
                            lamp.radius_m,
                            lamp.distance_log_sigma,
                            (lamp.flat ? kFlat : 0) | (lamp.beam ? kBeam : 0)};
    std::memcpy(&bytes[i * sizeof(stored)], &stored, sizeof(stored));
  }
  return bytes;
}

std::vector<KeptLamp> decode_lamps(std::span<const std::uint8_t> bytes, std::size_t count) {
  if (bytes.size() != count * sizeof(StoredLamp))
    throw capture::InputError(capture::formatted("found %zu bytes for %zu lamps, allowed: %zu", bytes.size(), count,
                                                 count * sizeof(StoredLamp)));
  std::vector<KeptLamp> lamps;
  for (std::size_t i = 0; i < count; ++i) {
    StoredLamp stored;
    std::memcpy(&stored, &bytes[i * sizeof(stored)], sizeof(stored));
    const Eigen::Vector3f position_m = Eigen::Vector3f::Map(stored.position_m);
    if (!position_m.allFinite() || !(stored.radius_m >= 0) || !std::isfinite(stored.radius_m) ||
        !(stored.distance_log_sigma >= 0) || stored.flags > (kFlat | kBeam))
      throw capture::InputError(capture::formatted(
          "found lamp %zu with radius %g, sigma %g and flags %u, allowed: a finite position, both at least 0, flags to "
          "%u",
          i, static_cast<double>(stored.radius_m), static_cast<double>(stored.distance_log_sigma), stored.flags,
          kFlat | kBeam));
    lamps.push_back({position_m, stored.radius_m, stored.distance_log_sigma, (stored.flags & kFlat) != 0,
                     (stored.flags & kBeam) != 0});
  }
  return lamps;
}

}  // namespace lumigraft::reconstruct
