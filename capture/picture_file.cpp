#include "capture/picture_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/error.h"

namespace lumigraft {
namespace {

constexpr const char* kAllowed = ", allowed: PNG, OpenEXR or Radiance HDR";

std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream in(path, std::ios::binary);
  if (!in || !std::filesystem::is_regular_file(path, error)) {
    throw InputError("found no readable file");
  }
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

int big_endian(const std::uint8_t* at) { return at[0] << 24 | at[1] << 16 | at[2] << 8 | at[3]; }

/// The IHDR chunk (PNG specification, 11.2.2).
PictureHeader png_header(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < 33 || !std::equal(bytes.begin() + 12, bytes.begin() + 16, "IHDR")) {
    throw InputError("found a PNG that ends in its header");
  }
  PictureHeader header;
  header.width = big_endian(&bytes[16]);
  header.height = big_endian(&bytes[20]);
  header.bits = bytes[24];
  header.gray = bytes[25] == 0;
  return header;
}

/// "-Y height +X width" after the empty line (Ward 1991, "Real Pixels").
PictureHeader hdr_header(const std::vector<std::uint8_t>& bytes) {
  const std::string start(bytes.begin(), bytes.begin() + std::min<std::size_t>(bytes.size(), 4096));
  PictureHeader header;
  header.format = PictureHeader::Format::hdr;
  header.bits = 32;
  const std::size_t empty_line = start.find("\n\n");
  if (empty_line == std::string::npos ||
      std::sscanf(start.c_str() + empty_line + 2, "-Y %d +X %d", &header.height, &header.width) != 2) {
    throw InputError("found an HDR header without a size line \"-Y height +X width\"");
  }
  return header;
}

/// Turns what OpenEXR throws, which says where in its own code, into one line of ours.
template <typename Read>
auto with_exr(const std::filesystem::path& path, Read read) {
  try {
    Imf::InputFile file(path.c_str());
    return read(file);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception&) {
    throw InputError("found an OpenEXR file that is damaged or cut short");
  }
}

PictureHeader exr_header(const std::filesystem::path& path) {
  return with_exr(path, [](const Imf::InputFile& file) {
    const Imf::ChannelList& channels = file.header().channels();
    for (const char* name : {"R", "G", "B"}) {
      const Imf::Channel* channel = channels.findChannel(name);
      if (channel == nullptr || channel->xSampling != 1 || channel->ySampling != 1) {
        throw InputError("found an OpenEXR file without full channels R, G and B");
      }
    }
    const Imath::Box2i window = file.header().dataWindow();
    PictureHeader header;
    header.format = PictureHeader::Format::exr;
    header.bits = 32;
    header.width = window.max.x - window.min.x + 1;
    header.height = window.max.y - window.min.y + 1;
    return header;
  });
}

cv::Mat decode(const std::filesystem::path& path, int flags) {
  const std::vector<std::uint8_t> bytes = read_bytes(path);
  cv::Mat picture;
  try {
    picture = cv::imdecode(bytes, flags);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) {
    throw InputError("found a picture that is damaged or cut short");
  }
  return picture;
}

template <typename T>
Image<T> to_image(const cv::Mat& mat) {
  Image<T> image(mat.cols, mat.rows, mat.channels());
  const std::size_t row = static_cast<std::size_t>(mat.cols) * mat.channels();
  for (int y = 0; y < mat.rows; ++y) {
    std::copy_n(mat.ptr<T>(y), row, image.data.begin() + static_cast<std::ptrdiff_t>(row) * y);
  }
  return image;
}

Image<float> read_exr(const std::filesystem::path& path, const PictureHeader& header) {
  return with_exr(path, [&](Imf::InputFile& file) {
    Image<float> image(header.width, header.height, 3);
    const Imath::Box2i window = file.header().dataWindow();
    constexpr std::size_t kPixel = 3 * sizeof(float);
    const std::size_t row = kPixel * header.width;
    Imf::FrameBuffer buffer;
    for (int c = 0; c < 3; ++c) {
      constexpr const char* kNames[3] = {"R", "G", "B"};
      buffer.insert(kNames[c], Imf::Slice::Make(Imf::FLOAT, image.data.data() + c, window, kPixel, row));
    }
    file.setFrameBuffer(buffer);
    file.readPixels(window.min.y, window.max.y);
    return image;
  });
}

}  // namespace

PictureHeader read_picture_header(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream in(path, std::ios::binary);
  if (!in || !std::filesystem::is_regular_file(path, error)) {
    throw InputError("found no readable file");
  }
  std::vector<std::uint8_t> bytes(4096);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  const auto starts_with = [&](std::string_view magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin(),
                                                      [](char a, int b) { return static_cast<unsigned char>(a) == b; });
  };
  if (starts_with("\x89PNG\r\n\x1a\n")) {
    return png_header(bytes);
  }
  if (starts_with("\x76\x2f\x31\x01")) {
    return exr_header(path);
  }
  if (starts_with("#?")) {
    return hdr_header(bytes);
  }
  throw InputError((bytes.empty() ? "found an empty file" : "found a file of another kind") + std::string(kAllowed));
}

Image<std::uint8_t> read_encoded(const std::filesystem::path& path) {
  cv::Mat picture = decode(path, cv::IMREAD_COLOR);
  cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
  return to_image<std::uint8_t>(picture);
}

Image<std::uint16_t> read_depth(const std::filesystem::path& path) {
  const cv::Mat picture = decode(path, cv::IMREAD_UNCHANGED);
  if (picture.type() != CV_16UC1) {
    throw InputError("found a depth picture that is not 16-bit grey");
  }
  return to_image<std::uint16_t>(picture);
}

Image<float> read_radiance(const std::filesystem::path& path) {
  const PictureHeader header = read_picture_header(path);
  if (header.format == PictureHeader::Format::exr) {
    return read_exr(path, header);
  }
  cv::Mat picture = decode(path, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
  if (picture.type() != CV_32FC3) {
    throw InputError("found a picture that does not hold radiance" + std::string(kAllowed));
  }
  cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
  return to_image<float>(picture);
}

}  // namespace lumigraft
