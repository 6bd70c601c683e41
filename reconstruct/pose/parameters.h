#pragma once
// Parameters of pose estimation. Its accuracy is measured over distance, tilt, blur, occlusion, overexposure and speed
// by tests/sweeps/pose_sweep_test.cpp; where no reason is given a value was chosen by hand and not swept on its own.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace lumigraft::reconstruct {

/// Search for tags in the image (pose, lamp_tags, tag_search, tag_pose_estimator).
struct TagSearchParameters {
  int full_resolution_px = 640;  ///< wider images are searched at half the resolution; corners are refined anyway
  double wide_tag_px = 64;  ///< a tag this wide is searched at half the resolution: libapriltag needs 3 pixels per cell
  double same_sighting_px = 8;  ///< sightings of one id with closer centres are the same tag
  double min_margin_px = 16;    ///< around the last position; at least half the tag, the motion between two frames
  std::int64_t interval_ns = 1'000'000'000;      ///< between searches of the whole image while tags are tracked
  std::int64_t short_interval_ns = 250'000'000;  ///< the same while a tag is hidden or not located yet
  std::int64_t mirrored_ns = 2'000'000'000;      ///< between searches for mirrored tags while a tag is not seen at all
  /// Between searches for their reflections while all are seen: mirrors stay, and a search takes as long as for tags.
  std::int64_t reflected_ns = 10'000'000'000;
};
inline constexpr TagSearchParameters kTagSearch;

/// Rows that are exposed one after the other (rolling_shutter).
struct RollingShutterParameters {
  /// 1σ of the readout time if no one states it: from none (global shutter) to a frame's time at 30 Hz, evenly.
  double unknown_readout_s = 0.033 / std::numbers::sqrt3;
  double usual_rad_s = 0.5;     ///< 1σ of the velocity in the first frame, as an angle: a hand-held camera that pans
  double min_shift_px = 0.001;  ///< smaller displacements of corners are not added to a pose's covariance
};
inline constexpr RollingShutterParameters kRollingShutter;

/// Choice and use of poses (pose).
struct PoseParameters {
  std::int64_t age_limit_ns = 500'000'000;  ///< how long a pose may be used after anything was last seen
  double surface_jitter = 1.0 / 3;  ///< noise from frame to frame as a fraction of the uncertainty of a pose from depth
  int first_size_checks = 8;        ///< frames in which a tag's size is compared with depth,
  int size_check_interval = 8;      ///< then in every eighth, since it costs as much as all of the tag's pixels
  double unsharp = 2;               ///< a print so many times less certain than before is blurred or partly covered:
  std::int64_t unsharp_ns = 2'000'000'000;  ///< for this time depth may be more certain
  double sharp_old = 0.8, sharp_new = 0.2;  ///< weights of the running mean of a sharp print's uncertainty
  double max_disagreement = 25;   ///< squared Mahalanobis distance (6 dimensions) up to which tag and depth agree
  double min_cost_gap = 2;        ///< squared σ; poses whose costs differ by less explain the tag equally well
  double min_map_cost_gap = 20;   ///< the same before a tag's pose in the room is learnt from one frame
  double max_clipped_blur = 0.3;  ///< beyond that the blur follows its prior (PrintAlignment::blur_hold)
  double max_clipped = 0.9;       ///< fraction of clipped pixels on a tag's edges that causes a warning
};
inline constexpr PoseParameters kPose;

/// Candidates for the pose of one tag (tag_pose_estimator, multi_tag_pose). Costs are squared deviations in σ.
struct TagPoseParameters {
  double evidence_cap = 100;      ///< limit of each term, so that no single one decides
  double corner_sigma_px = 0.1;   ///< 1σ of a corner found by the detector
  double bias_sigma_px = 0.015;   ///< 1σ of systematic errors at corners; doubled if clipped: only dark sides count
  double print_sigma_factor = 3;  ///< measured errors over those from residuals, which assume independent pixels
  double min_sigma = 1e-5;        ///< lower limit of metres and radians
  double corner_cost_px = 0.2;    ///< 1σ of the corners' error in the cost
  double pixels_per_sample = 10;  ///< pixels of the print that count as one independent sample
  double missing_print = 10;      ///< ratio of residuals, and samples, for a candidate whose print does not fit
  double still_deg = 2, deg_per_s = 60;       ///< 1σ of the change since the last frame: constant, and per second
  double max_corner_gap_px = 1.5;             ///< corners alone decide if one pose is worse by more
  double same_pose_deg = 0.1;                 ///< candidates closer to each other are one
  double follow_m = 0.04, follow_rad = 0.05;  ///< change up to which a partly visible print is followed
  double follow_contrast_error = 0.2;         ///< residual up to which it is
  double follow_min_contrast = 0.5, follow_max_contrast = 2;  ///< change of contrast up to which it is
  double tag_disagreement = 60;  ///< squared Mahalanobis distance beyond which two tags contradict each other
};
inline constexpr TagPoseParameters kTagPose;

/// Alignment to the whole print (print_alignment).
struct PrintAlignmentParameters {
  std::size_t min_pixels = 100;
  double huber = 0.15;      ///< threshold of the robust loss, of the contrast: fingers and highlights
  double blur_hold = 0.04;  ///< weight of blur - 1, where paper is clipped: error of 2 % of the contrast, 1σ of 0.5
  double min_blur = 0.5, max_blur = 4;  ///< in widths of a pixel
  double paper_cells = 0.5;             ///< paper around the square that is used
  double max_contrast_error = 0.25;     ///< RMS residual, of the contrast, beyond which it is not this print
  int max_iterations = 30;
  double convergence = 1e-5;         ///< relative decrease of the error
  std::size_t many_pixels = 13'000;  ///< more pixels are reduced to every 13th, fewer to every 5th
};
inline constexpr PrintAlignmentParameters kPrintAlignment;

/// Poses of tags relative to the first (tag_map).
struct TagMapParameters {
  int min_sightings = 8;         ///< before a pose is used
  int max_sightings = 300;       ///< in the mean
  double optimize_growth = 1.5;  ///< of a pair's sightings since the map was last optimized
  int moved_sightings = 15;      ///< contradicting ones in a row, after which the tag was moved
  int moved_alone = 3;  ///< frames in a row in which depth shows that the only tag was moved: no flip of its pose
  /// Of variance expected by the camera's motion over that with depth, along the tag's jump: depth measured it.
  double measured_by_depth = 16;
  /// Between comparisons with an earlier frame while the camera or the tag moves: each costs two alignments to the
  /// field.
  std::int64_t rest_check_interval_ns = 250'000'000;
  double configured_sigma_m = 0.003, configured_sigma_rad = 0.01;  ///< 1σ of what a person measures
  double min_sigma_m = 0.0003, min_sigma_rad = 0.0005;             ///< 1σ that more sightings do not improve
  double moved_m = 0.01, moved_rad = 0.035;  ///< a larger difference, besides noise, is a contradiction
  double moved_sigmas = 4;                   ///< that noise
};
inline constexpr TagMapParameters kTagMap;

/// File of the tag map (tag_map_file).
struct TagMapFileParameters {
  double same_number = 1e-9;  ///< relative difference of numbers that were written with 17 digits
  int max_id = 586;           ///< of the largest family, tag36h11
  int max_tables = 200'000;   ///< pairs of that many tags
};
inline constexpr TagMapFileParameters kTagMapFile;

/// Comparison of a tag's size with depth (depth_plane).
struct TagSizeParameters {
  int min_frames = 5, max_frames = 30;  ///< in the mean
  double tolerance = 0.03;              ///< relative error of scale of depth cameras,
  double tolerance_per_m = 0.015;       ///< and per metre beyond 1 m
  double unit_factor = 3;               ///< a larger ratio is a wrong unit, not a wrong print
};
inline constexpr TagSizeParameters kTagSize;

/// The plane that depth shows inside a tag (depth_plane).
struct DepthPlaneParameters {
  int rounds = 3;  ///< of outlier rejection
  std::size_t min_points = 30;
  double outlier_sigmas = 2.5;
  double noise_factor = 3;               ///< neighbouring pixels have correlated errors: nine count as one
  double camera_sigma_rad = M_PI / 180;  ///< 1σ of the depth camera's own distortion
};
inline constexpr DepthPlaneParameters kDepthPlane;

/// The surface around a tag (depth_plane).
struct SurroundingPlaneParameters {
  double growth = 1.6, max_growth = 17;  ///< of the region in each step: the whole image for a tag of a 16th of it
  double max_samples = 1500;
  double gate_sigmas = 3;
  double min_share = 0.5;     ///< of the samples on the plane; else the surface ends before
  double distortion = 0.005;  ///< bend of depth over a plane, of the depth: half of what cameras state for 2 m (1 %)
};
inline constexpr SurroundingPlaneParameters kSurroundingPlane;

/// Bias of a print's tilt (tag_tilt). Nodes of its prior, in pixels at the corners: that of a flat print seen by a
/// calibrated lens (TagPoseParameters::bias_sigma_px) has half the probability; the other half is spread evenly over
/// the logarithm up to two pixels: bent paper, lenses that are not calibrated for the image's border.
struct TagTiltParameters {
  int nodes = 7;
  double flat_probability = 0.5;
  int max_frames = 30;  ///< in the mean of differences
  /// Probability of a flat print above which it is taken for one: at first, and afterwards with a distance between both
  /// ways, so that a pose does not jump to and fro.
  double flat_at_first = 0.5, bent = 0.1, flat_again = 0.9;
  double contradiction_sigmas = 4;  ///< of the largest bias: depth shows another surface than the one the tag is on
  int contradictions = 5;           ///< consecutive frames before the warning
};
inline constexpr TagTiltParameters kTagTilt;

/// Points of a depth image for ICP (depth_points).
struct DepthPointParameters {
  int columns = 80;              ///< points per row
  float far_m = 5;               ///< depth beyond it is not used
  float rim_sigmas = 8;          ///< noise of twice the middle of three points on a plane less the others' sum
  float max_pixel_step = 0.1f;   ///< depth difference of opposite neighbours, of the depth
  float max_point_step = 0.5f;   ///< the same of points
  int min_pixels = 7;            ///< of 3 × 3 on one surface; fewer at rims and flying pixels
  float independent_pixels = 3;  ///< neighbouring pixels have correlated errors: nine count as three
};
inline constexpr DepthPointParameters kDepthPoints;

/// ICP (icp). Metres and radians.
struct IcpParameters {
  double correlation = 6;           ///< points whose errors count as one: depth errors are correlated over large areas
  double field_sigma_voxels = 0.1;  ///< 1σ of the field's distance
  int block_points = 10;            ///< points along a block of the depth grid, over which errors may be correlated
  int min_blocks = 12;              ///< twice the unknowns, for a covariance from them
  float aside_voxels = 3;           ///< distance of normals with independent noise: they share no pixel
  /// Standard errors of a slope up to which a direction is undetermined: with three, one in thirty poses over a plane
  /// was taken for determined at twice the modelled noise.
  double undetermined_errors = 4;
  double min_gain = 0.01;                        ///< information about a direction that counts, of the prior's
  int min_points = 200;                          ///< on the surface
  double min_inliers = 0.15;                     ///< of the measured points, on the surface
  double min_agreement = 0.4;                    ///< of the points where the field is known, on the surface
  double converged = 1e-4;                       ///< size of a step after which the next would be far smaller
  double nearly_converged = 2e-3;                ///< size of a step after which all points are used
  int max_rounds = 12, max_coarse_rounds = 8;    ///< against the field: an 8 cm jump between frames is followed
  float reach = 0.95f;                           ///< of the truncation distance
  float gate_sigmas = 5;                         ///< distance of used points in the last rounds
  float min_gradient = 0.5f;                     ///< a shorter gradient is between a front and a back
  int frame_rounds = 10, wide_frame_rounds = 4;  ///< against the earlier frame
  float wide_gate_m = 0.25f, gate_m = 0.08f;     ///< distance of used points in those rounds, and after
  float min_range_m = 0.05f;                     ///< of points in the earlier frame
  float min_normal_cosine = 0.8f;                ///< between the normals of corresponding points
  float frame_sigma_m = 0.01f;                   ///< 1σ: corresponding points are not the same points
};
inline constexpr IcpParameters kIcp;

/// Tracking by depth while tags are hidden (depth_tracking).
struct DepthTrackingParameters {
  double fade_s = 0.15;        ///< time constant of the return to the tag's pose: a few frames
  double max_gap_s = 0.5;      ///< after a longer time without a frame the pose is unknown
  double frame_prior = 100;    ///< factor on the predicted variance for alignment to the previous frame
  double max_jump_sigmas = 6;  ///< a larger jump may be a wrong match; its covariance grows by
  double jump_variance = 0.1;  ///< this fraction of the squared jump
  double max_fade_m = 0.05, max_fade_rad = 0.07;     ///< a tag that is farther off is used at once
  double max_sigma_m = 0.03, max_sigma_rad = 0.035;  ///< 1σ beyond which depth does not determine the pose
  std::int64_t settled_ns = 1'000'000'000;           ///< in which people walk by more than their width
  // Motion of a hand-held camera: per frame, plus half an acceleration times time squared, up to a limit.
  double step_m = 0.005, step_rad = 0.01;
  double acceleration_mps2 = 3, acceleration_radps2 = 10;
  double max_step = 0.3;  ///< metres and radians
};
inline constexpr DepthTrackingParameters kDepthTracking;

/// Views by which the camera is located without a tag (view_features, keyframe_map).
struct KeyframeParameters {
  int features = 800;   ///< of ORB in an image
  float octave = 1.2f;  ///< ratio of its scales, and their number: as published
  int octaves = 8;
  int corner_threshold = 10;                ///< of FAST, in codes: rooms have weak texture, and RANSAC drops noise
  float point_sigma_px = 1;                 ///< 1σ of a point at the finest scale
  int small_width = 40, small_height = 30;  ///< of the small image (Klein & Murray 2008)
  double small_blur_px = 1.25;
  int max_bits = 64;       ///< of 256 that differ between descriptors of one point
  float max_ratio = 0.8f;  ///< of the differences to the most and the second most similar point (Lowe 2004)
  int candidates = 5;      ///< views that are compared
  int min_inliers = 20;    ///< points that agree on a pose: chance gives hardly more than the 4 of a sample
  double min_inlier_fraction = 0.25;
  int ransac_rounds = 300;
  double ransac_confidence = 0.999, ransac_error_px = 4;
  double expected_reach_px = 60, near_reach_px = 12;  ///< around a point's place by an expected and by a found pose
  double gate_sigmas = 4;
  int rounds = 8;          ///< of least squares
  double block_rad = 0.1;  ///< edge of regions of the image over which errors may be common
  double new_view_fraction = 0.15, new_view_rad = 0.2;  ///< distance, of the median depth, and turn of a new view
  /// 1σ of errors that are common to a whole image, as an angle: colour and depth cameras a frame apart in time while
  /// the camera turns by 20° a second, or a focal length that is 3 % off.
  double common_rad = 0.01;
  double max_sigma_m = 0.01;               ///< of a pose by depth, beyond which views are asked, too
  std::int64_t interval_ns = 250'000'000;  ///< between searches of all views
  int confirmations = 40;                  ///< such searches with a tag in view, after which restored views are dropped
  double max_disagreement = 25;            ///< squared Mahalanobis distance up to which a restored view and a tag agree
  std::size_t max_views = 300;             ///< about 50 kB each
  std::size_t depth_stride = 97;           ///< pixels for the median depth
  float rim_fraction = 0.03f;              ///< difference of depth around a point at a rim
};
inline constexpr KeyframeParameters kKeyframes;

/// World frame without a tag (surface_anchor).
struct SurfaceAnchorParameters {
  std::size_t trials = 150;         ///< planes through points of the image, spread evenly: one of a tenth is hit
  float min_normal_cosine = 0.94f;  ///< 20°: noise of normals at 3 m
  float gate_sigmas = 4;            ///< of the noise of depth
  float min_upwards = 0.3f;         ///< of the normal: the camera looks down by at most 72°
  float min_slant = 0.1f;           ///< cosine: flatter views of a surface count as this one
  float min_share = 0.1f;           ///< of the area that is seen
};
inline constexpr SurfaceAnchorParameters kSurfaceAnchor;

/// Temporal filter (filter). Swept by pose-filter: no lag from 1 mm a frame on.
struct PoseFilterParameters {
  double max_count = 30;      ///< measurements in the mean of a still camera: one second at 30 Hz
  double jump_sigmas = 3;     ///< a larger innovation means that the camera moved
  double drift_rate = 0.25;   ///< weight of the newest innovation in their mean; noise keeps it below 1σ
  double drift_sigmas = 1.0;  ///< a larger mean innovation means that the camera moved
};
inline constexpr PoseFilterParameters kPoseFilter;

/// Tags on lamps (lamp_tags).
struct LampTagParameters {
  /// The whole image is searched at full resolution, since these tags are small: at intervals for tags that are not
  /// expected, more often while one is hidden, and at once if one that was just seen is not where it was.
  std::int64_t interval_ns = 2'000'000'000, short_interval_ns = 500'000'000, just_seen_ns = 300'000'000;
  std::int64_t expected_ns = 1'000'000'000;  ///< a hidden tag is searched at its last position for this time
  std::int64_t held_ns = 20'000'000'000;     ///< a hidden lamp keeps its position for this time
  double offset_sigma_m = 0.004;  ///< 1σ of the configured position of the lamp on its tag, measured by hand
  double scale_sigma = 0.005;     ///< 1σ of the distance, relative: errors of lens and print
  double drift_mps = 0.01;        ///< growth of the uncertainty while the tag is hidden
  double min_cost_gap = 2;        ///< squared σ; poses whose costs differ by less explain the tag equally well,
  double max_spread_m = 0.015;    ///< and may then differ in the lamp's position by this
};
inline constexpr LampTagParameters kLampTags;

}  // namespace lumigraft::reconstruct
