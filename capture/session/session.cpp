#include "capture/session/session.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "capture/camera/camera_serial.h"
#include "capture/formats/picture_file.h"
#include "capture/session/parameters.h"
#include "capture/session/source_uri.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture {
namespace {

constexpr const SessionLimits& kLimits = kSessionLimits;

/// A source URI of a kind that this build can open. The file is checked when the session is opened.
std::string source_uri(const ConfigTable& table) {
  std::string uri = table.text("source");
  const std::optional<SourceUri> source = parse_source(uri);
  if (!source) table.fail("source", "found \"" + uri + "\", allowed in this build: " + std::string(kSourceKinds));
  if ((!source->live || source->kind == "helper") && source->rest.empty()) {
    table.fail("source", "found \"" + uri + "\", allowed: a file after the colon");
  }
  return uri;
}

Response read_response(const ConfigTable& table) {
  const std::string name = table.text("response", "srgb");
  if (name == "srgb") return Response::srgb();
  return name == "linear" ? Response::linear() : Response::from_file(table.existing_file("response"));
}

void read_principal_point(const ConfigTable& table, CameraModel& model) {
  model.cx = table.number("cx", -kMaxSide_px, 2.0 * kMaxSide_px);
  model.cy = table.number("cy", -kMaxSide_px, 2.0 * kMaxSide_px);
}

CameraModel read_pinhole(const ConfigTable& table) {
  CameraModel model;
  model.fx = table.number("fx", 1.0, kLimits.max_focal_length_px);
  model.fy = table.number("fy", 1.0, kLimits.max_focal_length_px);
  read_principal_point(table, model);
  if (table.has("distortion")) {
    const std::vector<double> d = table.numbers("distortion", 5);
    std::copy(d.begin(), d.end(), model.distortion.begin());
  }
  return model;
}

CameraModel read_fisheye_model(const ConfigTable& table) {
  CameraModel model;
  model.width = table.integer("width", 1, kMaxSide_px);
  model.height = table.integer("height", 1, kMaxSide_px);
  read_principal_point(table, model);
  model.fov_rad = table.number("fov_degrees", 1.0, 360.0) * std::numbers::pi / 180.0;
  if (table.choice("model", {"equidistant", "kannala-brandt"}, "equidistant") == "equidistant") {
    model.kind = CameraModel::Kind::equidistant;
    model.fx = model.fy = table.number("f", 1.0, kLimits.max_focal_length_px);
    return model;
  }
  model.kind = CameraModel::Kind::kannala_brandt;
  model.fx = table.number("fx", 1.0, kLimits.max_focal_length_px);
  model.fy = table.number("fy", 1.0, kLimits.max_focal_length_px);
  const std::vector<double> k = table.numbers("k", 4);
  std::copy(k.begin(), k.end(), model.k.begin());
  const double edge = 0.5 * model.fov_rad * (1.0 - 1e-9);
  if (!model.project({std::sin(edge), 0.0, std::cos(edge)})) {
    table.fail("k", "found a polynomial that turns back within fov_degrees, allowed: one that grows up to half of it");
  }
  return model;
}

Vignetting read_vignetting(const ConfigTable& table, const CameraModel& camera) {
  Vignetting vignetting;
  if (!table.has("vignetting")) return vignetting;
  const std::vector<double> terms = table.numbers("vignetting", vignetting.terms.size());
  std::copy(terms.begin(), terms.end(), vignetting.terms.begin());
  constexpr int kSteps = 100;  // one per degree of a lens of 200 degrees
  for (int i = 0; i <= kSteps; ++i) {
    const double angle_rad = corner_angle_rad(camera) * i / kSteps, t = vignetting.transmission(angle_rad);
    if (!(t >= kLimits.min_transmission && t <= kLimits.max_transmission)) {
      table.fail("vignetting", "found " + std::to_string(t) + " of the axis' light at " +
                                   std::to_string(std::lround(angle_rad * 180.0 / std::numbers::pi)) +
                                   " degrees from it, allowed: 0.02 to 2 all over the field");
    }
  }
  return vignetting;
}

/// Replaces the 3x3 part by the nearest rotation: printed digits are not exactly orthonormal, and inverses rely on it.
Eigen::Isometry3d read_transform(const ConfigTable& table, std::string_view key) {
  const std::vector<double> rows = table.rigid_transform(key);
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(rows.data());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix.topLeftCorner<3, 3>(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = svd.matrixU() * svd.matrixV().transpose();
  out.translation() = matrix.topRightCorner<3, 1>();
  return out;
}

CameraSettings read_settings(const ConfigTable& table) {
  CameraSettings settings;
  if (table.has("pixel_format")) {
    const std::string name = table.text("pixel_format");
    settings.pixel_format = pixel_format_named(name);
    if (!settings.pixel_format) {
      table.fail("pixel_format", "found \"" + name +
                                     "\", allowed: rgb8, bgr8, grey8, grey10, grey12, grey16, bayer-rggb8, "
                                     "bayer-bggr8, bayer-gbrg8, bayer-grbg8, yuyv, uyvy, nv12, mjpeg, of depth z16");
    }
  }
  if (table.has("input")) {
    const std::string source = table.text("source");
    if (const auto uri = parse_source(source); uri && uri->live && uri->kind != "v4l2") {
      table.fail("input", "found it with \"" + source + "\", allowed: with a source of v4l2:");
    }
    settings.input = table.text("input");
  }
  const auto number = [&table](std::string_view key, double low, double high) {
    return table.has(key) ? std::optional(table.number(key, low, high)) : std::nullopt;
  };
  settings.rate_hz = number("rate_hz", kLimits.min_rate_hz, kLimits.max_rate_hz);
  settings.exposure_us = number("exposure_us", kLimits.min_exposure_us, kLimits.max_exposure_us);
  settings.gain = number("gain", -kLimits.max_gain, kLimits.max_gain);
  if (const auto controls = table.optional_table("controls")) {
    for (const std::string& name : controls->keys()) {
      settings.controls.emplace_back(name, controls->number(name, -2147483648.0, 2147483647.0));  // 32-bit integers
    }
  }
  return settings;
}

double read_exposure(const ConfigTable& table) {
  return table.number("exposure", kLimits.min_exposure, kLimits.max_exposure);
}

/// `serial` of the session, else the camera's name in its source URI.
std::string read_serial(const ConfigTable& table) { return table.text("serial", serial_in(table.text("source"))); }

/// As above; if both are absent, the serial number in the calibration.
std::string read_serial(const ConfigTable& table, const ConfigTable& lens) {
  const std::string own = read_serial(table);
  return own.empty() ? lens.text("serial", "") : own;
}

struct Size {
  int width, height;
};

Size read_size(const ConfigTable& table) {
  return {table.integer("width", 1, kMaxSide_px), table.integer("height", 1, kMaxSide_px)};
}

/// The table that describes the lens of `camera`: the calibration's if it has one, else the camera's own.
ConfigTable lens_table(const ConfigTable& camera, const Size& size, const std::optional<ConfigTable>& calibration,
                       std::string_view name) {
  const auto lens = calibration ? calibration->optional_table(name) : std::nullopt;
  if (!lens) return camera;
  const std::string other = ", allowed: that of the camera in " + camera.file().string() + ", ";
  for (const auto& [side, wanted] : {std::pair("width", size.width), std::pair("height", size.height)}) {
    const int found = lens->integer(side, 1, kMaxSide_px);
    if (found != wanted) lens->fail(side, "found " + std::to_string(found) + other + std::to_string(wanted));
  }
  const std::string wanted = read_serial(camera), found = lens->text("serial", "");
  if (!wanted.empty() && !found.empty() && found != wanted) {
    lens->fail("serial", "found \"" + found + "\"" + other + "\"" + wanted + "\"");
  }
  for (const std::string& key : camera.keys()) {
    const bool of_the_lens = key == "f" || (lens->has(key) && key != "width" && key != "height" && key != "serial");
    if (of_the_lens) {
      camera.fail(key,
                  "found together with " + lens->file().string() + ", which defines the lens, allowed: without it");
    }
  }
  return *lens;
}

/// Refuses keys that were not read, except those of cameras that the session does not have.
void finish_calibration(const ConfigTable& calibration, const Session& session) {
  const std::map<std::string, bool> used = {
      {"color", true}, {"depth", session.depth.has_value()}, {"fisheye", session.fisheye.has_value()}};
  for (const std::string& key : calibration.keys()) {
    if (const auto table = used.find(key); table == used.end()) {
      if (key != "format") {
        calibration.fail(key, "found an unknown key, allowed: format, color, depth, fisheye");
      }
    } else if (table->second) {
      calibration.table(key).finish();
    }
  }
}

ColorCamera read_color(const ConfigTable& table, const ConfigTable& lens) {
  ColorCamera camera{.source = source_uri(table), .serial = read_serial(table, lens), .model = read_pinhole(lens)};
  camera.model.width = read_size(table).width;
  camera.model.height = read_size(table).height;
  camera.exposure = read_exposure(table);
  camera.response = read_response(lens.has("response") ? lens : table);
  camera.vignetting = read_vignetting(lens.has("vignetting") ? lens : table, camera.model);
  if (table.has("readout_ms"))
    camera.readout_s = 1e-3 * table.number("readout_ms", -kLimits.max_readout_ms, kLimits.max_readout_ms);
  camera.settings = read_settings(table);
  return camera;
}

DepthPrinciple read_principle(const ConfigTable& table, DepthPrinciple usual) {
  const std::string name = table.text("principle", name_of(usual));
  std::string allowed;
  for (const DepthPrinciple principle :
       {DepthPrinciple::structured_light, DepthPrinciple::time_of_flight, DepthPrinciple::stereo}) {
    if (name == name_of(principle)) return principle;
    allowed += (allowed.empty() ? "\"" : ", \"") + std::string(name_of(principle)) + "\"";
  }
  table.fail("principle", "found \"" + name + "\", allowed: " + allowed);
}

double read_noise_scale(const ConfigTable& table, const std::optional<ConfigTable>& calibration) {
  const auto measured = calibration ? calibration->optional_table("depth") : std::nullopt;
  const bool of_calibration = measured && measured->has("noise_scale");
  if (of_calibration && table.has("noise_scale"))
    table.fail("noise_scale", "found it here and in " + measured->file().string() + ", allowed: one of both");
  return (of_calibration ? *measured : table)
      .number("noise_scale", kSessionLimits.min_noise_scale, kSessionLimits.max_noise_scale, 1.0);
}

DepthCamera read_depth(const ConfigTable& table, const CameraModel& color,
                       const std::optional<ConfigTable>& calibration) {
  DepthCamera camera;
  camera.source = source_uri(table);
  camera.serial = read_serial(table);
  camera.unit_m = table.number("unit_m", 1e-6, 1.0);
  const std::string kind = parse_source(camera.source)->kind;
  if ((kind == "v4l2" || kind == "helper") && !table.has("registered")) {
    table.fail("registered", "found nothing, allowed with " + kind +
                                 ": false, or true if the camera itself puts depth on the "
                                 "colour camera's pixels");
  }
  if (kind != "openni2" && kind != "oni") camera.settings = read_settings(table);
  // Cameras of USB Video Class with depth, and those of the helpers, have two lenses.
  camera.principle = read_principle(
      table, kind == "v4l2" || kind == "helper" ? DepthPrinciple::stereo : DepthPrinciple::structured_light);
  camera.noise_scale = read_noise_scale(table, calibration);
  camera.registered = table.flag("registered", true);
  if (camera.registered) {
    if (const auto lens = calibration ? calibration->optional_table("depth") : std::nullopt) {
      lens->fail("T_color_depth", "found it for depth on its own pixels, allowed: registered = false in " +
                                      table.file().string() + ", or a calibration without it");
    }
    camera.model = color;
    return camera;
  }
  camera.model = read_pinhole(table);
  camera.model.width = table.integer("width", 1, kMaxSide_px, color.width);
  camera.model.height = table.integer("height", 1, kMaxSide_px, color.height);
  const ConfigTable lens = lens_table(table, {camera.model.width, camera.model.height}, calibration, "depth");
  camera.serial = read_serial(table, lens);
  camera.T_color_depth = read_transform(lens, "T_color_depth");
  return camera;
}

FisheyeCamera read_fisheye(const ConfigTable& table, const ConfigTable& lens) {
  FisheyeCamera camera;
  camera.source = source_uri(table);
  camera.serial = read_serial(table, lens);
  camera.model = read_fisheye_model(lens);
  camera.exposure = read_exposure(table);
  camera.response = read_response(lens.has("response") ? lens : table);
  camera.vignetting = read_vignetting(lens.has("vignetting") ? lens : table, camera.model);
  camera.time_offset_s = (lens.has("time_offset_s") ? lens : table)
                             .number("time_offset_s", -kLimits.max_time_offset_s, kLimits.max_time_offset_s, 0.0);
  camera.T_tag_fisheye = read_transform(lens.has("T_tag_fisheye") ? lens : table, "T_tag_fisheye");
  camera.settings = read_settings(table);
  if (table.has("bracket_us")) {
    camera.settings.bracket_us = table.numbers("bracket_us", 2, 5);
    for (const double exposure_us : camera.settings.bracket_us) {
      if (exposure_us < kLimits.min_exposure_us || exposure_us > kLimits.max_exposure_us) {
        table.fail("bracket_us", "found " + std::to_string(exposure_us) + ", allowed: 1 to 60000000");
      }
    }
    if (!camera.settings.exposure_us) {
      table.fail("bracket_us", "found no exposure_us with it, allowed: the exposure time that `exposure` refers to");
    }
  }
  return camera;
}

/// Largest id of a tag family.
int largest_id(const std::string& family) { return family == "tag36h11" ? 586 : family == "tag25h9" ? 34 : 29; }

/// Adds the tag that `key` states to `taken`; refuses it if it is there.
void take_tag(const ConfigTable& table, std::string_view key, int id, std::set<int>& taken) {
  if (!taken.insert(id).second) table.fail(key, "found " + std::to_string(id) + " twice, allowed: each tag once");
}

Tag read_tag(const ConfigTable& table, std::set<int>& taken) {
  Tag tag;
  tag.family = table.choice("family", {"tag36h11", "tag25h9", "tag16h5"}, "tag36h11");
  const int largest = largest_id(tag.family);
  tag.id = table.integer("id", 0, largest);
  take_tag(table, "id", tag.id, taken);
  tag.size_m = table.number("size_m", kLimits.min_tag_size_m, kLimits.max_tag_size_m);
  tag.moves_exhibit = table.choice("moves", {"nothing", "exhibit"}, "nothing") == "exhibit";
  if (table.has("map")) tag.map = table.folder() / table.text("map");
  for (const ConfigTable& extra_table : table.tables(table.renamed("extra", "also"))) {
    ExtraTag& extra = tag.extra.emplace_back();
    extra.id = extra_table.integer("id", 0, largest);
    take_tag(extra_table, "id", extra.id, taken);
    extra.size_m = extra_table.number("size_m", kLimits.min_tag_size_m, kLimits.max_tag_size_m, tag.size_m);
    const std::string_view pose = extra_table.renamed("T_tag_extra", "T_tag_also");
    if (extra_table.has(pose)) extra.T_tag_extra = read_transform(extra_table, pose);
  }
  return tag;
}

/// Without a tag the world is a surface that depth shows, and no pose in the frame of a tag can be meant.
void require_surface_anchor(const ConfigTable& root, const Session& session) {
  if (!session.depth)
    root.fail(
        "tag",
        "found nothing, allowed without [tag]: sessions with [depth], which shows the surface that becomes the world");
  if (session.fisheye)
    root.fail("tag", "found nothing, but it is needed by fisheye.T_tag_fisheye; allowed without [tag]: no [fisheye]");
}

/// Three numbers; `allowed` describes the range in errors.
Eigen::Vector3d read_vector(const ConfigTable& table, std::string_view key, double low, double high,
                            const std::string& allowed) {
  const std::vector<double> numbers = table.numbers(key, 3);
  for (const double number : numbers) {
    if (!(number >= low && number <= high)) {
      table.fail(key, "found " + std::to_string(number) + ", allowed: three numbers " + allowed);
    }
  }
  return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

TaggedLamp read_lamp(const ConfigTable& table, const std::string& family, std::set<int>& taken) {
  TaggedLamp lamp;
  lamp.tag_id = table.integer("tag_id", 0, largest_id(family));
  take_tag(table, "tag_id", lamp.tag_id, taken);
  lamp.name = table.text("name", "with tag " + std::to_string(lamp.tag_id));
  lamp.tag_size_m = table.number("tag_size_m", kLimits.min_tag_size_m, kLimits.max_tag_size_m);
  lamp.radius_m = table.number("radius_m", kLimits.min_lamp_radius_m, kLimits.max_lamp_radius_m);
  lamp.position_m = read_vector(table, "position_m", -kLimits.max_lamp_offset_m, kLimits.max_lamp_offset_m,
                                "from -5 to 5, metres from the middle of its tag");
  if (table.has("normal")) {
    const Eigen::Vector3d normal = read_vector(table, "normal", -1.0, 1.0, "from -1 to 1");
    if (normal.norm() < 0.5) {
      table.fail("normal", "found a vector of length " + std::to_string(normal.norm()) + ", allowed: about 1");
    }
    lamp.normal = normal.normalized();
  }
  if (table.has("intensity")) {
    lamp.intensity =
        read_vector(table, "intensity", 0.0, kLimits.max_lamp_intensity_w_sr, "from 0 to 1000000, W/sr").cast<float>();
    if (lamp.intensity->isZero()) table.fail("intensity", "found none, allowed: what the lamp sends when it is on");
  }
  return lamp;
}

RealSurface read_real_surface(const ConfigTable& table) {
  RealSurface surface;
  surface.mesh = table.existing_file("mesh");
  surface.name = table.text("name", surface.mesh.stem().string());
  surface.roughness = static_cast<float>(table.number("roughness", 0.0, 1.0));
  surface.metallic = static_cast<float>(table.number("metallic", 0.0, 1.0));
  surface.specular = static_cast<float>(table.number("specular", 0.0, 1.0));
  surface.base_color = read_vector(table, "base_color", 0.0, 1.0, "from 0 to 1").cast<float>();
  return surface;
}

}  // namespace

Session read_session(const ConfigTable& root) {
  root.integer("format", 1, 1);
  Session session;
  session.folder = root.folder();
  session.name = root.text("name", std::filesystem::weakly_canonical(session.folder).filename().string());
  root.text("about", "");
  std::optional<ConfigTable> calibration;
  if (root.has("calibration")) {
    calibration = ConfigTable::load(root.existing_file("calibration"));
    calibration->integer("format", 1, 1);
  }
  const ConfigTable color = root.table("color");
  session.color = read_color(color, lens_table(color, read_size(color), calibration, "color"));
  if (const auto depth = root.optional_table("depth")) {
    session.depth = read_depth(*depth, session.color.model, calibration);
  }
  if (const auto fisheye = root.optional_table("fisheye")) {
    session.fisheye = read_fisheye(*fisheye, lens_table(*fisheye, read_size(*fisheye), calibration, "fisheye"));
  }
  if (calibration) finish_calibration(*calibration, session);
  std::set<int> tags;
  if (root.has("tag")) {
    session.tag = read_tag(root.table("tag"), tags);
  } else {
    require_surface_anchor(root, session);
    session.tag.size_m = 0;
  }
  for (const ConfigTable& table : root.tables("lamp")) {
    session.lamps.push_back(read_lamp(table, session.tag.family, tags));
  }
  for (const ConfigTable& table : root.tables("real_surface")) {
    session.real_surfaces.push_back(read_real_surface(table));
  }
  return session;
}

}  // namespace lumigraft::capture
