#include "relight/exhibit/gltf/primitive.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <string>

#include "relight/exhibit/gltf/draco_mesh.h"

namespace lumigraft::relight {
namespace {

enum Mode : std::size_t { kTriangles = 4, kStrip = 5, kFan = 6 };

Mode mode_of(const GltfValue& primitive) { return static_cast<Mode>(primitive.integer("mode", 0, 6, kTriangles)); }

/// What the specification allows of an attribute: component types as they are, and normalized; further ones by
/// KHR_mesh_quantization.
struct AttributeRule {
  const char* name;
  std::size_t min_components, max_components;
  unsigned plain, normalized, quantized_plain, quantized_normalized;
};

constexpr unsigned kSigned = kGltfByte | kGltfShort, kUnsigned = kGltfUnsignedByte | kGltfUnsignedShort;
constexpr AttributeRule kPosition{"POSITION", 3, 3, kGltfFloat, 0, kSigned | kUnsigned, kSigned | kUnsigned};
constexpr AttributeRule kNormal{"NORMAL", 3, 3, kGltfFloat, 0, 0, kSigned};
constexpr AttributeRule kTangent{"TANGENT", 4, 4, kGltfFloat, 0, 0, kSigned};
constexpr AttributeRule kTexcoords[] = {
    {"TEXCOORD_0", 2, 2, kGltfFloat, kUnsigned, kSigned | kUnsigned, kSigned},
    {"TEXCOORD_1", 2, 2, kGltfFloat, kUnsigned, kSigned | kUnsigned, kSigned},
};
constexpr AttributeRule kColor{"COLOR_0", 3, 4, kGltfFloat, kUnsigned, 0, 0};
constexpr AttributeRule kTargets[] = {{"POSITION", 3, 3, kGltfFloat, 0, kSigned, kSigned},
                                      {"NORMAL", 3, 3, kGltfFloat, 0, 0, kSigned},
                                      {"TANGENT", 3, 3, kGltfFloat, 0, 0, kSigned}};

std::string types_of(unsigned plain, unsigned normalized) {
  std::string names;
  for (unsigned type = 1; type <= kGltfFloat; type *= 2) {
    for (const bool is_normalized : {false, true}) {
      if (!((is_normalized ? normalized : plain) & type)) continue;
      names += (names.empty() ? "" : "; ") + GltfAccessors::name_of(static_cast<GltfComponents>(type), is_normalized);
    }
  }
  return names;
}

class Reader {
 public:
  Reader(const GltfDocument& document, GltfBuffers& buffers, GltfAccessors& accessors, const GltfValue& primitive)
      : quantized_(document.uses("KHR_mesh_quantization")),
        accessors_(accessors),
        primitive_(primitive),
        attributes_(primitive.member("attributes")),
        compressed_(primitive.extension("KHR_draco_mesh_compression")) {
    if (compressed_.exists()) draco_.emplace(compressed_, buffers.view(compressed_.member("bufferView")).bytes);
  }

  GltfPrimitive read(const GltfNeeds& needs) {
    GltfPrimitive out;
    const std::vector<float> positions = attribute(kPosition, 0);
    if (positions.empty()) return out;
    const std::size_t count = positions.size() / 3;
    const std::vector<float> normals = attribute(kNormal, count);
    std::vector<float> tangents;
    if (needs.tangents && !normals.empty()) tangents = attribute(kTangent, count);
    std::array<std::vector<float>, 2> texcoords;
    texcoords[0] = attribute(kTexcoords[0], count);
    if (needs.second_texcoords) texcoords[1] = attribute(kTexcoords[1], count);
    const std::vector<float> colors = attribute(kColor, count);
    const std::size_t color_components = colors.size() / count;
    out.vertices.resize(count);
    for (std::size_t v = 0; v < count; ++v) {
      Corner& vertex = out.vertices[v];
      vertex.position_m = Eigen::Map<const Eigen::Vector3f>(&positions[3 * v]);
      if (!normals.empty()) vertex.normal = Eigen::Map<const Eigen::Vector3f>(&normals[3 * v]);
      for (std::size_t set = 0; set < 2; ++set) {
        if (texcoords[set].empty()) continue;
        vertex.texcoords[set] = Eigen::Map<const Eigen::Vector2f>(&texcoords[set][2 * v]);
      }
      if (!colors.empty()) vertex.color = Eigen::Map<const Eigen::Vector3f>(&colors[color_components * v]);
      if (tangents.empty()) continue;
      vertex.tangent = Eigen::Map<const Eigen::Vector3f>(&tangents[4 * v]);
      vertex.handedness = tangents[4 * v + 3] < 0 ? -1.0f : 1.0f;
    }
    out.indices = triangles(count);
    if (needs.rig) {
      read_influences(count, &out);
      read_targets(count, &out);
    }
    return out;
  }

 private:
  void read_influences(std::size_t count, GltfPrimitive* out) {
    std::vector<std::vector<float>> joints, weights;  // by set
    for (;;) {
      const std::string set = std::to_string(joints.size()), joint = "JOINTS_" + set, weight = "WEIGHTS_" + set;
      const GltfValue has_joints = attributes_.member(joint), has_weights = attributes_.member(weight);
      if (!has_joints.exists() && !has_weights.exists()) break;
      if (!has_joints.exists()) has_joints.refuse("as many sets as of weights");
      if (!has_weights.exists()) has_weights.refuse("as many sets as of joints");
      joints.push_back(attribute({joint.c_str(), 4, 4, kUnsigned, 0, 0, 0}, count));
      weights.push_back(attribute({weight.c_str(), 4, 4, kGltfFloat, kUnsigned, 0, 0}, count));
    }
    out->influences = 4 * joints.size();
    for (std::size_t v = 0; v < count; ++v) {
      const auto first = static_cast<std::ptrdiff_t>(4 * v);
      for (std::size_t set = 0; set < joints.size(); ++set) {
        out->joints.insert(out->joints.end(), joints[set].begin() + first, joints[set].begin() + first + 4);
        out->weights.insert(out->weights.end(), weights[set].begin() + first, weights[set].begin() + first + 4);
      }
    }
  }

  void read_targets(std::size_t count, GltfPrimitive* out) {
    const GltfValue targets = primitive_.member("targets");
    for (std::size_t i = 0; i < targets.size(); ++i) {
      GltfPrimitive::Target& target = out->targets.emplace_back();
      const std::array values{&target.positions_m, &target.normals, &target.tangents};
      for (std::size_t k = 0; k < values.size(); ++k) {
        const GltfValue reference = targets[i].member(kTargets[k].name);
        if (!reference.exists()) continue;
        check(kTargets[k], reference, checked_count(reference, count));
        *values[k] = accessors_.floats(reference);
        const auto bad = std::ranges::find_if(
            *values[k], [](float x) { return !(std::abs(x) <= static_cast<float>(kGltf.max_length)); });
        if (bad != values[k]->end())
          reference.fail("found " + std::to_string(*bad) + ", allowed: finite numbers, at most 1e9 from 0");
      }
    }
  }

  GltfAccessorFormat checked_count(const GltfValue& reference, std::size_t count) const {
    const GltfAccessorFormat format = accessors_.format(reference);
    if (count > 0 && format.count != count) {
      reference.fail("found " + std::to_string(format.count) + " elements, allowed: " + std::to_string(count) +
                     ", as of POSITION");
    }
    return format;
  }

  /// Empty if the primitive has none. `count`: the number of vertices, 0 if it is not known yet.
  std::vector<float> attribute(const AttributeRule& rule, std::size_t count) {
    const GltfValue reference = attributes_.member(rule.name);
    if (!reference.exists()) return {};
    check(rule, reference, accessors_.format(reference));
    const GltfAccessorFormat format = checked_count(reference, count);
    const GltfValue id = compressed_.member("attributes").member(rule.name);
    if (!draco_ || !id.exists()) return accessors_.floats(reference);
    if (format.count != draco_->vertices()) {
      reference.fail("found " + std::to_string(format.count) +
                     " elements, allowed: " + std::to_string(draco_->vertices()) + ", as of the compressed mesh");
    }
    accessors_.charge(id, format.count);
    return draco_->floats(id, format);
  }

  void check(const AttributeRule& rule, const GltfValue& reference, const GltfAccessorFormat& format) const {
    const unsigned plain = rule.plain | (quantized_ ? rule.quantized_plain : 0),
                   normalized = rule.normalized | (quantized_ ? rule.quantized_normalized : 0);
    if (!((format.normalized && format.type != kGltfFloat ? normalized : plain) & format.type)) {
      reference.fail("found " + GltfAccessors::name_of(format.type, format.normalized) + ", allowed: " +
                     types_of(plain, normalized) + (quantized_ ? "" : " (others with KHR_mesh_quantization)"));
    }
    if (format.components < rule.min_components || format.components > rule.max_components) {
      reference.fail("found " + std::to_string(format.components) +
                     " components, allowed: " + std::to_string(rule.min_components) +
                     (rule.max_components > rule.min_components ? " or " + std::to_string(rule.max_components) : ""));
    }
  }

  std::vector<std::uint32_t> triangles(std::size_t count) {
    const GltfValue reference = primitive_.member("indices");
    std::vector<std::uint32_t> indices;
    if (draco_) {
      indices = draco_->triangles();
    } else if (reference.exists()) {
      indices = accessors_.indices(reference);
    } else {
      indices.resize(count);
      std::iota(indices.begin(), indices.end(), 0u);
    }
    const auto largest = std::max_element(indices.begin(), indices.end());
    if (largest != indices.end() && *largest >= count) {
      reference.fail("found index " + std::to_string(*largest) + ", allowed: less than the " + std::to_string(count) +
                     " vertices");
    }
    const Mode mode = draco_ ? kTriangles : mode_of(primitive_);
    if (mode == kTriangles) {
      if (indices.size() % 3 != 0) {
        reference.fail("found " + std::to_string(indices.size()) + " indices, allowed: a multiple of 3");
      }
      return indices;
    }
    return mode == kStrip ? of_strip(indices) : of_fan(indices);
  }

  // In the order of the specification, 3.7.2.1.
  static std::vector<std::uint32_t> of_strip(const std::vector<std::uint32_t>& v) {
    std::vector<std::uint32_t> out;
    for (std::size_t i = 0; i + 2 < v.size(); ++i) out.insert(out.end(), {v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]});
    return out;
  }
  static std::vector<std::uint32_t> of_fan(const std::vector<std::uint32_t>& v) {
    std::vector<std::uint32_t> out;
    for (std::size_t i = 0; i + 2 < v.size(); ++i) out.insert(out.end(), {v[i + 1], v[i + 2], v[0]});
    return out;
  }

  bool quantized_;
  GltfAccessors& accessors_;
  const GltfValue& primitive_;
  GltfValue attributes_, compressed_;
  std::optional<DracoMesh> draco_;
};

}  // namespace

bool has_triangles(const GltfValue& primitive) { return mode_of(primitive) >= kTriangles; }

GltfPrimitive read_primitive(const GltfDocument& document, GltfBuffers& buffers, GltfAccessors& accessors,
                             const GltfValue& primitive, const GltfNeeds& needs) {
  return Reader(document, buffers, accessors, primitive).read(needs);
}

}  // namespace lumigraft::relight
