#pragma once
// The pace of albedo in the live pipeline: it rests for a multiple of the processor time that it used, so that on few
// cores rendering comes first.
#include <optional>

#include "reconstruct/albedo_schedule.h"
#include "server/metrics/metrics.h"
#include "server/pipeline/audience.h"
#include "server/pipeline/pacing.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {

class RestingPace : public reconstruct::AlbedoPace {
 public:
  RestingPace(Metrics& metrics, Audience& audience) : metrics_(metrics), audience_(audience) {}

  bool waited(reconstruct::AlbedoWork work, int periods, bool learning) const override {
    if (audience_.background_may_rest(learning, PaceClock::now())) return rests(work).over(kPipeline.unwatched_rest);
    return rests(work).over(learning ? kPipeline.rest : periods * kPipeline.albedo_rest_later);
  }
  bool may_compare() override {
    const PaceClock::time_point now = PaceClock::now();
    if (now < compared_ + kPipeline.albedo_every) return false;
    compared_ = now;
    return true;
  }
  void begin(reconstruct::AlbedoWork work) override {
    at_work_ = work == reconstruct::AlbedoWork::everything ? &everything_ : &incremental_;
    at_work_->begin();
    timer_.emplace(metrics_, work == reconstruct::AlbedoWork::everything ? "albedo" : "albedo/new");
  }
  void end() override {
    timer_.reset();
    at_work_->end();
  }

 private:
  const DutyCycle& rests(reconstruct::AlbedoWork work) const {
    return work == reconstruct::AlbedoWork::everything ? everything_ : incremental_;
  }

  Metrics& metrics_;
  Audience& audience_;
  DutyCycle incremental_{kPipeline.albedo_every}, everything_{kPipeline.albedo_every};
  DutyCycle* at_work_ = nullptr;
  std::optional<StageTimer> timer_;
  PaceClock::time_point compared_{};
};

}  // namespace lumigraft::server
