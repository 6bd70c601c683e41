#include "capture/camera/radiance.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lumigraft::capture {
namespace {

/// Pixel value from which the weight falls linearly to 0 at kFullScale, so that merging leaves no seam. Chosen by hand.
constexpr int kFadeStart = 230;

void finish_mask(RadianceImage& out) {
  const auto clipped = std::count(out.clipped.data.begin(), out.clipped.data.end(), std::uint8_t{1});
  out.clipped_fraction =
      out.clipped.data.empty() ? 0.0 : static_cast<double>(clipped) / static_cast<double>(out.clipped.data.size());
}

RadianceImage pass_through(const Frame& frame) {
  RadianceImage out;
  out.radiance = frame.radiance;
  out.clipped = Image<std::uint8_t>(frame.radiance.width, frame.radiance.height, 1);
  for (std::size_t i = 0; i < out.radiance.data.size(); ++i) {
    float& value = out.radiance.data[i];
    if (!std::isfinite(value)) {  // unknown: 0 is a lower bound
      out.clipped.data[i / 3] = 1;
      value = 0.0f;
    }
    value = std::max(value, 0.0f);
  }
  finish_mask(out);
  return out;
}

/// Inverse variance, up to a constant, of linear / exposure under rounding to 8 bits; fades out towards full scale.
std::array<std::array<double, 256>, 3> weights_of(const Response& response, double exposure) {
  std::array<std::array<double, 256>, 3> weights{};
  for (int c = 0; c < 3; ++c) {
    for (int code = 0; code < kFullScale; ++code) {
      const int below = std::max(code - 1, 0);
      const double rise = response.to_linear(static_cast<std::uint8_t>(code + 1), c) -
                          response.to_linear(static_cast<std::uint8_t>(below), c);
      const double slope = std::max(rise / (code + 1 - below), 1e-6);
      const double fade = std::min(1.0, static_cast<double>(kFullScale - code) / (kFullScale - kFadeStart));
      weights[c][code] = fade * (exposure / slope) * (exposure / slope);
    }
  }
  return weights;
}

}  // namespace

RadianceImage to_radiance(const Frame& frame, const Response& response) {
  if (!frame.radiance.empty()) return pass_through(frame);
  RadianceImage out;
  const Image<std::uint8_t>& codes = frame.encoded;
  out.radiance = Image<float>(codes.width, codes.height, 3);
  out.clipped = Image<std::uint8_t>(codes.width, codes.height, 1);
  std::array<std::array<float, 256>, 3> table{};
  for (int c = 0; c < 3; ++c) {
    for (int code = 0; code < 256; ++code) {
      table[c][code] = static_cast<float>(response.to_linear(static_cast<std::uint8_t>(code), c) / frame.exposure);
    }
  }
  for (std::size_t pixel = 0; pixel < out.clipped.data.size(); ++pixel) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint8_t code = codes.data[3 * pixel + c];
      out.radiance.data[3 * pixel + c] = table[c][code];
      out.clipped.data[pixel] |= code >= kFullScale ? 1 : 0;
    }
  }
  finish_mask(out);
  return out;
}

RadianceImage merge_bracket(const std::vector<std::shared_ptr<const Frame>>& frames, const Response& response) {
  if (frames.empty()) return {};
  std::vector<std::shared_ptr<const Frame>> sorted;  // shortest exposure first
  for (const auto& frame : frames) {
    if (!frame->radiance.empty() || frames.size() == 1) return to_radiance(*frame, response);
    sorted.push_back(frame);
  }
  std::ranges::stable_sort(sorted, {}, [](const auto& frame) { return frame->exposure; });

  std::vector<std::array<std::array<double, 256>, 3>> weights;
  weights.reserve(sorted.size());
  for (const auto& frame : sorted) weights.push_back(weights_of(response, frame->exposure));
  const Image<std::uint8_t>& shortest = sorted.front()->encoded;
  RadianceImage out;
  out.radiance = Image<float>(shortest.width, shortest.height, 3);
  out.clipped = Image<std::uint8_t>(shortest.width, shortest.height, 1);
  for (std::size_t i = 0; i < out.radiance.data.size(); ++i) {
    const int c = static_cast<int>(i % 3);
    double sum = 0.0, weight_sum = 0.0;
    for (std::size_t p = 0; p < sorted.size(); ++p) {
      const std::uint8_t code = sorted[p]->encoded.data[i];
      sum += weights[p][c][code] * response.to_linear(code, c) / sorted[p]->exposure;
      weight_sum += weights[p][c][code];
    }
    if (weight_sum > 0.0) {
      out.radiance.data[i] = static_cast<float>(sum / weight_sum);
    } else {
      out.radiance.data[i] = static_cast<float>(response.to_linear(shortest.data[i], c) / sorted.front()->exposure);
      out.clipped.data[i / 3] = 1;
    }
  }
  finish_mask(out);
  return out;
}

void undo_vignetting(RadianceImage& image, const Image<float>& gain) {
  for (std::size_t pixel = 0; pixel < gain.data.size(); ++pixel) {
    for (std::size_t c = 0; c < 3; ++c) image.radiance.data[3 * pixel + c] *= gain.data[pixel];
  }
}

}  // namespace lumigraft::capture
