#pragma once
// glTF files with animations, skins and morph targets.
#include <string>
#include <vector>

#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {

inline std::string joint_bytes(const std::vector<std::uint8_t>& joints) { return bytes_of(joints); }

/// An animation of one channel; returns the file's accessor numbers of its times and values.
inline nlohmann::json channel_animation(GltfFile& file, const std::string& path, const std::vector<float>& times_s,
                                        const std::vector<float>& values, const std::string& type, int node = 0) {
  const int input = file.add(times_s, "SCALAR"), output = file.add(values, type);
  return {{"name", path},
          {"samplers", {{{"input", input}, {"output", output}}}},
          {"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}}};
}

/// The triangle on a node that moves along x by two metres in a second.
inline GltfFile moving_triangle() {
  GltfFile file;
  file.json["animations"] = {channel_animation(file, "translation", {0, 1}, {0, 0, 0, 2, 0, 0}, "VEC3")};
  return file;
}

/// The triangle with a skin of two joints: its corners are on the first, on the second and half on each. The second
/// joint is a child of the first, a metre along x, and moves along z by a metre in a second.
inline GltfFile skinned_triangle() {
  GltfFile file;
  file.attributes()["JOINTS_0"] =
      file.add_accessor(joint_bytes({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}), "VEC4", 5121, 3, false);
  file.attributes()["WEIGHTS_0"] = file.add({1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0}, "VEC4");
  const int inverse = file.add({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,   // of the first joint
                                1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1},  // a metre back
                               "MAT4");
  file.json["accessors"][inverse]["count"] = 2;
  file.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", inverse}}};
  file.json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {9, 9, 9}}},  // which a skin makes void
                        {{"children", {2}}},
                        {{"translation", {1, 0, 0}}}};
  file.json["scenes"] = {{{"nodes", {0, 1}}}};
  file.json["animations"] = {channel_animation(file, "translation", {0, 1}, {1, 0, 0, 1, 0, 1}, "VEC3", 2)};
  return file;
}

/// The triangle with a target that lifts its second corner by a metre along z, at weight 0 and 1 after 0 and 1 s.
inline GltfFile morphed_triangle() {
  GltfFile file;
  file.primitive()["targets"] = {{{"POSITION", file.add({0, 0, 0, 0, 0, 1, 0, 0, 0}, "VEC3")}}};
  file.json["animations"] = {channel_animation(file, "weights", {0, 1}, {0, 1}, "SCALAR")};
  return file;
}

}  // namespace lumigraft::test
