#include "server/commands/record_button.h"

#include <array>
#include <ctime>
#include <utility>

namespace lumigraft::server {
namespace {

/// Such as 2026-11-22T05-04-03Z, which is valid on every file system.
std::string time_name() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H-%M-%SZ", &utc);
  return text.data();
}

/// The item to record: a picture converted for display is replaced by the original, where the camera delivered one.
capture::SourceItem kept(const capture::SourceItem& item) {
  const auto* frame = std::get_if<capture::Frame>(&item);
  if (frame == nullptr || !frame->original) return item;
  return capture::Frame{
      .stamp = frame->stamp, .stream = frame->stream, .exposure = frame->exposure, .original = frame->original};
}

std::string reason_of(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "it failed";
  }
}

}  // namespace

RecordButton::RecordButton(capture::SessionText text, capture::Session session, std::filesystem::path folder,
                           capture::SourceObserver& tap)
    : text_(std::move(text)), session_(std::move(session)), folder_(std::move(folder)), tap_(tap) {}

RecordButton::~RecordButton() {
  const std::lock_guard lock(mutex_);
  end();
}

void RecordButton::press(bool on) {
  const std::lock_guard lock(mutex_);
  if (!on || state_.doing != Doing::nothing) return on ? void() : end();
  finisher_ = {};  // stops the compression of the previous recording's depth; that thread takes no lock any more
  const std::filesystem::path folder = folder_ / time_name();
  state_ = {};
  state_.folder = folder.string();
  try {
    lanes_ = std::make_shared<capture::RecordingLanes>(text_, session_, folder, true);
  } catch (const std::exception& e) {
    state_.error = e.what();
    return;
  }
  state_.doing = Doing::recording;
  began_ = Clock::now();
  tap_.listen([lanes = lanes_](const capture::SourceItem& item) { lanes->put(kept(item), true); });
}

/// Stops listening, and finishes writing on a thread of its own.
void RecordButton::end() {
  if (state_.doing != Doing::recording) return;
  tap_.listen({});
  count();
  state_.doing = Doing::finishing;
  finisher_ = std::jthread([this, lanes = lanes_](const std::stop_token& stop) {
    lanes->finish();
    {
      const std::lock_guard lock(mutex_);
      count();
      if (state_.error.empty() && lanes->count(capture::Stream::color).frames == 0) {
        state_.error = "no colour picture came, so it cannot be replayed";
      }
      compressing_ = state_.error.empty();
      state_.doing = Doing::nothing;
      lanes_.reset();
    }
    try {
      if (compressing_) lanes->compress_depth(stop);
    } catch (const std::exception&) {  // for example a full disk: the recording is complete, but larger
    }
    compressing_ = false;
  });
}

void RecordButton::count() {
  if (state_.doing == Doing::recording) state_.seconds = std::chrono::duration<double>(Clock::now() - began_).count();
  state_.frames = state_.lost = 0;
  for (const capture::Stream stream : capture::kStreams) {
    state_.frames += lanes_->count(stream).frames;
    state_.lost += lanes_->count(stream).lost;
  }
  if (const std::exception_ptr failure = lanes_->failure()) state_.error = reason_of(failure);
}

RecordButton::State RecordButton::state() {
  const std::lock_guard lock(mutex_);
  if (lanes_) {
    count();
    if (!state_.error.empty()) end();
  }
  State state = state_;
  state.doing = state.doing == Doing::nothing && compressing_ ? Doing::compressing : state.doing;
  return state;
}

}  // namespace lumigraft::server
