#include "capture/recorded/image_source.h"

#include "capture/error.h"
#include "capture/recorded/parameters.h"

namespace lumigraft::capture {

ImageSource::ImageSource(const std::filesystem::path& list, const StreamSpec& spec) : spec_(spec) {
  const bool depth = spec.stream == Stream::depth;
  pictures_ = read_picture_list(list, {.exposures = !depth, .brackets = spec.stream == Stream::fisheye});
  const auto naming_line = [&list](const ListedPicture& picture, const auto& action) {
    with_error_context(list.string() + ":" + std::to_string(picture.line) + ": " + picture.name, action);
  };
  const ListedPicture* before = nullptr;
  std::map<std::filesystem::path, PictureHeader> headers;
  for (const ListedPicture& picture : pictures_) {
    naming_line(picture, [&] {
      if (uses_[picture.path]++ == 0) {
        headers[picture.path] = read_picture_header(picture.path);
        require(headers[picture.path]);
      }
      const bool bracket = before != nullptr && before->time_ns == picture.time_ns;
      refuse_if(bracket && (headers[picture.path].holds_radiance() || headers[before->path].holds_radiance()),
                "found radiance in a bracket, allowed: 8-bit pictures at one timestamp");
    });
    before = &picture;
  }
  naming_line(pictures_.front(), [this] { decode(pictures_.front()); });
}

void ImageSource::require(const PictureHeader& header) const {
  refuse_if(header.width != spec_.width || header.height != spec_.height,
            "found " + size_text(header.width, header.height) + ", allowed: " + size_text(spec_.width, spec_.height));
  if (spec_.stream == Stream::depth) {
    refuse_if(header.holds_radiance() || header.bits != 16 || !header.gray,
              "found " + std::to_string(header.bits) + " bits a channel" + (header.gray ? "" : " in colour") +
                  ", allowed: 16-bit grey PNG for depth");
  } else if (!header.holds_radiance() && header.bits != 8) {
    throw InputError("found " + std::to_string(header.bits) + " bits a channel, allowed: 8-bit PNG, EXR or HDR");
  }
}

std::shared_ptr<const ImageSource::Decoded> ImageSource::decode(const ListedPicture& picture) {
  for (const auto& [path, decoded] : cache_) {
    if (path == picture.path) return decoded;
  }
  const PictureHeader header = read_picture_header(picture.path);  // the file may have changed since it was checked
  require(header);
  auto decoded = std::make_shared<Decoded>();
  if (spec_.stream == Stream::depth) {
    *decoded = read_depth(picture.path);
  } else if (header.holds_radiance()) {
    *decoded = read_radiance(picture.path);
  } else {
    *decoded = read_encoded(picture.path);
  }
  if (uses_[picture.path] > 1) {
    if (cache_.size() == kRecordedParameters.cached_images) cache_.erase(cache_.begin());
    cache_.emplace_back(picture.path, decoded);
  }
  return decoded;
}

void ImageSource::skip_to(std::int64_t time_ns) {
  while (next_ < pictures_.size() && pictures_[next_].time_ns < time_ns) ++next_;
}

std::optional<SourceItem> ImageSource::next(std::chrono::milliseconds /*timeout*/) {
  if (finished()) return std::nullopt;
  const ListedPicture& listed = pictures_[next_];
  const Stamp stamp{listed.time_ns, steady_now_ns(), next_};
  ++next_;
  std::shared_ptr<const Decoded> decoded;
  try {
    decoded = decode(listed);
  } catch (const std::exception& e) {
    return LostFrame{stamp, spec_.stream, listed.name + ": " + e.what()};
  }
  if (const auto* counts = std::get_if<Image<std::uint16_t>>(decoded.get())) return RawDepth{stamp, *counts};
  const double exposure = listed.exposure.value_or(spec_.exposure);
  Frame picture{.stamp = stamp, .stream = spec_.stream, .exposure = exposure};
  if (const auto* radiance = std::get_if<Image<float>>(decoded.get())) {
    picture.radiance = *radiance;
  } else {
    picture.encoded = std::get<Image<std::uint8_t>>(*decoded);
  }
  return picture;
}

}  // namespace lumigraft::capture
