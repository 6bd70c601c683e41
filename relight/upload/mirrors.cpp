#include "relight/upload/mirrors.h"

#include <algorithm>
#include <cmath>

#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

float towards(const shader::Lamp& lamp, const Vector3f& w) {
  return lamp.facing.w() > 0 ? lamp.facing.w() * std::max(lamp.facing.head<3>().dot(w), 0.0f) : 1.0f;
}

}  // namespace

Mirrors::Mirrors(gpu::Device& device)
    : outlines_(device.create_texture({.name = "outlines of mirrors",
                                       .width = shader::kOutline,
                                       .height = shader::kOutline * shader::kMaxMirrors,
                                       .format = gpu::Format::r8_unorm})) {}

void Mirrors::add(gpu::Device& device, const Model& model, const capture::RealSurface& surface, int number) {
  const float metallic = surface.metallic;
  for (FlatPiece& flat : flat_pieces(model)) {
    Piece piece;
    piece.flat = std::move(flat);
    piece.surface = number;
    piece.f0 = Vector3f::Constant((1 - metallic) * 0.04f * surface.specular) + metallic * surface.base_color;
    piece.f90.setConstant((1 - metallic) * surface.specular + metallic);
    piece.alpha = surface.roughness * surface.roughness;
    if (piece.f0.maxCoeff() > 0 || piece.f90.maxCoeff() > 0) pieces_.push_back(std::move(piece));
  }
  std::stable_sort(pieces_.begin(), pieces_.end(),
                   [](const Piece& a, const Piece& b) { return a.flat.area_m2 > b.flat.area_m2; });
  if (pieces_.size() > shader::kMaxMirrors) pieces_.resize(shader::kMaxMirrors);
  constexpr std::size_t kTexels = std::size_t{shader::kOutline} * shader::kOutline;
  std::vector<std::uint8_t> texels(kTexels * shader::kMaxMirrors, 0);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    std::copy(pieces_[i].flat.outline.begin(), pieces_[i].flat.outline.end(),
              texels.begin() + static_cast<std::ptrdiff_t>(i * kTexels));
  }
  device.upload(*outlines_, 0, std::as_bytes(std::span(texels)));
}

void Mirrors::describe(shader::FrameParams& params) const {
  const Vector3f middle = params.sphere.head<3>();
  const float radius = params.sphere.w();
  struct Image {
    int lamp, mirror;
    float brings;
  };
  std::vector<Image> images;
  float direct = 0;
  for (int l = 0; l < params.counts.x(); ++l) {
    const shader::Lamp& lamp = params.lamps[l];
    const Vector3f from = lamp.position_radius.head<3>(), to = middle - from;
    const float far = std::max(to.norm(), radius);
    direct += lamp.intensity.head<3>().maxCoeff() * towards(lamp, to.normalized()) / (far * far);
  }
  params.mirror_counts.setZero();
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const FlatPiece& flat = pieces_[i].flat;
    const float side = flat.two_sided && flat.normal.dot(middle) < flat.offset_m ? -1.0f : 1.0f;
    const Vector3f n = side * flat.normal;
    const float offset = side * flat.offset_m;
    shader::Mirror& mirror = params.mirrors[i];
    mirror.plane << n, offset;
    mirror.centre << flat.centre_m, static_cast<float>(pieces_[i].surface);
    mirror.along << flat.half_along_m / flat.half_along_m.squaredNorm(), 0;
    mirror.across << flat.half_across_m / flat.half_across_m.squaredNorm(), 0;
    ++params.mirror_counts.x();

    // Approximate light that reaches the objects' centre by way of this piece.
    const float height = n.dot(middle) - offset;
    if (height < -radius) continue;
    for (int l = 0; l < params.counts.x(); ++l) {
      const shader::Lamp& lamp = params.lamps[l];
      const Vector3f from = lamp.position_radius.head<3>();
      const float lamp_height = n.dot(from) - offset, reach = std::max(height, 0.1f * radius);
      if (lamp_height <= 0) continue;
      const Vector3f image = from - 2 * lamp_height * n, way = image - middle;
      const Vector3f at = middle + way * (reach / (reach + lamp_height));
      const float cosine = lamp_height / std::max((from - at).norm(), 1e-6f);
      // Outside the outline only the lobe's tail contributes; its half width on the piece follows from that of its
      // slopes.
      const float to_lamp = (from - at).norm(), to_object = (middle - at).norm();
      const float wide = 2 * pieces_[i].alpha / (1 / to_lamp + 1 / std::max(to_object, 0.1f * radius)) + radius;
      const Vector3f off = at - flat.centre_m;
      const float beyond =
          std::hypot(std::max(std::abs(off.dot(flat.half_along_m.normalized())) - flat.half_along_m.norm(), 0.0f),
                     std::max(std::abs(off.dot(flat.half_across_m.normalized())) - flat.half_across_m.norm(), 0.0f));
      const float flank = std::pow(1 + (beyond / wide) * (beyond / wide), -2.0f);
      const Vector3f f = pieces_[i].f0 + (pieces_[i].f90 - pieces_[i].f0) * std::pow(1 - cosine, 5.0f);
      const float brings = f.cwiseProduct(lamp.intensity.head<3>()).maxCoeff() *
                           towards(lamp, (at - from).normalized()) * flank / way.squaredNorm();
      if (brings > 0) images.push_back({l, static_cast<int>(i), brings});
    }
  }
  std::stable_sort(images.begin(), images.end(), [](const Image& a, const Image& b) { return a.brings > b.brings; });
  for (const Image& image : images) {
    int& count = params.mirror_counts.y();
    if (count == shader::kMaxImages || image.brings < kUpload.min_image * direct) break;
    params.images[count / 4][count % 4] = image.lamp + shader::kMaxLamps * image.mirror;
    ++count;
  }
}

}  // namespace lumigraft::relight
