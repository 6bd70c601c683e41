#pragma once
// The picture of a live service, put together on the host: the camera's code values, multiplied where the light of real
// surfaces changes, behind the objects. While nothing but the camera's code values is new, no device has any work.
#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "relight/gpu/device.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

class CpuCompositor {
 public:
  /// Reads what LiveView left on the device for the blocks that screen.tiles chose among `considered`; other blocks
  /// stay as they are.
  void read(gpu::Device& device, const Screen& screen, const std::vector<char>& considered);
  /// `exposure`: code value 1 over the radiance that it stands for, linear.
  capture::Image<std::uint8_t> over(const capture::Image<std::uint8_t>& coded, float exposure) const;

 private:
  enum class Kind : char { untouched, smooth, real, object };
  void spread_fine(int left, int top);
  void over_smooth(int left, int top, capture::Image<std::uint8_t>* picture) const;
  void over_real(int left, int top, capture::Image<std::uint8_t>* picture) const;
  void over_object(int left, int top, float exposure, capture::Image<std::uint8_t>* picture) const;

  int width_ = 0, height_ = 0, columns_ = 0, fine_step_ = 1;
  std::vector<Kind> kinds_;     ///< of every block
  std::vector<float> smooth_;   ///< gain to the power of 1 / 2.4 of every cell of kSmoothStep
  std::vector<float> fine_;     ///< gain of one pixel of every fine_step_
  std::vector<float> gain_;     ///< of every pixel, from these
  std::vector<float> objects_;  ///< radiance times coverage, coverage
};

}  // namespace lumigraft::relight
