#pragma once
// Times, counts and tolerances of live cameras. Chosen by hand unless a reason or a measurement is given.
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "capture/formats/pixel_format.h"

namespace lumigraft::capture {

inline constexpr struct LiveParameters {
  std::chrono::milliseconds silence{2000};  ///< without a frame a camera counts as frozen and is opened again
  std::chrono::milliseconds retry{500};     ///< between two attempts to open a camera
  std::chrono::milliseconds poll{50};       ///< longest wait for a frame before stop requests and silence are checked
  std::size_t max_queued = 32;              ///< items not taken yet; beyond that the oldest are dropped
  /// Frames, or time, before the clock offset is trusted: the first frame alone may arrive late by most of a period and
  /// would be paired with a neighbour. For slow cameras the time limit ends it, since their period is long.
  int clock_frames = 5;
  std::chrono::milliseconds clock_time{200};
  std::int64_t clock_window_ns = 1'000'000'000;  ///< of DeviceClock: 200 ppm drift by 0.4 ms in two windows
  std::int64_t clock_jump_ns = 1'000'000'000;    ///< no frame arrives that late unless its clock was set
  std::int64_t max_latency_ns = 1'000'000'000;   ///< a driver's host time older than this is not used
  std::uint32_t max_sequence_gap = 1000;         ///< a larger gap is a counter that was reset, not lost frames
  double max_exposure_ratio = 1e4;  ///< frame to session; sensors' ranges of exposure and of gain are far smaller
  int fallback_niceness = -10;      ///< of camera threads where SCHED_RR is not permitted
  std::chrono::milliseconds helper_exit{1000};  ///< for the exit status after a helper has closed its descriptor
} kLiveParameters;

inline constexpr struct V4l2Parameters {
  std::uint32_t buffers = 8;
  int min_buffers_with_driver = 4;  ///< with fewer, frames are copied instead of lent
  /// Before an unplugged camera is closed: closing it while the kernel still removes it makes two kernel threads use
  /// the same media entity, and one that finds it freed crashes the machine's kernel (6.1).
  std::chrono::milliseconds unplug_delay{300};
  std::chrono::milliseconds adapt_time{5000};    ///< longest for automatic exposure; usual ones take 1 to 3 s
  std::chrono::milliseconds adapt_reading{250};  ///< between two means: several steps of an automatic exposure
  int adapt_readings = 2;                        ///< means in a row that equal the one before
  double adapt_change = 0.02;                    ///< relative, of means that count as equal: of sRGB, 4 % of the light
  int old_exposures = 4;                         ///< frames after a change of exposure that may still have the old one
  double sufficient_rate_hz = 25.0;      ///< formats of at least this rate are chosen by preference, others by rate
  double default_rate_hz = 30.0;         ///< if the session states none; drivers otherwise keep the last program's rate
  double rate_rounding = 0.99;           ///< of the wanted rate: 29.97 Hz counts as 30 Hz
  double max_rate_error = 0.02;          ///< relative, between the rate asked for and the one that the driver set
  double max_aspect_ratio_error = 0.01;  ///< relative, between a digital signal and the session's frame size
} kV4l2Parameters;

inline constexpr struct HelperParameters {
  std::chrono::milliseconds patience{10'000};  ///< for the helper's first answer and for the rest of a message
  int pipe_bytes = 1 << 20;                    ///< a frame of 640x480; the default of 64 KiB is slower
  unsigned max_text_bytes = 4096;              ///< of a reason or a serial number
} kHelperParameters;

inline constexpr struct FreenectParameters {
  double tick_rate_hz = 60e6;          ///< of the camera's clock (openkinect.org, Protocol Documentation)
  double rate_hz = 30.0;               ///< of its frames of 640x480
  std::uint64_t adapting_frames = 60;  ///< of colour with automatic exposure, before it is held
} kFreenectParameters;

inline constexpr struct LibcameraParameters {
  unsigned buffers = 8;
  std::chrono::milliseconds open_timeout{10'000};  ///< for each answer of the helper until the camera runs
  std::chrono::milliseconds list_timeout{10'000};  ///< for each piece of the helper's list of cameras
} kLibcameraParameters;

inline constexpr struct AravisParameters {
  int buffers = 8;
  std::chrono::milliseconds close_timeout{500};  ///< closing a camera that is gone takes a dozen seconds: not awaited
  std::uint64_t max_time_difference_ns = 1'000'000'000;  ///< chunk to leader: exposure and transfer are shorter
  int max_feature_depth = 8;  ///< of linked GenICam nodes: a camera's description may be circular
} kAravisParameters;

inline constexpr struct OpenNiParameters {
  std::chrono::milliseconds recording_silence{5000};  ///< after which a recording with wrong frame counts has ended
  int end_silence_divisor = 5;                        ///< shortens it once OpenNI2 reports the end of the file
  std::uintmax_t min_frame_bytes = 20;  ///< in a recording: more frames than the file can contain are repetitions
  std::chrono::milliseconds player_pause{25};  ///< for its thread to leave the list of streams, visited every 10 ms
} kOpenNiParameters;

/// Order in which V4L2 and libcamera choose a format if the session names none: colour before grey, uncompressed before
/// JPEG, and interpolated colour before Bayer. Of grey the fewest bits, since RGB has eight.
inline constexpr PixelFormat kPreferredFormats[] = {
    PixelFormat::yuyv,        PixelFormat::uyvy,        PixelFormat::nv12,        PixelFormat::rgb8,
    PixelFormat::bgr8,        PixelFormat::bayer_rggb8, PixelFormat::bayer_bggr8, PixelFormat::bayer_gbrg8,
    PixelFormat::bayer_grbg8, PixelFormat::mjpeg,       PixelFormat::grey8,       PixelFormat::grey10,
    PixelFormat::grey12,      PixelFormat::grey16};

}  // namespace lumigraft::capture
