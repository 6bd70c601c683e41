#include "capture/image_source.h"

#include <algorithm>
#include <set>

#include "capture/error.h"
#include "capture/picture_file.h"

namespace lumigraft {
namespace {

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

std::int64_t steady_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

ImageSource::ImageSource(const std::filesystem::path& list, const StreamSpec& spec) : spec_(spec), list_(list) {
  const bool depth = spec.stream == Stream::depth;
  pictures_ = read_picture_list(list, {.exposures = !depth, .brackets = spec.stream == Stream::fisheye});
  for (const ListedPicture& picture : pictures_) {
    if (uses_[picture.path]++ == 0) {
      check(picture);
    }
  }
  for (std::size_t i = 1; i < pictures_.size(); ++i) {
    const ListedPicture& one = pictures_[i - 1];
    const ListedPicture& other = pictures_[i];
    if (one.time_ns == other.time_ns &&
        (read_picture_header(one.path).holds_radiance() || read_picture_header(other.path).holds_radiance())) {
      throw InputError(list_.string() + ":" + std::to_string(other.line) +
                       ": found a bracket with a picture of radiance, allowed: 8-bit pictures at one timestamp");
    }
  }
  try {
    decode(pictures_.front());
  } catch (const InputError& e) {
    throw InputError(list_.string() + ":" + std::to_string(pictures_.front().line) + ": " + pictures_.front().name +
                     ": " + e.what());
  }
}

void ImageSource::check(const ListedPicture& picture) const {
  const std::string where = list_.string() + ":" + std::to_string(picture.line) + ": " + picture.name + ": ";
  PictureHeader header;
  try {
    header = read_picture_header(picture.path);
  } catch (const InputError& e) {
    throw InputError(where + e.what());
  }
  if (header.width != spec_.width || header.height != spec_.height) {
    throw InputError(where + "found " + size_text(header.width, header.height) +
                     " pixels, allowed: " + size_text(spec_.width, spec_.height));
  }
  if (spec_.stream == Stream::depth) {
    if (header.holds_radiance() || header.bits != 16 || !header.gray) {
      throw InputError(where + "found " + std::to_string(header.bits) + " bits a channel" +
                       (header.gray ? "" : " in colour") + ", allowed: 16-bit grey PNG for depth");
    }
  } else if (!header.holds_radiance() && header.bits != 8) {
    throw InputError(where + "found " + std::to_string(header.bits) +
                     " bits a channel, allowed: 8-bit PNG, EXR or HDR");
  }
}

std::shared_ptr<const ImageSource::Decoded> ImageSource::decode(const ListedPicture& picture) {
  for (const auto& [path, decoded] : cache_) {
    if (path == picture.path) {
      return decoded;
    }
  }
  auto decoded = std::make_shared<Decoded>();
  if (spec_.stream == Stream::depth) {
    *decoded = read_depth(picture.path);
  } else if (read_picture_header(picture.path).holds_radiance()) {
    *decoded = read_radiance(picture.path);
  } else {
    *decoded = read_encoded(picture.path);
  }
  std::visit(
      [&](const auto& image) {
        if (image.width != spec_.width || image.height != spec_.height) {
          throw InputError("found " + size_text(image.width, image.height) +
                           " pixels, allowed: " + size_text(spec_.width, spec_.height));
        }
      },
      *decoded);
  constexpr std::size_t kMostCached = 8;  // a bracket or two
  if (uses_[picture.path] > 1) {
    if (cache_.size() == kMostCached) {
      cache_.erase(cache_.begin());
    }
    cache_.emplace_back(picture.path, decoded);
  }
  return decoded;
}

std::optional<SourceItem> ImageSource::next(std::chrono::milliseconds /*timeout*/) {
  if (finished()) {
    return std::nullopt;
  }
  const ListedPicture& listed = pictures_[next_];
  const Stamp stamp{listed.time_ns, steady_now_ns(), next_};
  ++next_;
  std::shared_ptr<const Decoded> decoded;
  try {
    decoded = decode(listed);
  } catch (const std::exception& e) {
    return LostPicture{stamp, spec_.stream, listed.name + ": " + e.what()};
  }
  if (const auto* counts = std::get_if<Image<std::uint16_t>>(decoded.get())) {
    return RawDepth{stamp, *counts};
  }
  Picture picture;
  picture.stamp = stamp;
  picture.stream = spec_.stream;
  picture.exposure = listed.exposure.value_or(spec_.exposure);
  if (const auto* radiance = std::get_if<Image<float>>(decoded.get())) {
    picture.radiance = *radiance;
  } else {
    picture.encoded = std::get<Image<std::uint8_t>>(*decoded);
  }
  return picture;
}

}  // namespace lumigraft
