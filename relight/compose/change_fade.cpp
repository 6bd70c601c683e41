#include "relight/compose/change_fade.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "capture/camera/srgb.h"
#include "relight/compose/parameters.h"

namespace lumigraft::relight {

ViewMeasure measure_view(const capture::Image<std::uint8_t>& picture) {
  const capture::SrgbTable& srgb = capture::srgb_table();
  ViewMeasure view;
  std::vector<float> blocks;
  int samples = 0;
  for (int top = 0; top + kCompose.view_block_px <= picture.height; top += kCompose.view_block_px) {
    for (int left = 0; left + kCompose.view_block_px <= picture.width; left += kCompose.view_block_px) {
      float sum = 0;
      const int before = samples;
      for (int v = top; v < top + kCompose.view_block_px; v += kCompose.view_step_px) {
        for (int u = left; u < left + kCompose.view_block_px; u += kCompose.view_step_px, ++samples) {
          const std::uint8_t code = picture.at(u, v, 1);  // green: most of luminance, least noise
          sum += code;
          view.light += srgb.linear[code];
        }
      }
      blocks.push_back(sum / static_cast<float>(samples - before));
    }
  }
  if (blocks.empty()) return view;
  view.light /= static_cast<float>(samples);
  const auto at = [&](std::size_t percent) {
    const auto found = blocks.begin() + static_cast<std::ptrdiff_t>((blocks.size() - 1) * percent / 100);
    std::nth_element(blocks.begin(), found, blocks.end());
    return *found;
  };
  view.contrast = at(95) - at(5);
  return view;
}

bool ChangeFade::is_covered(const ViewMeasure& now, bool sees_tag) const {
  if (sees_tag) return false;
  const float hysteresis = covered_ ? kCompose.covered_hysteresis : 1;
  return now.contrast < hysteresis * kCompose.min_contrast ||
         (now.contrast < hysteresis * kCompose.covered_contrast * usual_.contrast &&
          now.light < hysteresis * kCompose.covered_light * usual_.light);
}

void ChangeFade::follow(const capture::FrameSet& frame, const capture::Image<std::uint8_t>& picture,
                        const std::optional<reconstruct::Pose>& pose, bool depth_stopped) {
  const ViewMeasure now = measure_view(picture);
  // A step back in time (a recording that begins again) counts as 0, a gap as at most fade_out_ns.
  const std::int64_t since_ns = std::exchange(last_ns_, frame.time_ns);
  const std::int64_t step_ns = any_ ? std::clamp<std::int64_t>(frame.time_ns - since_ns, 0, kCompose.fade_out_ns) : 0;
  if (!any_) usual_ = now;
  any_ = true;
  covered_ = is_covered(now, pose && pose->from == reconstruct::Pose::From::tag);
  const float weight = static_cast<float>(step_ns) / static_cast<float>(kCompose.usual_view_ns);
  usual_.light = std::lerp(usual_.light, now.light, weight);
  usual_.contrast = std::lerp(usual_.contrast, now.contrast, weight);
  dimmed_ = covered_ ? std::min(now.light / std::max(usual_.light, 1e-6f), 1.0f) : 1;

  const bool unseen =
      !pose || (pose->from == reconstruct::Pose::From::past && frame.time_ns - pose->time_ns > kCompose.unseen_ns);
  if (covered_ || unseen || depth_stopped)
    opacity_ -= static_cast<float>(step_ns) / static_cast<float>(kCompose.fade_out_ns);
  else
    opacity_ += static_cast<float>(step_ns) / static_cast<float>(kCompose.fade_in_ns);
  opacity_ = std::clamp(opacity_, 0.0f, 1.0f);
}

void ChangeFade::apply(const std::shared_ptr<const capture::Image<std::uint8_t>>& camera,
                       capture::Image<std::uint8_t>* picture) {
  last_camera_ = camera;
  last_relit_ = *picture;
  const float opaque = opacity();
  if (opaque >= 1) return;
  for (std::size_t i = 0; i < picture->data.size(); ++i) {
    const auto real = static_cast<float>(camera->data[i]);
    std::uint8_t& code = picture->data[i];
    code = static_cast<std::uint8_t>(std::lround(std::lerp(real, static_cast<float>(code), opaque)));
  }
}

void ChangeFade::add_last(capture::Image<std::uint8_t>* picture) const {
  const float opaque = opacity();
  if (opaque <= 0 || last_relit_.data.size() != picture->data.size()) return;
  const capture::SrgbTable& srgb = capture::srgb_table();
  for (std::size_t i = 0; i < picture->data.size(); ++i) {
    const std::uint8_t relit = last_relit_.data[i], real = last_camera_->data[i];
    std::uint8_t& code = picture->data[i];
    if (relit != real) code = srgb.code(srgb.linear[code] + opaque * (srgb.linear[relit] - srgb.linear[real]));
  }
}

}  // namespace lumigraft::relight
