#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include "capture/error.h"
#include "capture/formats/picture_decoders.h"

namespace lumigraft::capture {
namespace {

/// Replaces OpenEXR's exceptions, whose texts describe its own code, by an InputError of one line.
template <typename Read>
auto with_file(const std::filesystem::path& path, Read read) {
  try {
    Imf::InputFile file(path.c_str());
    return read(file);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception&) {
    throw InputError("found an OpenEXR file that is damaged or cut short");
  }
}

PictureHeader header_of(const Imf::InputFile& file) {
  const Imf::ChannelList& channels = file.header().channels();
  for (const char* name : {"R", "G", "B"}) {
    const Imf::Channel* channel = channels.findChannel(name);
    refuse_if(channel == nullptr || channel->xSampling != 1 || channel->ySampling != 1,
              "found an OpenEXR file without full channels R, G and B");
  }
  const Imath::Box2i window = file.header().dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  refuse_if(width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px,
            "found an OpenEXR file of impossible size");
  return {PictureHeader::Format::exr, static_cast<int>(width), static_cast<int>(height), 32};
}

}  // namespace

bool is_exr(const std::vector<std::uint8_t>& start) {
  return start.size() >= 4 && start[0] == 0x76 && start[1] == 0x2f && start[2] == 0x31 && start[3] == 0x01;
}

PictureHeader exr_header(const std::filesystem::path& path) {
  return with_file(path, [](const Imf::InputFile& file) { return header_of(file); });
}

Image<float> decode_exr(const std::filesystem::path& path) {
  return with_file(path, [](Imf::InputFile& file) {
    const PictureHeader header = header_of(file);
    const Imath::Box2i window = file.header().dataWindow();
    Image<float> image(header.width, header.height, 3);
    constexpr std::size_t kPixel = 3 * sizeof(float);
    const std::size_t row = kPixel * static_cast<std::size_t>(header.width);
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

}  // namespace lumigraft::capture
