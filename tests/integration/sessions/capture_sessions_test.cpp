// Reads every list of the sessions in LUMIGRAFT_EXTRA to its end; no warning is allowed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "capture/camera/radiance.h"
#include "capture/camera/srgb.h"
#include "capture/session/config.h"
#include "capture/source.h"

namespace lumigraft::reconstruct {
namespace {

using namespace std::chrono_literals;

std::filesystem::path sessions_folder() {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  return extra == nullptr ? std::filesystem::path() : std::filesystem::path(extra) / "sessions";
}

capture::Session load(const std::filesystem::path& folder, const std::vector<std::string>& overrides = {}) {
  const capture::ConfigTable root = capture::ConfigTable::load(folder / "session.toml", overrides);
  capture::Session session = capture::read_session(root);
  root.finish();
  return session;
}

class Sessions : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    folder_ = sessions_folder() / GetParam();
    if (!std::filesystem::exists(folder_ / "session.toml")) {
      GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << GetParam();
    }
  }
  std::filesystem::path folder_;
};

TEST_P(Sessions, ReadsWithoutAWarning) {
  const auto reader = capture::open_frames(load(folder_));
  std::uint64_t index = 0;
  while (const auto frame = reader->next(100ms)) {
    EXPECT_EQ(frame->index, index++);
    EXPECT_EQ(frame->color->encoded.width, 320);
    ASSERT_NE(frame->depth, nullptr);
    EXPECT_EQ(frame->depth->stamp.time_ns, frame->time_ns);
    EXPECT_EQ(frame->fisheye.size(), 1u);
    EXPECT_EQ(frame->warnings, std::vector<std::string>());
  }
  EXPECT_TRUE(reader->finished());
  EXPECT_GE(index, 12u);
}

/// Radiance error of one pixel value in the longest exposure in which `radiance` is not clipped.
double one_code_at(double radiance, const std::vector<std::shared_ptr<const capture::Frame>>& bracket) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& picture : bracket) {
    const double linear = radiance * picture->exposure;
    if (linear < capture::srgb_to_linear(230.0f / 255.0f)) {
      const float code = std::min(253.0f, std::floor(255.0f * capture::linear_to_srgb(static_cast<float>(linear))));
      const double slope = capture::srgb_to_linear((code + 1.0f) / 255.0f) - capture::srgb_to_linear(code / 255.0f);
      smallest = std::min(smallest, slope / picture->exposure);
    }
  }
  return smallest;
}

/// The bracket's pictures have noise of one pixel value (standard deviation) in addition to rounding.
TEST_P(Sessions, BracketMatchesTheRadianceItWasMadeFrom) {
  if (!std::filesystem::exists(folder_ / "fisheye-bracket.txt")) {
    GTEST_SKIP() << "no bracket in " << GetParam();
  }
  const capture::Session hdr_session = load(folder_);
  const capture::Session bracket_session = load(folder_, {"fisheye.source=images:fisheye-bracket.txt"});
  const auto hdr_frame = capture::open_frames(hdr_session)->next(100ms);
  const auto bracket_frame = capture::open_frames(bracket_session)->next(100ms);
  ASSERT_TRUE(hdr_frame && bracket_frame);
  ASSERT_EQ(bracket_frame->fisheye.size(), 4u);
  const capture::RadianceImage truth = capture::merge_bracket(hdr_frame->fisheye, hdr_session.fisheye->response);
  const capture::RadianceImage merged =
      capture::merge_bracket(bracket_frame->fisheye, bracket_session.fisheye->response);
  double sum_truth = 0.0;
  double sum_merged = 0.0;
  double worst = 0.0;
  double sum_squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < truth.radiance.data.size(); ++i) {
    const double t = truth.radiance.data[i];
    const double m = merged.radiance.data[i];
    if (merged.clipped.data[i / 3] != 0) {
      EXPECT_GE(t, 0.9 * m);
      continue;
    }
    sum_truth += t;
    sum_merged += m;
    const double error = (m - t) / one_code_at(t, bracket_frame->fisheye);
    worst = std::max(worst, std::abs(error));
    sum_squares += error * error;
    ++count;
  }
  EXPECT_LE(worst, 7.0);  // maximum of 786,432 noise values: 5.5 pixel values
  EXPECT_LE(std::sqrt(sum_squares / count), 1.1);
  EXPECT_NEAR(sum_merged / sum_truth, 1.0, 1e-3);
  RecordProperty("clipped_fraction", std::to_string(merged.clipped_fraction));
}

INSTANTIATE_TEST_SUITE_P(Extra, Sessions,
                         testing::Values("box-with-inside", "brushed-metal", "cornell", "tabletop", "tabletop-orbit"),
                         [](const auto& session) {
                           std::string name = session.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace lumigraft::reconstruct
