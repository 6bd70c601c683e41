#include "reconstruct/pose/print_equations.h"

#include <bit>
#include <cmath>

#include "reconstruct/math/simd8.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kLanes = 8, kBlocksInSinglePrecision = 64;
constexpr int kProducts = kPrintUnknowns * (kPrintUnknowns + 1) / 2;

[[gnu::always_inline]] inline Simd8 rounded_down8(Simd8 x) {
  const Simd8 toward_zero = __builtin_convertvector(__builtin_convertvector(x, Simd8Int), Simd8);
  return toward_zero - select(x < toward_zero, broadcast8(1), Simd8{});
}

[[gnu::always_inline]] inline int count_of(Simd8Int where) { return std::popcount(lane_mask(where)); }

[[gnu::always_inline]] inline Simd8Int mask8(const std::array<std::int32_t, 8>& bits) {
  Simd8Int mask;
  __builtin_memcpy(&mask, bits.data(), sizeof(mask));
  return mask;
}

/// Of lanes that are not `where` nothing remains, even if it is not finite.
[[gnu::always_inline]] inline Simd8 only(Simd8Int where, Simd8 x) { return select(where, x, Simd8{}); }

/// Means of the print over footprints.
struct FootprintMeans {
  Simd8 white, by_x, by_y, by_scale;  ///< and derivatives, as in PrintIntegral::Mean
  Simd8Int flat, large;               ///< inside one cell; over more than 2 × 2, where the others are not computed
};

struct Sums {
  Simd8 products[kProducts]{};  ///< lower half of JᵀJ, by rows
  Simd8 residuals[kPrintUnknowns]{};
  Simd8 error{};
};

}  // namespace

/// What the pixels of one view have in common. Everything is in the tag's frame.
struct PrintEquations::View {
  float along_x, along_y, along_1;  ///< cosine with the tag's normal times length, of a ray less the middle
  float x_x, x_y, x_1;              ///< the place on the tag over its height is (x_x, x_y, x_1) over that,
  float y_x, y_y, y_1;
  float turn[2][2];              ///< the rays' x and y in the tag's frame
  float slant_x, slant_y;        ///< of the ray to the tag's centre, metres across the tag per metre towards it
  float height_m;                ///< of the tag's plane over the camera
  float per_cell, per_half;      ///< 1/m
  float blur, wide, narrow;      ///< footprints
  float ink, paper, by_x, by_y;  ///< light
  float limit;
};

struct PrintEquations::Totals {
  double products[kProducts]{}, residuals[kPrintUnknowns]{}, error = 0;
  int used = 0, edges = 0, clipped_edges = 0;

  [[gnu::always_inline]] void take(Sums& sums) {
    const auto total = [](Simd8 x) { return static_cast<double>(sum_of(low_half(x) + high_half(x))); };
    for (int i = 0; i < kProducts; ++i) products[i] += total(sums.products[i]);
    for (int i = 0; i < kPrintUnknowns; ++i) residuals[i] += total(sums.residuals[i]);
    error += total(sums.error);
    sums = Sums();
  }
};

/// One evaluation of all pixels.
struct PrintEquations::Pass {
  const PrintEquations& equations;
  const View& view;
  Sums sums;
  Totals totals;

  FootprintMeans box(Simd8 x, Simd8 y, Simd8 width, Simd8 height) const;
  FootprintMeans means(Simd8 x, Simd8 y, Simd8 width, Simd8 height, Simd8Int valid) const;
  void add(const Block& block);
};

PrintEquations::PrintEquations(const std::vector<PixelSample>& pixels, const TagPattern& pattern, double size_m)
    : print_(pattern),
      cells_(static_cast<float>(pattern.cells)),
      cell_m_(size_m / pattern.square_cells),
      half_m_(size_m / 2) {
  const auto white = [&](int column, int row) { return pattern.white_at(column, row) ? 1.0f : 0.0f; };
  for (int row = -1; row < pattern.cells; ++row)
    for (int column = -1; column < pattern.cells; ++column)
      corners_.push_back(
          {white(column, row), white(column + 1, row), white(column, row + 1), white(column + 1, row + 1)});
  if (pixels.empty()) return;
  middle_ = pixels[pixels.size() / 2].ray;
  blocks_.resize((pixels.size() + kLanes - 1) / kLanes);
  for (std::size_t i = 0; i < blocks_.size() * kLanes; ++i) {
    const PixelSample& pixel = pixels[std::min(i, pixels.size() - 1)];
    Block& block = blocks_[i / kLanes];
    const std::size_t lane = i % kLanes;
    const Vector2d ray = pixel.ray - middle_;
    block.ray_x[lane] = static_cast<float>(ray.x());
    block.ray_y[lane] = static_cast<float>(ray.y());
    block.u_x[lane] = static_cast<float>(pixel.ray_by_u.x());
    block.u_y[lane] = static_cast<float>(pixel.ray_by_u.y());
    block.v_x[lane] = static_cast<float>(pixel.ray_by_v.x());
    block.v_y[lane] = static_cast<float>(pixel.ray_by_v.y());
    block.light[lane] = static_cast<float>(pixel.light);
    block.clipped[lane] = pixel.clipped ? -1 : 0;
    block.valid[lane] = i < pixels.size() ? -1 : 0;
  }
}

/// Means over boxes that cover at most 2 × 2 cells. Units are cells.
[[gnu::always_inline]] inline FootprintMeans PrintEquations::Pass::box(Simd8 x, Simd8 y, Simd8 width,
                                                                       Simd8 height) const {
  const float cells = equations.cells_;
  const Simd8 x0 = x - width / 2, y0 = y - height / 2, x1 = x0 + width, y1 = y0 + height;
  const Simd8 column = rounded_down8(x0), row = rounded_down8(y0);
  // Beyond the print its border continues.
  const Simd8 last = broadcast8(cells - 1), first = broadcast8(-1);
  const Simd8Int place = __builtin_convertvector(
      (max(min(row, last), first) + 1) * broadcast8(cells + 1) + (max(min(column, last), first) + 1), Simd8Int);
  const auto corner = [&](int lane) { return load(equations.corners_[static_cast<std::size_t>(place[lane])].data()); };
  Simd4 a0 = corner(0), a1 = corner(1), a2 = corner(2), a3 = corner(3);
  Simd4 b0 = corner(4), b1 = corner(5), b2 = corner(6), b3 = corner(7);
  transpose(a0, a1, a2, a3);
  transpose(b0, b1, b2, b3);
  const Simd8Int across = x1 >= column + 1, down = y1 >= row + 1;
  const Simd8 c00 = join(a0, b0), c10 = select(across, join(a1, b1), c00), c01 = select(down, join(a2, b2), c00);
  const Simd8 c11 = select(down, select(across, join(a3, b3), c01), c10);
  const Simd8 left = select(across, column + 1 - x0, width), right = width - left;
  const Simd8 top = select(down, row + 1 - y0, height), low = height - top;
  const Simd8 at_left = top * c00 + low * c01, at_right = top * c10 + low * c11;
  const Simd8 at_top = left * c00 + right * c10, at_low = left * c01 + right * c11;
  const Simd8 per_area = 1 / (width * height);
  FootprintMeans means;
  means.white = (left * at_left + right * at_right) * per_area;
  means.by_x = (at_right - at_left) * per_area;
  means.by_y = (at_low - at_top) * per_area;
  means.by_scale = (width * (at_left + at_right) + height * (at_top + at_low)) * (per_area / 2) - 2 * means.white;
  means.flat = ~(across | down);
  means.large = (x1 >= column + 2) | (y1 >= row + 2);
  return means;
}

/// As PrintIntegral::mean_of_two.
[[gnu::always_inline]] inline FootprintMeans PrintEquations::Pass::means(Simd8 x, Simd8 y, Simd8 width, Simd8 height,
                                                                         Simd8Int valid) const {
  FootprintMeans a = box(x, y, view.wide * width, view.wide * height);
  if (!any(~a.flat)) return a;
  const FootprintMeans b = box(x, y, view.narrow * width, view.narrow * height);
  a.white = (a.white + b.white) / 2;
  a.by_x = (a.by_x + b.by_x) / 2;
  a.by_y = (a.by_y + b.by_y) / 2;
  a.by_scale = (a.by_scale + b.by_scale) / 2;
  for (unsigned lanes = lane_mask(a.large & valid); lanes != 0; lanes &= lanes - 1) {
    const int lane = std::countr_zero(lanes);
    const PrintIntegral::Mean mean = equations.print_.mean_of_two(
        static_cast<double>(x[lane]), static_cast<double>(y[lane]), static_cast<double>(width[lane]),
        static_cast<double>(height[lane]), static_cast<double>(view.wide), static_cast<double>(view.narrow));
    a.white[lane] = static_cast<float>(mean.white);
    a.by_x[lane] = static_cast<float>(mean.by_centre.x());
    a.by_y[lane] = static_cast<float>(mean.by_centre.y());
    a.by_scale[lane] = static_cast<float>(mean.by_scale);
  }
  return a;
}

[[gnu::always_inline]] inline void PrintEquations::Pass::add(const Block& block) {
  const Simd8 ray_x = load8(block.ray_x.data()), ray_y = load8(block.ray_y.data());
  const Simd8 u_x = load8(block.u_x.data()), u_y = load8(block.u_y.data());
  const Simd8 v_x = load8(block.v_x.data()), v_y = load8(block.v_y.data());
  const Simd8Int valid = mask8(block.valid), clipped = mask8(block.clipped);
  const Simd8 per_along = 1 / (view.along_x * ray_x + view.along_y * ray_y + view.along_1);
  const Simd8 over_height_x = (view.x_x * ray_x + view.x_y * ray_y + view.x_1) * per_along;
  const Simd8 over_height_y = (view.y_x * ray_x + view.y_y * ray_y + view.y_1) * per_along;
  const Simd8 on_tag_x = view.height_m * over_height_x, on_tag_y = view.height_m * over_height_y;
  const Simd8 slant_x = over_height_x + view.slant_x, slant_y = over_height_y + view.slant_y;

  // The pixel's footprint as the axis-parallel box with the same second moments.
  const Simd8 by_normal_u = view.along_x * u_x + view.along_y * u_y;
  const Simd8 by_normal_v = view.along_x * v_x + view.along_y * v_y;
  const Simd8 ux = view.turn[0][0] * u_x + view.turn[0][1] * u_y - by_normal_u * slant_x;
  const Simd8 uy = view.turn[1][0] * u_x + view.turn[1][1] * u_y - by_normal_u * slant_y;
  const Simd8 vx = view.turn[0][0] * v_x + view.turn[0][1] * v_y - by_normal_v * slant_x;
  const Simd8 vy = view.turn[1][0] * v_x + view.turn[1][1] * v_y - by_normal_v * slant_y;
  const Simd8 scale = abs(view.height_m * view.per_cell * view.blur * per_along);
  const Simd8 width = scale * sqrt(ux * ux + vx * vx), height = scale * sqrt(uy * uy + vy * vy);

  const float middle = equations.cells_ / 2;
  const FootprintMeans mean =
      means(middle + on_tag_x * view.per_cell, middle - on_tag_y * view.per_cell, width, height, valid);
  const Simd8 x = on_tag_x * view.per_half, y = on_tag_y * view.per_half;
  const Simd8 contrast = view.paper + view.by_x * x + view.by_y * y - view.ink;
  const Simd8 residual = view.ink + contrast * mean.white - load8(block.light.data());
  const Simd8Int edge = (mean.white > 0.01f) & (mean.white < 0.99f) & valid;
  totals.edges += count_of(edge);
  totals.clipped_edges += count_of(edge & clipped);
  const Simd8Int used = valid & ~(clipped & (residual >= 0.0f));
  totals.used += count_of(used);
  const Simd8 size = abs(residual);
  const Simd8Int near = size <= view.limit;
  const Simd8 weight = only(used, select(near, broadcast8(1), view.limit / size));
  sums.error += only(used, select(near, residual * residual, view.limit * (2 * size - view.limit)));

  Simd8 j[kPrintUnknowns];
  j[6] = 1 - mean.white;
  j[7] = mean.white;
  j[8] = mean.white * x;
  j[9] = mean.white * y;
  int first = 6;
  if (any(~mean.flat)) {  // else no edge: the pixels do not depend on the pose
    first = 0;
    // Gradient per metre, y towards the tag's top. A translation s of the tag moves the observed point on the tag by
    // (n·s) slant - s; a rotation ω about its centre acts as the translation ω × arm.
    const float contrast_per_m = (view.paper - view.ink) * view.per_cell;
    const Simd8 gradient_x = contrast_per_m * mean.by_x, gradient_y = -contrast_per_m * mean.by_y;
    const Simd8 towards = gradient_x * slant_x + gradient_y * slant_y;
    j[0] = on_tag_y * towards;
    j[1] = -on_tag_x * towards;
    j[2] = on_tag_y * gradient_x - on_tag_x * gradient_y;
    j[3] = -gradient_x;
    j[4] = -gradient_y;
    j[5] = towards;
    j[10] = contrast * mean.by_scale / view.blur;
  }
  const int end = first == 0 ? kPrintUnknowns : 10;
  for (int row = first; row < end; ++row) {
    const Simd8 weighted = weight * j[row];
    Simd8* products = &sums.products[row * (row + 1) / 2];
    for (int column = first; column <= row; ++column) products[column] += weighted * j[column];
    sums.residuals[row] += weighted * residual;
  }
}

[[gnu::always_inline]] inline PrintEquations::Totals PrintEquations::sum_up(const View& view) const {
  Pass pass{*this, view, {}, {}};
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    pass.add(blocks_[i]);
    if (i % kBlocksInSinglePrecision == kBlocksInSinglePrecision - 1) pass.totals.take(pass.sums);
  }
  pass.totals.take(pass.sums);
  return pass.totals;
}

LUMIGRAFT_SIMD8_TARGET PrintEquations::Totals PrintEquations::sum_up_wide(const View& view) const {
  return sum_up(view);
}

PrintFit PrintEquations::linearise(const Isometry3d& pose, const PrintAppearance& appearance, double limit,
                                   double hold) const {
  const Eigen::Matrix3d to_tag = pose.linear().transpose();
  const Vector3d centre = to_tag * pose.translation(), middle = middle_.homogeneous();
  const Vector2d slant = centre.head<2>() / centre.z();
  const Vector3d along = to_tag.row(2), x = to_tag.row(0).transpose() - slant.x() * along,
                 y = to_tag.row(1).transpose() - slant.y() * along;
  // A footprint is the mean of two boxes whose squared sizes are larger and smaller by the fraction `spread`.
  // Together they have the second moment of one box, and the fourth moment of a box-shaped pixel blurred by a
  // Gaussian lens, whose excess is -1.2 / b⁴ for a blur of b pixels. A single box would make the dark sides of soft
  // edges too steep.
  const double spread = std::sqrt(2.0 / 3 * (1 - std::pow(std::max(appearance.blur, 1.0), -4)));
  const auto f = [](double value) { return static_cast<float>(value); };
  const View view{.along_x = f(along.x()),
                  .along_y = f(along.y()),
                  .along_1 = f(along.dot(middle)),
                  .x_x = f(x.x()),
                  .x_y = f(x.y()),
                  .x_1 = f(x.dot(middle)),
                  .y_x = f(y.x()),
                  .y_y = f(y.y()),
                  .y_1 = f(y.dot(middle)),
                  .turn = {{f(to_tag(0, 0)), f(to_tag(0, 1))}, {f(to_tag(1, 0)), f(to_tag(1, 1))}},
                  .slant_x = f(slant.x()),
                  .slant_y = f(slant.y()),
                  .height_m = f(centre.z()),
                  .per_cell = f(1 / cell_m_),
                  .per_half = f(1 / half_m_),
                  .blur = f(appearance.blur),
                  .wide = f(std::sqrt(1 + spread)),
                  .narrow = f(std::sqrt(1 - spread)),
                  .ink = f(appearance.ink),
                  .paper = f(appearance.paper),
                  .by_x = f(appearance.slope_x),
                  .by_y = f(appearance.slope_y),
                  .limit = f(limit)};
  static const bool wide = simd8_supported();
  const Totals totals = wide ? sum_up_wide(view) : sum_up(view);

  PrintFit fit;
  fit.error = totals.error + hold * hold * (appearance.blur - 1) * (appearance.blur - 1);
  fit.used = totals.used;
  fit.edges = totals.edges;
  fit.clipped_edges = totals.clipped_edges;
  for (int row = 0; row < kPrintUnknowns; ++row) {
    for (int column = 0; column <= row; ++column)
      fit.jtj(row, column) = fit.jtj(column, row) = totals.products[row * (row + 1) / 2 + column];
    fit.jtr[row] = totals.residuals[row];
  }
  PrintMatrix to_camera = PrintMatrix::Identity();
  to_camera.block<3, 3>(0, 0) = to_camera.block<3, 3>(3, 3) = pose.linear();
  fit.jtj = (to_camera * fit.jtj * to_camera.transpose()).eval();
  fit.jtr = (to_camera * fit.jtr).eval();
  fit.jtj(10, 10) += hold * hold;
  fit.jtr[10] += hold * hold * (appearance.blur - 1);
  return fit;
}

}  // namespace lumigraft::reconstruct
