// Opens what a session's source URIs name. A new kind of camera is added here and in session.cpp's list of kinds.
#include "capture/depth_registration.h"
#include "capture/error.h"
#include "capture/image_source.h"
#include "capture/pairing_reader.h"

namespace lumigraft {
namespace {

struct Uri {
  std::string kind;
  std::string rest;
};

Uri split(const std::string& uri) {
  const std::size_t colon = uri.find(':');
  return {uri.substr(0, colon), colon == std::string::npos ? "" : uri.substr(colon + 1)};
}

std::shared_ptr<Source> open_source(const std::string& key, const std::string& uri, const std::filesystem::path& folder,
                                    const StreamSpec& spec) {
  const auto [kind, rest] = split(uri);
  if (kind == "images") {
    return std::make_shared<ImageSource>(folder / rest, spec);
  }
  throw InputError(key + ".source: found \"" + uri + "\", allowed in this build: images:LIST");
}

}  // namespace

std::unique_ptr<FrameReader> open_frames(const Session& session) {
  const ColorCamera& color = session.color;
  PairedSources sources;
  sources.color = open_source("color", color.source, session.folder,
                              {Stream::color, color.model.width, color.model.height, color.exposure});
  PairingReader::Registration registration;
  if (session.depth) {
    const DepthCamera& depth = *session.depth;
    sources.depth =
        open_source("depth", depth.source, session.folder, {Stream::depth, depth.model.width, depth.model.height, 1.0});
    registration = DepthRegistration(depth, color.model);
  }
  if (session.fisheye) {
    const FisheyeCamera& fisheye = *session.fisheye;
    sources.fisheye = open_source("fisheye", fisheye.source, session.folder,
                                  {Stream::fisheye, fisheye.model.width, fisheye.model.height, fisheye.exposure});
  }
  return std::make_unique<PairingReader>(std::move(sources), std::move(registration));
}

}  // namespace lumigraft
