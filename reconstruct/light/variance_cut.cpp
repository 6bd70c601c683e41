#include "reconstruct/light/variance_cut.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

namespace lumigraft::reconstruct {
namespace {

/// Moments of the energy's distribution over directions.
struct Moments {
  double weight = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  double second = 0;

  void add(const Eigen::Vector3f& direction, double w) {
    weight += w;
    first += w * direction.cast<double>();
    second += w * direction.squaredNorm();
  }
  /// Σ w |direction - mean|²
  double variance() const { return weight > 0 ? std::max(0.0, second - first.squaredNorm() / weight) : 0; }
};

double weight_of(const PixelEnergy& p) { return p.energy.mean(); }

Moments moments(const std::vector<PixelEnergy>& part, const FisheyeView& view) {
  Moments m;
  for (const PixelEnergy& p : part) m.add(view.direction[p.pixel], weight_of(p));
  return m;
}

Eigen::Vector3f principal_axis(const std::vector<PixelEnergy>& part, const FisheyeView& view) {
  const Moments m = moments(part, view);
  const Eigen::Vector3d mean = m.first / m.weight;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const PixelEnergy& p : part) {
    const Eigen::Vector3d d = view.direction[p.pixel].cast<double>() - mean;
    spread += weight_of(p) * d * d.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2).cast<float>();
}

/// Sorts the part along its principal axis; returns the number of pixels before the best cut, 0 if none is better.
std::size_t best_cut(std::vector<PixelEnergy>& part, const FisheyeView& view) {
  const Eigen::Vector3f axis = principal_axis(part, view);
  std::sort(part.begin(), part.end(), [&](const PixelEnergy& a, const PixelEnergy& b) {
    const float da = axis.dot(view.direction[a.pixel]), db = axis.dot(view.direction[b.pixel]);
    return da != db ? da < db : a.pixel < b.pixel;
  });
  const Moments total = moments(part, view);
  Moments low;
  double smallest = total.variance();
  std::size_t cut = 0;
  for (std::size_t i = 0; i + 1 < part.size(); ++i) {
    low.add(view.direction[part[i].pixel], weight_of(part[i]));
    Moments high{
        .weight = total.weight - low.weight, .first = total.first - low.first, .second = total.second - low.second};
    const double sum = low.variance() + high.variance();
    if (sum < smallest) {
      smallest = sum;
      cut = i + 1;
    }
  }
  return cut;
}

}  // namespace

std::vector<std::vector<PixelEnergy>> variance_cut(std::vector<PixelEnergy> pixels, const FisheyeView& view,
                                                   int parts) {
  std::vector<std::vector<PixelEnergy>> result;
  result.push_back(std::move(pixels));
  while (static_cast<int>(result.size()) < parts) {
    const auto widest = std::max_element(result.begin(), result.end(), [&](const auto& a, const auto& b) {
      return moments(a, view).variance() < moments(b, view).variance();
    });
    const std::size_t cut = best_cut(*widest, view);
    if (cut == 0) break;
    std::vector<PixelEnergy> high(widest->begin() + static_cast<std::ptrdiff_t>(cut), widest->end());
    widest->resize(cut);
    result.push_back(std::move(high));
  }
  return result;
}

}  // namespace lumigraft::reconstruct
