#include "relight/views/light_thread.h"

#include <pthread.h>

#include <utility>

#include "relight/parameters.h"
#include "relight/tracing/build_trace_scene.h"

namespace lumigraft::relight {

std::vector<DrawnObject> drawn_objects(const Exhibit& exhibit, double time_s) {
  std::vector<DrawnObject> objects;
  for (const VirtualObject& object : exhibit.objects) {
    if (object.drawn(time_s)) objects.push_back({object.name, object.model});
  }
  return objects;
}

LightThread::LightThread(const capture::Session& session, std::shared_ptr<const RayModels> models)
    : session_(session),
      models_(std::move(models)),
      known_(known_surfaces(session.real_surfaces)),
      camera_(session.color),
      view_motion_(session.color.model),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::optional<std::uint64_t> LightThread::ask(LightRequest request) {
  const std::lock_guard lock(mutex_);
  if (request_ || at_work_) return std::nullopt;
  request_ = std::move(request);
  asked_at_ = std::chrono::steady_clock::now();
  changed_.notify_all();
  return ++asked_;
}

bool LightThread::hangs() const {
  const std::lock_guard lock(mutex_);
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - asked_at_;
  return (request_ || at_work_) && since.count() > kRelight.hung_light_s;
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
    LightRequest request;
    FoundLight found;  // outlives the lock: what it frees is large
    std::exception_ptr failure;
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [&] { return request_.has_value(); })) return;
    request = *std::exchange(request_, std::nullopt);
    at_work_ = true;
    lock.unlock();
    try {
      found = newest();
      found.passes.clear();
      answer(request, &found);
    } catch (...) {
      failure = std::current_exception();
      lighting_.reset();
    }
    lock.lock();
    if (failure)
      newest_.passes.clear();
    else
      std::swap(newest_, found);
    newest_.failure = failure;
    newest_.number = asked_;
    newest_.ended = std::chrono::steady_clock::now();
    at_work_ = false;
    changed_.notify_all();
  }
}

void LightThread::answer(const LightRequest& request, FoundLight* found) {
  const double time_s = 1e-9 * static_cast<double>(request.frame.time_ns);
  PassClock clock(found->passes);
  const std::shared_ptr<const reconstruct::Illumination>& illumination = request.scene.illumination;
  if (!lighting_) {
    lighting_.emplace(session_, known_, models_, ViewLighting::Views::nearby);
    entered_.reset();
    found->light.reset();
  }
  if (request.room != entered_) {
    lighting_->enter(request.room);
    entered_ = request.room;
  }
  if (lighting_->room()->illumination() != illumination)
    lighting_->enter(std::make_shared<const RayRoom>(*lighting_->room(), illumination));
  camera_.take(request.frame);
  found->preparing.clear();
  const Exhibit exhibit = lighting_->prepare(request.exhibit, &found->preparing);
  found->asked = drawn_objects(request.exhibit, time_s);
  found->drawn.clear();
  for (std::size_t i = 0; i < exhibit.objects.size(); ++i) {
    if (request.exhibit.objects[i].drawn(time_s)) found->drawn.push_back(exhibit.objects[i].visible);
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
  lighting_->follow(request.scene, objects, plan, clock);
  const bool anew = lighting_->find(request.frame, camera_, request.T_tag_camera, plan, false, clock);
  if (anew || !found->light) found->light = std::make_shared<const ViewLight>(lighting_->found());
  found->frame_index = static_cast<std::int64_t>(request.frame.index);
  found->changes = lighting_->changes();
  found->shadows = request.scene.shadows;
  found->plan = std::move(plan);
  found->took_ms = clock.total_ms();
  if (chooses) ladder_.took(found->took_ms, anew);
}

}  // namespace lumigraft::relight
