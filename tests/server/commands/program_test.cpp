// The program as a process: exit codes, one line on stderr, no partial output, and a prompt end.
#include "tests/server/commands/program.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "server/commands/parameters.h"
#include "tests/server/stream/websocket_client.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

using Clock = std::chrono::steady_clock;

std::vector<std::string> small(std::vector<std::string> words) {
  words.insert(words.end(), {"--set", "plan.volume=32", "--set", "plan.trace_scale=4", "--set", "plan.rsm=64"});
  return words;
}

void expect_refused(const TinySession& tiny, const std::vector<std::string>& words, const std::string& says) {
  Program program(tiny.folder, words);
  EXPECT_EQ(program.wait(), 2) << says;
  const std::string text = program.stderr_text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
  EXPECT_NE(text.find(says), std::string::npos) << text;
  EXPECT_FALSE(std::filesystem::exists(tiny.folder / "out"));
}

TEST(Program, BadInputIsOneLineExitCode2AndNothingWritten) {
  const TinySession tiny("bad-input");
  const std::string s = tiny.folder, out = tiny.folder / "out";
  expect_refused(tiny, {"replay", s + "/none", "--out", out}, "no such folder");
  expect_refused(tiny, {"replay", s, "--out", out, "--set", "color.fy=nan"}, "color.fy");
  expect_refused(tiny, {"replay", s, "--out", out, "--exhibit", s + "/none.toml"}, "none.toml");
  expect_refused(tiny, {"replay", s, "--out", out, "--oracle", "pose"}, "pose.json");
  expect_refused(tiny, {"replay", s, "--out", s + "/session.toml"}, "--out");
  expect_refused(tiny, {"bench", s, "--out", out}, "truth");
  expect_refused(tiny, {"bench", s, "--out", out, "--methods", "dvct,luck"}, "\"luck\", allowed: dvct");
  expect_refused(tiny, {"bench", s, "--out", out, "--charts", "pie"}, "\"pie\", allowed: error-time");
  expect_refused(tiny, {"bench", s, "--out", out, "--settings", "slow"}, "\"slow\", allowed: live-32");
  expect_refused(tiny, {"serve", "--session", s, "--listen", "here"}, "--listen");
  const std::string pyramid = tiny.read("pyramid.obj");
  tiny.write("pyramid.obj", pyramid.substr(0, pyramid.find("f ")));
  expect_refused(tiny, {"replay", s, "--out", out}, "pyramid.obj");
  tiny.write("pyramid.obj", pyramid);
  tiny.write("color.txt", "");
  expect_refused(tiny, {"replay", s, "--out", out, "--set", "plan.volume=32"}, "color.txt");
}

TEST(Program, ReplayWritesEveryFrameAndReplacesAnEarlierReplay) {
  const TinySession tiny("replay");
  const std::filesystem::path out = tiny.folder / "out";
  std::filesystem::create_directories(out);
  std::ofstream(out / "frame_000099.png") << "of an earlier replay";
  std::ofstream(out / "notes.txt") << "somebody's";
  const std::string intact = tiny.read("color/000001.png");
  tiny.write("color/000001.png", intact.substr(0, intact.size() / 2));
  Program program(tiny.folder, small({"replay", tiny.folder, "--out", out}));
  EXPECT_EQ(program.wait(), 0) << program.stderr_text();
  EXPECT_TRUE(std::filesystem::exists(out / "frame_000000.png"));
  EXPECT_FALSE(std::filesystem::exists(out / "frame_000001.png")) << "lost in the middle: skipped";
  EXPECT_TRUE(std::filesystem::exists(out / "frame_000002.png"));
  EXPECT_FALSE(std::filesystem::exists(out / "frame_000099.png"));
  EXPECT_TRUE(std::filesystem::exists(out / "notes.txt"));
  EXPECT_FALSE(std::filesystem::exists(out / ".lumigraft-partial"));
  std::ifstream lines(out / "frames.jsonl");
  std::vector<nlohmann::json> records;
  for (std::string line; std::getline(lines, line);) {
    records.push_back(nlohmann::json::parse(line));
  }
  ASSERT_EQ(records.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(records[i]["index"], i);
    EXPECT_FALSE(records[i]["warnings"].empty()) << "no tag, or lost";
    EXPECT_TRUE(records[i]["T_tag_camera"].is_null());
    EXPECT_EQ(records[i].contains("skipped"), i == 1);
  }
  EXPECT_EQ(records[2]["time_s"], 0.2);
  EXPECT_EQ(records[2]["plan"]["volume"], 32);
  EXPECT_GT(records[2]["stage_ms"]["pose"], 0.0);
}

TEST(Program, AnInterruptedReplayLeavesNothing) {
  const TinySession tiny("interrupted");
  const std::filesystem::path out = tiny.folder / "out";
  Program program(tiny.folder, {"replay", tiny.folder, "--out", out});
  while (!std::filesystem::exists(out)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  program.signal(SIGINT);
  if (program.wait() == 1) {
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

TEST(Program, ServesAndEndsWithinASecond) {
  const TinySession tiny("serve");
  for (const int number : {SIGINT, SIGTERM}) {
    Program program(tiny.folder, small({"serve", "--session", tiny.folder, "--listen", "127.0.0.1:0"}));
    const std::uint16_t port = program.port();
    ASSERT_NE(port, 0) << program.stderr_text();
    WebsocketClient viewer(port);
    ASSERT_TRUE(viewer.open()) << viewer.handshake_reply() << program.stderr_text();
    const auto hello = viewer.receive_text("hello");
    ASSERT_TRUE(hello);
    const auto said = nlohmann::json::parse(*hello);
    EXPECT_EQ(said["session"], "tiny");
    EXPECT_EQ(said["width"], 64);
    EXPECT_EQ(said["objects"][0]["name"], "pyramid");
    viewer.send_text(R"({"type":"want","codec":"h264"})");
    viewer.send_text(R"({"type":"object","name":"pyramid","position_m":[0.5,0,0]})");
    const auto state = viewer.receive_text("\"state\"");
    ASSERT_TRUE(state);
    EXPECT_EQ(nlohmann::json::parse(*state)["objects"][0]["position_m"][0], 0.5);
    int pictures = 0;
    while (pictures < 5) {
      const auto message = viewer.receive(std::chrono::seconds(60));
      ASSERT_TRUE(message);
      pictures += message->opcode == 2 ? 1 : 0;
    }
    const auto stats = viewer.receive_text("\"stats\"");
    ASSERT_TRUE(stats);
    EXPECT_EQ(nlohmann::json::parse(*stats)["clients"], 1);
    EXPECT_NE(http_get(port, "/healthz").find("\"ok\":true"), std::string::npos);
    EXPECT_NE(http_get(port, "/metrics").find("lumigraft_stage_seconds_bucket{stage=\"pose\""), std::string::npos);
    EXPECT_NE(http_get(port, "/snapshot.jpg").find("\xff\xd8\xff"), std::string::npos);
    EXPECT_NE(http_get(port, "/").find("<!doctype html>"), std::string::npos);
    const Clock::time_point begin = Clock::now();
    program.signal(number);
    EXPECT_EQ(program.wait(), 0);
    EXPECT_LT(Clock::now() - begin, std::chrono::seconds(1));
  }
}

TEST(Program, ServesWithoutItsCameraAndSaysSo) {
  const TinySession tiny("no-camera");
  tiny.edit("session.toml", "images:color.txt", "openni2:no-such-camera");
  tiny.edit("session.toml", "images:depth.txt", "openni2:no-such-camera");
  Program program(tiny.folder, small({"serve", "--session", tiny.folder, "--listen", "127.0.0.1:0"}));
  const std::uint16_t port = program.port();
  ASSERT_NE(port, 0) << program.stderr_text();
  WebsocketClient viewer(port);
  ASSERT_TRUE(viewer.open()) << viewer.handshake_reply() << program.stderr_text();
  const auto stats = viewer.receive_text("\"stats\"");
  ASSERT_TRUE(stats);
  const std::string says = "colour and depth: openni2:no-such-camera: found nothing OpenNI2 can open";
  EXPECT_NE(stats->find(says), std::string::npos) << *stats;
  EXPECT_NE(http_get(port, "/healthz").find("\"ok\":false"), std::string::npos);
  EXPECT_NE(http_get(port, "/metrics").find("lumigraft_cameras_in_trouble 1\n"), std::string::npos);
  EXPECT_NE(program.stderr_text().find(says), std::string::npos);
  const Clock::time_point begin = Clock::now();
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(1));
}

TEST(Program, ASignalWhileStartingEndsItToo) {
  const TinySession tiny("starting");
  Program program(tiny.folder, small({"serve", "--session", tiny.folder, "--listen", "127.0.0.1:0"}));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  const Clock::time_point begin = Clock::now();
  program.signal(SIGTERM);
  const int code = program.wait();
  EXPECT_TRUE(code == 0 || code == -SIGTERM) << code;  // killed by the signal before main began
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(1));
}

TEST(Program, ASignalEndsItAtAnyMoment) {
  const TinySession tiny("any-moment");
  for (const int after_ms : {0, 100, 300, 1000, 3000}) {
    Program program(tiny.folder, small({"serve", "--session", tiny.folder, "--listen", "127.0.0.1:0"}));
    ASSERT_NE(program.port(), 0) << program.stderr_text();
    std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
    const Clock::time_point begin = Clock::now();
    program.signal(SIGINT);
    EXPECT_EQ(program.wait(), 0);
    EXPECT_LT(Clock::now() - begin, std::chrono::seconds(1)) << after_ms << " ms after it served";
  }
}

// Also if it is killed, as when the power fails.
TEST(Program, KeepsItsRoomForTheNextStart) {
  const TinySession scratch("keeps-room");
  const std::filesystem::path file = scratch.folder / "hall.room";
  const std::string recording = LUMIGRAFT_SOURCE_DIR "/recordings/tabletop";
  const std::vector<std::string> words = {"serve",
                                          "--session",
                                          recording,
                                          "--listen",
                                          "127.0.0.1:0",
                                          "--set",
                                          "plan.method=rays",
                                          "--set",
                                          "server.room=" + file.string()};
  {
    const Program first(scratch.folder, words);
    const Clock::time_point deadline = Clock::now() + std::chrono::seconds(90);
    while (!std::filesystem::exists(file) && Clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(first.stderr_text().find("hall.room"), std::string::npos) << "there was none: " << first.stderr_text();
  }
  ASSERT_TRUE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".unused"));
  const auto said_at_start = [&] {
    const Program program(scratch.folder, words);
    EXPECT_NE(program.port(), 0) << program.stderr_text();
    return program.stderr_text();
  };
  std::string text = said_at_start();
  EXPECT_NE(text.find(" bricks of surface, as kept before, is used"), std::string::npos) << text;
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  text = said_at_start();
  EXPECT_NE(text.find("the file is cut short; this room is not used, and kept as " + file.string() + ".unused"),
            std::string::npos)
      << text;
}

TEST(Program, AStopSignalKeepsWhatTheRoomIsThen) {
  const TinySession scratch("stop-keeps-room");
  const std::filesystem::path file = scratch.folder / "hall.room";
  const std::string recording = LUMIGRAFT_SOURCE_DIR "/recordings/tabletop";
  Program program(scratch.folder, {"serve", "--session", recording, "--listen", "127.0.0.1:0", "--set",
                                   "plan.method=rays", "--set", "server.room=" + file.string()});
  const std::uint16_t port = program.port();
  ASSERT_NE(port, 0) << program.stderr_text();
  const Clock::time_point deadline = Clock::now() + std::chrono::seconds(60);
  while (http_get(port, "/metrics").find("\nlumigraft_fusion_bricks 0\n") != std::string::npos &&
         Clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(std::filesystem::exists(file)) << "it is written after ten seconds";
  const Clock::time_point begin = Clock::now();
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  EXPECT_LT(Clock::now() - begin, kCommands.save_patience + std::chrono::seconds(1));
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".partial"));
}

TEST(Program, AnAddressInUseIsExitCode1) {
  const TinySession tiny("in-use");
  Program first(tiny.folder, small({"serve", "--session", tiny.folder, "--listen", "127.0.0.1:0"}));
  const std::string address = "127.0.0.1:" + std::to_string(first.port());
  const TinySession other("in-use-too");
  Program second(other.folder, small({"serve", "--session", other.folder, "--listen", address}));
  EXPECT_EQ(second.wait(), 1);
  EXPECT_NE(second.stderr_text().find("cannot listen"), std::string::npos) << second.stderr_text();
}

}  // namespace
}  // namespace lumigraft::server
