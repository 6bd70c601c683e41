// example_helper MODE STREAM WIDTH HEIGHT UNIT_M [STREAM ...]: a program that gives frames as docs/helpers.md
// describes, without any code of the service. MODE is `frames`, or a fault to cause.
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

namespace {

struct Message {
  char mark[4] = {'L', 'G', 'H', '1'};
  std::uint32_t kind = 0;  // 0 unavailable, 1 refused, 2 opened, 3 frame, 4 lost
  std::uint32_t stream = 0, bytes = 0;
  std::int64_t time_ns = 0;
  std::uint64_t sequence = 0;
  double exposure_us = 0.0, gain = 0.0;
};

void put(const void* data, std::size_t size) {
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(3, next, size);
    if (written <= 0) std::exit(0);
    next += written;
    size -= static_cast<std::size_t>(written);
  }
}

void put_text(std::uint32_t kind, const std::string& text) {
  Message message;
  message.kind = kind;
  message.bytes = static_cast<std::uint32_t>(text.size());
  put(&message, sizeof message);
  put(text.data(), text.size());
}

}  // namespace

int main(int count, char** words) {
  if (count < 6 || count % 4 != 2) return 2;
  const std::string mode = words[1];
  if (mode == "unavailable") put_text(0, "found the camera asleep");
  if (mode == "refused") put_text(1, "found no such size");
  if (mode == "silent") std::this_thread::sleep_for(std::chrono::minutes(1));
  if (mode == "unavailable" || mode == "refused") return 0;
  if (mode == "fails") return 1;
  if (mode == "crashes") std::abort();
  put_text(2, "E-0001");
  for (std::uint64_t number = 0;; ++number) {
    for (int stream = 0; 4 * stream + 5 < count; ++stream) {
      const char* const* of = words + 2 + 4 * stream;
      const bool depth = std::strcmp(of[0], "depth") == 0 || std::strcmp(of[0], "registered-depth") == 0;
      std::vector<std::uint8_t> pixels(static_cast<std::size_t>(std::atoi(of[1]) * std::atoi(of[2]) * (depth ? 2 : 3)));
      for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i + number);
      Message message;
      message.kind = 3;
      message.stream = static_cast<std::uint32_t>(mode == "stream" ? 7 : stream);
      message.bytes = static_cast<std::uint32_t>(pixels.size() - (mode == "size" ? 1 : 0));
      message.time_ns = static_cast<std::int64_t>(number) * 20'000'000;
      message.sequence = number;
      message.exposure_us = depth ? 0.0 : number < 3 ? 5000.0 : 10000.0;
      if (mode == "mark") message.mark[3] = '2';
      if (mode == "lost" && number == 2) {
        message.kind = 4;
        pixels = {'t', 'o', 'r', 'n'};
        message.bytes = 4;
      }
      put(&message, sizeof message);
      if (mode == "cut" && number == 2) std::exit(0);
      put(pixels.data(), pixels.size());
    }
    if (mode == "ends" && number == 4) return 0;
    if (mode == "unplugged" && number == 4) put_text(0, "the camera is unplugged");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}
