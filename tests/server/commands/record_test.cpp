// Recording a recorded session reproduces it.
#include "server/commands/record.h"

#include <gtest/gtest.h>

#include <sstream>

#include "capture/error.h"
#include "capture/sync/pairing_reader.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

using namespace std::chrono_literals;

ServiceFiles files_of(const std::filesystem::path& folder) {
  ServiceFiles files;
  files.session = folder;
  return files;
}

RecordCommand command(const std::filesystem::path& session, const std::filesystem::path& out) {
  return {.files = files_of(session), .out = out, .seconds = std::nullopt};
}

capture::Session session_in(const std::filesystem::path& folder) {
  return read_service(files_of(folder), interactive_plan()).session;
}

void expect_same_frames(const std::filesystem::path& a, const std::filesystem::path& b, int frames) {
  const auto one = capture::open_frames(session_in(a));
  const auto other = capture::open_frames(session_in(b));
  for (int i = 0; i < frames; ++i) {
    const auto x = one->next(0ms);
    const auto y = other->next(0ms);
    ASSERT_TRUE(x && y) << i;
    EXPECT_EQ(x->time_ns, y->time_ns);
    EXPECT_EQ(x->color->encoded.data, y->color->encoded.data);
    ASSERT_TRUE(x->depth && y->depth);
    EXPECT_EQ(x->depth->depth_m.data, y->depth->depth_m.data);
    EXPECT_EQ(x->warnings, y->warnings);
  }
  EXPECT_FALSE(other->next(0ms));
}

TEST(Record, ARecordedSessionIsTheSameSession) {
  const TinySession tiny("record");
  const std::filesystem::path first = tiny.folder / "first", second = tiny.folder / "second";
  std::ostringstream report;
  run_record(command(tiny.folder, first), false, report);
  EXPECT_NE(report.str().find("colour: 3 pictures\n  depth: 3 pictures\n"), std::string::npos) << report.str();
  expect_same_frames(tiny.folder, first, 3);
  run_record(command(first, second), false, report);
  expect_same_frames(tiny.folder, second, 3);
}

TEST(Record, EndsAfterItsSeconds) {
  const TinySession tiny("record-seconds");
  std::ostringstream report;
  run_record({.files = files_of(tiny.folder), .out = tiny.folder / "out", .seconds = 0.15}, false, report);
  expect_same_frames(tiny.folder, tiny.folder / "out", 2);
}

TEST(Record, CountsWhatWasLost) {
  const TinySession tiny("record-lost");
  const std::string intact = tiny.read("color/000001.png");
  tiny.write("color/000001.png", intact.substr(0, intact.size() / 2));
  std::ostringstream report;
  run_record(command(tiny.folder, tiny.folder / "out"), false, report);
  EXPECT_NE(report.str().find("colour: 2 pictures, 1 lost"), std::string::npos) << report.str();
}

TEST(Record, RefusesAFolderInUseAndCamerasThatAreNotThere) {
  const TinySession tiny("record-bad");
  std::ostringstream report;
  EXPECT_THROW(run_record(command(tiny.folder, tiny.folder), false, report), capture::InputError);
  EXPECT_THROW(run_record(command(tiny.folder / "none", tiny.folder / "out"), false, report), capture::InputError);
  EXPECT_FALSE(std::filesystem::exists(tiny.folder / "out"));
}

}  // namespace
}  // namespace lumigraft::server
