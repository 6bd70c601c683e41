#include "reconstruct/calibrate/pictures.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

#include "capture/camera/radiance.h"
#include "capture/error.h"
#include "capture/formats/coded_picture.h"
#include "capture/formats/picture_file.h"
#include "reconstruct/pose/gray_regions.h"

namespace lumigraft::reconstruct {
namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& file) {
  constexpr std::array kKinds = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp"};
  std::string kind = file.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::find(kKinds.begin(), kKinds.end(), kind) != kKinds.end();
}

constexpr std::array<float, 3> kLuminance = {0.2126f, 0.7152f, 0.0722f};  // Rec. 709

}  // namespace

std::vector<fs::path> picture_files(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.is_regular_file() && is_picture(entry.path())) files.push_back(entry.path());
  if (error) throw capture::InputError(folder.string() + ": " + error.message() + ", allowed: a folder of pictures");
  if (files.empty())
    throw capture::InputError(folder.string() + ": found no picture, allowed: .png, .jpg, .tiff or .bmp files");
  std::sort(files.begin(), files.end());
  return files;
}

capture::Frame read_any_picture(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
  capture::Image<std::uint8_t> decoded = capture::with_error_context(
      file.string(), [&] { return capture::decode_coded_picture(bytes, capture::kMaxSide_px); });
  if (decoded.empty())
    throw capture::InputError(file.string() +
                              ": found no picture that can be decoded, allowed: PNG, JPEG, TIFF or BMP");
  capture::Frame picture;
  picture.encoded = capture::without_alpha(std::move(decoded));
  return picture;
}

capture::Image<std::uint16_t> linear_light(const capture::Frame& picture, const capture::Response& response) {
  const bool encoded = !picture.encoded.empty();
  capture::Image<std::uint16_t> light(encoded ? picture.encoded.width : picture.radiance.width,
                                      encoded ? picture.encoded.height : picture.radiance.height, 1);
  const float gain = encoded ? 1.0f : detector_gain(picture.radiance);
  for (std::size_t i = 0; i < light.data.size(); ++i) {
    float sum = 0;
    bool cut = false;
    for (int c = 0; c < 3; ++c) {
      const std::size_t at = 3 * i + static_cast<std::size_t>(c);
      const float channel = encoded ? response.to_linear(std::min(picture.encoded.data[at], capture::kFullScale), c)
                                    : gain * picture.radiance.data[at];
      sum += kLuminance[static_cast<std::size_t>(c)] * channel;
      cut = cut || (encoded && picture.encoded.data[at] >= capture::kFullScale);
    }
    cut = cut || sum > 1.0f;
    const auto halves = static_cast<std::uint16_t>(std::lround(32767.0f * std::clamp(sum, 0.0f, 1.0f)));
    light.data[i] = static_cast<std::uint16_t>(2 * halves + (cut ? 1 : 0));
  }
  return light;
}

}  // namespace lumigraft::reconstruct
