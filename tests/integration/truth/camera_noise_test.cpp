// The measured noise of a camera that moves through a room, against what its pictures differ from rendered ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "capture/camera/srgb.h"
#include "capture/session/config.h"
#include "capture/session/session.h"
#include "capture/source.h"
#include "relight/look/noise_estimator.h"
#include "server/truth/truth.h"

namespace lumigraft::test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLevels = 8;

/// Of one channel, in pixel values.
struct Residuals {
  struct Sum {
    double count = 0, squares = 0;
  };
  std::array<Sum, kLevels> levels{};
  double products = 0, squares = 0;  ///< of neighbours in a row

  /// `rendered`: linear. Where it is even but for its own noise, which the pictures have, too.
  void add(const capture::Image<std::uint8_t>& seen, const capture::Image<float>& rendered, int c) {
    constexpr int kHalf = 3;
    capture::Image<float> codes(seen.width, seen.height, 1);
    for (int v = 0; v < seen.height; ++v)
      for (int u = 0; u < seen.width; ++u) codes.at(u, v) = 255 * capture::linear_to_srgb(rendered.at(u, v, c));
    for (int v = kHalf; v + kHalf < seen.height; v += 2) {
      float last = NAN;
      for (int u = kHalf; u + kHalf < seen.width; ++u) {
        float sum = 0, squared = 0, by_x = 0, by_y = 0;
        for (int y = -kHalf; y <= kHalf; ++y) {
          for (int x = -kHalf; x <= kHalf; ++x) {
            const float value = codes.at(u + x, v + y) - codes.at(u, v);
            sum += value;
            squared += value * value;
            by_x += static_cast<float>(x) * value;
            by_y += static_cast<float>(y) * value;
          }
        }
        constexpr float kPixels = (2 * kHalf + 1) * (2 * kHalf + 1), kSpread = kPixels * kHalf * (kHalf + 1) / 3;
        const float off_plane = squared - sum * sum / kPixels - (by_x * by_x + by_y * by_y) / kSpread;
        const float level = codes.at(u, v) + sum / kPixels;
        // Within a pixel value: texture is more. Of the noise of rendering, up to one, this prefers the least.
        const bool even = off_plane < kPixels && level < 245;
        const float off = even ? static_cast<float>(seen.at(u, v, c)) - level : NAN;
        if (!std::isnan(off)) {
          Sum& of_level = levels[static_cast<std::size_t>(level) * kLevels / 256];
          of_level.count += 1;
          of_level.squares += off * off;
          if (!std::isnan(last)) {
            products += off * last;
            squares += off * off;
          }
        }
        last = off;
      }
    }
  }

  double all() const {
    double count = 0;
    for (const Sum& sum : levels) count += sum.count;
    return count;
  }
};

double correlation_of(const relight::NoiseTile& tile, std::size_t c) {
  double products = 0, squares = 0;
  for (int v = 0; v < relight::NoiseTile::kEdge; ++v) {
    for (int u = 0; u < relight::NoiseTile::kEdge; ++u) {
      products += tile.at(u, v)[c] * tile.at(u + 1, v)[c];
      squares += tile.at(u, v)[c] * tile.at(u, v)[c];
    }
  }
  return products / squares;
}

void is_that_of_the_camera(const fs::path& folder) {
  const capture::Session session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  const auto frames = capture::open_frames(session);
  relight::NoiseEstimator estimator;
  std::array<Residuals, 3> residuals;
  while (const auto frame = frames->next(std::chrono::seconds(1))) {
    const fs::path truth = server::truth_folder(folder, static_cast<int>(frame->index));
    const auto& picture = frame->color->encoded;
    const Eigen::Isometry3d T_tag_camera = server::read_true_pose(truth / "pose.json");
    estimator.take(std::make_shared<const capture::Image<std::uint8_t>>(picture),
                   {session.color.model, T_tag_camera, frame->depth ? &frame->depth->depth_m : nullptr});
    if (frame->index % 6 != 0) continue;
    capture::Image<float> rendered = server::read_true_picture(truth / "background.exr");
    for (float& value : rendered.data) value *= static_cast<float>(session.color.exposure);
    for (int c = 0; c < 3; ++c) residuals[static_cast<std::size_t>(c)].add(picture, rendered, c);
  }
  ASSERT_TRUE(estimator.model());
  int compared = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < kLevels; ++i) {
      const Residuals::Sum& sum = residuals[c].levels[i];
      if (sum.count < 0.1 * residuals[c].all()) continue;  // few patches: drawn towards the fitted curve
      const std::size_t middle = (2 * i + 1) * 128 / kLevels;
      const double measured = std::sqrt(estimator.model()->variance[c][middle] + 1.0 / 12);  // of rounding
      std::printf("noise: %-15s channel %zu, level %3zu: %.2f, true %.2f\n", folder.filename().c_str(), c, middle,
                  measured, std::sqrt(sum.squares / sum.count));
      EXPECT_NEAR(measured / std::sqrt(sum.squares / sum.count), 1, 0.17) << c << ", " << middle;
      ++compared;
    }
    EXPECT_NEAR(correlation_of(*estimator.model()->tile, c), residuals[c].products / residuals[c].squares, 0.1) << c;
  }
  EXPECT_GE(compared, 6);
}

TEST(CameraNoise, IsMeasuredInTheRecording) {
  is_that_of_the_camera(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop");
}

TEST(CameraNoise, IsMeasuredInAnExtraSession) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  const fs::path folder = fs::path(extra ? extra : "") / "sessions/tabletop-orbit";
  if (!extra || !fs::exists(folder)) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/tabletop-orbit";
  is_that_of_the_camera(folder);
}

}  // namespace
}  // namespace lumigraft::test
