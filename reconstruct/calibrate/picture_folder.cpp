#include "reconstruct/calibrate/picture_folder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "capture/error.h"
#include "capture/formats/picture_file.h"

namespace lumigraft::reconstruct {
namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& file) {
  constexpr std::array kKinds = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp"};
  std::string kind = file.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::find(kKinds.begin(), kKinds.end(), kind) != kKinds.end();
}

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
  cv::Mat bgr;
  try {
    bgr = cv::imread(file.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    // too large to decode: reported as unreadable
  }
  if (bgr.empty() || bgr.cols > capture::kMaxSide_px || bgr.rows > capture::kMaxSide_px)
    throw capture::InputError(file.string() +
                              ": found no picture that can be decoded, allowed: PNG, JPEG, TIFF or BMP");
  capture::Frame picture;
  picture.encoded = capture::Image<std::uint8_t>(bgr.cols, bgr.rows, 3);
  cv::cvtColor(bgr, cv::Mat(bgr.rows, bgr.cols, CV_8UC3, picture.encoded.data.data()), cv::COLOR_BGR2RGB);
  return picture;
}

}  // namespace lumigraft::reconstruct
