#include "relight/tracing/worker_pool.h"

#include <algorithm>

namespace lumigraft::relight {

WorkerPool& WorkerPool::shared() {
  static WorkerPool pool(static_cast<int>(std::thread::hardware_concurrency()) - 1);
  return pool;
}

WorkerPool::WorkerPool(int threads) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this](const std::stop_token& stop) { help(stop); });
}

WorkerPool::~WorkerPool() {
  for (std::jthread& thread : threads_) thread.request_stop();
}

void WorkerPool::run(int parts, const std::function<bool()>& part) {
  if (threads_.empty() || parts < 2) {
    while (part()) {
    }
    return;
  }
  const auto job = std::make_shared<Job>(part);
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(job);
  }
  for (int i = 0; i < std::min(parts - 1, static_cast<int>(threads_.size())); ++i) wanted_.notify_one();
  while (part()) {
  }
  std::unique_lock lock(mutex_);
  job->closed = true;
  std::erase(jobs_, job);
  ended_.wait(lock, [&] { return job->running == 0; });
}

void WorkerPool::help(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (wanted_.wait(lock, stop, [&] { return !jobs_.empty(); })) {
    const std::shared_ptr<Job> job = jobs_.back();
    ++job->running;
    lock.unlock();
    const bool more = job->part();
    lock.lock();
    --job->running;
    if (!more && !job->closed) {
      job->closed = true;
      std::erase(jobs_, job);
    }
    if (job->closed && job->running == 0) ended_.notify_all();
  }
}

}  // namespace lumigraft::relight
