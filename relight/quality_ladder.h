#pragma once
// Chooses the settings of rays by the time that pictures take, so that they keep to a budget.
//
// The settings are steps of increasing accuracy and cost. A picture that is computed anew takes the measured time of
// its step; the time of the next step is that times the ratio of both, as measured when it was last changed, or as
// given at first. The step goes down as soon as pictures usually take longer than the budget, and up where the next one
// would leave a margin, but not soon after a change, and later the more often that failed: a change may be visible.
//
// While the camera moves every picture is computed for a new view, and takes several times as long as while only
// objects move. Both have their own step and times. While nothing moves at all a picture is computed once and kept: the
// step goes up as long as one picture takes no longer than kRelight.max_pause_ms.
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "relight/plan.h"

namespace lumigraft::relight {

class QualityLadder {
 public:
  struct Step {
    int trace_scale, rays;
    double cost;  ///< relative to the first step, if nothing else is known
  };
  static constexpr std::array<Step, 5> kSteps{Step{16, 8, 1}, Step{16, 20, 1.3}, Step{8, 20, 2}, Step{4, 20, 4.5},
                                              Step{4, 64, 7}};

  /// Whether a plan leaves the choice: it has a budget, and no setting that is chosen here was set by the user.
  static bool chooses(const Plan& plan);

  /// The plan of the next picture. `view_moves`: see ViewMotion. `time_s`: of the picture.
  Plan plan(const Plan& asked, bool view_moves, double time_s);
  /// Call after it. `anew`: light was computed for it; else it kept what was.
  void took(double ms, bool anew);

 private:
  class Times {
   public:
    void clear() { count_ = 0; }
    void add(double ms) { last_[count_++ % last_.size()] = ms; }
    bool enough() const { return count_ >= last_.size(); }
    double usual() const;  ///< the median; only if there are enough

   private:
    std::array<double, 3> last_{};
    std::size_t count_ = 0;
  };
  struct State {
    std::size_t step = 0;
    Times times;
    double last_ms = 0;                                           ///< of the last picture that was computed anew
    int settling = 0;                                             ///< pictures that still contain the change itself
    double changed_s = 0, wait_s = 0;                             ///< until the next step up
    std::array<std::optional<double>, kSteps.size() - 1> ratios;  ///< measured, of each step to the one below
    std::optional<double> before_up_ms;                           ///< of the step below, since the last step up
  };

  double ratio(const State& state, std::size_t lower) const;
  void change(State& state, std::size_t step, int settling);
  void go_down(State& state);
  /// If the wait is over and the next step will take no longer than the limit.
  void go_up(State& state, double from_ms, double limit_ms, int settling);

  std::array<State, 2> states_;  ///< while the view rests, and while it moves
  std::size_t now_ = 0;
  double time_s_ = 0, budget_ms_ = 0;
  int kept_ = 0;  ///< pictures in a row that kept what was computed
};

}  // namespace lumigraft::relight
