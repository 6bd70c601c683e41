#include "tests/capture/formats/exr_writer.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>

namespace lumigraft::test {

void write_exr(const std::filesystem::path& file, const capture::Image<float>& image) {
  Imf::Header header(image.width, image.height);
  Imf::FrameBuffer buffer;
  const std::size_t pixel = sizeof(float) * static_cast<std::size_t>(image.channels);
  for (int c = 0; c < image.channels; ++c) {
    const char* name = image.channels == 1 ? "Y" : c == 0 ? "R" : c == 1 ? "G" : "B";
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    auto* base = reinterpret_cast<char*>(const_cast<float*>(image.data.data() + c));
    buffer.insert(name, Imf::Slice(Imf::FLOAT, base, pixel, pixel * static_cast<std::size_t>(image.width)));
  }
  Imf::OutputFile out(file.c_str(), header);
  out.setFrameBuffer(buffer);
  out.writePixels(image.height);
}

}  // namespace lumigraft::test
