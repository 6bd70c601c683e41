#include "server/stream/protocol.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/server/stream/stream_header.h"

namespace lumigraft::server {
namespace {

TEST(Protocol, HeaderRoundTripAndLayout) {
  StreamHeader header;
  header.kind = StreamKind::h264_delta;
  header.flags = StreamHeader::kPassedThrough;
  header.sequence = 0x89abcdefu;
  header.width = 640;
  header.height = 480;
  header.capture_time_ns = 1'700'000'000'123'456'789;
  header.send_time_ns = -5;
  const std::vector<std::uint8_t> payload{9, 8, 7};
  const auto message = make_stream_message(header, payload);
  ASSERT_EQ(message->bytes.size(), kStreamHeaderBytes + 3);
  EXPECT_EQ(std::string(message->bytes.begin(), message->bytes.begin() + 4), "LUMI");
  EXPECT_EQ(message->bytes[8], 0xef);  // little-endian
  EXPECT_EQ(message->bytes[kStreamHeaderBytes], 9);
  const std::optional<StreamHeader> back = parse_stream_header(message->bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->kind, header.kind);
  EXPECT_EQ(back->flags, header.flags);
  EXPECT_EQ(back->sequence, header.sequence);
  EXPECT_EQ(back->width, header.width);
  EXPECT_EQ(back->height, header.height);
  EXPECT_EQ(back->capture_time_ns, header.capture_time_ns);
  EXPECT_EQ(back->send_time_ns, header.send_time_ns);
}

TEST(Protocol, RefusesWhatIsNoPicture) {
  std::vector<std::uint8_t> bytes = make_stream_message({}, {})->bytes;
  EXPECT_TRUE(parse_stream_header(bytes));
  EXPECT_FALSE(parse_stream_header(std::span(bytes).first(31)));
  for (const std::size_t changed : {0u, 4u, 5u}) {
    std::vector<std::uint8_t> bad = bytes;
    bad[changed] = 77;
    EXPECT_FALSE(parse_stream_header(bad)) << changed;
  }
}

TEST(Protocol, Commands) {
  EXPECT_EQ(std::get<WantCommand>(parse_command(R"({"type":"want","codec":"h264"})")).codec, Codec::h264);
  EXPECT_EQ(std::get<WantCommand>(parse_command(R"({"type":"want","codec":"none"})")).codec, Codec::none);
  EXPECT_EQ(std::get<WantCommand>(parse_command(R"({"type":"want","codec":"h264"})")).size, std::nullopt);
  EXPECT_EQ(std::get<WantCommand>(parse_command(R"({"type":"want","codec":"h264","size":"auto"})")).size, std::nullopt);
  EXPECT_EQ(std::get<WantCommand>(parse_command(R"({"type":"want","codec":"jpeg","size":"half"})")).size,
            StreamSize::half);
  EXPECT_TRUE(std::holds_alternative<KeyCommand>(parse_command(R"({"type":"key"})")));
  EXPECT_TRUE(std::get<RecordCommandOfViewer>(parse_command(R"({"type":"record","on":true})")).on);
  EXPECT_FALSE(std::get<RecordCommandOfViewer>(parse_command(R"({"type":"record","on":false})")).on);
  EXPECT_EQ(std::get<BadCommand>(parse_command(R"({"type":"record","on":1})")).error, "on: true or false");
  EXPECT_TRUE(std::holds_alternative<SaveCommand>(parse_command(R"({"type":"save"})")));
  const auto seek = std::get<PlaybackCommand>(parse_command(R"({"type":"playback","at_s":12.5,"paused":true})"));
  EXPECT_EQ(seek.at_s, 12.5);
  EXPECT_EQ(seek.paused, true);
  EXPECT_FALSE(seek.step);
  EXPECT_TRUE(std::get<PlaybackCommand>(parse_command(R"({"type":"playback","step":true})")).step);
  EXPECT_TRUE(std::holds_alternative<BadCommand>(parse_command(R"({"type":"playback","at_s":-1})")));
  EXPECT_EQ(std::get<BadCommand>(parse_command(R"({"type":"playback","speed":2})")).error,
            "playback: at_s in seconds, paused and step true or false");
  EXPECT_EQ(std::get<AckCommand>(parse_command(R"({"type":"ack","sequence":4294967295})")).sequence, 4294967295u);
  const auto object = std::get<ObjectCommand>(parse_command(
      R"({"type":"object","name":"statue","position_m":[0.1,-2,3],"yaw_degrees":90,"visible":false,
          "material":{"base_color":[1,0.5,0],"roughness":0.25,"emission":[4,0,0],
          "transmission":1,"ior":1.33,"thin_walled":true,"attenuation_color":[0,1,0.5],"attenuation_distance_m":0.25}})"));
  EXPECT_EQ(std::get<std::string>(object.object), "statue");
  EXPECT_EQ(*object.position_m, Eigen::Vector3d(0.1, -2, 3));
  EXPECT_EQ(object.yaw_degrees, 90.0);
  EXPECT_EQ(*std::get<ObjectCommand>(parse_command(R"({"type":"object","index":0,"on_pixel":[12.5,7]})")).on_pixel,
            Eigen::Vector2d(12.5, 7));
  EXPECT_EQ(object.visible, false);
  EXPECT_EQ(object.material->base_color.value()->y(), 0.5f);
  EXPECT_EQ(object.material->roughness.value(), 0.25f);
  EXPECT_EQ(object.material->emission.value()->x(), 4);
  EXPECT_EQ(object.material->transmission.value(), 1);
  EXPECT_EQ(object.material->ior.value(), 1.33f);
  EXPECT_EQ(object.material->thin_walled.value(), true);
  EXPECT_EQ(object.material->attenuation_color.value()->z(), 0.5f);
  EXPECT_EQ(object.material->attenuation_distance_m.value(), 0.25f);
  EXPECT_FALSE(object.material->metallic) << "not named";
  const auto own = std::get<ObjectCommand>(parse_command(
      R"({"type":"object","index":0,"material":{"base_color":null,"specular":null,"thin_walled":null}})"));
  EXPECT_EQ(own.material->base_color.value(), std::nullopt);
  EXPECT_EQ(own.material->specular.value(), std::nullopt);
  EXPECT_EQ(own.material->thin_walled.value(), std::nullopt);
  const auto turned = std::get<ObjectCommand>(
      parse_command(R"({"type":"object","index":2,"rotation_wxyz":[2,0,0,0],"material":null})"));
  EXPECT_EQ(std::get<std::size_t>(turned.object), 2u);
  EXPECT_NEAR(turned.rotation->norm(), 1.0, 1e-12);
  EXPECT_TRUE(turned.material->models_own);
  const auto animated = std::get<ObjectCommand>(parse_command(
      R"({"type":"object","index":0,"animation":{"name":"walk","playing":true,"loop":false,"at_s":1.5}})"));
  EXPECT_EQ(animated.animation->name, "walk");
  EXPECT_EQ(animated.animation->playing, true);
  EXPECT_EQ(animated.animation->loop, false);
  EXPECT_EQ(animated.animation->at_s, 1.5);
  EXPECT_EQ(animated.variant, std::nullopt);
  const auto red = std::get<ObjectCommand>(parse_command(R"({"type":"object","index":0,"variant":"red"})"));
  EXPECT_EQ(red.variant.value(), "red");
  const auto unset = std::get<ObjectCommand>(parse_command(R"({"type":"object","index":0,"variant":null})"));
  ASSERT_TRUE(unset.variant);
  EXPECT_EQ(*unset.variant, std::nullopt);
}

TEST(Protocol, EverythingElseIsRefusedWithAReason) {
  for (const char* text : {"",
                           "{",
                           "[]",
                           "7",
                           R"("x")",
                           R"({"type":7})",
                           R"({"type":"launch"})",
                           R"({"codec":"h264"})",
                           R"({"type":"want","codec":"av1"})",
                           R"({"type":"want"})",
                           R"({"type":"want","codec":"h264","size":"quarter"})",
                           R"({"type":"want","codec":"h264","size":2})",
                           R"({"type":"want","codec":["h264"]})",
                           R"({"type":"ack"})",
                           R"({"type":"ack","sequence":-1})",
                           R"({"type":"ack","sequence":"1"})",
                           R"({"type":"object"})",
                           R"({"type":"object","index":-1})",
                           R"({"type":"object","index":0,"colour":1})",
                           R"({"type":"object","index":0,"position_m":[1e999,0,0]})",
                           R"({"type":"object","index":0,"position_m":[0,0]})",
                           R"({"type":"object","index":0,"on_pixel":[0,-1]})",
                           R"({"type":"object","index":0,"on_pixel":[0,1],"position_m":[0,0,0]})",
                           R"({"type":"object","index":0,"position_m":[0,0,101]})",
                           R"({"type":"object","index":0,"visible":1})",
                           R"({"type":"object","index":0,"material":{"ior":0.5}})",
                           R"({"type":"object","index":0,"material":{"thin_walled":1}})",
                           R"({"type":"object","index":0,"material":{"clearcoat":1.5}})",
                           R"({"type":"object","index":0,"material":{"attenuation_distance_m":0}})",
                           R"({"type":"object","index":0,"rotation_wxyz":[0,0,0,0]})",
                           R"({"type":"object","index":0,"rotation_wxyz":[1,0,0,0],"yaw_degrees":1})",
                           R"({"type":"object","index":0,"material":7})",
                           R"({"type":"object","index":0,"material":{"roughness":2}})",
                           R"({"type":"object","index":0,"material":{"shine":1}})",
                           R"({"type":"object","index":0,"variant":7})",
                           R"({"type":"object","index":0,"animation":null})",
                           R"({"type":"object","index":0,"animation":{"name":7}})",
                           R"({"type":"object","index":0,"animation":{"playing":1}})",
                           R"({"type":"object","index":0,"animation":{"at_s":-1}})",
                           R"({"type":"object","index":0,"animation":{"speed":2}})"}) {
    const Command command = parse_command(text);
    ASSERT_TRUE(std::holds_alternative<BadCommand>(command)) << text;
    EXPECT_FALSE(std::get<BadCommand>(command).error.empty()) << text;
  }
  EXPECT_TRUE(std::holds_alternative<BadCommand>(parse_command(std::string(60000, '['))));
  const std::string name = R"({"type":"object","name":")" + std::string(5000, 'a') + "\"}";
  EXPECT_TRUE(std::holds_alternative<BadCommand>(parse_command(name)));
}

TEST(Protocol, ThePageNamesEveryMessage) {
  std::ifstream in(LUMIGRAFT_SOURCE_DIR "/docs/protocol.md");
  std::stringstream text;
  text << in.rdbuf();
  for (const char* word :
       {"hello", "state", "stats", "error", "want", "object", "record", "save", "saved", "key", "ack"}) {
    EXPECT_NE(text.str().find("\"type\":\"" + std::string(word) + "\""), std::string::npos) << word;
  }
}

}  // namespace
}  // namespace lumigraft::server
