#include "relight/views/light_thread.h"

#include <pthread.h>

#include <utility>

#include "relight/parameters.h"
#include "relight/tracing/build_trace_scene.h"

namespace lumigraft::relight {

LightThread::LightThread(const capture::Session& session, std::shared_ptr<const RayModels> models)
    : lighting_(session, std::move(models), ViewLighting::Views::nearby),
      camera_(session.color),
      view_motion_(session.color.model),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::optional<std::uint64_t> LightThread::ask(LightRequest request) {
  const std::lock_guard lock(mutex_);
  if (request_ || at_work_) return std::nullopt;
  request_ = std::move(request);
  changed_.notify_all();
  return ++asked_;
}

void LightThread::wait(std::uint64_t number) const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return newest_.number >= number; });
}

void LightThread::wait_idle() const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !request_ && !at_work_; });
}

void LightThread::wait_for(std::uint64_t number, double ms) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double, std::milli>(ms), [&] { return newest_.number >= number; });
}

FoundLight LightThread::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void LightThread::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "view light");  // for `top -H`
  for (;;) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [&] { return request_.has_value(); })) return;
    const LightRequest request = *std::exchange(request_, std::nullopt);
    at_work_ = true;
    FoundLight found = newest_;
    lock.unlock();
    found.passes.clear();
    found.failure = nullptr;
    try {
      answer(request, &found);
    } catch (...) {
      found.failure = std::current_exception();
    }
    lock.lock();
    found.number = asked_;
    found.ended = std::chrono::steady_clock::now();
    newest_ = std::move(found);
    at_work_ = false;
    changed_.notify_all();
  }
}

void LightThread::answer(const LightRequest& request, FoundLight* found) {
  const double time_s = 1e-9 * static_cast<double>(request.frame.time_ns);
  PassClock clock(found->passes);
  const std::shared_ptr<const reconstruct::Illumination>& illumination = request.scene.illumination;
  if (request.room != entered_) {
    lighting_.enter(entered_ = request.room);
  }
  if (lighting_.room()->illumination() != illumination)
    lighting_.enter(std::make_shared<const RayRoom>(*lighting_.room(), illumination));
  camera_.take(request.frame);
  found->preparing.clear();
  const Exhibit exhibit = lighting_.prepare(request.exhibit, &found->preparing);
  found->asked.clear();
  found->drawn.clear();
  for (std::size_t i = 0; i < exhibit.objects.size(); ++i) {
    if (!request.exhibit.objects[i].drawn(time_s)) continue;
    found->asked.push_back(exhibit.objects[i].model);
    found->drawn.push_back(exhibit.objects[i].visible);
  }
  const std::vector<ReferenceMesh> objects = reference_objects_of(exhibit, time_s);
  if (objects.empty()) {
    found->light = nullptr;
    return;
  }
  Plan plan = request.plan;
  const bool chooses = QualityLadder::chooses(plan);
  if (chooses) {
    plan.budget_ms *= kRelight.light_budgets;
    const bool moves = view_motion_.moves(exhibit, request.scene.pose->T_tag_camera, request.frame.time_ns);
    plan = ladder_.plan(plan, moves, time_s);
    plan.budget_ms = request.plan.budget_ms;
  }
  lighting_.follow(request.scene, objects, plan, clock);
  const bool anew = lighting_.find(request.frame, camera_, request.T_tag_camera, plan, false, clock);
  if (anew || !found->light) found->light = std::make_shared<const ViewLight>(lighting_.found());
  found->frame_index = request.frame.index;
  found->plan = std::move(plan);
  found->took_ms = clock.total_ms();
  if (chooses) ladder_.took(found->took_ms, anew);
}

}  // namespace lumigraft::relight
