#include "server/bench/measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "capture/camera/srgb.h"
#include "capture/error.h"
#include "capture/formats/picture_file.h"
#include "server/bench/flip.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

constexpr double kAffected = 2.0 / 255.0;

/// Sums of squares over a subset of the pixels.
struct Squares {
  double sum = 0, of = 0;
  std::size_t count = 0;
  void add(double difference, double reference) {
    sum += difference * difference;
    of += reference * reference;
    ++count;
  }
  double relative() const { return count == 0 ? std::nan("") : std::sqrt(sum / of); }
  double psnr_db() const { return count == 0 ? std::nan("") : -10.0 * std::log10(sum / static_cast<double>(count)); }
};

capture::Image<float> exposed(const std::filesystem::path& exr, double exposure) {
  capture::Image<float> picture = read_true_picture(exr);
  for (float& value : picture.data) value = std::clamp(static_cast<float>(value * exposure), 0.0f, 1.0f);
  return picture;
}

template <typename A, typename B>
bool same_size(const capture::Image<A>& a, const capture::Image<B>& b) {
  return a.width == b.width && a.height == b.height;
}

}  // namespace

TruePictures read_true_pictures(const std::filesystem::path& truth, double exposure) {
  TruePictures pictures;
  pictures.background = exposed(truth / "background.exr", exposure);
  pictures.augmented = exposed(truth / "augmented.exr", exposure);
  const std::filesystem::path mask = truth / "object_mask.png";
  const auto rgb = capture::with_error_context(mask.string(), [&] { return capture::read_encoded(mask); });
  pictures.coverage = capture::Image<float>(rgb.width, rgb.height, 1);
  for (std::size_t i = 0; i < pictures.coverage.data.size(); ++i) {
    pictures.coverage.data[i] = static_cast<float>(rgb.data[3 * i]) / 255.0f;
  }
  capture::refuse_if(
      !same_size(pictures.background, pictures.augmented) || !same_size(pictures.background, pictures.coverage),
      truth.string() + ": background.exr, augmented.exr and object_mask.png differ in size");
  return pictures;
}

Measures measure_picture(const capture::Image<std::uint8_t>& picture, const capture::Image<std::uint8_t>& camera,
                         const TruePictures& truth) {
  capture::refuse_if(!same_size(picture, truth.augmented) || !same_size(camera, truth.augmented),
                     "the picture is " + std::to_string(picture.width) + "x" + std::to_string(picture.height) +
                         ", its truth " + std::to_string(truth.augmented.width) + "x" +
                         std::to_string(truth.augmented.height));
  Squares relit, object, all_shown, affected_shown, object_shown, relit_shown;
  capture::Image<float> shown(picture.width, picture.height, 3), wanted(picture.width, picture.height, 3);
  for (std::size_t pixel = 0; pixel < truth.coverage.data.size(); ++pixel) {
    const double coverage = truth.coverage.data[pixel];
    std::array<double, 3> change{}, difference{}, true_linear{}, difference_shown{};
    bool affected = false;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t i = 3 * pixel + c;
      const float mu = truth.background.data[i], rho = truth.augmented.data[i];
      const float given = capture::srgb_table().linear[camera.data[i]];
      true_linear[c] = std::clamp(rho + (1.0 - coverage) * (static_cast<double>(given) - mu), 0.0, 1.0);
      wanted.data[i] = capture::linear_to_srgb(static_cast<float>(true_linear[c]));
      shown.data[i] = static_cast<float>(picture.data[i]) / 255.0f;
      change[c] = static_cast<double>(rho) - mu;
      difference[c] = capture::srgb_table().linear[picture.data[i]] - true_linear[c];
      difference_shown[c] = static_cast<double>(shown.data[i]) - wanted.data[i];
      affected |= std::abs(static_cast<double>(capture::linear_to_srgb(rho)) - capture::linear_to_srgb(mu)) > kAffected;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      all_shown.add(difference_shown[c], 1);
      if (affected) affected_shown.add(difference_shown[c], 1);
      if (affected && coverage == 0) {
        relit.add(difference[c], change[c]);
        relit_shown.add(difference_shown[c], 1);
      }
      if (coverage >= 0.5) {
        object.add(difference[c], true_linear[c]);
        object_shown.add(difference_shown[c], 1);
      }
    }
  }
  return {relit.relative(),       object.relative(),     all_shown.psnr_db(),     affected_shown.psnr_db(),
          object_shown.psnr_db(), relit_shown.psnr_db(), mean_flip(wanted, shown)};
}

}  // namespace lumigraft::server
