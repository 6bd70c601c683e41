#include "relight/exhibit/model_corners.h"

#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "relight/exhibit/parameters.h"

namespace lumigraft::relight {
namespace {

constexpr float crease_cosine = 0.5f;  // 60°

float angle_between(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// -0 becomes 0.
template <typename Vector>
Vector without_minus_zero(const Vector& v) {
  return v.array() + 0.0f;
}

Eigen::Vector3f unit_or_zero(const Eigen::Vector3f& v) {
  const float length = v.stableNorm();
  if (!(std::isfinite(length) && length > 0)) return Eigen::Vector3f::Zero();
  return without_minus_zero<Eigen::Vector3f>(v / length);
}

bool finite(const Corner& corner) {
  if (!corner.position_m.allFinite() || !corner.color.allFinite()) return false;
  const auto resolved = [](const Eigen::Vector2f& texcoord) {
    return texcoord.cwiseAbs().maxCoeff() < kExhibit.max_texcoord;
  };
  return resolved(corner.texcoords[0]) && resolved(corner.texcoords[1]);
}

}  // namespace

bool is_usable(const Corner& a, const Corner& b, const Corner& c) {
  if (!finite(a) || !finite(b) || !finite(c)) return false;
  const Eigen::Vector3d ab = (b.position_m - a.position_m).cast<double>();
  const Eigen::Vector3d ac = (c.position_m - a.position_m).cast<double>();
  const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  return ab.cross(ac).norm() > 1e-9 * longest;
}

CornerTransform::CornerTransform(const Eigen::Affine3f& T_model_mesh) : T_model_mesh_(T_model_mesh) {
  const Eigen::Matrix3f m = T_model_mesh.linear();
  normal_matrix_ << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
  mirrors_ = m.determinant() < 0;
  if (mirrors_) normal_matrix_ = -normal_matrix_;
}

Corner CornerTransform::operator()(const Corner& from) const {
  Corner to = from;
  to.position_m = without_minus_zero<Eigen::Vector3f>(T_model_mesh_ * from.position_m);
  to.normal = unit_or_zero(normal_matrix_ * from.normal);
  for (Eigen::Vector2f& texcoord : to.texcoords) texcoord = without_minus_zero(texcoord);
  to.tangent = unit_or_zero(T_model_mesh_.linear() * from.tangent);
  to.handedness = to.tangent.isZero(0.0f) ? 0.0f : mirrors_ ? -from.handedness : from.handedness;
  return to;
}

void fill_missing_normals(std::span<Corner> corners) {
  const std::size_t count = corners.size();
  if (std::none_of(corners.begin(), corners.end(), [](const Corner& c) { return c.normal.isZero(0.0f); })) return;

  // Corners by position, as lists: those of position v are at[first[v]] ... at[first[v + 1] - 1].
  std::vector<Eigen::Vector3f> positions(count);
  std::transform(corners.begin(), corners.end(), positions.begin(), [](const Corner& c) { return c.position_m; });
  std::vector<std::uint32_t> place(count);
  const std::size_t places =
      meshopt_generateVertexRemap(place.data(), nullptr, count, positions.data(), count, sizeof(Eigen::Vector3f));
  std::vector<std::uint32_t> first(places + 1, 0), at(count);
  for (std::uint32_t p : place) ++first[p + 1];
  for (std::size_t v = 0; v < places; ++v) first[v + 1] += first[v];
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t c = 0; c < count; ++c) at[next[place[c]]++] = c;

  std::vector<Eigen::Vector3f> face_normal(count / 3), weighted(count);
  for (std::size_t c = 0; c < count; c += 3) {
    const Eigen::Vector3f& p0 = positions[c];
    face_normal[c / 3] =
        (positions[c + 1] - p0).cast<double>().cross((positions[c + 2] - p0).cast<double>()).normalized().cast<float>();
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = positions[c + k];
      weighted[c + k] =
          face_normal[c / 3] * angle_between(positions[c + (k + 1) % 3] - p, positions[c + (k + 2) % 3] - p);
    }
  }

  for (std::size_t c = 0; c < count; ++c) {
    if (!corners[c].normal.isZero(0.0f)) continue;
    const Eigen::Vector3f& own = face_normal[c / 3];
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (std::uint32_t i = first[place[c]]; i < first[place[c] + 1]; ++i) {
      if (face_normal[at[i] / 3].dot(own) > crease_cosine) sum += weighted[at[i]];
    }
    const float length = sum.norm();
    corners[c].normal = length > 1e-12f ? Eigen::Vector3f(sum / length) : own;
  }
}

}  // namespace lumigraft::relight
