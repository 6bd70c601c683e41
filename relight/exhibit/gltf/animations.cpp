#include "relight/exhibit/gltf/animations.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

std::optional<Rig::Moves> moves_of(const GltfValue& path) {
  const std::string name = path.text();
  if (name == "translation") return Rig::Moves::translation;
  if (name == "rotation") return Rig::Moves::rotation;
  if (name == "scale") return Rig::Moves::scale;
  if (name == "weights") return Rig::Moves::weights;
  if (name == "pointer") return std::nullopt;  // KHR_animation_pointer
  path.refuse("translation, rotation, scale or weights");
}

Interpolation interpolation_of(const GltfValue& sampler) {
  const std::string name = sampler.text("interpolation", "LINEAR");
  if (name == "STEP") return Interpolation::step;
  if (name == "LINEAR") return Interpolation::linear;
  if (name == "CUBICSPLINE") return Interpolation::cubic_spline;
  sampler.member("interpolation").refuse("STEP, LINEAR or CUBICSPLINE");
}

/// Bounded and finite, which NaN is not.
void check_values(const GltfValue& reference, const std::vector<float>& values, std::size_t width, double low,
                  double high, const std::string& allowed) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (static_cast<double>(values[i]) >= low && static_cast<double>(values[i]) <= high) continue;
    reference.fail("found " + std::to_string(values[i]) + " in element " + std::to_string(i / width) +
                   ", allowed: " + allowed);
  }
}

class SamplerReader {
 public:
  SamplerReader(GltfAccessors& accessors, const GltfValue& sampler, Rig::Moves moves, std::size_t weights)
      : accessors_(accessors), sampler_(sampler), moves_(moves) {
    read_.interpolation = interpolation_of(sampler);
    read_.width = moves == Rig::Moves::weights ? weights : moves == Rig::Moves::rotation ? 4 : 3;
  }

  AnimatedValue read() {
    read_times();
    read_values();
    if (moves_ == Rig::Moves::rotation) check_rotations();
    return std::move(read_);
  }

 private:
  void read_times() {
    const GltfValue input = sampler_.member("input");
    const GltfAccessorFormat format = accessors_.format(input);
    if (format.type != kGltfFloat || format.components != 1) {
      input.fail("found " + GltfAccessors::name_of(format.type, format.normalized) + " of " +
                 std::to_string(format.components) + " components, allowed: scalars of FLOAT as times");
    }
    read_.times_s = accessors_.floats(input);
    check_values(input, read_.times_s, 1, 0, kGltf.max_time_s,
                 "times from 0 to " + std::to_string(static_cast<int>(kGltf.max_time_s)) + " s");
    for (std::size_t i = 1; i < read_.times_s.size(); ++i) {
      if (read_.times_s[i] >= read_.times_s[i - 1]) continue;
      input.fail("found " + std::to_string(read_.times_s[i]) + " s in element " + std::to_string(i) +
                 ", allowed: no earlier than the key before, " + std::to_string(read_.times_s[i - 1]) + " s");
    }
  }

  void read_values() {
    const GltfValue output = sampler_.member("output");
    const GltfAccessorFormat format = accessors_.format(output);
    const bool may_be_integers = moves_ == Rig::Moves::rotation || moves_ == Rig::Moves::weights;
    if (format.type != kGltfFloat && !(may_be_integers && format.normalized && format.type != kGltfUnsignedInt)) {
      output.fail("found " + GltfAccessors::name_of(format.type, format.normalized) + ", allowed: FLOAT" +
                  (may_be_integers ? ", or normalized BYTE, UNSIGNED_BYTE, SHORT or UNSIGNED_SHORT" : ""));
    }
    const std::size_t components = moves_ == Rig::Moves::weights ? 1 : read_.width;
    if (format.components != components) {
      output.fail("found " + std::to_string(format.components) + " components, allowed: " + std::to_string(components));
    }
    const std::size_t per_key = (read_.interpolation == Interpolation::cubic_spline ? 3 : 1) * read_.width / components;
    if (format.count != per_key * read_.times_s.size()) {
      output.fail("found " + std::to_string(format.count) + " elements, allowed: " + std::to_string(per_key) +
                  " for each of the " + std::to_string(read_.times_s.size()) + " times");
    }
    read_.values = accessors_.floats(output);
    check_values(output, read_.values, components, -kGltf.max_length, kGltf.max_length,
                 "finite numbers, at most 1e9 from 0");
  }

  void check_rotations() const {
    const std::size_t per_key = read_.values.size() / read_.times_s.size();
    for (std::size_t key = 0; key < read_.times_s.size(); ++key) {
      const float* q = &read_.values[key * per_key + (per_key > 4 ? 4 : 0)];
      if (Eigen::Map<const Eigen::Vector4f>(q).norm() > kMinQuaternion) continue;
      sampler_.member("output").fail("found a quaternion of length 0 at key " + std::to_string(key) +
                                     ", allowed: quaternions of length 1");
    }
  }

  static constexpr float kMinQuaternion = 1e-9f;

  GltfAccessors& accessors_;
  GltfValue sampler_;
  Rig::Moves moves_;
  AnimatedValue read_;
};

class AnimationReader {
 public:
  AnimationReader(GltfAccessors& accessors, const GltfValue& nodes, const GltfScene& scene,
                  const std::map<std::size_t, GltfMorphs>& morphs, const GltfValue& animation)
      : accessors_(accessors), nodes_(nodes), scene_(scene), morphs_(morphs), animation_(animation) {}

  Rig::Animation read() {
    const GltfValue channels = animation_.member("channels");
    for (std::size_t i = 0; i < channels.size(); ++i) add(channels[i]);
    return std::move(read_);
  }

 private:
  void add(const GltfValue& channel) {
    const GltfValue target = channel.member("target"), node = target.member("node"), path = target.member("path");
    const std::optional<Rig::Moves> moves = moves_of(path);
    if (!node.exists() || !moves) return;
    const std::size_t index = node.index(nodes_.size(), "nodes");
    const auto number = scene_.number.find(index);
    if (number == scene_.number.end()) return;
    if (!seen_.emplace(index, *moves).second)
      path.fail("found a second channel of node " + std::to_string(index) + ", allowed: one");
    const auto morphs = morphs_.find(number->second);
    if (*moves == Rig::Moves::weights && morphs == morphs_.end())
      node.fail("found node " + std::to_string(index) + " without morph targets, allowed: one with them");
    if (*moves != Rig::Moves::weights && nodes_[index].member("matrix").exists())
      node.fail("found node " + std::to_string(index) + " with a matrix, allowed: one without");
    const GltfValue samplers = animation_.member("samplers");
    const GltfValue sampler = samplers[channel.member("sampler").index(samplers.size(), "samplers")];
    Rig::Channel& read = read_.channels.emplace_back();
    read.moves = *moves;
    read.node = static_cast<std::uint32_t>(number->second);
    if (*moves == Rig::Moves::weights) read.first_weight = morphs->second.first;
    read.value = SamplerReader(accessors_, sampler, *moves, morphs == morphs_.end() ? 0 : morphs->second.count).read();
    read_.length_s = std::max(read_.length_s, static_cast<double>(read.value.times_s.back()));
  }

  GltfAccessors& accessors_;
  GltfValue nodes_;
  const GltfScene& scene_;
  const std::map<std::size_t, GltfMorphs>& morphs_;
  GltfValue animation_;
  std::set<std::pair<std::size_t, Rig::Moves>> seen_;
  Rig::Animation read_;
};

}  // namespace

std::vector<Rig::Animation> read_animations(const GltfDocument& document, GltfAccessors& accessors,
                                            const GltfScene& scene, const std::map<std::size_t, GltfMorphs>& morphs) {
  std::vector<Rig::Animation> all;
  const GltfValue animations = document.root().member("animations"), nodes = document.root().member("nodes");
  for (std::size_t i = 0; i < animations.size(); ++i) {
    Rig::Animation animation = AnimationReader(accessors, nodes, scene, morphs, animations[i]).read();
    if (animation.channels.empty()) continue;
    animation.name = animations[i].text("name", "");
    if (animation.name.empty()) animation.name = "animation " + std::to_string(i);
    all.push_back(std::move(animation));
  }
  return all;
}

}  // namespace lumigraft::relight
