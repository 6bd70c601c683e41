#pragma once
// Stores the commands and executes them on submission, with a full memory barrier before each.
#include <functional>

#include "relight/gpu/egl/pipelines.h"
#include "relight/gpu/egl/resources.h"
#include "relight/gpu/texture_clear.h"

namespace lumigraft::relight::gpu::egl {

class EglCommandList final : public CommandList {
 public:
  EglCommandList(std::shared_ptr<Context> context, std::shared_ptr<const TextureClear> texture_clear)
      : context_(std::move(context)), texture_clear_(std::move(texture_clear)) {}

  bool is_software() const override { return context_->is_software(); }

  void begin_pass(std::string_view name) override;
  void dispatch(const ComputePipeline& pipeline, std::span<const Binding> bindings, std::span<const std::byte> params,
                int groups_x, int groups_y, int groups_z) override;
  void draw(const RasterPipeline& pipeline, const std::vector<const Texture*>& colors, const Texture& depth,
            std::span<const DrawCall> calls, const Area* area) override;
  void fill(const Buffer& buffer, std::uint32_t value) override;
  void clear(const Texture& texture, std::array<float, 4> value) override;

  /// Executes the commands, waits, and returns the times of the passes.
  std::vector<PassTime> run();
  const Context* context() const { return context_.get(); }

 private:
  struct BoundUnit {
    Binding::Kind kind;
    GLuint unit, handle;
    GLuint sampler;       ///< if sampled
    GLboolean is_volume;  ///< if storage_image, as is the next
    GLenum internal_format;
  };
  struct BoundParams {
    std::size_t offset = 0, bytes = 0;
  };
  struct Bound {
    std::vector<BoundUnit> units;
    BoundParams params;
    void apply(const Context& context) const;
  };

  void record(std::function<void()> command);
  Bound bind(const PipelineObjects& pipeline, std::span<const Binding> bindings, std::span<const std::byte> params);
  std::function<void()> draw_of(const EglRaster& pipeline, const DrawCall& call);
  void write_timestamp(std::size_t index);

  std::shared_ptr<Context> context_;
  std::shared_ptr<const TextureClear> texture_clear_;  ///< null on software devices, whose own clear is fast
  std::vector<std::function<void()>> commands_;
  std::vector<std::byte> params_;    ///< uniform blocks of all commands
  std::vector<std::string> passes_;  ///< one timestamp per pass, and one at the end
  bool submitted_ = false;
};

}  // namespace lumigraft::relight::gpu::egl
