#include "relight/passes/lamps/observed_shadows.h"

#include <array>
#include <span>

namespace lumigraft::relight {

void ObservedShadows::fit(gpu::Device& device, std::size_t values) {
  const std::size_t bytes = sizeof(shader::ObservedShadow) * shader::kMaxLamps + sizeof(float) * (values + 1);
  if (!buffer_ || buffer_->size_bytes() < bytes) buffer_ = device.create_buffer(bytes, "observed shadows");
}

void ObservedShadows::take(gpu::Device& device, const std::shared_ptr<const reconstruct::LampShadows>& shadows,
                           const std::vector<int>& lamp_ids, shader::FrameParams& params) {
  changed_ = shadows != shadows_ || (shadows && lamp_ids != lamp_ids_);
  if (changed_) {
    shadows_ = shadows;
    lamp_ids_ = lamp_ids;
    lamps_ = 0;
    std::array<shader::ObservedShadow, shader::kMaxLamps> heads;
    std::vector<float> open;
    for (std::size_t i = 0; i < heads.size(); ++i) {
      const reconstruct::LampShadow* shadow = shadows && i < lamp_ids.size() ? shadows->of(lamp_ids[i]) : nullptr;
      shader::ObservedShadow& head = heads[i];
      for (shader::vec4* row : {&head.origin, &head.x, &head.y, &head.z, &head.place}) row->setZero();
      head.cells.setZero();
      if (!shadow) continue;
      ++lamps_;
      const reconstruct::LampProjection& projection = shadow->projection;
      head.origin << projection.origin_m, projection.far ? 1.0f : 0.0f;
      head.x << projection.axes.row(0).transpose(), 0;
      head.y << projection.axes.row(1).transpose(), 0;
      head.z << projection.axes.row(2).transpose(), 0;
      head.place << shadow->min, shadow->cell, 0;
      head.cells << shadow->open.width, shadow->open.height, static_cast<int>(open.size()), 0;
      open.insert(open.end(), shadow->open.data.begin(), shadow->open.data.end());
    }
    if (lamps_ > 0) {
      fit(device, open.size());
      device.upload(*buffer_, 0, std::as_bytes(std::span(heads)));
      device.upload(*buffer_, sizeof(heads), std::as_bytes(std::span(open)));
    }
  }
  params.observed << lamps_, 0, 0, 0;
}

}  // namespace lumigraft::relight
