#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace lumigraft::server {
inline constexpr struct PipelineParameters {
  /// A stage waits for input for a tick (for a frame: patience), then looks whether it is to stop. The last picture is
  /// encoded again after keep_alive. A recording later than too_late continues where it was instead of skipping frames.
  std::chrono::milliseconds tick{100}, patience{100}, keep_alive{1000}, too_late{500};
  std::chrono::milliseconds geometry_every{100}, light_every{100}, room_every{1000}, albedo_every{1000};
  std::chrono::seconds first_pause{1}, longest_pause{30};  ///< until a device that failed is made again
  /// So many devices may hang, each of which leaves up to a gigabyte that is never freed (relight/gpu/hang.h).
  int max_hangs = 3;
  /// Between two times that the room is kept: first, and at last after doubling. Of 30 MB a time 1.4 GB are written a
  /// day; a kiosk that is switched off loses what it learnt in half an hour.
  std::chrono::seconds first_keep{10}, longest_keep{32 * 60};
  std::int64_t moment_ns = 250'000'000;  ///< between a colour and a fish-eye frame: light changes slowly
  /// Rest after a turn, as a multiple of its processor time: each uses a third of a core while the room is unknown,
  /// later geometry and room a tenth, and albedo a twentieth: later solutions differ little from the previous ones.
  int rest = 2, geometry_rest_later = 9, room_rest_later = 9, albedo_rest_later = 19, background_niceness = 10;
  /// While nobody watches: one pose in this time, which is below the 5 s after which /healthz misses the camera, and
  /// one picture in the second time: one of 0.7 s on two cores takes 4 % of a core then, and whoever comes first sees a
  /// picture no older than that at once. Each background stage uses half a hundredth of a core. Only after nobody has
  /// watched for a while, and until the room is known or this time has passed at the usual pace.
  std::chrono::seconds unwatched_period{3}, unwatched_picture_period{30}, audience_lingers{10};
  std::chrono::minutes learns_unwatched{10};
  /// Of the threads that then look whether somebody came: two of them, each time 10 us. Background stages go on resting
  /// until the first picture is made, which on two cores they would delay by a quarter, but no longer than a second.
  std::chrono::milliseconds looks_for_audience{10}, first_picture_patience{1000};
  int unwatched_rest = 199;
  /// Range of a surface that is picked in the picture, and the cosine of its slope: an object stands on up to 30°.
  float pick_near_m = 0.1f, pick_far_m = 12;
  double pick_min_up = 0.866;
  std::uintmax_t max_model_bytes = 16 << 20;  ///< of a model's file that is loaded before the service starts: 0.5 s
  std::size_t min_token_bytes = 16;           ///< of a listener: nobody guesses what 16 random characters say
  int certificate_ends_soon_days = 14;        ///< Let's Encrypt renews 30 days before
  std::size_t memory_bytes = std::size_t{512} << 20;  ///< for a recording that is played repeatedly
} kPipeline;
}  // namespace lumigraft::server
