#include "relight/objects/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "capture/camera/srgb.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using Bytes = std::array<std::uint8_t, 3>;

template <typename Color>
TexturePicture picture(int width, int height, Color color) {
  auto image = std::make_shared<capture::Image<std::uint8_t>>(width, height, 3);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const Bytes bytes = color(u, v);
      for (int c = 0; c < 3; ++c) image->at(u, v, c) = bytes[static_cast<std::size_t>(c)];
    }
  }
  return image;
}

TexturePicture checker(int edge) {
  return picture(edge, edge, [](int u, int v) { return (u + v) % 2 ? Bytes{255, 255, 255} : Bytes{0, 0, 0}; });
}

TEST(Texture, RepeatsAndIsLinearBetweenTexelCentres) {
  const Texture texture(picture(2, 1,
                                [](int u, int) {
                                  return u ? Bytes{255, 0, 0} : Bytes{0, 0, 0};
                                }),
                        Texels::linear, false);
  EXPECT_NEAR(texture.at({0.25f, 0.5f}, 1).x(), 0, 1e-6);
  EXPECT_NEAR(texture.at({0.75f, 0.5f}, 1).x(), 1, 1e-6);
  EXPECT_NEAR(texture.at({0.5f, 0.5f}, 1).x(), 0.5, 1e-6);
  EXPECT_NEAR(texture.at({1.0f, 0.5f}, 1).x(), 0.5, 1e-6);
  EXPECT_NEAR(texture.at({-3.25f, 7.5f}, 1).x(), 1, 1e-6);
}

// A ramp of 4 texels along each axis, 0 to 3 / 5, at texel centres and half way between them.
TEST(Texture, WrapModes) {
  const Texture texture(picture(4, 4,
                                [](int u, int v) {
                                  return Bytes{static_cast<std::uint8_t>(51 * u), static_cast<std::uint8_t>(51 * v), 0};
                                }),
                        Texels::linear, true);
  const struct {
    Wrap wrap;
    std::array<float, 6> texels;  ///< expected at these coordinates, in texels
  } cases[] = {{Wrap::repeat, {3, 2, 0, 1.5f, 1.5f, 3}},
               {Wrap::clamp_to_edge, {0, 0, 3, 3, 0, 0}},
               {Wrap::mirrored_repeat, {0, 1, 3, 1.5f, 1.5f, 0}}};
  const std::array<float, 6> at = {-0.5f, -1.5f, 4.5f, 6, -14, -8.5f};  // texels from the edge
  for (const auto& c : cases) {
    for (std::size_t i = 0; i < at.size(); ++i) {
      SCOPED_TRACE(at[i]);
      const Vector3f u = texture.at({at[i] / 4, 0.125f}, 1, c.wrap, Wrap::repeat),
                     v = texture.at({0.125f, at[i] / 4}, 1, Wrap::repeat, c.wrap);
      EXPECT_NEAR(5 * u.x(), c.texels[i], 1e-4) << static_cast<int>(c.wrap);
      EXPECT_NEAR(5 * v.y(), c.texels[i], 1e-4) << static_cast<int>(c.wrap);
      EXPECT_NEAR(u.y() + v.x(), 0, 1e-6) << "the other axis";
    }
  }
  // At the edge: half of the texel on the other side, or the edge's alone; also in mip levels.
  EXPECT_NEAR(5 * texture.at({1, 0.5f}, 1).x(), 1.5f, 1e-4);
  EXPECT_NEAR(5 * texture.at({1, 0.5f}, 1, Wrap::clamp_to_edge).x(), 3, 1e-4);
  EXPECT_NEAR(5 * texture.at({1, 0.5f}, 1, Wrap::mirrored_repeat).x(), 3, 1e-4);
  const float half = 2 * std::sqrt(3.0f);  // of the footprint at which the second level alone counts
  EXPECT_NEAR(5 * texture.at({1, 0.5f}, half).x(), 1.5f, 1e-3);
  EXPECT_NEAR(5 * texture.at({1, 0.5f}, half, Wrap::clamp_to_edge).x(), 2.5f, 1e-3);
  EXPECT_NEAR(5 * texture.at({-0.25f, 0.5f}, half, Wrap::mirrored_repeat).x(), 0.5f, 1e-3);
}

TEST(Texture, TheMeanOfColoursIsThatOfTheirLight) {
  for (const int edge : {16, 15}) {
    const Vector3f mean = Texture(checker(edge), Texels::srgb, true).at({0.5f, 0.5f}, 1000);
    EXPECT_NEAR(mean.x(), 0.5, 0.01) << edge;  // of 225 texels 112 are white
  }
  const Texture grey(picture(8, 8, [](int, int) { return Bytes{188, 188, 188}; }), Texels::srgb, true);
  for (const float across : {1.0f, 3.0f, 50.0f})
    EXPECT_NEAR(grey.at({0.3f, 0.7f}, across).x(), capture::srgb_to_linear(188 / 255.0f), 1e-5) << across;
}

// Against 64 × 64 samples of the footprint's square.
TEST(Texture, FootprintsAgainstSupersampling) {
  constexpr int kEdge = 128;
  const auto wave = [](int u, int v) {
    const double at = std::sin(2 * std::numbers::pi * u / 32.0) * std::cos(2 * std::numbers::pi * v / 64.0);
    const auto code = static_cast<std::uint8_t>(std::lround(127.5 + 127 * at));
    return Bytes{code, code, code};
  };
  const Texture with(picture(kEdge, kEdge, wave), Texels::linear, true),
      without(picture(kEdge, kEdge, wave), Texels::linear, false);
  for (const float across : {1.0f, 2.0f, 5.0f, 11.0f, 23.0f}) {
    double squares = 0, squares_of_points = 0;
    int count = 0;
    for (float u = 0.11f; u < 1; u += 0.17f) {
      for (float v = 0.07f; v < 1; v += 0.13f, ++count) {
        double truth = 0;
        for (int i = 0; i < 64 * 64; ++i) {
          const Vector2f off((static_cast<float>(i % 64) + 0.5f) / 64 - 0.5f,
                             (static_cast<float>(i / 64) + 0.5f) / 64 - 0.5f);
          truth += without.at(Vector2f(u, v) + off * across / kEdge, 1).x() / (64 * 64);
        }
        squares += std::pow(with.at({u, v}, across).x() - truth, 2);
        squares_of_points += std::pow(without.at({u, v}, across).x() - truth, 2);
      }
    }
    const double error = std::sqrt(squares / count);
    const double of_points = std::sqrt(squares_of_points / count);
    EXPECT_LT(error, across > 10 ? of_points / 3 : 0.03) << across;
  }
}

TexturePicture squares(int edge, int square) {
  return picture(edge, edge, [=](int u, int v) {
    return (u / square + v / square) % 2 ? Bytes{235, 235, 235} : Bytes{20, 20, 20};
  });
}

// Against 128 × 128 samples of the parallelogram, in linear light.
TEST(Texture, ParallelogramsAgainstSupersampling) {
  constexpr int kEdge = 128, kSamples = 128;
  const Texture with(squares(kEdge, 8), Texels::srgb, true), without(squares(kEdge, 8), Texels::srgb, false);
  Eigen::Matrix2f turned, sheared, narrow, line;
  turned << 3, -2, 2, 3;
  sheared << 9, 2, 0, 4;
  narrow << 30, 1, 18, 2;
  line << 20, 14, 9, 7;  // edges that are nearly parallel
  for (const Eigen::Matrix2f& shape : {turned, sheared, narrow, line}) {
    for (const float scale : {0.2f, 1.0f, 3.1f, 7.0f}) {
      const Eigen::Matrix2f edges = scale * shape / kEdge;
      double squares_of_errors = 0;
      int count = 0;
      for (float u = 0.11f; u < 1; u += 0.17f) {
        for (float v = 0.07f; v < 1; v += 0.13f, ++count) {
          double truth = 0;
          for (int i = 0; i < kSamples * kSamples; ++i) {
            const Vector2f off((static_cast<float>(i % kSamples) + 0.5f) / kSamples - 0.5f,
                               (static_cast<float>(i / kSamples) + 0.5f) / kSamples - 0.5f);
            truth += without.at(Vector2f(u, v) + edges * off, 1).x() / (kSamples * kSamples);
          }
          squares_of_errors += std::pow(with.mean({u, v}, edges).x() - truth, 2);
        }
      }
      EXPECT_LT(std::sqrt(squares_of_errors / count), 0.01) << shape << " times " << scale;
    }
  }
}

// The same across the picture's border and far from it, of a picture without symmetry.
TEST(Texture, ParallelogramsBeyondTheBorder) {
  constexpr int kEdge = 64, kSamples = 64;
  const auto ramp = picture(kEdge, kEdge, [](int u, int v) {
    return Bytes{static_cast<std::uint8_t>(4 * u), static_cast<std::uint8_t>(4 * v),
                 static_cast<std::uint8_t>((u / 4 + v / 4) % 2 ? 230 : 20)};
  });
  const Texture with(ramp, Texels::srgb, true), without(ramp, Texels::srgb, false);
  Eigen::Matrix2f shape;
  shape << 7, -2, 3, 6;
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp_to_edge, Wrap::mirrored_repeat}) {
    for (const float scale : {0.3f, 1.0f, 2.5f}) {
      for (const Vector2f& uv : {Vector2f(0.01f, 0.5f), Vector2f(-0.02f, 1.03f), Vector2f(3.3f, -2.25f),
                                 Vector2f(1.98f, 0.99f), Vector2f(900.4f, -1200.7f)}) {
        const Eigen::Matrix2f edges = scale * shape / kEdge;
        Vector3f truth = Vector3f::Zero();
        for (int i = 0; i < kSamples * kSamples; ++i) {
          const Vector2f off((static_cast<float>(i % kSamples) + 0.5f) / kSamples - 0.5f,
                             (static_cast<float>(i / kSamples) + 0.5f) / kSamples - 0.5f);
          truth += without.at(uv + edges * off, 1, wrap, wrap) / (kSamples * kSamples);
        }
        EXPECT_LT((with.mean(uv, edges, wrap, wrap) - truth).cwiseAbs().maxCoeff(), 0.03f)
            << static_cast<int>(wrap) << ' ' << scale << " at " << uv.transpose();
      }
    }
  }
}

// Texels tilted by ± 0.2 along u.
TEST(Texture, TheMeanOfNormalsIsShorterByWhatTheyDiffer) {
  const float tilt = 0.2f;
  const auto code = [](float x) { return static_cast<std::uint8_t>(std::lround(127.5f * (x + 1))); };
  const auto turned = [&](int u, int) {
    return Bytes{code(u % 2 ? tilt : -tilt), code(0), code(std::sqrt(1 - tilt * tilt))};
  };
  const Texture texture(picture(8, 8, turned), Texels::normals, true);
  EXPECT_NEAR(texture.at({1.5f / 8, 0.5f}, 1).norm(), 1, 1e-5);
  EXPECT_NEAR(texture.at({1.5f / 8, 1.5f / 8}, 1).x(), tilt, 0.005);
  const Vector3f mean = texture.at({0.5f, 0.5f}, 100);
  EXPECT_NEAR(mean.x(), 0, 0.005);
  EXPECT_NEAR(mean.norm(), std::sqrt(1 - tilt * tilt), 0.002);
}

}  // namespace
}  // namespace lumigraft::relight
