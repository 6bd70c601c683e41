#include "server/publish/parameter_sets.h"

#include <gtest/gtest.h>

#include "server/stream/encode_h264.h"

namespace lumigraft::server {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(ParameterSets, AreFoundAmongOtherUnits) {
  const Bytes unit{0, 0, 0, 1, 0x09, 0xf0, 0, 0, 0, 1,    0x67, 1, 2, 0, 0,    1, 0x68,
                   3, 0, 0, 1, 0x06, 9,    0, 0, 1, 0x65, 7,    0, 0, 1, 0x67, 8};
  EXPECT_EQ(parameter_sets(unit), (Bytes{0, 0, 0, 1, 0x67, 1, 2, 0, 0, 0, 1, 0x68, 3})) << "none follows the picture";
  EXPECT_EQ(parameter_sets(Bytes{}), Bytes{});
  EXPECT_EQ(parameter_sets(Bytes{0, 0, 1}), Bytes{});
  EXPECT_EQ(parameter_sets(Bytes{0, 0, 1, 0x41, 5}), Bytes{});
  EXPECT_EQ(parameter_sets(Bytes{0, 0, 1, 0x67}), (Bytes{0, 0, 0, 1, 0x67}));
}

/// The connection is made anew when these change, and only then.
TEST(ParameterSets, OfTheEncoderDependOnTheSizeAlone) {
  const auto sets_of = [](int width, int height, std::uint8_t grey) {
    capture::Image<std::uint8_t> image(width, height, 3);
    std::fill(image.data.begin(), image.data.end(), grey);
    return parameter_sets(H264Encoder(width, height).encode(image, 0, true).bytes);
  };
  EXPECT_FALSE(sets_of(64, 48, 10).empty());
  EXPECT_EQ(sets_of(64, 48, 10), sets_of(64, 48, 200));
  EXPECT_NE(sets_of(64, 48, 10), sets_of(96, 48, 10));
}

}  // namespace
}  // namespace lumigraft::server
