// Frames of a program of its own, and what the service says of one that fails.
#include "capture/live/helper_source.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "capture/error.h"
#include "capture/live/live_source.h"
#include "capture/sync/depth_registration.h"
#include "tests/capture/live/small_camera.h"
#include "tests/capture/recorded_frames.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
constexpr int kHelperWidth = 160, kHelperHeight = 120;

std::vector<StreamSpec> both_streams() {
  StreamSpec color{.stream = Stream::color, .width = kHelperWidth, .height = kHelperHeight, .exposure = 2.0};
  StreamSpec depth = color;
  depth.stream = Stream::depth;
  depth.registered = false;
  return {color, depth};
}

std::string example(const std::string& mode) { return std::string(LUMIGRAFT_EXAMPLE_HELPER) + " " + mode; }

std::uint8_t byte_of(std::size_t i, std::uint64_t sequence) { return static_cast<std::uint8_t>(i + sequence); }

TEST(HelperSource, EveryFrameOfBothStreamsArrives) {
  HelperSource source(example("frames"), both_streams());
  EXPECT_EQ(source.serial(), "E-0001");
  for (std::uint64_t number = 0; number < 6; ++number) {
    const auto first = source.next(3s), second = source.next(3s);
    ASSERT_TRUE(first && second) << source.fault();
    const auto& color = std::get<Frame>(*first);
    const auto& depth = std::get<RawDepth>(*second);
    for (const Stamp& stamp : {color.stamp, depth.stamp}) {
      EXPECT_EQ(stamp.sequence, number);
      EXPECT_EQ(stamp.time_ns, static_cast<std::int64_t>(number) * 20'000'000);
    }
    EXPECT_EQ(color.exposure, number < 3 ? 2.0 : 4.0) << "the reported exposure time doubles";
    ASSERT_EQ(color.encoded.data.size(), 3u * kHelperWidth * kHelperHeight);
    for (std::size_t i = 0; i < color.encoded.data.size(); ++i) ASSERT_EQ(color.encoded.data[i], byte_of(i, number));
    ASSERT_EQ(depth.counts.data.size(), std::size_t{kHelperWidth} * kHelperHeight);
    for (std::size_t i = 0; i < depth.counts.data.size(); ++i) {
      ASSERT_EQ(depth.counts.data[i], byte_of(2 * i, number) | byte_of(2 * i + 1, number) << 8);
    }
  }
}

TEST(HelperSource, ALostFrameKeepsItsPlace) {
  HelperSource source(example("lost"), {both_streams()[0]});
  ASSERT_TRUE(source.next(3s) && source.next(3s));
  const auto item = source.next(3s);
  ASSERT_TRUE(item);
  const auto& lost = std::get<LostFrame>(*item);
  EXPECT_EQ(lost.reason, "torn");
  EXPECT_EQ(lost.stamp.sequence, 2u);
  EXPECT_TRUE(source.next(3s));
}

TEST(HelperSource, WhatItRefusesAtTheStartIsSaid) {
  const auto error = [](const std::string& command) -> std::string {
    try {
      const HelperSource source(command, both_streams());
    } catch (const CameraFault& e) {
      return std::string("fault: ") + e.what();
    } catch (const InputError& e) {
      return std::string("error: ") + e.what();
    }
    return "no error";
  };
  EXPECT_EQ(error(example("unavailable")), "fault: found the camera asleep");
  EXPECT_EQ(error(example("refused")), "error: found no such size");
  EXPECT_EQ(error(example("fails")), "fault: it failed");
  EXPECT_EQ(error(example("crashes")), "fault: Aborted");
  EXPECT_EQ(error("/bin/true"), "fault: its helper ended without an answer");
  EXPECT_EQ(error("example"), "error: found \"example\", allowed: the absolute path of a program, and its arguments");
  EXPECT_EQ(error("/dev/null x"),
            "error: found \"/dev/null\", allowed: the absolute path of a program, and its arguments");
}

TEST(HelperSource, OneThatDoesNotAnswerIsNotWaitedForLonger) {
  EXPECT_THROW(HelperFrames(LUMIGRAFT_EXAMPLE_HELPER, {"silent"}, both_streams(), 200ms), CameraFault);
}

TEST(HelperSource, WhatEndsItIsItsFault) {
  const std::map<std::string, std::string> faults = {
      {"ends", "its helper ended"},
      {"cut", "its helper ended"},
      {"unplugged", "its helper ended: the camera is unplugged"},
      {"mark", "its helper ended: its helper sent no message of version 1"},
      {"stream",
       "its helper ended: its helper sent a message that is not allowed now, or of a stream that was not "
       "requested"},
      {"size", "its helper ended: its helper sent a colour frame of 57599 bytes, allowed: 57600, for 160x120 pixels"}};
  for (const auto& [mode, fault] : faults) {
    HelperSource source(example(mode), both_streams());
    for (int i = 0; i < 40 && !source.finished(); ++i) source.next(3s);
    EXPECT_TRUE(source.finished()) << mode;
    EXPECT_EQ(source.fault(), fault);
  }
}

TEST(HelperSource, IsStartedAgainWhereItEnds) {
  LiveSource source("colour", [] { return std::make_unique<HelperSource>(example("ends"), both_streams()); });
  std::uint64_t last = 0;
  for (int i = 0; i < 24; ++i) {  // two runs of five frames of each stream, less those before the clock is known
    const auto item = source.next(5s);
    if (!item) break;
    last = std::max(last, stamp_of(*item).sequence);
  }
  EXPECT_GE(last, 5u);
}

class RecordedHelper : public test::ScratchFolder {
 protected:
  Session session(const std::string& more) const {
    std::ofstream(folder_ / "session.toml") << "format = 1\n[color]\nsource = \"helper:" << example("frames") << "\"\n"
                                            << test::kSmallCamera << more << "[tag]\nid = 1\nsize_m = 0.1\n";
    const ConfigTable root = ConfigTable::load(folder_ / "session.toml");
    Session out = read_session(root);
    root.finish();
    return out;
  }
  std::string error(const std::string& more) const {
    try {
      open_sources(session(more));
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  }
  std::string depth(const std::string& keys) const {
    return "[depth]\nsource = \"helper:" + example("frames") + "\"\nunit_m = 0.001\n" + keys;
  }
};

TEST_F(RecordedHelper, ReplaysByteForByte) {
  session("");
  test::expect_identical_replay(folder_, 8);
}

TEST_F(RecordedHelper, OneProgramGivesColourAndDepthOfAMoment) {
  const Session live = session(depth("registered = true\n"));
  const auto reader = std::make_unique<RegisteredFrames>(live, std::make_unique<PairingReader>(open_sources(live)));
  int paired = 0;
  for (int i = 0; i < 20 && paired < 5; ++i) {
    const auto set = reader->next(3s);
    ASSERT_TRUE(set);
    if (set->depth) {
      ++paired;
      EXPECT_EQ(set->raw_depth->counts.data[0] & 0xFF, set->color->encoded.data[0]) << "of the same number";
    }
  }
  EXPECT_EQ(paired, 5);
}

TEST_F(RecordedHelper, WrongConfigurationsAreRefused) {
  EXPECT_NE(error(depth("")).find("depth.registered: found nothing, allowed with helper: false, or true if the camera"),
            std::string::npos);
  try {
    open_paired_frames(session(""));
    FAIL() << "a recording ran a program";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("allowed here: no programs, since recordings come from others"),
              std::string::npos);
  }
  EXPECT_EQ(error("gain = 2\n"), "color: found settings of the camera with helper:, allowed: none");
  EXPECT_EQ(error(depth("registered = true\nrate_hz = 30\n")),
            "depth: found settings of the camera with helper:, allowed: none");
}

}  // namespace
}  // namespace lumigraft::capture
