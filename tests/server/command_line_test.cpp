#include "server/command_line.h"

#include <gtest/gtest.h>

#include "capture/error.h"

namespace lumigraft::server {
namespace {

CommandLine parse(std::vector<const char*> words) {
  words.insert(words.begin(), "lumigraft");
  return parse_command_line(static_cast<int>(words.size()), words.data());
}

TEST(CommandLine, Serve) {
  const auto serve = std::get<ServeCommand>(parse({"serve", "--session", "s", "--listen", ":0", "--set",
                                                   "plan.volume=32", "--set", "tag.id=7", "--backend", "egl"}));
  EXPECT_EQ(serve.files.session, "s");
  EXPECT_EQ(serve.listen, ":0");
  EXPECT_EQ(serve.files.overrides, (std::vector<std::string>{"plan.volume=32", "tag.id=7", "server.backend=egl"}));
}

TEST(CommandLine, Replay) {
  const auto replay = std::get<ReplayCommand>(parse({"replay", "--set", "plan.volume=32", "s", "--out", "o", "--frames",
                                                     "3", "--oracle", "pose,light", "--dump", "--backend", "vulkan"}));
  EXPECT_EQ(replay.files.session, "s");
  EXPECT_EQ(replay.out, "o");
  EXPECT_EQ(replay.frames, 3);
  EXPECT_TRUE(replay.oracle.pose && replay.oracle.light && !replay.oracle.albedo);
  EXPECT_TRUE(replay.dump);
  EXPECT_EQ(replay.files.overrides, (std::vector<std::string>{"plan.volume=32", "server.backend=vulkan"}));
}

TEST(CommandLine, Record) {
  const auto record = std::get<RecordCommand>(parse({"record", "s", "--out", "o", "--seconds", "2.5"}));
  EXPECT_EQ(record.files.session, "s");
  EXPECT_EQ(record.out, "o");
  EXPECT_EQ(record.seconds, 2.5);
  EXPECT_EQ(std::get<RecordCommand>(parse({"record", "--config", "k", "--out", "o"})).files.config, "k");
  EXPECT_THROW(parse({"record", "--out", "o"}), capture::InputError);
  EXPECT_THROW(parse({"record", "s"}), capture::InputError);
  EXPECT_THROW(parse({"record", "s", "--out", "o", "--seconds", "0"}), capture::InputError);
}

TEST(CommandLine, Calibrate) {
  const auto session = std::get<CalibrateCommand>(parse({"calibrate", "s", "--board", "b", "--out", "o"}));
  EXPECT_EQ(session.files.session, "s");
  EXPECT_EQ(session.board, "b");
  EXPECT_EQ(session.out, "o");
  const auto folders = std::get<CalibrateCommand>(
      parse({"calibrate", "--board", "b", "--color", "c", "--fisheye", "f", "--fov-degrees", "190", "--out", "o"}));
  EXPECT_EQ(folders.color, "c");
  EXPECT_EQ(folders.fisheye, "f");
  EXPECT_EQ(folders.fov_degrees, 190);
  EXPECT_EQ(std::get<CalibrateCommand>(parse({"calibrate", "--board", "b", "--draw", "d"})).draw, "d");
  EXPECT_EQ(std::get<CalibrateCommand>(parse({"calibrate", "--sweep", "l", "--out", "o"})).sweep, "l");
  EXPECT_THROW(parse({"calibrate", "--sweep", "l"}), capture::InputError);
  EXPECT_THROW(parse({"calibrate", "s", "--sweep", "l", "--out", "o"}), capture::InputError);
  EXPECT_THROW(parse({"calibrate", "--board", "b"}), capture::InputError);
  EXPECT_THROW(parse({"calibrate", "s", "--board", "b"}), capture::InputError);
  EXPECT_THROW(parse({"calibrate", "--board", "b", "--out", "o"}), capture::InputError);
  EXPECT_THROW(parse({"calibrate", "s", "--board", "b", "--color", "c", "--out", "o"}), capture::InputError);
}

TEST(CommandLine, Devices) {
  EXPECT_FALSE(std::get<DevicesCommand>(parse({"devices"})).json);
  EXPECT_TRUE(std::get<DevicesCommand>(parse({"devices", "--json"})).json);
}

TEST(CommandLine, Bench) {
  const auto bench =
      std::get<BenchCommand>(parse({"bench", "s", "t", "--out", "o", "--oracle", "pose,light", "--methods", "dvct",
                                    "--settings", "live-32,live-64", "--charts", "cost-work", "--backend", "egl"}));
  EXPECT_EQ(bench.sessions, (std::vector<std::filesystem::path>{"s", "t"}));
  EXPECT_EQ(bench.out, "o");
  EXPECT_EQ(name_of(bench.oracle), "pose+light");
  EXPECT_EQ(bench.methods, std::vector<std::string>{"dvct"});
  EXPECT_EQ(bench.charts, std::vector<std::string>{"cost-work"});
  EXPECT_EQ(bench.settings, (std::vector<std::string>{"live-32", "live-64"}));
  EXPECT_EQ(bench.backend, relight::gpu::Backend::egl);
  EXPECT_EQ(name_of(std::get<BenchCommand>(parse({"bench", "s", "--out", "o"})).oracle), "none");
  EXPECT_FALSE(bench.shard);
  EXPECT_EQ(std::get<BenchCommand>(parse({"bench", "s", "--out", "o", "--shard", "2/3"})).shard.value().number, 2);
}

TEST(CommandLine, Texts) {
  EXPECT_NE(std::get<PrintCommand>(parse({"--version"})).text.find("lumigraft 0."), std::string::npos);
  EXPECT_NE(std::get<PrintCommand>(parse({"--help"})).text.find("replay"), std::string::npos);
  EXPECT_NE(std::get<PrintCommand>(parse({"serve", "--help"})).text.find("--listen"), std::string::npos);
  EXPECT_NE(std::get<PrintCommand>(parse({"replay", "--set", "help"})).text.find("volume"), std::string::npos);
  EXPECT_NE(std::get<PrintCommand>(parse({"serve", "--set", "help"})).text.find("server.listen"), std::string::npos);
  EXPECT_TRUE(std::holds_alternative<DoctorCommand>(parse({"doctor"})));
}

TEST(CommandLine, WhatIsWrongIsOneLine) {
  for (const std::vector<const char*>& words :
       std::vector<std::vector<const char*>>{{"launch"},
                                             {"serve"},
                                             {"serve", "--session", "a", "--config", "b"},
                                             {"replay"},
                                             {"replay", "s"},
                                             {"replay", "s", "--out", "o", "--frames", "0"},
                                             {"replay", "s", "--out", "o", "--frames", "x"},
                                             {"replay", "s", "--out", "o", "--backend", "metal"},
                                             {"replay", "s", "--out", "o", "--oracle", "luck"},
                                             {"replay", "s", "--out", "o", "--set", "volume"},
                                             {"replay", "s", "t", "--out", "o"},
                                             {"bench"},
                                             {"bench", "s"},
                                             {"bench", "s", "--out", "o", "--oracle", "luck"},
                                             {"bench", "s", "--out", "o", "--shard", "3/2"},
                                             {"record"},
                                             {"serve", "--session"}}) {
    try {
      parse(words);
      FAIL() << words[0];
    } catch (const capture::InputError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
      EXPECT_FALSE(std::string(e.what()).empty());
    }
  }
}

}  // namespace
}  // namespace lumigraft::server
