#pragma once
// Records a live colour camera and checks that the replay equals it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "capture/record/session_recorder.h"
#include "capture/session/config.h"
#include "capture/sync/pairing_reader.h"

namespace lumigraft::test {

/// Records the session of `folder`/session.toml into `folder`/out.
inline void expect_identical_replay(const std::filesystem::path& folder, std::size_t pictures) {
  const capture::Session live = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  std::vector<capture::Frame> seen;
  {
    const capture::PairedSources sources = capture::open_sources(live);
    capture::SessionRecorder recorder({folder / "session.toml", {}}, live, folder / "out");
    while (seen.size() < pictures) {
      const auto item = sources.color->next(std::chrono::seconds(3));
      ASSERT_TRUE(item) << sources.color->fault();
      if (recorder.write(capture::Stream::color, *item)) {
        seen.push_back(std::get<capture::Frame>(*item));
      }
    }
  }
  const capture::PairedSources replay =
      capture::open_sources(capture::read_session(capture::ConfigTable::load(folder / "out" / "session.toml")));
  for (const capture::Frame& before : seen) {
    const auto item = replay.color->next(std::chrono::seconds(0));
    ASSERT_TRUE(item);
    const auto& after = std::get<capture::Frame>(*item);
    EXPECT_EQ(after.stamp.time_ns, before.stamp.time_ns);
    EXPECT_EQ(after.exposure, before.exposure);
    EXPECT_EQ(after.encoded.data, before.encoded.data);
    ASSERT_EQ(after.original == nullptr, before.original == nullptr);
    if (after.original) {
      EXPECT_EQ(after.original->format, before.original->format);
      EXPECT_TRUE(std::ranges::equal(after.original->bytes, before.original->bytes));
    }
  }
}

}  // namespace lumigraft::test
