// Opens the sources that a session's URIs name. A new kind of camera is added here and in source_uri.cpp.
#include <cmath>

#include "capture/error.h"
#include "capture/live/aravis/source.h"
#include "capture/live/helper_source.h"
#include "capture/live/libcamera/source.h"
#include "capture/live/live_source.h"
#include "capture/live/openni/source.h"
#include "capture/live/v4l2/source.h"
#include "capture/recorded/image_source.h"
#include "capture/recorded/mkv_source.h"
#include "capture/recorded/oni_source.h"
#include "capture/session/source_uri.h"
#include "capture/sync/depth_registration.h"
#include "capture/sync/pairing_reader.h"

namespace lumigraft::capture {
namespace {

/// A stream of the session and its source.
struct Wanted {
  std::string key;  ///< of the session file, for errors
  SourceUri uri;
  StreamSpec spec;

  bool openni() const { return uri.kind == "oni" || uri.kind == "openni2"; }
  bool helper() const { return uri.kind == "freenect" || uri.kind == "helper"; }
  bool several_streams() const { return openni() || helper(); }  ///< from one source
  bool same_place(const Wanted& other) const { return uri.kind == other.uri.kind && uri.rest == other.uri.rest; }
};

/// `spec` holds what not all cameras have.
template <typename Camera>
Wanted wanted(const std::string& key, Stream stream, const Camera& camera, StreamSpec spec) {
  const std::optional<SourceUri> source = parse_source(camera.source);
  refuse_if(!source, key + ".source: found \"" + camera.source + "\", allowed in this build: " + kSourceKinds);
  spec.stream = stream;
  spec.width = camera.model.width;
  spec.height = camera.model.height;
  spec.serial = camera.serial;
  return {key, *source, spec};
}

std::shared_ptr<Source> open_source(const Wanted& w, const std::vector<StreamSpec>& specs,
                                    const std::filesystem::path& folder) {
  return with_error_context(w.key + ".source", [&]() -> std::shared_ptr<Source> {
    const auto file = folder / w.uri.rest;
    if (w.uri.kind == "images") return std::make_shared<ImageSource>(file, w.spec);
    if (w.uri.kind == "mkv") return std::make_shared<MkvSource>(file, w.spec);
    if (w.uri.kind == "oni") return std::make_shared<OniSource>(file.string(), specs);
    const std::string name = specs.size() > 1 ? "colour and depth" : name_of(w.spec.stream);
    LivePatience patience;
    patience.silence *=
        std::max<std::size_t>(w.spec.settings.bracket_us.size(), 1);  // all frames of a bracket arrive together
    const auto open = [w, specs]() -> std::unique_ptr<Source> {
      const std::string& camera = w.uri.rest;
      if (w.uri.kind == "openni2") return std::make_unique<OpenNiSource>(OpenNiSource::Kind::device, camera, specs);
      if (w.uri.kind == "v4l2") return std::make_unique<V4l2Source>(camera, w.spec);
      if (w.uri.kind == "freenect") {
        return std::make_unique<HelperSource>("lumigraft_freenect", std::vector{camera}, specs);
      }
      if (w.uri.kind == "helper") return std::make_unique<HelperSource>(camera, specs);
      if (w.uri.kind == "libcamera") return std::make_unique<LibcameraSource>(camera, w.spec);
      return std::make_unique<AravisSource>(camera, w.spec);
    };
    return std::make_shared<LiveSource>(name, open, patience);
  });
}

/// Throws if a live camera does not support one of its settings.
void check_settings(const Wanted& w) {
  const CameraSettings& s = w.spec.settings;
  const auto refuse_with_openni = [&w](bool given, const std::string& key) {
    refuse_if(w.openni() && given,
              w.key + "." + key + ": found it with openni2:, allowed: gain, rate_hz, controls.exposure");
  };
  refuse_with_openni(s.pixel_format.has_value(), "pixel_format");
  refuse_with_openni(s.exposure_us.has_value(), "exposure_us");
  for (const auto& [name, value] : s.controls) refuse_with_openni(name != "exposure", "controls." + name);
  refuse_if(w.helper() && (s.pixel_format || s.rate_hz || s.exposure_us || s.gain || !s.controls.empty()),
            w.key + ": found settings of the camera with " + w.uri.kind + ":, allowed: none");
  refuse_if(!s.bracket_us.empty() && w.uri.kind != "v4l2",
            w.key + ".bracket_us: found it with " + w.uri.kind + ":, allowed: v4l2:");
}

void check(const std::vector<Wanted>& all) {
  for (const Wanted& w : all) {
    const bool live = w.uri.live;
    const std::string where = w.key + ".source: found ";
    refuse_if(live != all.front().uri.live,
              where + (live ? "a device with a recording" : "a recording with a device") +
                  " for colour, allowed: all devices or all recordings, since their clocks are unrelated");
    const bool depth = w.spec.stream == Stream::depth;
    refuse_if(depth && (w.uri.kind == "libcamera" || w.uri.kind == "aravis"),
              where + "\"" + w.uri.kind + ":\", allowed of devices for depth: openni2:, v4l2:, freenect:, helper:");
    const bool one_device = depth && w.several_streams();  // gives colour and depth
    refuse_if(&w != &all.front() && !one_device && (w.openni() || live) && w.same_place(all.front()),
              where + "the colour camera again, allowed: a camera of its own");
    if (live) check_settings(w);
  }
}

}  // namespace

PairedSources open_sources(const Session& session) {
  const ColorCamera& color = session.color;
  std::vector<Wanted> all = {
      wanted("color", Stream::color, color, {.exposure = color.exposure, .settings = color.settings})};
  if (const auto& depth = session.depth) {
    all.push_back(wanted("depth", Stream::depth, *depth,
                         {.unit_m = depth->unit_m, .registered = depth->registered, .settings = depth->settings}));
  }
  if (const auto& fisheye = session.fisheye) {
    all.push_back(
        wanted("fisheye", Stream::fisheye, *fisheye, {.exposure = fisheye->exposure, .settings = fisheye->settings}));
  }
  check(all);

  const Wanted& color_wanted = all.front();
  const bool one_device = session.depth && color_wanted.several_streams() && all[1].same_place(color_wanted);
  PairedSources sources;
  sources.live = color_wanted.uri.live;
  sources.color = open_source(color_wanted,
                              one_device ? std::vector{color_wanted.spec, all[1].spec} : std::vector{color_wanted.spec},
                              session.folder);
  if (session.depth) sources.depth = one_device ? sources.color : open_source(all[1], {all[1].spec}, session.folder);
  if (session.fisheye) {
    sources.fisheye = open_source(all.back(), {all.back().spec}, session.folder);
    sources.fisheye_offset_ns = std::llround(1e9 * session.fisheye->time_offset_s);
  }
  return sources;
}

void take_serials(Session& session, const PairedSources& sources) {
  const auto take = [](std::string& serial, const std::shared_ptr<Source>& source) {
    if (serial.empty() && source) serial = source->serial();
  };
  take(session.color.serial, sources.color);
  if (session.depth) take(session.depth->serial, sources.depth);
  if (session.fisheye) take(session.fisheye->serial, sources.fisheye);
}

std::unique_ptr<FrameReader> open_paired_frames(const Session& session) {
  for (const std::string& source : {session.color.source, session.depth ? session.depth->source : "",
                                    session.fisheye ? session.fisheye->source : ""}) {
    refuse_if(source.starts_with("helper:"), session.name + ": found \"" + source +
                                                 "\", allowed here: no programs, since recordings come from others");
  }
  return std::make_unique<PairingReader>(open_sources(session));
}

std::unique_ptr<FrameReader> open_frames(const Session& session) {
  return std::make_unique<RegisteredFrames>(session, open_paired_frames(session));
}

}  // namespace lumigraft::capture
