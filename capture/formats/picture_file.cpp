#include "capture/formats/picture_file.h"

#include <fstream>
#include <iterator>

#include "capture/error.h"
#include "capture/formats/picture_decoders.h"

namespace lumigraft::capture {
namespace {

std::ifstream open(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream in(path, std::ios::binary);
  refuse_if(!in || !std::filesystem::is_regular_file(path, error), "found no readable file");
  return in;
}

std::vector<std::uint8_t> read_all(const std::filesystem::path& path) {
  std::ifstream in = open(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

PictureHeader read_picture_header(const std::filesystem::path& path) {
  std::ifstream in = open(path);
  std::vector<std::uint8_t> start(4096);
  in.read(reinterpret_cast<char*>(start.data()), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(in.gcount()));
  if (is_png(start)) return png_header(start);
  if (is_exr(start)) return exr_header(path);
  if (is_hdr(start)) return hdr_header(start);
  throw InputError(std::string(start.empty() ? "found an empty file" : "found a file of another kind") +
                   ", allowed: PNG, OpenEXR or Radiance HDR");
}

Image<std::uint8_t> read_encoded(const std::filesystem::path& path) { return decode_png8(read_all(path)); }

Image<std::uint16_t> read_depth(const std::filesystem::path& path) { return decode_png16(read_all(path)); }

Image<float> read_radiance(const std::filesystem::path& path) {
  return read_picture_header(path).format == PictureHeader::Format::exr ? decode_exr(path) : decode_hdr(read_all(path));
}

}  // namespace lumigraft::capture
