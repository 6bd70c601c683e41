// record_cost SESSION.TOML FOLDER SECONDS: cost of recording a session's colour and depth and a 1024x1024 fish-eye at
// 30 frames per second each. The first frames are read into memory, and written to FOLDER repeatedly as `lumigraft
// record` does, in pieces of one second. Not part of the product.
#include <sys/resource.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <random>
#include <vector>

#include "capture/error.h"
#include "capture/record/session_recorder.h"
#include "capture/session/config.h"
#include "capture/session/stream_spec.h"
#include "capture/sync/pairing_reader.h"

namespace lumigraft::test {
namespace {

constexpr int kRate_hz = 30, kEdge = 1024;
constexpr std::int64_t kPeriod_ns = 1'000'000'000 / kRate_hz;
constexpr std::array kStreams = {capture::Stream::color, capture::Stream::depth, capture::Stream::fisheye};

double thread_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::vector<capture::SourceItem> first_of(capture::Source& source, capture::Stream stream) {
  std::vector<capture::SourceItem> out;
  while (out.size() < kRate_hz) {
    std::optional<capture::SourceItem> item = source.next(std::chrono::milliseconds(0));
    if (!item) {
      break;
    }
    if (capture::stream_of(*item) == stream && !std::holds_alternative<capture::LostFrame>(*item)) {
      out.push_back(std::move(*item));
    }
  }
  return out;
}

/// A frame of noise in the camera's format.
capture::SourceItem fisheye_of(capture::PixelFormat format) {
  std::mt19937 random(1);
  std::vector<std::uint8_t> bytes(*capture::bytes_of(format, kEdge, kEdge));
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  capture::Frame picture;
  picture.stream = capture::Stream::fisheye;
  capture::PixelConverter pixels;
  picture.encoded = *pixels.to_rgb(format, kEdge, kEdge, bytes);
  if (format != capture::PixelFormat::rgb8)
    picture.original = std::make_shared<capture::RawFrame>(format, std::move(bytes));
  return picture;
}

void measure(const std::filesystem::path& file, const std::filesystem::path& folder, int seconds) {
  capture::Session session = capture::read_session(capture::ConfigTable::load(file));
  const capture::PairedSources sources = capture::open_sources(session);
  std::array<std::vector<capture::SourceItem>, 3> pictures;
  pictures[0] = first_of(*sources.color, capture::Stream::color);
  pictures[1] = first_of(*sources.depth, capture::Stream::depth);
  session.fisheye.emplace();
  session.fisheye->model.width = session.fisheye->model.height = kEdge;
  for (const capture::PixelFormat format : {capture::PixelFormat::bayer_rggb8, capture::PixelFormat::rgb8}) {
    pictures[2] = {fisheye_of(format)};
    for (const capture::DepthCoding coding : {capture::DepthCoding::ffv1, capture::DepthCoding::uncompressed}) {
      std::array<double, 3> used_s{};
      double worst_s = 0;
      std::int64_t time_ns = 0;
      for (int second = 0; second < seconds; ++second) {
        std::filesystem::remove_all(folder);
        capture::SessionRecorder recorder({file, {}}, session, folder, coding);
        double this_s = 0;
        for (std::size_t i = 0; i < kRate_hz; ++i) {
          time_ns += kPeriod_ns;
          for (std::size_t s = 0; s < 3; ++s) {
            capture::SourceItem& item = pictures[s][i % pictures[s].size()];
            std::visit([&](auto& any) { any.stamp.time_ns = time_ns; }, item);
            const double before_s = thread_s();
            recorder.write(kStreams[s], item);
            const double took_s = thread_s() - before_s;
            used_s[s] += took_s;
            this_s += took_s;
          }
        }
        worst_s = std::max(worst_s, this_s);
      }
      const double all = 100 / static_cast<double>(seconds);
      std::printf(
          "fish-eye %s, depth %s: %.1f %% of a core (colour %.1f, depth %.1f, fish-eye %.1f), worst second %.1f\n",
          std::string(name_of(format)).c_str(), coding == capture::DepthCoding::ffv1 ? "ffv1" : "uncompressed",
          all * (used_s[0] + used_s[1] + used_s[2]), all * used_s[0], all * used_s[1], all * used_s[2], 100 * worst_s);
    }
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace lumigraft::test

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("record_cost SESSION.TOML FOLDER SECONDS\n", stderr);
    return 2;
  }
  try {
    lumigraft::test::measure(argv[1], argv[2], std::atoi(argv[3]));
    return 0;
  } catch (const lumigraft::capture::InputError& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
