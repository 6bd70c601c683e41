#include "relight/passes/filter.h"

namespace lumigraft {

Filter::Filter(gpu::Device& device) : pipeline_(device.create_compute("mip.comp")) {}

void Filter::record(gpu::CommandList& list, const gpu::Texture& volume) const {
  for (int mip = 1; mip < volume.desc().mips; ++mip) {
    const int n = volume.desc().width >> mip;
    const std::vector<gpu::Binding> bindings{gpu::image(1, volume, mip - 1), gpu::image(2, volume, mip)};
    list.dispatch(*pipeline_, bindings, {}, (n + 7) / 8, (n + 3) / 4, ((volume.desc().depth >> mip) + 1) / 2);
  }
}

}  // namespace lumigraft
