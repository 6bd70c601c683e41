#pragma once
// When albedo, and with it the lamps, is solved again. It takes hundreds of milliseconds and changes slowly.
//
// Where a solution brings next to nothing new, the next one waits twice as long, up to kMostPatience times: as long as
// nothing moves and the light stays. What is left out then is what one more solution would have changed: less than
// kLittle of the albedo, kLittle of the light, and of the room what kMoved of its bricks hold.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// What is solved: only the samples that are new or changed (AlbedoStage::solve_new), or the lamps and all samples.
enum class AlbedoWork { nothing, incremental, everything };

/// How long a schedule waits. A live pipeline rests in proportion to the work done; offline, frames are counted.
class AlbedoPace {
 public:
  virtual ~AlbedoPace() = default;
  /// The schedule is asked whether something is due: offline, once a frame.
  virtual void asked() {}
  /// Whether `periods` usual waits are over since work of this kind. `learning`: much is unknown, waits are short.
  virtual bool waited(AlbedoWork work, int periods, bool learning) const = 0;
  /// Whether fields may be compared now to find what moved, which takes some milliseconds.
  virtual bool may_compare() = 0;
  virtual void begin(AlbedoWork work) = 0;
  virtual void end() {}
};

/// Offline: a period is kFrames frames. While much is unknown every frame is solved.
class FramePace : public AlbedoPace {
 public:
  static constexpr int kFrames = 8;

  void asked() override { ++frames_; }
  bool waited(AlbedoWork, int periods, bool learning) const override {
    return learning || frames_ >= kFrames * periods;
  }
  bool may_compare() override { return frames_ % kFrames == 0; }
  void begin(AlbedoWork) override { frames_ = 0; }

 private:
  int frames_ = 0;  ///< since the last work
};

class AlbedoSchedule {
 public:
  static constexpr double kMuchMoreRoom = 1.25;  ///< solved at once, when the field has grown by a quarter
  static constexpr double kMuchLight = 0.2;      ///< or the lamps' irradiance changed by a fifth of its sum
  static constexpr int kMostPatience = 8;
  static constexpr float kLittle = 0.01f;  ///< of albedo, of light
  static constexpr float kFew = 0.05f;     ///< of samples, newly known; of their standard deviation
  static constexpr float kMoved = 0.005f;  ///< of the bricks

  explicit AlbedoSchedule(std::unique_ptr<AlbedoPace> pace = std::make_unique<FramePace>());

  /// What is due now.
  AlbedoWork next(const DistanceField& field, const Illumination& light);
  /// Whether everything may be solved now, where solving what is new turns out not to do.
  bool may_solve_everything() const { return may_solve_everything_; }

  /// Work of this kind, from its making to its end.
  class Work {
   public:
    Work(AlbedoSchedule& schedule, AlbedoWork work) : pace_(*schedule.pace_) { pace_.begin(work); }
    ~Work() { pace_.end(); }
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;

   private:
    AlbedoPace& pace_;
  };
  /// What is being solved, before it is.
  void begin(std::shared_ptr<const DistanceField> field, const Illumination& light);
  /// What came of it; `everything_due`: solving what is new sufficed, but everything should follow.
  void solved(std::shared_ptr<const AlbedoField> albedo, bool everything_due);
  /// Nothing came of it: only everything will do, and waits for its time.
  void wait_for_everything();

  /// Whether nothing was solved yet, or what was solved is far from what was known when it was last asked.
  bool learning() const { return learning_; }
  /// Whether something moved since that solutions should follow, or the light changed by more than a little.
  bool moved(const DistanceField& field, const Illumination& light) const;
  /// Times the usual wait until it is solved again.
  int patience() const { return patience_; }

 private:
  struct Known {
    std::shared_ptr<const DistanceField> field;
    std::uint64_t light_version;
    std::vector<PointLight> lights;
  };
  double light_change(const Illumination& light) const;
  bool changed_much(const DistanceField& field, const Illumination& light) const;
  bool changed(const DistanceField& field, const Illumination& light) const;

  std::unique_ptr<AlbedoPace> pace_;
  std::optional<Known> known_, known_before_;
  std::shared_ptr<const AlbedoField> albedo_;
  int patience_ = 1;
  bool disturbed_ = true;  ///< what is being solved was much, or something moved
  bool learning_ = true;
  bool everything_due_ = true, only_everything_ = true;  ///< at first there is nothing to solve anew
  bool may_solve_everything_ = true;
};

}  // namespace lumigraft::reconstruct
