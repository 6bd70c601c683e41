#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <chrono>
#include <cstddef>

namespace lumigraft::server {
inline constexpr struct CommandParameters {
  std::chrono::milliseconds tick{50}, stop_patience{250};  ///< between looks for input; for an orderly shutdown
  /// For files to be written at a stop signal: 60 MB, the largest rooms seen, on a card that writes 10 MB/s.
  std::chrono::milliseconds save_patience{6000};
  /// Files that cannot be used are kept so many times, each up to the size of a room: a few mistakes can be undone.
  int max_unused = 5;
  /// Between repetitions in the log, at least. After a recording's time: a camera may deliver no frames.
  std::chrono::seconds warning_again{60}, drops_every{30}, grace{2};
  std::size_t max_remembered = 200, more_after_refusal = 5;  ///< warnings that contain numbers; moments after which
  int enough_views = 15;                                     ///< calibration is attempted again, first with these
  std::chrono::milliseconds snapshots_apart{200};            ///< encoded
  std::chrono::milliseconds recording_check{500};            ///< of a recording's limits: 60 MB at 120 MB/s
  std::chrono::hours certificates_apart{24};                 ///< looked at, since a service runs for months
  /// A thread without an iteration for so long hangs.
  std::chrono::seconds hung_after{10};
  unsigned gpu_probe_s = 30;  ///< until a process whose driver does not answer is ended; software devices take 1 s
  std::size_t max_model_name = 64;   ///< of an uploaded model, without its extension
  double not_grafting_after_s = 60;  ///< as while the tag is hidden
  double stale_after_s = 5;          ///< age of the newest picture that is not healthy
  /// The same while nobody watches: a picture is made every 30 s, and may take some.
  double resting_stale_after_s = 45;
} kCommands;
}  // namespace lumigraft::server
