#include "capture/live/v4l2/format.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "capture/error.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture::v4l2 {
namespace {

struct Offer {
  std::uint32_t fourcc = 0;
  PixelFormat format = PixelFormat::rgb8;
  bool has_size = false;  ///< the session's frame size is offered
  double rate_hz = 0.0;
};

std::vector<Offer> offers(const Device& device, const StreamSpec& spec) {
  std::vector<Offer> out;
  for (const std::uint32_t fourcc : formats(device)) {
    const std::optional<PixelFormat> format = pixel_format_of(fourcc);
    if (!format || (*format != PixelFormat::mjpeg && !bytes_of(*format, spec.width, spec.height))) continue;
    if (*format == PixelFormat::z16 && spec.stream != capture::Stream::depth) continue;
    out.push_back({fourcc, *format, sizes(device, fourcc).contains(spec.width, spec.height),
                   highest_rate_hz(device, fourcc, {spec.width, spec.height})});
  }
  return out;
}

/// Offers with the session's frame size. First those that are fast enough, by preference, then the others by rate.
std::vector<Offer> choices(const Device& device, const StreamSpec& spec) {
  std::vector<Offer> all = offers(device, spec);
  std::string names;
  for (const Offer& offer : all) names += " " + std::string(name_of(offer.format));
  std::optional<PixelFormat> wanted = spec.settings.pixel_format;
  if (!wanted && spec.stream == capture::Stream::depth) wanted = PixelFormat::z16;
  if (wanted) {
    std::erase_if(all, [&](const Offer& o) { return o.format != *wanted; });
    refuse_if(all.empty(), "found no pixel format " + std::string(name_of(*wanted)) + " for " +
                               size_text(spec.width, spec.height) + ", offered:" + names);
  }
  std::erase_if(all, [](const Offer& o) { return !o.has_size; });
  refuse_if(all.empty(),
            "found no pictures of " + size_text(spec.width, spec.height) + ", allowed: what `lumigraft devices` lists");
  const double wanted_hz =
      spec.settings.rate_hz.value_or(kV4l2Parameters.sufficient_rate_hz) * kV4l2Parameters.rate_rounding;
  const auto rank = [&](const Offer& o) {
    const bool fast = o.rate_hz == 0.0 || o.rate_hz >= wanted_hz;
    const auto preference =
        std::find(std::begin(kPreferredFormats), std::end(kPreferredFormats), o.format) - std::begin(kPreferredFormats);
    return std::tuple(fast ? 0 : 1, fast ? 0.0 : -o.rate_hz, preference);
  };
  std::stable_sort(all.begin(), all.end(), [&](const Offer& a, const Offer& b) { return rank(a) < rank(b); });
  return all;
}

/// Fields that single-planar and multi-planar v4l2_format have in common.
struct FormatFields {
  int width, height;
  std::uint32_t fourcc, field, colorspace, encoding, quantization;
};

FormatFields fields_of(const v4l2_format& f, bool planar) {
  const auto of = [](const auto& p) {
    return FormatFields{static_cast<int>(p.width),
                        static_cast<int>(p.height),
                        p.pixelformat,
                        p.field,
                        p.colorspace,
                        p.ycbcr_enc,
                        p.quantization};
  };
  return planar ? of(f.fmt.pix_mp) : of(f.fmt.pix);
}

/// Refuses YUV encodings and value ranges that PixelConverter does not assume.
void check_colors(const FormatFields& s, PixelFormat format) {
  const bool rgb = format == PixelFormat::rgb8 || format == PixelFormat::bgr8;
  std::uint32_t encoding = s.encoding;
  if (encoding == V4L2_YCBCR_ENC_DEFAULT) encoding = V4L2_MAP_YCBCR_ENC_DEFAULT(s.colorspace);
  std::uint32_t range = s.quantization;
  if (range == V4L2_QUANTIZATION_DEFAULT) range = V4L2_MAP_QUANTIZATION_DEFAULT(rgb, s.colorspace, encoding);
  refuse_if(is_yuv(format) && (encoding != V4L2_YCBCR_ENC_601 || range != V4L2_QUANTIZATION_LIM_RANGE),
            "found " + std::string(name_of(format)) +
                " of another kind than BT.601 from 16 to 235, allowed: pixel_format rgb8 or mjpeg");
  refuse_if(rgb && range == V4L2_QUANTIZATION_LIM_RANGE,
            "found " + std::string(name_of(format)) + " from 16 to 235, allowed: 0 to 255");
}

/// Sets the wanted rate, else a default, since drivers keep the rate that another program set.
void set_rate(const Device& device, const std::optional<double>& wanted_hz) {
  const double rate_hz = wanted_hz.value_or(kV4l2Parameters.default_rate_hz);
  v4l2_streamparm parameters{};
  parameters.type = device.buffers();
  constexpr __u32 kNumerator = 1'000'000;  // the rate is given as a fraction, to 1e-6 Hz
  parameters.parm.capture.timeperframe = {kNumerator, static_cast<__u32>(std::lround(rate_hz * kNumerator))};
  const int error = device.call(VIDIOC_S_PARM, &parameters);
  if (!wanted_hz) return;
  refuse_if(error == ENOTTY || error == EINVAL, "rate_hz: found a camera whose rate is not set this way");
  if (error != 0) fail(error, "rate_hz");
  const v4l2_fract& period = parameters.parm.capture.timeperframe;
  const double given_hz = period.numerator > 0 ? static_cast<double>(period.denominator) / period.numerator : 0.0;
  refuse_if(
      std::abs(given_hz - rate_hz) > kV4l2Parameters.max_rate_error * rate_hz,
      "rate_hz: found a camera that gives " + std::to_string(given_hz) + " Hz, wanted " + std::to_string(rate_hz));
}

/// Throws InputError if the driver sets another format or size, or colours that PixelConverter would misread.
v4l2_format set_format(const Device& device, const StreamSpec& spec, const Offer& offer) {
  const bool planar = device.multi_planar();
  v4l2_format format{};
  format.type = device.buffers();
  const auto ask = [&](auto& pixels) {
    pixels.width = static_cast<__u32>(spec.width);
    pixels.height = static_cast<__u32>(spec.height);
    pixels.pixelformat = offer.fourcc;
    pixels.field = V4L2_FIELD_NONE;
  };
  if (planar) {
    ask(format.fmt.pix_mp);
  } else {
    ask(format.fmt.pix);
  }
  device.demand(VIDIOC_S_FMT, &format, "format");
  const FormatFields given = fields_of(format, planar);
  refuse_if(given.width != spec.width || given.height != spec.height || given.fourcc != offer.fourcc,
            "found a camera that gives " + fourcc_text(given.fourcc) + " of " + size_text(given.width, given.height) +
                ", allowed by the session: " + size_text(spec.width, spec.height));
  refuse_if(given.field != V4L2_FIELD_NONE && given.field != V4L2_FIELD_ANY,
            "found interlaced frames, allowed: progressive ones");
  check_colors(given, offer.format);
  return format;
}

/// The first choice that can be used: HDMI grabbers often use another YUV encoding than webcams, but also offer RGB.
std::pair<Offer, v4l2_format> set_best_format(const Device& device, const StreamSpec& spec) {
  const std::vector<Offer> all = choices(device, spec);
  std::optional<InputError> refused;
  for (const Offer& offer : all) {
    if (refused && grey_bits(offer.format) != 0) continue;  // a colour camera is not used as a grey one
    try {
      return {offer, set_format(device, spec, offer)};
    } catch (const CameraFault&) {
      throw;
    } catch (const InputError& e) {
      refused = refused ? refused : e;
    }
  }
  throw InputError(*refused);
}

}  // namespace

NegotiatedFormat negotiate_format(const Device& device, const StreamSpec& spec) {
  const auto [offer, format] = set_best_format(device, spec);
  const bool planar = device.multi_planar();
  set_rate(device, spec.settings.rate_hz);

  NegotiatedFormat out{.format = offer.format, .planes = planar ? format.fmt.pix_mp.num_planes : 1};
  refuse_if(out.planes < 1 || out.planes > (offer.fourcc == V4L2_PIX_FMT_NV12M ? 2 : 1),
            "found pictures in " + std::to_string(out.planes) + " pieces");
  if (offer.format == PixelFormat::mjpeg) return out;
  const auto width = static_cast<std::size_t>(spec.width);
  const std::size_t row = offer.format == PixelFormat::nv12 ? width
                                                            : *bytes_of(offer.format, spec.width, spec.height) /
                                                                  static_cast<std::size_t>(spec.height);
  for (int i = 0; i < out.planes; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const std::size_t driver_row = planar ? format.fmt.pix_mp.plane_fmt[i].bytesperline : format.fmt.pix.bytesperline;
    out.row_bytes[n] = driver_row != 0 ? driver_row : row;
    out.padded = out.padded || out.row_bytes[n] != row;
  }
  return out;
}

}  // namespace lumigraft::capture::v4l2
