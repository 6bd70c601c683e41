#include "tests/truth/score.h"

#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "capture/response.h"

namespace lumigraft {
namespace {

cv::Mat read_picture(const std::filesystem::path& path) {
  setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 0);  // OpenCV 4.6 refuses EXR without it
  cv::Mat picture = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  if (picture.empty()) {
    throw std::runtime_error("cannot read " + path.string());
  }
  return picture;
}

/// Linear display value in [0, 1] of channel c (OpenCV's order) at a pixel.
double linear_at(const cv::Mat& picture, int y, int x, int c, double exposure) {
  if (picture.depth() == CV_8U) {
    return srgb_to_linear(static_cast<float>(picture.ptr<unsigned char>(y)[x * picture.channels() + c]) / 255.0f);
  }
  const double value = picture.ptr<float>(y)[x * picture.channels() + c] * exposure;
  return std::min(1.0, std::max(0.0, value));
}

double psnr(double squares, double count) { return count == 0 ? NAN : -10.0 * std::log10(squares / count); }

}  // namespace

Score score_picture(const std::filesystem::path& picture_path, const std::filesystem::path& camera_path,
                    const std::filesystem::path& truth, double exposure) {
  const cv::Mat picture = read_picture(picture_path);
  const cv::Mat camera = read_picture(camera_path);
  const cv::Mat background = read_picture(truth / "background.exr");
  const cv::Mat augmented = read_picture(truth / "augmented.exr");
  const cv::Mat mask = read_picture(truth / "object_mask.png");
  for (const cv::Mat* other : {&camera, &background, &augmented, &mask}) {
    if (other->size() != picture.size()) {
      throw std::runtime_error(picture_path.string() + " and its truth differ in size");
    }
  }
  double relit_squares = 0, relit_change = 0, object_squares = 0, object_truth = 0;
  double all_squares = 0, affected_squares = 0, unchanged_squares = 0, all_count = 0, affected_count = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const double coverage = mask.ptr<unsigned char>(y)[x * mask.channels()] / 255.0;
      double difference_linear[3], change[3], truth_linear[3], difference_shown[3], difference_unchanged[3];
      bool affected = false;
      for (int c = 0; c < 3; ++c) {
        const double mu = linear_at(background, y, x, c, exposure);
        const double rho = linear_at(augmented, y, x, c, exposure);
        const double given = linear_at(camera, y, x, c, exposure);
        const double result = linear_at(picture, y, x, c, exposure);
        truth_linear[c] = std::min(1.0, std::max(0.0, rho + (1.0 - coverage) * (given - mu)));
        change[c] = rho - mu;
        difference_linear[c] = result - truth_linear[c];
        const double shown = linear_to_srgb(static_cast<float>(truth_linear[c]));
        difference_shown[c] = linear_to_srgb(static_cast<float>(result)) - shown;
        difference_unchanged[c] = linear_to_srgb(static_cast<float>(given)) - shown;
        affected |=
            std::abs(linear_to_srgb(static_cast<float>(rho)) - linear_to_srgb(static_cast<float>(mu))) > 2.0 / 255.0;
      }
      for (int c = 0; c < 3; ++c) {
        all_squares += difference_shown[c] * difference_shown[c];
        unchanged_squares += difference_unchanged[c] * difference_unchanged[c];
        all_count += 1;
        if (affected) {
          affected_squares += difference_shown[c] * difference_shown[c];
          affected_count += 1;
        }
        if (affected && coverage == 0) {
          relit_squares += difference_linear[c] * difference_linear[c];
          relit_change += change[c] * change[c];
        }
        if (coverage >= 0.5) {
          object_squares += difference_linear[c] * difference_linear[c];
          object_truth += truth_linear[c] * truth_linear[c];
        }
      }
    }
  }
  return {std::sqrt(relit_squares / relit_change), std::sqrt(object_squares / object_truth),
          psnr(all_squares, all_count), psnr(affected_squares, affected_count), psnr(unchanged_squares, all_count)};
}

}  // namespace lumigraft
