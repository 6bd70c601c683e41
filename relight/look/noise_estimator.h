#pragma once
// Measures a camera's noise while it runs.
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "relight/look/camera_motion.h"
#include "relight/look/noise_model.h"
#include "relight/look/noise_spectrum.h"

namespace lumigraft::relight {

/// Noise is the difference between two frames over √2, in patches that show nothing else: what both frames share varies
/// there less than the noise. Compared is where both show the same surface, to the nearest pixel: between other places
/// a texture would differ as noise does. Patches that differ more than others, where something moved, do not count.
/// Follows a camera that changes its gain.
class NoiseEstimator {
 public:
  NoiseEstimator();
  using Picture = capture::Image<std::uint8_t>;
  /// A new frame, sRGB pixel values. Frames of another size start anew.
  void take(std::shared_ptr<const Picture> picture, const Viewpoint& from);
  /// Null until enough patches were seen.
  const std::shared_ptr<const NoiseModel>& model() const { return model_; }

 private:
  struct Patch {
    std::array<NoiseSpectrum::Patch, 3> noise{};
    std::array<float, 3> level{}, variance{};
    std::array<bool, 3> clipped{};
    float mean_variance() const { return (variance[0] + variance[1] + variance[2]) / 3; }
  };
  struct Level {
    float weight = 0, variance = 0;  ///< sums over patches
  };

  struct Frame {
    std::shared_ptr<const Picture> picture;
    Eigen::Isometry3d T_tag_camera;
  };

  /// Of two frames; `before`: the same place in the earlier one.
  static std::optional<Patch> patch_at(const Picture& a, const Picture& b, const Eigen::Vector2i& at,
                                       const Eigen::Vector2i& before);
  void count(const Patch& patch);
  bool shows_motion(const Patch& patch);
  bool gain_changed(const std::vector<Patch>& patches);
  void forget();
  void rebuild();
  std::array<float, 256> curve(std::size_t channel, float missing) const;

  std::deque<Frame> last_;
  std::uint64_t frames_ = 0;
  std::array<std::vector<Level>, 3> levels_;
  NoiseSpectrum spectrum_;
  int patches_ = 0, tile_patches_ = 0;             ///< counted so far; and when the tile was made
  std::vector<float> ratios_;                      ///< of measured over known variance
  std::vector<std::deque<float>> last_variances_;  ///< of patches, by level
  std::shared_ptr<const NoiseTile> tile_;
  std::shared_ptr<const NoiseModel> model_;
};

}  // namespace lumigraft::relight
