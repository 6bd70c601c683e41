// Sums over cells against the sum of every pixel around.
#include "relight/compose/outline_matte.h"

#include <cmath>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test::outline_matte_tests {
namespace {

/// A foreground left of the middle. The variance, along the outline, of where the colours of one side come from.
struct Straight {
  int width, height, edge;
  capture::Session session;
  relight::PixelRays rays;
  capture::Image<float> depth_m, places;  ///< places: row, its square
  cv::Mat1b front;
  relight::MatteReach reach;

  explicit Straight(int width_px)
      : width(width_px),
        height(width_px / 4),
        edge(width_px / 2),
        session(session_of(width, height, 280)),
        rays(session.color.model),
        depth_m(width, height, 1),
        places(width, height, 3),
        front(height, width, std::uint8_t{0}),
        reach(width) {
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        front(v, u) = u < edge ? 255 : 0;
        depth_m.at(u, v) = u < edge ? 0.5f : 1.0f;
        const auto row = static_cast<float>(v - height / 2);
        places.at(u, v, 0) = row;
        places.at(u, v, 1) = row * row;
      }
  }

  double by_cells(int u, int v) const {
    const relight::OutlineMatte::Mixture mixture = read({{u, v}}).front();
    EXPECT_TRUE(mixture.both);
    return mixture.values_behind[1] - mixture.values_behind[0] * mixture.values_behind[0];
  }
  /// By one reader.
  std::vector<relight::OutlineMatte::Mixture> read(const std::vector<cv::Point>& pixels) const {
    relight::CameraUpload picture(session.color);
    capture::FrameSet frame;
    auto color = std::make_shared<capture::Frame>();
    color->exposure = 1;
    color->encoded = capture::Image<std::uint8_t>(width, height, 3, 100);
    frame.color = color;
    picture.take(frame);
    const relight::CurrentDepth depth(rays, &depth_m, 0.008f);
    const relight::OutlineDistance away(front, reach.samples_px);
    relight::OutlineMatte matte({depth}, picture, {0, 0}, away, &places);
    matte.prepare(pixels);
    relight::OutlineMatte::Reader reader(matte);
    std::vector<relight::OutlineMatte::Mixture> mixtures;
    for (const cv::Point& pixel : pixels) mixtures.push_back(reader.at(pixel.x, pixel.y));
    return mixtures;
  }
  /// Of all pixels within the reach, with weights 1 / (1 + r²/s²)², s half of the reach, and less near the outline.
  double by_pixels(int u, int v) const {
    double weights = 0, sum = 0, squares = 0;
    const double spread = 0.5 * reach.samples_px;
    for (int y = v - reach.samples_px; y <= v + reach.samples_px; ++y)
      for (int x = std::max(u - reach.samples_px, edge); x <= u + reach.samples_px; ++x) {
        const double near = 1 / (1 + ((x - u) * (x - u) + (y - v) * (y - v)) / (spread * spread));
        const double sure = std::min(0.5 * (x - edge + 0.5) / double{reach.sigma_px}, 1.0);
        const double weight = near * near * sure * sure * sure;
        weights += weight;
        sum += weight * (y - height / 2);
        squares += weight * (y - height / 2) * (y - height / 2);
      }
    return squares / weights - sum / weights * (sum / weights);
  }
};

TEST(OutlineMatte, CellsSumColoursFromAsFarAsPixels) {
  for (const int width : {320, 640, 1280}) {
    const Straight scene(width);
    double cells = 0, pixels = 0;
    for (int du = -1; du <= 2; ++du)  // of all phases of the cells
      for (int dv = 0; dv < 4; ++dv) {
        const int u = scene.edge + du, v = scene.height / 2 + dv;
        cells += scene.by_cells(u, v);
        pixels += scene.by_pixels(u, v);
      }
    std::printf("%d: variance %.2f by cells, %.2f by pixels\n", width, cells / 16, pixels / 16);
    EXPECT_NEAR(cells / pixels, 1, 0.15) << width;
  }
}

/// A reader keeps sums between nodes from one pixel to the next.
TEST(OutlineMatte, OneReaderGivesWhatOneForEachPixelGives) {
  const Straight scene(640);
  std::vector<cv::Point> pixels;
  for (const int du : {0, 1, 5}) {
    for (int v = scene.height / 2; v < scene.height / 2 + 9; ++v)
      pixels.emplace_back(scene.edge + du, v);  // down a column
  }
  const std::vector<relight::OutlineMatte::Mixture> by_one = scene.read(pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const relight::OutlineMatte::Mixture own = scene.read({pixels[i]}).front();
    EXPECT_FLOAT_EQ(by_one[i].values_behind[0], own.values_behind[0]) << pixels[i];
    EXPECT_FLOAT_EQ(by_one[i].foreground, own.foreground) << pixels[i];
  }
}

}  // namespace
}  // namespace lumigraft::test::outline_matte_tests
