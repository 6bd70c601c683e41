#include "server/truth/truth.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "capture/error.h"
#include "capture/formats/picture_file.h"
#include "capture/message_text.h"

namespace lumigraft::server {
namespace {

/// What `parse` reads from a file.
template <typename Parse>
auto read_json(const std::filesystem::path& path, const Parse& parse) {
  std::ifstream in(path);
  capture::refuse_if(!in, path.string() + ": found no such file, needed by --oracle");
  try {
    return parse(nlohmann::json::parse(in));
  } catch (const nlohmann::json::exception& e) {
    throw capture::InputError(path.string() + ": " + e.what());
  }
}

Eigen::Vector3d vector(const nlohmann::json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

}  // namespace

double TrueLamp::seen_area_m2(const Eigen::Vector3d& from_m) const {
  if (normal.isZero()) return std::numbers::pi * radius_m * radius_m;
  return area_m2 * std::max(0.0, normal.dot((from_m - centre_m).normalized()));
}

std::filesystem::path truth_folder(const std::filesystem::path& session, std::uint64_t index) {
  const std::string name = capture::formatted("%06llu", static_cast<unsigned long long>(index));
  const std::filesystem::path truth = session / "truth";
  const bool is_static = !std::filesystem::exists(truth / "000001");
  return std::filesystem::exists(truth / name) || !is_static ? truth / name : truth / "000000";
}

Eigen::Isometry3d read_true_pose(const std::filesystem::path& pose_json) {
  return read_json(pose_json, [](const nlohmann::json& json) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 4; ++c) pose(r, c) = json.at("T_tag_from_camera").at(r).at(c).get<double>();
    }
    return pose;
  });
}

std::vector<TrueLamp> read_true_lamps(const std::filesystem::path& lights_json) {
  return read_json(lights_json, [](const nlohmann::json& json) {
    std::vector<TrueLamp> lamps;
    for (const nlohmann::json& entry : json.at("lights")) {
      TrueLamp lamp;
      lamp.name = entry.value("name", "lamp");
      lamp.centre_m = vector(entry.at("centre"));
      lamp.radiance = vector(entry.at("radiance"));
      lamp.area_m2 = entry.at("area_m2").get<double>();
      if (entry.contains("normal")) {
        lamp.normal = vector(entry["normal"]).normalized();
        lamp.radius_m = std::sqrt(lamp.area_m2 / std::numbers::pi);
        if (entry.contains("size")) {
          lamp.size_m = {entry["size"].at(0).get<double>(), entry["size"].at(1).get<double>()};
        }
      } else {
        lamp.radius_m = entry.at("radius").get<double>();
      }
      lamps.push_back(lamp);
    }
    return lamps;
  });
}

TrueSky read_true_sky(const std::filesystem::path& lights_json) {
  return read_json(lights_json, [](const nlohmann::json& json) {
    TrueSky sky;
    const auto entry = json.find("environment");
    if (entry != json.end() && !entry->is_null()) {
      sky.is_picture = !entry->contains("constant");
      if (!sky.is_picture) sky.constant = vector(entry->at("constant"));
    }
    return sky;
  });
}

capture::Image<float> read_true_picture(const std::filesystem::path& exr) {
  return capture::with_error_context(exr.string(), [&] { return capture::read_radiance(exr); });
}

capture::Image<float> read_true_depth(const std::filesystem::path& exr) {
  try {
    Imf::InputFile file(exr.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    capture::Image<float> depth(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1, 1);
    const char* name = file.header().channels().findChannel("Y") != nullptr ? "Y" : "R";
    Imf::FrameBuffer pixels;
    pixels.insert(name,
                  Imf::Slice::Make(Imf::FLOAT, depth.data.data(), window, sizeof(float), sizeof(float) * depth.width));
    file.setFrameBuffer(pixels);
    file.readPixels(window.min.y, window.max.y);
    return depth;
  } catch (const std::exception& e) {
    throw capture::InputError(exr.string() + ": " + e.what());
  }
}

}  // namespace lumigraft::server
