// The record button with a fake live camera; for the page with a real one see
// tests/integration/end_to_end/record_page_test.py.
#include "server/commands/record_button.h"

#include <gtest/gtest.h>

#include <atomic>

#include "capture/session/stream_spec.h"
#include "server/pipeline/service_config.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

class MadeUp : public capture::Source {
 public:
  std::optional<capture::SourceItem> next(std::chrono::milliseconds) override {
    capture::Frame picture;
    picture.stamp = {capture::steady_now_ns(), capture::steady_now_ns(), sequence_++};
    picture.encoded = capture::Image<std::uint8_t>(TinySession::kWidth, TinySession::kHeight, 3);
    return picture;
  }
  bool finished() const override { return false; }
  void rewind() override {}

 private:
  std::uint64_t sequence_ = 7;
};

class RecordButtonTest : public testing::Test {
 protected:
  RecordButtonTest() {
    ServiceFiles files;
    files.session = tiny_.folder;
    const ServiceInput input = read_service(files, interactive_plan());
    sources_ = tap_.on({std::make_shared<MadeUp>(), nullptr, nullptr, true});
    text_ = input.session_text;
    session_ = input.session;
    make({.max_s = 600, .max_total_gb = 1, .min_free_gb = 1e-3});
  }
  void make(const RecordingLimits& limits, RecordingsFolder::FreeBytes free_bytes = RecordingsFolder::disk_free_bytes) {
    button_.reset();
    button_ = std::make_unique<RecordButton>(text_, session_,
                                             RecordingsFolder(tiny_.folder / "recorded", limits, std::move(free_bytes)),
                                             limits.max_s, tap_);
  }
  void begin() const {
    button_->press(true);
    EXPECT_NE(button_->state().doing, RecordButton::Doing::nothing) << "all viewers see that it begins";
    while (button_->state().doing == RecordButton::Doing::starting) std::this_thread::sleep_for(1ms);
  }
  void show(int frames) const {
    for (int i = 0; i < frames; ++i) EXPECT_TRUE(sources_.color->next(0ms));
  }
  RecordButton::State ended() const {
    const Clock::time_point begin = Clock::now();
    while (button_->state().doing != RecordButton::Doing::nothing && Clock::now() - begin < 60s) {
      std::this_thread::sleep_for(1ms);
    }
    return button_->state();
  }

  const TinySession tiny_{"record-button"};
  capture::SourceObserver tap_;
  capture::PairedSources sources_;
  capture::SessionText text_;
  capture::Session session_;
  std::unique_ptr<RecordButton> button_;
};

TEST_F(RecordButtonTest, KeepsWhatPassesBetweenTheTwoPresses) {
  EXPECT_EQ(button_->state().folder, "");
  show(3);
  begin();
  button_->press(true);
  show(20);
  EXPECT_EQ(button_->state().doing, RecordButton::Doing::recording);
  button_->press(false);
  show(5);
  const RecordButton::State state = ended();
  EXPECT_EQ(state.frames, 20u);
  EXPECT_EQ(state.lost, 0u) << "what was before it is none of its business";
  EXPECT_EQ(state.error, "");
  ServiceFiles files;
  files.session = state.folder;
  const auto frames = capture::open_frames(read_service(files, interactive_plan()).session);
  int count = 0;
  while (frames->next(0ms)) ++count;
  EXPECT_EQ(count, 20);
}

TEST_F(RecordButtonTest, SaysWhyNothingIsKept) {
  begin();
  button_->press(false);
  EXPECT_EQ(ended().error, "no colour picture came, so it cannot be replayed");
  std::filesystem::remove_all(tiny_.folder / "recorded");
  tiny_.write("recorded", "a file");
  button_->press(true);  // may have ended before anything else
  EXPECT_NE(ended().error.find("Not a directory"), std::string::npos) << button_->state().error;
  EXPECT_EQ(button_->state().doing, RecordButton::Doing::nothing);
  std::filesystem::remove(tiny_.folder / "recorded");
}

TEST_F(RecordButtonTest, EndsByItselfWhereTheDiskTakesNoMore) {
  begin();
  std::filesystem::create_directory(std::filesystem::path(button_->state().folder) / "color.mkv");
  show(3);
  const Clock::time_point begin = Clock::now();
  while (button_->state().error.empty() && Clock::now() - begin < 60s) show(1);
  EXPECT_NE(ended().error.find("color.mkv"), std::string::npos) << button_->state().error;
  show(3);
}

TEST_F(RecordButtonTest, APressWhileItBeginsEndsIt) {
  button_->press(true);
  button_->press(false);
  EXPECT_EQ(ended().error, "no colour picture came, so it cannot be replayed");
}

TEST_F(RecordButtonTest, EndsAfterTheLongestTimeAndIsComplete) {
  make({.max_s = 1, .max_total_gb = 1, .min_free_gb = 1e-3});
  begin();
  const Clock::time_point start = Clock::now();
  while (button_->state().doing == RecordButton::Doing::recording && Clock::now() - start < 30s) {
    show(1);
    std::this_thread::sleep_for(5ms);
  }
  const RecordButton::State state = ended();
  EXPECT_EQ(state.error, "it has lasted 1 s (server.max_recording_s)");
  EXPECT_GT(state.frames, 0u);
}

TEST_F(RecordButtonTest, OlderRecordingsGoForItAndADiskThatIsFullEndsIt) {
  std::atomic<std::uintmax_t> free_bytes = 5'000'000'000;
  make({.max_s = 600, .max_total_gb = 1, .min_free_gb = 1},
       [&](const std::filesystem::path&) { return free_bytes.load(); });
  begin();
  show(3);
  button_->press(false);
  const std::filesystem::path first = ended().folder;
  EXPECT_TRUE(std::filesystem::exists(first / RecordingsFolder::kMark));
  free_bytes = 999'999'999;  // one byte is missing
  begin();
  EXPECT_FALSE(std::filesystem::exists(first));
  show(3);
  free_bytes = 10;
  const std::string error = ended().error;
  EXPECT_EQ(
      error,
      "less than 1 GB are free on the disk of recordings (server.min_free_disk_gb), and removing older ones would "
      "not suffice");
  const std::filesystem::path second = button_->state().folder;
  button_->press(true);  // may have ended before anything else
  EXPECT_EQ(ended().error, error);
  EXPECT_EQ(button_->state().doing, RecordButton::Doing::nothing);
  EXPECT_TRUE(std::filesystem::exists(second)) << "what was written until then stays";
}

}  // namespace
}  // namespace lumigraft::server
