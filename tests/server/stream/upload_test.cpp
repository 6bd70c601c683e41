#include "server/stream/upload.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "server/stream/web_server.h"
#include "tests/server/stream/websocket_client.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A service that takes files up to 1 MB and says how long they are.
class UploadTest : public testing::Test {
 protected:
  static constexpr std::uint64_t kMaxBytes = 1 << 20;

  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override {
    web_.reset();
    fs::remove_all(folder_);
  }
  void start(Permissions permissions = Permissions::all()) {
    WebSettings settings;
    settings.listeners[0].permissions = permissions;
    settings.request_timeout = std::chrono::milliseconds(500);
    WebHandlers handlers;
    handlers.get = [](std::string_view) { return WebReply{.status = 200, .body = "page"}; };
    handlers.upload = UploadHandlers{
        .begin = [this](std::string_view name,
                        std::optional<std::uint64_t> bytes) -> std::variant<UploadHandlers::Place, WebReply> {
          if (bytes.value_or(0) > kMaxBytes) return WebReply{.status = 413, .body = "too large"};
          return UploadHandlers::Place{folder_ / name, kMaxBytes};
        },
        .received =
            [this](const fs::path& file, std::string_view name) {
              if (name == "broken") throw std::runtime_error("as a disk that fails");
              received_ = content_of(file);
              return WebReply{.status = 201, .body = std::to_string(received_.size())};
            },
        .remove =
            [](std::string_view name) {
              if (name == "broken") throw std::runtime_error("as a disk that fails");
              return WebReply{.status = 200, .body = "removed " + std::string(name)};
            }};
    web_ = std::make_unique<WebServer>(settings, handlers, demand_, metrics_);
    web_->start();
  }
  std::string put(const std::string& name, const std::string& body, const std::string& more = "") const {
    return http_exchange(web_->port(), "PUT /models/" + name + " HTTP/1.1\r\nHost: localhost\r\n" + more +
                                           "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  }
  std::string remove(const std::string& path, const std::string& more = "") const {
    return http_exchange(web_->port(), "DELETE " + path + " HTTP/1.1\r\nHost: localhost\r\n" + more + "\r\n");
  }
  static bool answers(const std::string& reply, int status) {
    return reply.starts_with("HTTP/1.1 " + std::to_string(status));
  }
  bool folder_is_empty() const { return fs::is_empty(folder_); }

  const fs::path folder_ = fs::temp_directory_path() / ("lumigraft-upload-" + std::to_string(::getpid()));
  std::string received_;
  EncoderDemand demand_;
  Metrics metrics_;
  std::unique_ptr<WebServer> web_;
};

TEST_F(UploadTest, AFileOfManyChunksArrives) {
  start();
  std::string body(kMaxBytes - 7, 0);
  for (std::size_t i = 0; i < body.size(); ++i) body[i] = static_cast<char>(i * i >> 3);
  const std::string reply = put("a.glb", body);
  EXPECT_TRUE(answers(reply, 201)) << reply;
  EXPECT_TRUE(reply.ends_with(std::to_string(body.size())));
  EXPECT_TRUE(received_ == body);
  EXPECT_TRUE(folder_is_empty()) << "what was not moved away is removed";
  EXPECT_TRUE(answers(put("empty.glb", ""), 201));
}

TEST_F(UploadTest, WhatIsRefusedIsNotRead) {
  start();
  EXPECT_TRUE(answers(put("a.glb", std::string(kMaxBytes + 1, 'x')), 413));
  EXPECT_TRUE(answers(put("a.glb", "x", "Origin: http://evil.example\r\n"), 403));
  EXPECT_TRUE(answers(put("broken", "x"), 500));
  EXPECT_TRUE(answers(put("a.glb", "x"), 201)) << "the next one is taken";
  EXPECT_TRUE(answers(http_exchange(web_->port(), "PUT /other HTTP/1.1\r\nHost: localhost\r\n\r\n"), 405));
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(UploadTest, OnlyAdministratorsSendFiles) {
  start({Permission::view, Permission::control, Permission::record});
  EXPECT_TRUE(answers(put("a.glb", "x"), 403));
  EXPECT_TRUE(answers(remove("/models/a.glb"), 403));
}

TEST_F(UploadTest, ModelsAreRemoved) {
  start();
  EXPECT_TRUE(remove("/models/a.glb").ends_with("removed a.glb"));
  EXPECT_TRUE(answers(remove("/models/a.glb", "Origin: http://evil.example\r\n"), 403));
  EXPECT_TRUE(answers(remove("/models/broken"), 500));
  EXPECT_TRUE(answers(remove("/other"), 405));
  EXPECT_TRUE(answers(put("a.glb", "x"), 201)) << "the next one is taken";
}

// A client who states no length is cut off at the limit, one who stops or goes away leaves no file.
TEST_F(UploadTest, UnfinishedFilesLeaveNothing) {
  start();
  const auto soon = [](const auto& condition) {
    for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return condition();
  };
  const auto begin = [&] {
    const int client = connect_to(web_->port());
    const std::string head = "PUT /models/a.glb HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\nabc";
    ::send(client, head.data(), head.size(), MSG_NOSIGNAL);
    EXPECT_TRUE(soon([&] { return !folder_is_empty(); }));
    return client;
  };
  const int leaves = begin();
  EXPECT_TRUE(answers(put("b.glb", "x"), 409)) << "one at a time";
  ::close(leaves);
  EXPECT_TRUE(soon([&] { return folder_is_empty(); }));
  const int stops = begin();
  EXPECT_TRUE(soon([&] { return folder_is_empty(); })) << "nothing came for half a second";
  ::close(stops);
  std::string chunks = "PUT /models/a.glb HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 5; ++i) chunks += "40000\r\n" + std::string(0x40000, 'x') + "\r\n";
  EXPECT_FALSE(answers(http_exchange(web_->port(), chunks + "0\r\n\r\n"), 201));
  EXPECT_TRUE(soon([&] { return folder_is_empty(); }));
  EXPECT_TRUE(answers(put("a.glb", "x"), 201));
}

}  // namespace
}  // namespace lumigraft::server
