// The record button with a fake live camera; for the page with a real one see
// tests/integration/end_to_end/record_page_test.py.
#include "server/commands/record_button.h"

#include <gtest/gtest.h>

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
    button_ = std::make_unique<RecordButton>(input.session_text, input.session, tiny_.folder / "recorded", tap_);
  }
  void show(int frames) const {
    for (int i = 0; i < frames; ++i) EXPECT_TRUE(sources_.color->next(0ms));
  }
  RecordButton::State ended() const {
    const Clock::time_point begin = Clock::now();
    while (button_->state().doing != RecordButton::Doing::nothing && Clock::now() - begin < 10s) {
      std::this_thread::sleep_for(1ms);
    }
    return button_->state();
  }

  const TinySession tiny_{"record-button"};
  capture::SourceObserver tap_;
  capture::PairedSources sources_;
  std::unique_ptr<RecordButton> button_;
};

TEST_F(RecordButtonTest, KeepsWhatPassesBetweenTheTwoPresses) {
  EXPECT_EQ(button_->state().folder, "");
  show(3);
  button_->press(true);
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
  button_->press(true);
  button_->press(false);
  EXPECT_EQ(ended().error, "no colour picture came, so it cannot be replayed");
  std::filesystem::remove_all(tiny_.folder / "recorded");
  tiny_.write("recorded", "a file");
  button_->press(true);
  EXPECT_NE(button_->state().error.find("recorded"), std::string::npos) << button_->state().error;
  EXPECT_EQ(button_->state().doing, RecordButton::Doing::nothing);
  std::filesystem::remove(tiny_.folder / "recorded");
}

TEST_F(RecordButtonTest, EndsByItselfWhereTheDiskTakesNoMore) {
  button_->press(true);
  std::filesystem::create_directory(std::filesystem::path(button_->state().folder) / "color.mkv");
  show(3);
  const Clock::time_point begin = Clock::now();
  while (button_->state().error.empty() && Clock::now() - begin < 10s) show(1);
  EXPECT_NE(ended().error.find("color.mkv"), std::string::npos) << button_->state().error;
  show(3);
}

}  // namespace
}  // namespace lumigraft::server
