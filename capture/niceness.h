#pragma once
// How much of the processor a thread takes beside others that want it too.

namespace lumigraft {

/// The calling thread's niceness, as `man 7 sched` has it, for as long as this lives; threads and programs that it
/// begins meanwhile start with it. Where the system lets nobody go before others the thread stays as it is.
class Niceness {
 public:
  explicit Niceness(int wanted);
  ~Niceness();
  Niceness(const Niceness&) = delete;
  Niceness& operator=(const Niceness&) = delete;

 private:
  int before_;
};

}  // namespace lumigraft
