// Path traces the true room of sessions with truth: compares the change with the truth's, and the noise of the delta
// path tracer with that of the difference of two pictures.
#include "server/truth/reference_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "capture/formats/picture_file.h"
#include "relight/reference/delta_path_tracer.h"
#include "relight/tracing/build_trace_scene.h"
#include "server/pipeline/service_config.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

constexpr int kReducedWidth = 40, kSamples = 64;

struct Case {
  const char* session;
  double bound;  ///< limit of the error relative to the change, beyond noise
};

fs::path folder_of(const std::string& session) {
  if (session == "recordings/tabletop") return fs::path(LUMIGRAFT_SOURCE_DIR) / session;
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  return extra ? fs::path(extra) / "sessions" / session : fs::path();
}

/// Box filter over squares of `factor` pixels.
capture::Image<float> smaller(const capture::Image<float>& image, int factor) {
  capture::Image<float> small(image.width / factor, image.height / factor, image.channels);
  for (int v = 0; v < small.height * factor; ++v) {
    for (int u = 0; u < small.width * factor; ++u) {
      for (int c = 0; c < image.channels; ++c) {
        small.at(u / factor, v / factor, c) += image.at(u, v, c) / static_cast<float>(factor * factor);
      }
    }
  }
  return small;
}

/// Noise of a picture, from two independent renderings, outside the objects.
double noise(const capture::Image<float>& a, const capture::Image<float>& b, const capture::Image<float>& coverage) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    if (coverage.data[i / 3] > 0) continue;
    sum += 0.5 * (a.data[i] - b.data[i]) * (a.data[i] - b.data[i]);
    ++count;
  }
  return std::sqrt(sum / count);
}

class ReferenceTruth : public testing::TestWithParam<Case> {};

TEST_P(ReferenceTruth, ChangeIsTheTruthsOwn) {
  const fs::path folder = folder_of(GetParam().session);
  if (folder.empty() || !fs::exists(folder)) {
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << GetParam().session;
  }
  const ServiceInput input = read_service({{}, folder, {}, {}}, replay_plan());
  auto scene = std::make_shared<relight::ReferenceScene>(*TrueRoom(input.session).at({}));
  scene->objects = relight::reference_objects_of(input.exhibit, 0);
  const relight::DeltaPathTracer tracer(scene);

  const fs::path truth = truth_folder(folder, 0);
  relight::PosedCamera camera{input.session.color.model, read_true_pose(truth / "pose.json").cast<float>()};
  const int factor = camera.model.width / kReducedWidth;
  camera.model.width /= factor;
  camera.model.height /= factor;
  camera.model.fx /= factor;
  camera.model.fy /= factor;
  camera.model.cx = (camera.model.cx + 0.5) / factor - 0.5;
  camera.model.cy = (camera.model.cy + 0.5) / factor - 0.5;
  const capture::Image<float> with = smaller(capture::read_radiance(truth / "augmented.exr"), factor);
  const capture::Image<float> without = smaller(capture::read_radiance(truth / "background.exr"), factor);

  relight::ReferenceSamples samples;
  samples.per_pixel = kSamples;
  const std::clock_t start = std::clock();
  const relight::ReferencePicture first = tracer.change(camera, samples);
  samples.seed = 1;
  const relight::ReferencePicture second = tracer.change(camera, samples);
  const std::clock_t changed = std::clock();
  double error2 = 0, change2 = 0, noise2 = 0, sum = 0, truth_sum = 0;
  for (std::size_t i = 0; i < with.data.size(); ++i) {
    if (first.coverage.data[i / 3] > 0 || second.coverage.data[i / 3] > 0) continue;
    const double truth_change = with.data[i] - without.data[i];
    const double change = 0.5 * (first.change.data[i] + second.change.data[i]);
    error2 += (change - truth_change) * (change - truth_change);
    change2 += truth_change * truth_change;
    noise2 += 0.25 * std::pow(first.change.data[i] - second.change.data[i], 2);
    sum += change;
    truth_sum += truth_change;
  }
  const double error = std::sqrt(std::max(error2 - noise2, 0.0) / change2);
  EXPECT_LT(error, GetParam().bound);
  EXPECT_NEAR(sum, truth_sum, 0.02 * std::abs(truth_sum) + 4 * std::sqrt(noise2))
      << "light that the room loses or gains in all";

  std::vector<capture::Image<float>> differences;
  for (const std::uint32_t seed : {2u, 3u}) {
    samples.seed = 2 * seed;
    capture::Image<float> difference = tracer.radiance(camera, samples, true);
    samples.seed = 2 * seed + 1;
    const capture::Image<float> real = tracer.radiance(camera, samples, false);
    for (std::size_t i = 0; i < real.data.size(); ++i) difference.data[i] -= real.data[i];
    differences.push_back(std::move(difference));
  }
  const double cost = static_cast<double>(std::clock() - changed) / static_cast<double>(changed - start);
  const double of_change = noise(first.change, second.change, first.coverage);
  const double of_difference = noise(differences[0], differences[1], first.coverage);
  EXPECT_LT(of_change, of_difference);
  const double fewer = std::pow(of_difference / of_change, 2);
  std::printf(
      "  %-20s error beyond noise %.3f; noise of the change %.5f, of the difference %.5f: %.0f times fewer samples, "
      "%.0f times less time\n",
      GetParam().session, error, of_change, of_difference, fewer, fewer * cost);
}

INSTANTIATE_TEST_SUITE_P(Sessions, ReferenceTruth,
                         testing::Values(Case{"recordings/tabletop", 0.06}, Case{"tabletop", 0.06},
                                         Case{"cornell", 0.2}, Case{"box-with-inside", 0.06},
                                         Case{"brushed-metal", 0.15}),
                         [](const testing::TestParamInfo<Case>& session) {
                           std::string name = session.param.session;
                           for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                           return name;
                         });

}  // namespace
}  // namespace lumigraft::server
