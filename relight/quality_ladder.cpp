#include "relight/quality_ladder.h"

#include <algorithm>

#include "relight/parameters.h"

namespace lumigraft::relight {

bool QualityLadder::chooses(const Plan& plan) {
  return plan.method == "rays" && plan.budget_ms > 0 && plan.adaptive == 1 && !plan.user_set.contains("trace_scale") &&
         !plan.user_set.contains("rays");
}

double QualityLadder::Times::usual() const {
  std::array<double, 3> sorted = last_;
  std::sort(sorted.begin(), sorted.end());
  return sorted[sorted.size() / 2];
}

Plan QualityLadder::plan(const Plan& asked, bool view_moves, double time_s) {
  if (time_s < time_s_) {  // a recording that begins again
    for (State& state : states_) state.changed_s += time_s - time_s_;
  }
  time_s_ = time_s;
  budget_ms_ = asked.budget_ms;
  const std::size_t next = view_moves ? 1 : 0;
  if (next != now_) {
    State& state = states_[next];
    state.settling = kRelight.settling_pictures;
    state.times.clear();
    now_ = next;
    kept_ = 0;
  }
  State& state = states_[now_];
  if (state.wait_s == 0) {
    state.changed_s = time_s;
    state.wait_s = kRelight.first_wait_s;
  }
  Plan result = asked;
  result.trace_scale = kSteps[state.step].trace_scale;
  result.rays = kSteps[state.step].rays;
  return result;
}

double QualityLadder::ratio(const State& state, std::size_t lower) const {
  return state.ratios[lower].value_or(kSteps[lower + 1].cost / kSteps[lower].cost);
}

void QualityLadder::change(State& state, std::size_t step, int settling) {
  state.step = step;
  state.changed_s = time_s_;
  state.settling = settling;
  state.times.clear();
}

void QualityLadder::go_down(State& state) {
  double ms = state.times.usual();
  std::size_t step = state.step;
  while (step > 0 && ms > budget_ms_) ms /= ratio(state, --step);
  state.before_up_ms.reset();
  state.wait_s = std::min(2 * std::max(state.wait_s, 0.5 * kRelight.next_wait_s), kRelight.max_wait_s);
  change(state, step, kRelight.settling_pictures);
}

void QualityLadder::go_up(State& state, double from_ms, double limit_ms, int settling) {
  if (state.step + 1 == kSteps.size() || time_s_ - state.changed_s < state.wait_s) return;
  if (from_ms * ratio(state, state.step) > limit_ms) return;
  state.before_up_ms = from_ms;
  change(state, state.step + 1, settling);
}

void QualityLadder::took(double ms, bool anew) {
  State& state = states_[now_];
  kept_ = anew ? 0 : kept_ + 1;
  if (!anew) {
    if (kept_ >= kRelight.kept_pictures) go_up(state, state.last_ms, kRelight.max_pause_ms, kRelight.refining_pictures);
    return;
  }
  state.last_ms = ms;
  if (state.settling > 0) {
    --state.settling;
    return;
  }
  state.times.add(ms);
  if (!state.times.enough()) return;
  const double usual = state.times.usual();
  if (state.before_up_ms && *state.before_up_ms > 0) {
    state.ratios[state.step - 1] = usual / *state.before_up_ms;
    state.before_up_ms.reset();
  }
  if (usual > kRelight.over_budget * budget_ms_ && state.step > 0) {
    go_down(state);
  } else {
    go_up(state, usual, kRelight.under_budget * budget_ms_, kRelight.settling_pictures);
  }
}

}  // namespace lumigraft::relight
