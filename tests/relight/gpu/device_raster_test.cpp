// Rasterization: orientation, front faces, depth, several targets.
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight::gpu {
namespace {

struct Vertex {
  std::array<float, 4> position;
  std::array<float, 3> color;
};

class DeviceRasterTest : public DeviceTest {
 protected:
  void SetUp() override {
    color_ = target("color", Format::rgba32_float);
    facing_ = target("facing", Format::r32_float);
    depth_ = target("depth", Format::depth32_float);
    weight_ = device_->create_texture({.name = "weight", .format = Format::r32_float});
    const float one = 1;
    device_->upload(*weight_, 0, bytes_of(one));
  }

  std::unique_ptr<Texture> target(const char* name, Format format) {
    return device_->create_texture({.name = name, .width = 16, .height = 12, .format = format, .attachment = true});
  }

  RasterDesc desc() const {
    return {.vertex_shader = "device_triangles.vert",
            .fragment_shader = "device_triangles.frag",
            .vertex_stride_bytes = sizeof(Vertex),
            .attributes = {{0, 4, 0}, {1, 3, 16}},
            .color_formats = {Format::rgba32_float, Format::r32_float}};
  }

  void draw(const std::vector<Vertex>& vertices, const std::vector<std::uint32_t>& indices,
            const Area* area = nullptr) {
    const auto pipeline = device_->create_raster(desc());
    const auto vertex_buffer = buffer_with(vertices, "vertices");
    const auto index_buffer = buffer_with(indices, "indices");
    const std::array<float, 4> tint{1, 1, 0.5f, 1};
    const DrawCall call{.bindings = {sampled(1, *weight_)},
                        .params = bytes_of(tint),
                        .vertices = vertex_buffer.get(),
                        .indices = index_buffer.get(),
                        .index_count = static_cast<std::uint32_t>(indices.size())};
    const auto list = device_->begin();
    list->draw(*pipeline, {color_.get(), facing_.get()}, *depth_, {&call, 1}, area);
    device_->submit(*list);
  }

  std::array<float, 4> color_at(std::size_t x, std::size_t y) {
    return values_of<std::array<float, 4>>(device_->download(*color_))[x + 16 * y];
  }
  std::uint32_t facing_at(std::size_t x, std::size_t y) {
    return static_cast<std::uint32_t>(values_of<float>(device_->download(*facing_))[x + 16 * y]);
  }
  float depth_at(std::size_t x, std::size_t y) { return values_of<float>(device_->download(*depth_))[x + 16 * y]; }

  /// Covers the top left half of the image: clip (-1,-1) is the top left corner. Counter-clockwise there: top left,
  /// bottom left, top right.
  static std::vector<Vertex> top_left(float z, std::array<float, 3> color) {
    return {{{-1, -1, z, 1}, color}, {{-1, 1, z, 1}, color}, {{1, -1, z, 1}, color}};
  }

  std::unique_ptr<Texture> color_, facing_, depth_, weight_;
};

ON_BOTH_DEVICES(DeviceRasterTest);

TEST_P(DeviceRasterTest, RowZeroIsClipMinusOneAndFrontIsCounterClockwise) {
  draw(top_left(0.25f, {1, 2, 4}), {0, 1, 2});
  EXPECT_EQ(color_at(0, 0), (std::array<float, 4>{1, 2, 2, 1}));
  EXPECT_EQ(color_at(15, 11), (std::array<float, 4>{0, 0, 0, 0}));
  EXPECT_EQ(facing_at(0, 0), 1u) << "front, gl_FragCoord.y below 1";
  EXPECT_EQ(facing_at(0, 5), 1u | (5u << 8));
  EXPECT_EQ(facing_at(15, 11), 0u);
  EXPECT_EQ(depth_at(0, 0), 0.25f);
  EXPECT_EQ(depth_at(15, 11), 1.0f);

  draw(top_left(0.25f, {1, 2, 4}), {0, 2, 1});
  EXPECT_EQ(facing_at(0, 0), 2u) << "turned round";
}

TEST_P(DeviceRasterTest, TheNearerWinsAndEqualDepthOverwrites) {
  auto both = top_left(0.5f, {1, 0, 0});
  for (const Vertex& vertex : top_left(0.75f, {0, 1, 0})) both.push_back(vertex);
  for (const Vertex& vertex : top_left(0.5f, {0, 0, 1})) both.push_back(vertex);
  draw(both, {0, 1, 2, 3, 4, 5});
  EXPECT_EQ(color_at(0, 0)[0], 1.0f) << "the far one comes second and loses";

  draw(both, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  EXPECT_EQ(color_at(0, 0)[2], 0.5f) << "equal depth, drawn onto what was there";
  EXPECT_EQ(depth_at(0, 0), 0.5f);

  draw(top_left(-0.1f, {1, 1, 1}), {0, 1, 2});
  EXPECT_EQ(facing_at(0, 0), 0u) << "in front of the near plane";
}

TEST_P(DeviceRasterTest, AttributesAreInterpolatedInPerspective) {
  // A floor that runs from w = 1 at the left to w = 4 at the right; red is a position along it, 0 to 1.
  std::vector<Vertex> floor;
  for (const auto& [x, y, w] : {std::array{-1.f, -1.f, 1.f}, {-1.f, 1.f, 1.f}, {1.f, -1.f, 4.f}, {1.f, 1.f, 4.f}}) {
    floor.push_back({{x * w, y * w, 0.5f * w, w}, {x < 0 ? 0.f : 1.f, 0, 0}});
  }
  draw(floor, {0, 1, 2, 2, 1, 3});
  for (const std::size_t x : {0u, 5u, 15u}) {
    const float t = (static_cast<float>(x) + 0.5f) / 16;  // 1/w is linear on the screen, and so is red/w
    EXPECT_NEAR(color_at(x, 3)[0], (t / 4) / (1 - t + t / 4), 1e-5f);
  }
}

TEST_P(DeviceRasterTest, AnAreaIsClearedAndDrawnToAlone) {
  draw(top_left(0.25f, {1, 2, 4}), {0, 1, 2});
  const Area area{2, 1, 3, 4};
  draw(top_left(0.5f, {4, 4, 4}), {0, 1, 2}, &area);
  for (std::size_t y = 0; y < 6; ++y) {
    for (std::size_t x = 0; x < 8; ++x) {
      const bool inside = x >= 2 && x < 5 && y >= 1 && y < 5;
      EXPECT_EQ(color_at(x, y)[0], inside ? 4.0f : 1.0f) << x << ", " << y;
      EXPECT_EQ(depth_at(x, y), inside ? 0.5f : 0.25f) << x << ", " << y;
    }
  }
  const Area outside{14, 0, 3, 4};
  EXPECT_THROW(draw(top_left(0.5f, {4, 4, 4}), {0, 1, 2}, &outside), std::logic_error);
}

TEST_P(DeviceRasterTest, DepthAlone) {
  RasterDesc wanted = desc();
  wanted.fragment_shader = "device_depth.frag";
  wanted.color_formats.clear();
  const auto pipeline = device_->create_raster(wanted);
  const auto vertices = buffer_with(top_left(0.25f, {1, 1, 1}), "vertices");
  const auto indices = buffer_with(std::vector<std::uint32_t>{0, 1, 2}, "indices");
  const std::array<float, 4> tint{};
  const DrawCall call{
      .bindings = {}, .params = bytes_of(tint), .vertices = vertices.get(), .indices = indices.get(), .index_count = 3};
  const auto list = device_->begin();
  list->draw(*pipeline, {}, *depth_, {&call, 1});
  device_->submit(*list);
  EXPECT_EQ(depth_at(0, 0), 0.25f);
  EXPECT_EQ(depth_at(15, 11), 1.0f);
}

TEST_P(DeviceRasterTest, TheSameDrawGivesTheSameBytes) {
  draw(top_left(0.25f, {0.1f, 0.2f, 0.3f}), {0, 1, 2});
  const auto first = device_->download(*color_);
  draw(top_left(0.25f, {0.1f, 0.2f, 0.3f}), {0, 1, 2});
  EXPECT_EQ(first, device_->download(*color_));
}

}  // namespace
}  // namespace lumigraft::relight::gpu
