// Broken animations, skins and morph targets: each is refused in a sentence that says where, what was found and what is
// allowed.
#include <functional>
#include <limits>

#include "tests/relight/exhibit/gltf/animated_files.h"
#include "tests/relight/exhibit/gltf/gltf_models.h"

namespace lumigraft::test {
namespace {

struct Damage {
  std::string expected;
  std::function<void(GltfFile&)> done;
};

void expect_refused(const std::function<GltfFile()>& sound, const std::vector<Damage>& cases) {
  ASSERT_EQ(refusal_of(sound().gltf()), "");
  for (const Damage& damage : cases) {
    GltfFile file = sound();
    damage.done(file);
    EXPECT_EQ(refusal_of(file.gltf()), damage.expected);
  }
}

nlohmann::json& sampler(GltfFile& file) { return file.json["animations"][0]["samplers"][0]; }
nlohmann::json& target(GltfFile& file) { return file.json["animations"][0]["channels"][0]["target"]; }
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

TEST(AnimatedRefusals, Channels) {
  const std::string channel = "animations[0].channels[0].";
  expect_refused(
      moving_triangle,
      {{channel + "sampler: found 3, allowed: the number of one of 1 samplers",
        [](GltfFile& f) { f.json["animations"][0]["channels"][0]["sampler"] = 3; }},
       {channel + "target.node: found 7, allowed: the number of one of 1 nodes",
        [](GltfFile& f) { target(f)["node"] = 7; }},
       {channel + "target.path: found \"colour\", allowed: translation, rotation, scale or weights",
        [](GltfFile& f) { target(f)["path"] = "colour"; }},
       {channel + "target.path: found none, allowed: a text", [](GltfFile& f) { target(f).erase("path"); }},
       {channel + "target.node: found node 0 without morph targets, allowed: one with them",
        [](GltfFile& f) { target(f)["path"] = "weights"; }},
       {"animations[0].channels[1].target.path: found a second channel of node 0, allowed: one",
        [](GltfFile& f) {
          nlohmann::json& channels = f.json["animations"][0]["channels"];
          channels.push_back(nlohmann::json(channels[0]));
        }},
       {channel + "target.node: found node 0 with a matrix, allowed: one without",
        [](GltfFile& f) { f.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }},
       {"animations: found \"x\", allowed: an array", [](GltfFile& f) { f.json["animations"] = "x"; }}});
}

TEST(AnimatedRefusals, Keys) {
  const std::string keys = "animations[0].samplers[0].";
  expect_refused(
      moving_triangle,
      {{keys + "interpolation: found \"SMOOTH\", allowed: STEP, LINEAR or CUBICSPLINE",
        [](GltfFile& f) { sampler(f)["interpolation"] = "SMOOTH"; }},
       {keys + "output: found 2 elements, allowed: 3 for each of the 2 times",
        [](GltfFile& f) { sampler(f)["interpolation"] = "CUBICSPLINE"; }},
       {keys + "input: found none, allowed: the number of one of 4 accessors",
        [](GltfFile& f) { sampler(f).erase("input"); }},
       {keys + "input: found nan in element 1, allowed: times from 0 to 1000000 s",
        [](GltfFile& f) {
          sampler(f)["input"] = f.add({0, kNan}, "SCALAR");
        }},
       {keys + "input: found -1.000000 in element 0, allowed: times from 0 to 1000000 s",
        [](GltfFile& f) {
          sampler(f)["input"] = f.add({-1, 0}, "SCALAR");
        }},
       {keys + "input: found 1.000000 s in element 1, allowed: no earlier than the key before, 2.000000 s",
        [](GltfFile& f) {
          sampler(f)["input"] = f.add({2, 1}, "SCALAR");
        }},
       {keys + "input: found FLOAT of 3 components, allowed: scalars of FLOAT as times",
        [](GltfFile& f) { sampler(f)["input"] = sampler(f)["output"]; }},
       {keys + "output: found nan in element 1, allowed: finite numbers, at most 1e9 from 0",
        [](GltfFile& f) {
          sampler(f)["output"] = f.add({0, 0, 0, 0, kNan, 0}, "VEC3");
        }},
       {keys + "output: found inf in element 0, allowed: finite numbers, at most 1e9 from 0",
        [](GltfFile& f) {
          sampler(f)["output"] = f.add({0, 0, kInfinity, 0, 0, 0}, "VEC3");
        }},
       {keys + "output: found 2 components, allowed: 3",
        [](GltfFile& f) {
          sampler(f)["output"] = f.add({0, 0, 0, 0}, "VEC2");
        }},
       {"accessors[2].count: found 1000000000, allowed: an integer from 1 to 50000000",
        [](GltfFile& f) { f.json["accessors"][2]["count"] = 1'000'000'000; }},
       {"accessors[2]: found elements up to byte 160000000, allowed: the 8 bytes of its view",
        [](GltfFile& f) { f.json["accessors"][2]["count"] = 40'000'000; }},
       {keys + "output: found a quaternion of length 0 at key 1, allowed: quaternions of length 1", [](GltfFile& f) {
          f.json["animations"] = {channel_animation(f, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, 0, 0}, "VEC4")};
        }}});
}

TEST(AnimatedRefusals, Skins) {
  const std::string attributes = "meshes[0].primitives[0].attributes.";
  expect_refused(
      skinned_triangle,
      {{"nodes[0].skin: found 1, allowed: the number of one of 1 skins",
        [](GltfFile& f) { f.json["nodes"][0]["skin"] = 1; }},
       {"skins[0].joints: found none, allowed: at least one joint",
        [](GltfFile& f) { f.json["skins"][0].erase("joints"); }},
       {"skins[0].joints[1]: found 9, allowed: the number of one of 3 nodes",
        [](GltfFile& f) {
          f.json["skins"][0]["joints"] = {1, 9};
        }},
       {"skins[0].joints[0]: found node 1, which the scene does not have, allowed: one of it",
        [](GltfFile& f) {
          f.json["scenes"] = {{{"nodes", {0}}}};
        }},
       {"nodes[2].children[0]: found node 1 a second time, allowed: trees of nodes",
        [](GltfFile& f) { f.json["nodes"][2]["children"] = {1}; }},
       {"skins[0].inverseBindMatrices: found 2 elements of 16 components of FLOAT, allowed: MAT4 of FLOAT for each of "
        "the 3 joints",
        [](GltfFile& f) {
          f.json["skins"][0]["joints"] = {1, 2, 0};
        }},
       {"skins[0].inverseBindMatrices: found no finite, affine matrix in element 0, allowed: numbers at most 1e9 from "
        "0, "
        "the last row 0 0 0 1",
        [](GltfFile& f) {
          std::vector<float> matrix(16, kNan);
          f.json["skins"][0]["inverseBindMatrices"] = f.add(matrix, "MAT4");
          f.json["accessors"].back()["count"] = 1;
          f.json["skins"][0]["joints"] = {1};
        }},
       {attributes + "JOINTS_0: found joint 1 of vertex 1, allowed: less than the 1 joints of skins[0]",
        [](GltfFile& f) { f.json["skins"][0]["joints"] = {1}; }},
       {attributes + "WEIGHTS_0: found weights of vertex 2 that sum to 0.750000, allowed: 1, as far as 8 bits hold it",
        [](GltfFile& f) {
          f.attributes()["WEIGHTS_0"] = f.add({1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.25f, 0, 0}, "VEC4");
        }},
       {attributes + "WEIGHTS_0: found weights of vertex 0 that sum to 0.000000, allowed: 1, as far as 8 bits hold it",
        [](GltfFile& f) { f.attributes()["WEIGHTS_0"] = f.add(std::vector<float>(12, 0), "VEC4"); }},
       {attributes + "WEIGHTS_0: found nan of vertex 0, allowed: weights from 0 to 1",
        [](GltfFile& f) { f.attributes()["WEIGHTS_0"] = f.add(std::vector<float>(12, kNan), "VEC4"); }},
       {attributes + "WEIGHTS_0: found none, allowed: as many sets as of joints",
        [](GltfFile& f) { f.attributes().erase("WEIGHTS_0"); }},
       {attributes +
            "JOINTS_0: found FLOAT, allowed: UNSIGNED_BYTE; UNSIGNED_SHORT (others with KHR_mesh_quantization)",
        [](GltfFile& f) { f.attributes()["JOINTS_0"] = f.attributes()["WEIGHTS_0"]; }}});
}

TEST(AnimatedRefusals, MorphTargets) {
  const std::string targets = "meshes[0].primitives[0].targets[0].";
  expect_refused(
      morphed_triangle,
      {{targets + "POSITION: found 2 elements, allowed: 3, as of POSITION",
        [](GltfFile& f) {
          f.primitive()["targets"][0]["POSITION"] = f.add({0, 0, 0, 0, 0, 0}, "VEC3");
        }},
       {targets + "POSITION: found nan, allowed: finite numbers, at most 1e9 from 0",
        [](GltfFile& f) { f.primitive()["targets"][0]["POSITION"] = f.add(std::vector<float>(9, kNan), "VEC3"); }},
       {"meshes[0].weights: found an array of 2, allowed: 1 numbers",
        [](GltfFile& f) {
          f.json["meshes"][0]["weights"] = {0, 0};
        }},
       {"animations[0].samplers[0].output: found 2 elements, allowed: 2 for each of the 2 times",
        [](GltfFile& f) { f.primitive()["targets"].push_back(nlohmann::json(f.primitive()["targets"][0])); }},
       {"meshes[0].primitives[1].targets: found 0 morph targets, allowed: 1, as of the first primitive",
        [](GltfFile& f) {
          nlohmann::json other = f.primitive();
          other.erase("targets");
          f.json["meshes"][0]["primitives"].push_back(other);
        }}});
}

}  // namespace
}  // namespace lumigraft::test
