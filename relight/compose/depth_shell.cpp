#include "relight/compose/depth_shell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "relight/compose/parameters.h"
#include "relight/compose/rgb_image.h"
#include "relight/tracing/enclosure_mesh.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr std::array<std::array<int, 2>, 4> kAxes = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

class Shell {
 public:
  Shell(const PixelRays& rays, const Eigen::Isometry3f& T_tag_camera, const CurrentDepth& depth, const cv::Rect& part,
        const capture::Image<float>& behind_m, const capture::Image<float>* color, int max_vertices)
      : rays_(rays),
        T_tag_camera_(T_tag_camera),
        depth_(depth),
        part_(part),
        color_(color),
        pixel_rad_((rays.at(part.x, part.y, {1, 0.5f}) - rays.at(part.x, part.y, {0, 0.5f})).norm()),
        step_(std::max(static_cast<int>(std::ceil(std::sqrt(static_cast<double>(part.area()) / max_vertices))), 1)),
        columns_((part.width - 1) / step_ + 1),
        rows_((part.height - 1) / step_ + 1) {
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        const int u = part.x + x * step_, v = part.y + y * step_;
        far_m_.push_back(depth.at(u, v));
        behind_m_.push_back(far_m_.back() > 0 ? behind_m.at(u, v) : 0);
        cosine_.push_back(rays.at(u, v).z());
      }
    }
    fill_holes();
    find_thickness();
  }

  std::shared_ptr<const Model> triangles() const {
    auto model = std::make_shared<Model>();
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        if (far_m_[at(x, y)] > 0) add(x, y, *model);
      }
    }
    if (model->indices.empty()) return nullptr;
    model->texcoords.assign(model->positions_m.size(), Eigen::Vector2f::Zero());
    add_part_of_vertex_colors(*model);
    return model;
  }

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
  }
  bool inside(int x, int y) const { return x >= 0 && y >= 0 && x < columns_ && y < rows_; }
  static bool same_surface(float a_m, float b_m) {
    return std::abs(a_m - b_m) <= kCompose.moved_jump * std::min(a_m, b_m);
  }

  /// Depth cameras leave out single pixels: most neighbours are of one surface, which continues there.
  void fill_holes() {
    const std::vector<float> measured = far_m_;
    for (int y = 1; y + 1 < rows_; ++y) {
      for (int x = 1; x + 1 < columns_; ++x) {
        if (measured[at(x, y)] > 0) continue;
        float nearest_m = 0;
        for (int k = 0; k < 9; ++k) {
          const float m = measured[at(x + k % 3 - 1, y + k / 3 - 1)];
          if (m > 0 && (nearest_m == 0 || m < nearest_m)) nearest_m = m;
        }
        float sum_m = 0, behind_m = 0;
        int alike = 0;
        for (int k = 0; k < 9; ++k) {
          const std::size_t i = at(x + k % 3 - 1, y + k / 3 - 1);
          if (!(measured[i] > 0) || !same_surface(measured[i], nearest_m)) continue;
          sum_m += measured[i];
          behind_m = std::max(behind_m, behind_m_[i]);
          ++alike;
        }
        if (alike < 5) continue;
        far_m_[at(x, y)] = sum_m / static_cast<float>(alike);
        behind_m_[at(x, y)] = behind_m;
      }
    }
  }

  /// Whether a vertex is at the moved surface's outline: its neighbour is farther, or unknown, or has not moved.
  bool ends(int x, int y, const std::array<int, 2>& axis) const {
    const float own_m = far_m_[at(x, y)];
    for (int k = 1; k <= kCompose.shell_hole; ++k) {
      const int i = x + k * axis[0], j = y + k * axis[1];
      if (!inside(i, j)) return false;  // the image ends, not the surface
      const float m = far_m_[at(i, j)];
      if (!(m > 0)) continue;
      return same_surface(own_m, m) ? !(behind_m_[at(i, j)] > 0) : m > own_m;
    }
    return true;
  }

  /// Depth of the outline's plane at a vertex of the outline; nothing inside. A round surface has the depth
  /// z - c √d at the distance d from its outline: that of this vertex is half a pixel, of the next one inside 1.5.
  /// Hands are flatter.
  std::optional<float> outline_m(int x, int y) const {
    const float own_m = far_m_[at(x, y)];
    bool any = false;
    float rise_m = 0;
    int count = 0;
    for (const auto& axis : kAxes) {
      if (!ends(x, y, axis)) continue;
      any = true;
      const int i = x - axis[0], j = y - axis[1];
      if (!inside(i, j) || !(far_m_[at(i, j)] > 0) || !same_surface(own_m, far_m_[at(i, j)])) continue;
      rise_m += own_m - far_m_[at(i, j)];
      ++count;
    }
    if (!any) return std::nullopt;
    if (count == 0) return own_m;
    const float pixel_m = own_m * pixel_rad_ * static_cast<float>(step_);
    const float bounded_m =
        std::clamp(rise_m / static_cast<float>(count), -kCompose.shell_slope * pixel_m, kCompose.shell_slope * pixel_m);
    static const float kToOutline = std::sqrt(0.5f) / (std::sqrt(1.5f) - std::sqrt(0.5f));
    return own_m + kCompose.shell_round * kToOutline * bounded_m;
  }

  void find_thickness() {
    thickness_m_.assign(far_m_.size(), 0.0f);
    std::vector<std::array<int, 2>> within;  // moved, and not the outline
    // Inverse depth along the camera's axis: that of a plane is linear in the image.
    std::vector<float> plane(far_m_.size(), 0.0f);
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        if (!(behind_m_[at(x, y)] > 0)) continue;
        if (const auto outline = outline_m(x, y)) {
          plane[at(x, y)] = 1 / (*outline * cosine_[at(x, y)]);
        } else {
          within.push_back({x, y});
        }
      }
    }
    // Successive over-relaxation (Young 1954), forwards and backwards, so that values spread at once.
    for (int round = 0; round < kCompose.shell_rounds; ++round) {
      float change_m = 0;
      for (std::size_t k = 0; k < within.size(); ++k) {
        const auto [x, y] = within[round % 2 == 0 ? k : within.size() - 1 - k];
        float sum = 0;
        int count = 0;
        for (const auto& [dx, dy] : kAxes) {
          if (!inside(x + dx, y + dy)) continue;
          const std::size_t i = at(x + dx, y + dy);
          if (!(plane[i] > 0) || !same_surface(far_m_[i], far_m_[at(x, y)])) continue;
          sum += plane[i];
          ++count;
        }
        if (count == 0) continue;
        float& own = plane[at(x, y)];
        const float mean = sum / static_cast<float>(count), next = own > 0 ? own + 1.8f * (mean - own) : mean;
        change_m = std::max(change_m, std::abs(next - own) / (next * next));
        own = next;
      }
      if (change_m < kCompose.shell_settled_m) break;
    }
    for (std::size_t i = 0; i < far_m_.size(); ++i) {
      if (plane[i] > 0) thickness_m_[i] = std::max(2 * (1 / (plane[i] * cosine_[i]) - far_m_[i]), 0.0f);
    }
  }

  /// A vertex's square of the image, and its back.
  void add(int x, int y, Model& model) const {
    const std::size_t own = at(x, y);
    const auto first = static_cast<std::uint32_t>(model.positions_m.size());
    const bool has_back = behind_m_[own] > 0;
    std::array<Vector3f, 4> back;
    for (int corner = 0; corner < 4; ++corner) {
      const int right = corner % 2, below = corner / 2;
      float sum_m = 0, sum_back_m = 0;
      int count = 0;
      for (int k = 0; k < 4; ++k) {
        const int i = x + right - k % 2, j = y + below - k / 2;
        if (!inside(i, j)) continue;
        const float m = far_m_[at(i, j)];
        if (!(m > 0) || !same_surface(m, far_m_[own])) continue;
        sum_m += m;
        sum_back_m += thickness_m_[at(i, j)];
        ++count;
      }
      const float front_m = sum_m / static_cast<float>(count);
      const float pushed_m = front_m + (has_back ? depth_.noise_m(front_m) : depth_.allowed_m(front_m));
      const float back_m = std::min(front_m + sum_back_m / static_cast<float>(count), behind_m_[own]);
      const Vector3f w = T_tag_camera_.linear() * corner_ray(x, y, right, below);
      model.positions_m.push_back(T_tag_camera_.translation() + pushed_m * w);
      back[static_cast<std::size_t>(corner)] = T_tag_camera_.translation() + std::max(back_m, pushed_m) * w;
    }
    add_square(x, y, first, model);
    if (!has_back || back[0] == model.positions_m[first]) return;
    model.positions_m.insert(model.positions_m.end(), back.begin(), back.end());
    add_square(x, y, first + 4, model);
  }
  /// Of the four last corners.
  void add_square(int x, int y, std::uint32_t first, Model& model) const {
    const Vector3f* corner = &model.positions_m[first];
    const Vector3f normal = (corner[3] - corner[0]).cross(corner[1] - corner[2]).stableNormalized();
    Vector3f color = Vector3f::Ones();
    if (color_) color = radiance_at(*color_, color_->index(part_.x + x * step_, part_.y + y * step_) / 3).matrix();
    model.normals.insert(model.normals.end(), 4, normal);
    model.colors.insert(model.colors.end(), 4, color);
    model.indices.insert(model.indices.end(), {first, first + 1, first + 2, first + 1, first + 3, first + 2});
  }

  /// Through the middle between a vertex's pixel and the next ones.
  Vector3f corner_ray(int x, int y, int right, int below) const {
    const float off = 0.5f * static_cast<float>(step_);
    const float u = static_cast<float>(x * step_) + 0.5f + off * static_cast<float>(2 * right - 1);
    const float v = static_cast<float>(y * step_) + 0.5f + off * static_cast<float>(2 * below - 1);
    const int column = std::clamp(static_cast<int>(std::floor(u)), 0, part_.width - 1),
              row = std::clamp(static_cast<int>(std::floor(v)), 0, part_.height - 1);
    return rays_.at(part_.x + column, part_.y + row, {u - static_cast<float>(column), v - static_cast<float>(row)});
  }

  const PixelRays& rays_;
  Eigen::Isometry3f T_tag_camera_;
  const CurrentDepth& depth_;
  cv::Rect part_;
  const capture::Image<float>* color_;
  float pixel_rad_;
  int step_, columns_, rows_;
  /// By vertex of the grid; cosine: of the ray to the camera's axis.
  std::vector<float> far_m_, behind_m_, cosine_, thickness_m_;
};

}  // namespace

std::shared_ptr<const Model> depth_shell(const PixelRays& rays, const Eigen::Isometry3f& T_tag_camera,
                                         const CurrentDepth& depth, const cv::Rect& part,
                                         const capture::Image<float>& behind_m, const capture::Image<float>* color,
                                         int max_vertices) {
  if (part.empty()) return nullptr;
  return Shell(rays, T_tag_camera, depth, part, behind_m, color, max_vertices).triangles();
}

}  // namespace lumigraft::relight
