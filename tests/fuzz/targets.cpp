#include "tests/fuzz/targets.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "capture/camera/response.h"
#include "capture/error.h"
#include "capture/formats/picture_list.h"
#include "capture/live/openni/source.h"
#include "capture/recorded/mkv_source.h"
#include "capture/recorded/oni_source.h"
#include "capture/session/config.h"
#include "capture/session/session.h"
#include "relight/exhibit/exhibit.h"
#include "relight/exhibit/load_gltf.h"
#include "relight/exhibit/picture_decode.h"
#include "tests/fuzz/expect_answer.h"

namespace lumigraft::fuzz {
namespace {

constexpr int kWidth = 24;
constexpr int kHeight = 16;

/// The streams of the recordings in the corpus.
const std::vector<capture::StreamSpec> kOniStreams = {{.stream = capture::Stream::color, .width = 160, .height = 120},
                                                      {.stream = capture::Stream::depth, .width = 160, .height = 120}};

/// A name with this extension for file_with.
std::filesystem::path named_file_with(Bytes bytes, const char* extension) {
  const std::filesystem::path name =
      std::filesystem::temp_directory_path() / ("fuzz_" + std::to_string(getpid()) + extension);
  std::filesystem::remove(name);
  std::filesystem::create_symlink(file_with(bytes), name);
  return name;
}

void load_and_remove(const std::filesystem::path& name) {
  expect_answer([&] { relight::load_model(name, 'z'); });
  std::filesystem::remove(name);
}

/// A temporary folder with a model.ply, one triangle, for exhibits to name.
std::filesystem::path folder_with_model() {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("fuzz_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "model.ply") << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                         "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                                         "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  return folder;
}

void play_oni(capture::Source&& recording) {
  while (!recording.finished()) {
    recording.next(std::chrono::milliseconds(0));
  }
}

}  // namespace

std::filesystem::path file_with(Bytes bytes) {
  static const int file = memfd_create("fuzz", MFD_CLOEXEC);
  if (ftruncate(file, 0) != 0 || pwrite(file, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::runtime_error("no memory for a file");
  }
  return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(file);  // a path that helper programs can open
}

void mkv(Bytes bytes) {
  if (bytes.empty()) {
    return;
  }
  constexpr std::array kStreams = {capture::Stream::color, capture::Stream::depth, capture::Stream::fisheye};
  const capture::StreamSpec spec{.stream = kStreams[bytes[0] % 3], .width = kWidth, .height = kHeight};
  expect_answer([&] {
    capture::MkvSource source(file_with(bytes.subspan(1)), spec);
    source.last_time_ns();
    constexpr std::int64_t kStep_ns = 20'000'000;
    if (bytes[0] >= 128) {
      source.skip_to(source.first_time_ns() + (bytes[0] - 126) * kStep_ns);
    }
    while (source.next(std::chrono::milliseconds(0))) {
    }
  });
}

void session(Bytes bytes) {
  expect_answer([&] {
    const capture::ConfigTable root = capture::ConfigTable::parse(text_of(bytes), "session.toml");
    capture::read_session(root);
    root.finish();
  });
}

void calibration(Bytes bytes) {
  const std::filesystem::path file = file_with(bytes);
  expect_answer([&] {
    capture::read_session(capture::ConfigTable::parse("format = 1\ncalibration = \"" + file.string() + R"("
[color]
source = "v4l2:"
width = 640
height = 480
exposure = 1
[fisheye]
source = "aravis:Maker-17"
width = 1024
height = 1024
exposure = 1
T_tag_fisheye = [[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]]
[tag]
id = 1
size_m = 0.1
)",
                                                      "session.toml"));
  });
}

void gltf(Bytes bytes) {
  expect_answer([&] { relight::load_gltf(file_with(bytes), 'y'); });
}

void ply(Bytes bytes) { load_and_remove(named_file_with(bytes, ".ply")); }

void obj(Bytes bytes) { load_and_remove(named_file_with(bytes, ".obj")); }

void picture(Bytes bytes) {
  constexpr std::int64_t kFewTexels = 1000;
  relight::picture_header(bytes);
  for (const std::int64_t texels : {relight::kAllTexels, kFewTexels}) {
    expect_answer([&] { relight::decode_picture(bytes, texels); });
    expect_answer([&] { relight::decode_alpha(bytes, texels); });
  }
}

void picture_list(Bytes bytes) {
  if (bytes.empty()) return;
  const capture::ListRules rules{.exposures = (bytes[0] & 1) != 0, .brackets = (bytes[0] & 2) != 0};
  expect_answer([&] { capture::read_picture_list(file_with(bytes.subspan(1)), rules); });
}

void response(Bytes bytes) {
  expect_answer([&] { capture::Response::from_file(file_with(bytes)); });
}

void exhibit(Bytes bytes) {
  static const std::filesystem::path folder = folder_with_model();
  expect_answer([&] {
    const capture::ConfigTable root = capture::ConfigTable::parse(text_of(bytes), (folder / "exhibit.toml").string());
    relight::read_exhibit(root);
    root.finish();
  });
}

void oni(Bytes bytes) {
  expect_answer([&] { play_oni(capture::OniSource(file_with(bytes).string(), kOniStreams)); });
}

void oni_library(Bytes bytes) {
  expect_answer([&] {
    play_oni(capture::OpenNiSource(capture::OpenNiSource::Kind::recording, file_with(bytes).string(), kOniStreams,
                                   std::chrono::milliseconds(20)));
  });
}

}  // namespace lumigraft::fuzz
