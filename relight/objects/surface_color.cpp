#include "relight/objects/surface_color.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "capture/camera/srgb.h"

namespace lumigraft::relight {
namespace {

float linear(std::uint8_t code) { return capture::srgb_table().linear[code]; }
float linear(float value) { return value; }

// Half the size: each texel is the area-weighted mean of those it covers, also at odd sizes.
template <typename T>
capture::Image<float> halved(const capture::Image<T>& from) {
  capture::Image<float> to(std::max(1, from.width / 2), std::max(1, from.height / 2), 3);
  for (int y = 0; y < to.height; ++y) {
    const int y0 = y * from.height / to.height, y1 = (y + 1) * from.height / to.height;
    for (int x = 0; x < to.width; ++x) {
      const int x0 = x * from.width / to.width, x1 = (x + 1) * from.width / to.width;
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        for (int v = y0; v < y1; ++v) {
          for (int u = x0; u < x1; ++u) sum += linear(from.at(u, v, c));
        }
        to.at(x, y, c) = sum / static_cast<float>((y1 - y0) * (x1 - x0));
      }
    }
  }
  return to;
}

template <typename T>
Eigen::Vector3f bilinear(const capture::Image<T>& image, const Eigen::Vector2f& uv) {
  const float x = (uv.x() - std::floor(uv.x())) * static_cast<float>(image.width) - 0.5f;
  const float y = (uv.y() - std::floor(uv.y())) * static_cast<float>(image.height) - 0.5f;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const int u = (x0 + dx + image.width) % image.width, v = (y0 + dy + image.height) % image.height;
      const float weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
      for (int c = 0; c < 3; ++c) sum[c] += weight * linear(image.at(u, v, c));
    }
  }
  return sum;
}

}  // namespace

Eigen::Vector3f texel(const capture::Image<std::uint8_t>& texture, const Eigen::Vector2f& uv) {
  return bilinear(texture, uv);
}

ObjectColor::ObjectColor(const Model& model) : model_(model), part_of_triangle_(model.indices.size() / 3, 0) {
  for (std::uint32_t p = 0; p < model.parts.size(); ++p) {
    const Model::Part& part = model.parts[p];
    const auto first = part_of_triangle_.begin() + part.first_index / 3;
    std::fill(first, first + part.index_count / 3, p);
    const Picture* texture = part.base_color_texture.get();
    if (!texture || pyramids_.count(texture) != 0) continue;
    Pyramid& pyramid = pyramids_[texture];
    pyramid.push_back(halved(*texture));
    while (pyramid.back().width > 1 || pyramid.back().height > 1) pyramid.push_back(halved(pyramid.back()));
  }
}

Eigen::Vector3f ObjectColor::at(std::uint32_t triangle, const Eigen::Vector3f& barycentric, float footprint_m) const {
  const Model::Part& part = model_.parts[part_of_triangle_[triangle]];
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
  for (int k = 0; k < 3; ++k) color += barycentric[k] * model_.colors[model_.indices[3 * std::size_t{triangle} + k]];
  color = color.cwiseProduct(part.material.base_color);
  if (part.base_color_texture) {
    color = color.cwiseProduct(texture_at(*part.base_color_texture, triangle, barycentric, footprint_m));
  }
  return color;
}

Eigen::Vector3f ObjectColor::texture_at(const Picture& texture, std::uint32_t triangle,
                                        const Eigen::Vector3f& barycentric, float footprint_m) const {
  std::array<Eigen::Vector3f, 3> p;
  std::array<Eigen::Vector2f, 3> t;
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t vertex = model_.indices[3 * std::size_t{triangle} + k];
    p[k] = model_.positions_m[vertex];
    t[k] = model_.texcoords[vertex];
    uv += barycentric[k] * t[k];
  }
  const Eigen::Vector2f t1 = t[1] - t[0], t2 = t[2] - t[0];
  const float texels = std::abs(t1.x() * t2.y() - t1.y() * t2.x()) * static_cast<float>(texture.width) *
                       static_cast<float>(texture.height);
  const float area_m2 = (p[1] - p[0]).cross(p[2] - p[0]).norm();  // both are twice the triangle's
  const float texels_across = footprint_m * std::sqrt(texels / std::max(area_m2, 1e-30f));
  const Pyramid& pyramid = pyramids_.at(&texture);
  const int level = static_cast<int>(std::lround(std::log2(std::max(texels_across, 1.0f))));
  if (level == 0) return texel(texture, uv);
  return bilinear(pyramid[std::min<std::size_t>(level, pyramid.size()) - 1], uv);
}

}  // namespace lumigraft::relight
