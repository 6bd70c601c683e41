#pragma once
// Threads that wait for parts of the work of others: starting threads takes as long as a small loop over pixels.
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace lumigraft::relight {

/// One thread less than the machine has cores: whoever has work does a part of it.
class WorkerPool {
 public:
  static WorkerPool& shared();
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Calls `part()`, here and on idle threads at once, until it has returned false everywhere; it must not throw.
  /// `parts`: how many calls have something to do, at most. Threads help whoever asked last, so that a short loop need
  /// not wait for the end of a long one. May be called from within a part.
  void run(int parts, const std::function<bool()>& part);

 private:
  struct Job {
    explicit Job(const std::function<bool()>& of) : part(of) {}
    const std::function<bool()>& part;
    int running = 0;      ///< calls on other threads
    bool closed = false;  ///< nothing is left to do
  };
  void help(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any wanted_;  ///< helpers
  std::condition_variable ended_;       ///< a call on another thread
  std::vector<std::shared_ptr<Job>> jobs_;
  std::vector<std::jthread> threads_;
};

}  // namespace lumigraft::relight
