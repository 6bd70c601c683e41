#pragma once
// Every number that decides something in this folder. Where no reason is given the value was chosen by hand and not
// swept. Measured: tests/bench/results/scene.md (unobserved walls), sweep fusion-mirror.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace lumigraft::reconstruct {

struct RoomParameters {
  struct Enclosure {
    std::size_t min_points = 100;   ///< of surface: fewer do not show a room
    std::size_t max_points = 4000;  ///< evaluated; bounds the time
    std::size_t seeds = 160;        ///< points tried as the origin of a plane
    int fit_rounds = 3;             ///< of fitting a plane to the points on it
    /// A point is on a plane within this distance, plus a fraction of its distance from the fish-eye, as depth noise
    /// grows with distance.
    float plane_tolerance_m = 0.025f, plane_tolerance_ratio = 0.005f;
    float same_plane_cosine = 0.95f;     ///< of the normals of points on one plane, at least
    float other_side_cosine = 0.85f;     ///< of the normals of two sides, at most
    float min_fraction_on_side = 0.03f;  ///< of all points
    float max_fraction_behind = 0.01f;   ///< of all points, behind a side: outliers
    float covers_cosine = 0.75f;         ///< a side closes the directions within 41° of its normal
    float lamp_on_side_cosine = 0.94f;   ///< a panel facing away from a side within 20° is mounted in it
    /// Distance of a guessed side beyond the farthest known point, over that point's distance from the fish-eye. Its
    /// radiance is what the fish-eye saw anyway; only parallax depends on it.
    float guess_ratio = 0.5f;
    float same_offset_m = 0.02f, same_normal_cosine = 0.9995f;  ///< noise of a measured side between solutions
    float same_guess_ratio = 0.1f;                              ///< noise of a guessed side, of the room's half width
  } enclosure;

  struct Mirrors {
    std::size_t seeds = 60;         ///< points tried as the origin of a plane
    std::size_t max_points = 1000;  ///< evaluated behind a plane
    int fit_rounds = 3;
    float plane_tolerance_m = 0.02f;
    float same_plane_cosine = 0.95f;                     ///< of the normals of points on one plane, at least
    float duplicate_cosine = 0.98f;                      ///< of two planes, above which the later is dropped
    std::size_t min_points_on_plane = 40;                ///< each about 10 cm²
    int min_sectors = 6;                                 ///< of 8 around a hole that contain the plane's surface,
    float surround_m = 1;                                ///< within this distance
    float min_depth_m = 0.06f;                           ///< behind the plane; nearer points may belong to the plane
    float tolerance_m = 0.02f, tolerance_ratio = 0.02f;  ///< of a reflected point; the second of its depth
    float same_normal_cosine = 0.7f;                     ///< of a reflected point and the surface there
    float first_ray_m = 0.05f;                           ///< where rays from a camera start
    float min_ray_m = 0.1f;                              ///< nearer points say nothing of free space
    float ray_beyond_m = 6;                              ///< how far rays go on beyond a reflected point
    int min_confirmed = 20;                              ///< points
    float max_contradicted = 0.15f;                      ///< of the points that are confirmed or contradicted
  } mirrors;

  /// Mirrors whose surface is measured as depth; rays and planes as of `mirrors`.
  struct ReflectedColors {
    std::size_t max_points = 1000, max_cameras = 4;  ///< of a plane, with two rays each: up to 20 ms
    Eigen::Index min_points = 100;                   ///< at which known surface is reflected
    /// Of luminance and of hue. In rooms without a mirror hue has a slope of at most 0.1 and a correlation of at most
    /// 0.26; noise of the colours lowers the slope of a true mirror to a half.
    float min_reflectance = 0.25f, min_correlation = 0.3f;
  } reflected_colors;

  /// Depth where no camera measures it. Chosen on images of rooms with truth: below 1 % of the depth is wrong in six of
  /// seven, 10 % in the seventh, where wall and floor are of one colour; without the limits it is 22 to 48 %.
  struct TagPlanes {
    std::int64_t awaited_ns = 500'000'000;  ///< without depth, after which the planes are used
    int columns = 80;                       ///< blocks of pixels in a row of the image: a mean hides noise and grain
    float min_facing = 0.1f;                ///< cos 84°, as of planes that are fused
    float paper = 0.7f, around = 1.5f;      ///< half widths in sizes of the tag: the paper's; of the surface it lies on
    float reach = 6;                        ///< in sizes of the tag; 4 is as good for shadows, but shows less of lamps
    float dark = 1e-3f;                     ///< linear value below which noise and rounding hide the hue
    /// Differences of log values beyond which it is another surface: so many times the variation around the tag, whose
    /// edges have long tails in texture, and at least those of coloured light and of noise.
    float hue_sigmas = 4, edge_sigmas = 8, min_hue = 0.1f, min_edge = 0.1f;
  } tag_planes;

  struct FrozenDepth {
    int block_px = 16;             ///< compared at once, at half the resolution
    float min_contrast = 0.1f;     ///< σ of texture over its mean; noise has a quarter of it
    float min_correlation = 0.9f;  ///< of a block with itself; noise leaves 0.94 at the least contrast
    int columns = 4, rows = 3;     ///< parts of the picture: most have moved with the camera, few with a hand
    std::size_t min_parts = 4;     ///< that have texture
  } frozen_depth;
};

inline constexpr RoomParameters kRoomParameters{};

}  // namespace lumigraft::reconstruct
