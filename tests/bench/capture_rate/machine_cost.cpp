// machine_cost: measures the basic operations of this machine in a camera frame's path, to separate the cost of an
// emulated processor from the program's own. Not part of the product.
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "capture/formats/pixel_format.h"

namespace lumigraft::test {
namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr std::size_t kBytes = std::size_t{3} * kWidth * kHeight;

template <typename Work>
void say(const std::string& what, int times, const Work& work) {
  work();
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < times; ++i) work();
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  std::printf("%-34s %.5f ms\n", what.c_str(), took.count() / times);
}

/// Keeps the compiler from removing the writes.
void use(const void* memory) { asm volatile("" ::"r"(memory) : "memory"); }

void conversions() {
  std::vector<std::uint8_t> picture(kBytes);
  for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = static_cast<std::uint8_t>(i * 2654435761U >> 24);
  for (const capture::PixelFormat format :
       {capture::PixelFormat::rgb8, capture::PixelFormat::bgr8, capture::PixelFormat::grey8, capture::PixelFormat::yuyv,
        capture::PixelFormat::bayer_rggb8}) {
    capture::PixelConverter converter;
    say(std::string(name_of(format)) + " to RGB", 50, [&] { converter.to_rgb(format, kWidth, kHeight, picture); });
  }
}

void memory() {
  std::vector<std::uint8_t> from(kBytes), to(kBytes);
  say("a picture copied", 50, [&] {
    std::memcpy(to.data(), from.data(), kBytes);
    use(to.data());
  });
  say("a picture's pages, new", 50, [] {
    void* pages = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    std::memset(pages, 1, kBytes);
    munmap(pages, kBytes);
  });
}

void calls() {
  say("a system call", 20'000, [] { syscall(SYS_getppid); });
  say("a map of 60 words", 300, [] {
    std::map<std::string, int> words;
    for (int i = 0; i < 60; ++i) words[std::to_string(i * 7919 % 1000) + " is a name"] = i;
    use(&words);
  });
}

/// Measures the hand-over between two threads; a round trip counts as two.
void ways() {
  std::mutex mutex;
  std::condition_variable changed;
  int turn = 0;  // 0: this thread, 1: the other, 2: end
  std::thread other([&] {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [&] { return turn != 0; });
      if (turn == 2) return;
      turn = 0;
      changed.notify_one();
    }
  });
  say("from thread to thread and back", 300, [&] {
    std::unique_lock lock(mutex);
    turn = 1;
    changed.notify_one();
    changed.wait(lock, [&] { return turn == 0; });
  });
  {
    const std::lock_guard lock(mutex);
    turn = 2;
  }
  changed.notify_one();
  other.join();

  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) != 0) return;
  std::array<char, 400> message{};
  const pid_t process = fork();
  if (process == 0) {
    close(ends[0]);
    while (recv(ends[1], message.data(), message.size(), 0) > 0) send(ends[1], message.data(), message.size(), 0);
    _exit(0);
  }
  close(ends[1]);
  say("from process to process and back", 300, [&] {
    send(ends[0], message.data(), message.size(), 0);
    recv(ends[0], message.data(), message.size(), 0);
  });
  close(ends[0]);
  waitpid(process, nullptr, 0);
}

}  // namespace
}  // namespace lumigraft::test

int main() {
  lumigraft::test::conversions();
  lumigraft::test::memory();
  lumigraft::test::calls();
  lumigraft::test::ways();
}
