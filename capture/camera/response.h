#pragma once
// Camera response: 8-bit pixel values to linear values in [0, 1].
#include <array>
#include <cstdint>
#include <filesystem>

namespace lumigraft::capture {

/// Monotonic response of an 8-bit camera. linear = exposure · radiance, clipped at 1.
class Response {
 public:
  static Response srgb();
  static Response linear();
  /// Text table of 256 lines, one or three values in [0, 1] each that never decrease. Throws InputError.
  static Response from_file(const std::filesystem::path& path);

  float to_linear(std::uint8_t code, int channel = 1) const { return table_[channel][code]; }

 private:
  std::array<std::array<float, 256>, 3> table_{};
};

}  // namespace lumigraft::capture
