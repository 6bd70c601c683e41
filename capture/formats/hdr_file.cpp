#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>

#include "capture/error.h"
#include "capture/formats/picture_decoders.h"

namespace lumigraft::capture {
namespace {

struct Start {
  PictureHeader header;
  double exposure = 1.0;
  std::size_t pixels_at = 0;
};

/// The header: lines up to an empty one, then "-Y height +X width".
Start read_start(const std::vector<std::uint8_t>& bytes) {
  Start start;
  start.header.format = PictureHeader::Format::hdr;
  start.header.bits = 32;
  std::size_t at = 0;
  const auto next_line = [&] {
    const void* end = at < bytes.size() ? std::memchr(&bytes[at], '\n', bytes.size() - at) : nullptr;
    refuse_if(end == nullptr, "found an HDR file that ends in its header");
    const std::size_t length = static_cast<std::size_t>(static_cast<const std::uint8_t*>(end) - &bytes[at]);
    std::string line(reinterpret_cast<const char*>(&bytes[at]), length);
    at += length + 1;
    return line;
  };
  bool format = false;
  for (std::string line = next_line(); !line.empty(); line = next_line()) {
    format = format || line == "FORMAT=32-bit_rle_rgbe";
    double factor = 0.0;
    if (std::sscanf(line.c_str(), "EXPOSURE=%lf", &factor) == 1 && factor > 0.0 && std::isfinite(factor)) {
      start.exposure *= factor;
    }
  }
  const std::string size = next_line();
  refuse_if(!format || std::sscanf(size.c_str(), "-Y %d +X %d", &start.header.height, &start.header.width) != 2 ||
                start.header.width < 1 || start.header.height < 1 || start.header.width > kMaxSide_px ||
                start.header.height > kMaxSide_px,
            "found an HDR header of another kind, allowed: 32-bit_rle_rgbe and -Y height +X width");
  start.pixels_at = at;
  return start;
}

class Scanlines {
 public:
  Scanlines(const std::vector<std::uint8_t>& bytes, std::size_t at) : bytes_(bytes), at_(at) {}

  /// One row of R G B E pixels.
  void read(std::vector<std::uint8_t>& row) {
    const std::size_t width = row.size() / 4;
    const bool by_channel = width >= 8 && width < 32768 && at_ + 4 <= bytes_.size() && bytes_[at_] == 2 &&
                            bytes_[at_ + 1] == 2 && bytes_[at_ + 2] < 128;
    by_channel ? read_channels(row, width) : read_pixels(row, width);
  }

 private:
  std::uint8_t byte() {
    if (at_ == bytes_.size()) fail();
    return bytes_[at_++];
  }
  [[noreturn]] static void fail() { throw InputError("found a picture that is damaged or cut short"); }

  /// Run-length encoding per channel: a count above 128 repeats one byte count - 128 times, else `count` bytes follow.
  void read_channels(std::vector<std::uint8_t>& row, std::size_t width) {
    at_ += 2;
    const std::size_t high = byte();
    if (high * 256 + byte() != width) fail();
    for (std::size_t channel = 0; channel < 4; ++channel) {
      for (std::size_t x = 0; x < width;) {
        const std::uint8_t code = byte();
        const std::size_t count = code > 128 ? code - 128u : code;
        if (count == 0 || x + count > width) fail();
        const std::uint8_t first = byte();
        for (std::size_t i = 0; i < count; ++i, ++x) row[4 * x + channel] = code > 128 || i == 0 ? first : byte();
      }
    }
  }

  /// Old format: plain pixels; 1 1 1 n repeats the previous pixel n times; consecutive repeats are digits in base 256.
  void read_pixels(std::vector<std::uint8_t>& row, std::size_t width) {
    int shift = 0;
    for (std::size_t x = 0; x < width;) {
      std::uint8_t pixel[4];
      for (std::uint8_t& value : pixel) value = byte();
      if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1) {
        const std::size_t count = std::size_t{pixel[3]} << shift;
        if (x == 0 || shift > 16 || x + count > width) fail();
        for (std::size_t i = 0; i < count; ++i, ++x) std::memcpy(&row[4 * x], &row[4 * (x - 1)], 4);
        shift += 8;
      } else {
        std::memcpy(&row[4 * x++], pixel, 4);
        shift = 0;
      }
    }
  }

  const std::vector<std::uint8_t>& bytes_;
  std::size_t at_;
};

}  // namespace

bool is_hdr(const std::vector<std::uint8_t>& start) {
  return start.size() >= 6 &&
         (std::memcmp(start.data(), "#?RADI", 6) == 0 || std::memcmp(start.data(), "#?RGBE", 6) == 0);
}

PictureHeader hdr_header(const std::vector<std::uint8_t>& start) { return read_start(start).header; }

Image<float> decode_hdr(const std::vector<std::uint8_t>& bytes) {
  const Start start = read_start(bytes);
  Image<float> image(start.header.width, start.header.height, 3);
  std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(image.width));
  Scanlines lines(bytes, start.pixels_at);
  for (int y = 0; y < image.height; ++y) {
    lines.read(row);
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* pixel = &row[4 * static_cast<std::size_t>(x)];
      for (int c = 0; c < 3 && pixel[3] != 0; ++c) {
        // Writers truncate the mantissa, so its expected value is half a step higher. Exponent: 128 + 8 bits.
        image.at(x, y, c) = static_cast<float>(std::ldexp(pixel[c] + 0.5, pixel[3] - 136) / start.exposure);
      }
    }
  }
  return image;
}

}  // namespace lumigraft::capture
