#include "server/commands/record_button.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include "server/commands/parameters.h"
#include "server/commands/viewer_text.h"

namespace lumigraft::server {
namespace {

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

RecordButton::RecordButton(capture::SessionText text, capture::Session session, RecordingsFolder folder, double max_s,
                           capture::SourceObserver& tap)
    : text_(std::move(text)),
      session_(std::move(session)),
      folder_(std::move(folder)),
      max_s_(max_s),
      tap_(tap),
      worker_([this](const std::stop_token& stop) { run(stop); }) {}

RecordButton::~RecordButton() {
  worker_.request_stop();
  worker_.join();
}

void RecordButton::press(bool on) {
  const std::lock_guard lock(mutex_);
  if (on && state_.doing == Doing::nothing) {
    state_ = {};
    state_.doing = Doing::starting;
    end_wanted_ = false;
  } else if (!on && (state_.doing == Doing::starting || state_.doing == Doing::recording)) {
    end_wanted_ = true;
    if (state_.doing == Doing::recording) tap_.listen({});  // what comes from now on is not recorded
  }
  pressed_.notify_all();
}

void RecordButton::run(const std::stop_token& stop) {
  for (std::unique_lock lock(mutex_); !stop.stop_requested();) {
    pressed_.wait_for(lock, stop, kCommands.recording_check,
                      [this] { return state_.doing == Doing::starting || end_wanted_; });
    const Doing doing = state_.doing;
    const bool end_wanted = std::exchange(end_wanted_, doing == Doing::starting && end_wanted_);
    lock.unlock();
    if (doing == Doing::starting) start();
    if (doing == Doing::recording) end_wanted ? end("", true) : check();
    lock.lock();
  }
  end("", false);
  finisher_ = {};
}

void RecordButton::start() {
  finisher_ = {};  // stops the compression of the previous recording's depth
  std::shared_ptr<capture::RecordingLanes> lanes;
  const std::filesystem::path folder = folder_.new_recording();
  {
    const std::lock_guard lock(mutex_);
    state_.folder = folder.string();
  }
  try {
    if (const std::string reason = folder_.make_room({}); !reason.empty()) return fail(reason);
    lanes = std::make_shared<capture::RecordingLanes>(text_, session_, folder, true);
    RecordingsFolder::mark(folder);
  } catch (const std::exception& e) {
    return fail(e.what());
  }
  // Listens before it says that it records: whoever waits for that counts on what comes then.
  const std::lock_guard lock(mutex_);
  lanes_ = lanes;
  tap_.listen([lanes](const capture::SourceItem& item) { lanes->put(kept(item), true); });
  state_.doing = Doing::recording;
  began_ = Clock::now();
}

/// The error of the recording, in the log with paths. `mutex_` is not held.
void RecordButton::fail(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  std::fprintf(stderr, "lumigraft: recording %s: %s\n", state_.folder.c_str(), reason.c_str());
  state_.error = without_folders(reason);
  if (!lanes_) state_.doing = Doing::nothing;
}

/// Ends a recording that failed, for example on a full disk, or that reached a limit.
void RecordButton::check() {
  std::exception_ptr failure;
  std::filesystem::path folder;
  bool too_long = false;
  {
    const std::lock_guard lock(mutex_);
    count();
    failure = lanes_->failure();
    folder = state_.folder;
    too_long = state_.seconds >= max_s_;
  }
  if (failure) return end(reason_of(failure), false);
  if (too_long)
    return end("it has lasted " + std::to_string(std::lround(max_s_)) + " s (server.max_recording_s)", true);
  if (const std::string reason = folder_.make_room(folder); !reason.empty()) end(reason, false);
}

/// Stops listening, and finishes writing on a thread of its own. No effect while nothing is recorded.
void RecordButton::end(const std::string& reason, bool compress) {
  {
    const std::lock_guard lock(mutex_);
    if (state_.doing != Doing::recording) return;
  }
  tap_.listen({});
  if (!reason.empty()) fail(reason);
  {
    const std::lock_guard lock(mutex_);
    count();
    state_.doing = Doing::finishing;
  }
  finisher_ = std::jthread([this, lanes = lanes_, compress](const std::stop_token& stop) {
    lanes->finish();
    const std::exception_ptr failure = lanes->failure();
    const bool empty = lanes->count(capture::Stream::color).frames == 0;
    const bool said = !state().error.empty();
    if (failure && !said) fail(reason_of(failure));
    if (!failure && !said && empty) fail("no colour picture came, so it cannot be replayed");
    {
      const std::lock_guard lock(mutex_);
      count();
      compressing_ = compress && !failure && !empty;
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
}

RecordButton::State RecordButton::state() {
  const std::lock_guard lock(mutex_);
  if (lanes_) count();
  State state = state_;
  state.doing = state.doing == Doing::nothing && compressing_ ? Doing::compressing : state.doing;
  return state;
}

}  // namespace lumigraft::server
