#include "server/publish/publish_url.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

TEST(PublishUrl, SchemesSayTheMuxer) {
  EXPECT_EQ(read_publish_url("rtsp://127.0.0.1:8554/kiosk")->muxer, "rtsp");
  EXPECT_EQ(read_publish_url("RTSP://media.example/kiosk")->muxer, "rtsp") << "its port may be left out";
  EXPECT_EQ(read_publish_url("srt://[::1]:8890?streamid=publish:kiosk")->muxer, "mpegts");
  EXPECT_EQ(read_publish_url("rtp://127.0.0.1:5004")->muxer, "rtp");
}

TEST(PublishUrl, RefusesWhatCannotBePublishedTo) {
  for (const char* text :
       {"", "rtsp", "rtsp://", "rtsp://:8554/kiosk", "rtsp://host", "rtsp://host/", "rtsp://host:0/kiosk",
        "rtsp://host:65536/kiosk", "rtsp://host:port/kiosk", "rtsp://ho st/kiosk", "srt://host", "rtp://host/",
        "http://host/kiosk", "file:///etc/passwd", "/dev/null", "pipe:1", "concat:a|b", "rtmp://host:1935/live"}) {
    EXPECT_FALSE(read_publish_url(text)) << text;
  }
}

/// Whatever is said of a URL contains no password, wherever it stands.
TEST(PublishUrl, WhatIsShownHasNoPassword) {
  EXPECT_EQ(read_publish_url("rtsp://kiosk:secret@media.example:8554/hall?key=secret")->shown,
            "rtsp://media.example:8554/hall");
  EXPECT_EQ(read_publish_url("rtsp://kiosk:se/cret@media.example/hall"), std::nullopt)
      << "a slash in a password must be written %2F";
  EXPECT_EQ(read_publish_url("srt://media.example:8890?passphrase=secret&streamid=publish:hall:kiosk:secret")->shown,
            "srt://media.example:8890");
  EXPECT_EQ(shown_of_refused("rtmp://kiosk:secret@media.example/hall?key=secret"), "rtmp://media.example");
  EXPECT_EQ(shown_of_refused("rtsp://kiosk:secret@:8554/hall"), "rtsp://...");
  EXPECT_EQ(shown_of_refused("secret"), "no URL");
  EXPECT_EQ(read_publish_url("rtsp://kiosk:secret@media.example/hall")->url, "rtsp://kiosk:secret@media.example/hall")
      << "but the connection needs it";
}

}  // namespace
}  // namespace lumigraft::server
