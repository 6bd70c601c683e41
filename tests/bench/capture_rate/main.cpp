// capture_rate SESSION.TOML SECONDS: measures live cameras for that time: frames, losses, the age of frames at
// delivery, and CPU time, including the part for conversion to RGB. Not part of the product.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "capture/error.h"
#include "capture/session/config.h"
#include "capture/session/stream_spec.h"
#include "capture/sync/pairing_reader.h"

namespace lumigraft::test {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// CPU time in seconds of the running helper processes, such as libcamera's.
double helpers_s() {
  double ticks = 0.0;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream children(thread.path() / "children");
    for (int id = 0; children >> id;) {
      std::ifstream file("/proc/" + std::to_string(id) + "/stat");
      std::string words;
      std::getline(file, words, ')');  // the process name may contain any character
      for (int i = 0; i < 11; ++i) {
        file >> words;
      }
      double user = 0.0, system = 0.0;
      file >> user >> system;
      ticks += user + system;
    }
  }
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double processor_s() {
  rusage own{};
  getrusage(RUSAGE_SELF, &own);
  return seconds_of(own.ru_utime) + seconds_of(own.ru_stime) + helpers_s();
}

/// CPU time in seconds to convert one picture to RGB.
double conversion_s(const capture::RawFrame& picture, int width, int height) {
  constexpr int kTimes = 50;
  capture::PixelConverter converter;
  converter.to_rgb(picture.format, width, height, picture.bytes);
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double begin = now();
  for (int i = 0; i < kTimes; ++i) converter.to_rgb(picture.format, width, height, picture.bytes);
  return (now() - begin) / kTimes;
}

struct Seen {
  std::uint64_t pictures = 0, lost = 0;
  std::optional<std::uint64_t> next;
  std::vector<float> age_ms;   ///< since the driver's timestamp
  std::vector<float> here_ms;  ///< since arrival: conversion and thread hand-over
  std::optional<capture::Frame> last;
};

void listen(capture::Source& source, std::array<Seen, 3>& seen, Clock::time_point until) {
  while (Clock::now() < until) {
    const auto item = source.next(std::chrono::milliseconds(100));
    if (!item) {
      continue;
    }
    const capture::Stamp& stamp = capture::stamp_of(*item);
    Seen& one = seen[static_cast<std::size_t>(capture::stream_of(*item))];
    one.lost += one.next && stamp.sequence > *one.next ? stamp.sequence - *one.next : 0;
    one.next = stamp.sequence + 1;
    if (std::holds_alternative<capture::LostFrame>(*item)) {
      ++one.lost;
      continue;
    }
    ++one.pictures;
    const std::int64_t now_ns = capture::steady_now_ns();
    one.age_ms.push_back(1e-6f * static_cast<float>(now_ns - stamp.time_ns));
    one.here_ms.push_back(1e-6f * static_cast<float>(now_ns - stamp.host_time_ns));
    if (const auto* picture = std::get_if<capture::Frame>(&*item); picture != nullptr && one.pictures == 30) {
      one.last = *picture;
    }
  }
}

int run(const char* file, double seconds) {
  const capture::Session session = capture::read_session(capture::ConfigTable::load(file));
  const capture::PairedSources sources = capture::open_sources(session);
  std::array<Seen, 3> seen;
  const double before_s = processor_s();
  const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  {
    std::vector<std::jthread> threads;
    for (capture::Source* source : {sources.color.get(), sources.depth.get(), sources.fisheye.get()}) {
      const bool again =
          source == nullptr || (source == sources.depth.get() && sources.depth == sources.color && !threads.empty());
      if (!again) {
        threads.emplace_back([&, source] { listen(*source, seen, until); });
      }
    }
  }
  const double used = (processor_s() - before_s) / seconds;  // while libcamera's process still runs
  double conversion = 0.0;
  for (const capture::Stream stream : {capture::Stream::color, capture::Stream::depth, capture::Stream::fisheye}) {
    Seen& one = seen[static_cast<std::size_t>(stream)];
    if (one.pictures == 0) {
      continue;
    }
    std::printf("%s: %llu pictures, %.2f Hz, %llu lost\n", name_of(stream),
                static_cast<unsigned long long>(one.pictures), static_cast<double>(one.pictures) / seconds,
                static_cast<unsigned long long>(one.lost));
    for (const auto& [what, ms] :
         {std::pair("age", &one.age_ms), std::pair("of which since it arrived", &one.here_ms)}) {
      std::sort(ms->begin(), ms->end());
      const auto at = [&](double fraction) { return (*ms)[static_cast<std::size_t>(fraction * (ms->size() - 1))]; };
      std::printf("  %s, ms: median %.2f, 95 %% %.2f, 99 %% %.2f, max %.2f\n", what, at(0.5), at(0.95), at(0.99),
                  at(1.0));
    }
    if (one.last && one.last->original) {
      conversion += conversion_s(*one.last->original, one.last->encoded.width, one.last->encoded.height) *
                    static_cast<double>(one.pictures) / seconds;
    }
  }
  std::printf("processor: %.2f %% of a core, of which to RGB %.2f %%\n", 100 * used, 100 * conversion);
  return 0;
}

}  // namespace
}  // namespace lumigraft::test

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("capture_rate SESSION.TOML SECONDS\n", stderr);
    return 2;
  }
  try {
    return lumigraft::test::run(argv[1], std::atof(argv[2]));
  } catch (const lumigraft::capture::InputError& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
