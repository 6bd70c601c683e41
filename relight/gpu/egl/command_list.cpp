#include "relight/gpu/egl/command_list.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu::egl {
namespace {

/// Attaches the targets of a draw to the single framebuffer.
struct Targets {
  struct Target {
    GLenum point;
    GLuint texture;
    bool clear, integer;
    std::array<float, 4> clear_color;
  };
  std::vector<Target> colors;
  Target depth{};
  bool has_depth = false;
  int width = 0, height = 0;
  Area area;

  void attach(GLuint framebuffer) const {
    std::vector<GLenum> points;
    for (const Target& color : colors) {
      glNamedFramebufferTexture(framebuffer, color.point, color.texture, 0);
      points.push_back(color.point);
    }
    if (has_depth) glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT, depth.texture, 0);
    glNamedFramebufferDrawBuffers(framebuffer, static_cast<GLsizei>(points.size()), points.data());
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width, height);
    glEnable(GL_SCISSOR_TEST);
    glScissor(area.x, area.y, area.width, area.height);
  }

  void clear(GLuint framebuffer) const {
    for (std::size_t i = 0; i < colors.size(); ++i) {
      if (!colors[i].clear) continue;
      if (colors[i].integer) {
        const std::array<GLuint, 4> value = integer_value(colors[i].clear_color);
        glClearNamedFramebufferuiv(framebuffer, GL_COLOR, static_cast<GLint>(i), value.data());
      } else {
        glClearNamedFramebufferfv(framebuffer, GL_COLOR, static_cast<GLint>(i), colors[i].clear_color.data());
      }
    }
    const float far_plane = 1;
    if (has_depth && depth.clear) {
      glDepthMask(GL_TRUE);
      glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &far_plane);
    }
  }

  /// Otherwise the framebuffer would keep textures alive.
  void detach(GLuint framebuffer) const {
    glDisable(GL_SCISSOR_TEST);
    for (const Target& color : colors) glNamedFramebufferTexture(framebuffer, color.point, 0, 0);
    if (has_depth) glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT, 0, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
  }
};

void set(GLenum capability, bool on) { on ? glEnable(capability) : glDisable(capability); }

}  // namespace

void EglCommandList::record(std::function<void()> command) {
  if (submitted_) throw std::logic_error("a command list that was submitted records nothing more");
  commands_.push_back(std::move(command));
}

void EglCommandList::begin_pass(std::string_view name) {
  const std::size_t index = passes_.size();
  record([this, index] { write_timestamp(index); });
  passes_.emplace_back(name);
}

void EglCommandList::write_timestamp(std::size_t index) { glQueryCounter(context_->timestamp(index), GL_TIMESTAMP); }

EglCommandList::Bound EglCommandList::bind(const PipelineObjects& pipeline, std::span<const Binding> bindings,
                                           std::span<const std::byte> params) {
  check_bindings(pipeline.name, pipeline.interface, bindings, params);
  Bound bound;
  for (const Binding& binding : bindings) {
    const auto unit = pipeline.units.find(binding.slot);
    if (unit == pipeline.units.end()) continue;  // declared but not accessed
    BoundUnit& one = bound.units.emplace_back();
    one.kind = binding.kind;
    one.unit = static_cast<GLuint>(unit->second);
    if (binding.kind == Binding::Kind::storage_buffer) {
      one.handle = own(*binding.buffer, *context_).handle();
      continue;
    }
    const EglTexture& texture = own(*binding.texture, *context_);
    if (binding.kind == Binding::Kind::sampled) {
      one.handle = texture.view_from(binding.mip);
      one.sampler = context_->sampler(binding.filter);
    } else {
      one.handle = texture.handle();
      one.level = binding.mip;
      one.is_volume = is_volume(texture.desc()) ? GL_TRUE : GL_FALSE;
      one.internal_format = gl_format(texture.desc().format).internal;
    }
  }
  if (pipeline.interface.params_used) {
    const std::size_t alignment = context_->limits().params_alignment;
    bound.params = {(params_.size() + alignment - 1) / alignment * alignment, (params.size() + 15) / 16 * 16};
    params_.resize(bound.params.offset + bound.params.bytes);
    std::copy(params.begin(), params.end(), params_.begin() + static_cast<std::ptrdiff_t>(bound.params.offset));
  }
  return bound;
}

void EglCommandList::Bound::apply(const Context& context) const {
  for (const BoundUnit& one : units) {
    switch (one.kind) {
      case Binding::Kind::sampled:
        glBindTextureUnit(one.unit, one.handle);
        glBindSampler(one.unit, one.sampler);
        break;
      case Binding::Kind::storage_image:
        glBindImageTexture(one.unit, one.handle, one.level, one.is_volume, 0, GL_READ_WRITE, one.internal_format);
        break;
      case Binding::Kind::storage_buffer:
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, one.unit, one.handle);
        break;
    }
  }
  if (params.bytes > 0) {
    glBindBufferRange(GL_UNIFORM_BUFFER, 0, context.params(), static_cast<GLintptr>(params.offset),
                      static_cast<GLsizeiptr>(params.bytes));
  }
}

void EglCommandList::dispatch(const ComputePipeline& pipeline, std::span<const Binding> bindings,
                              std::span<const std::byte> params, int groups_x, int groups_y, int groups_z) {
  const PipelineObjects& objects = own_object<const EglCompute>(pipeline, *context_, "a pipeline").objects();
  check_groups(objects.name, {groups_x, groups_y, groups_z}, context_->limits().groups);
  const Current current = context_->enter();
  Bound bound = bind(objects, bindings, params);
  if (groups_x == 0 || groups_y == 0 || groups_z == 0) return;
  record([this, program = objects.program, bound = std::move(bound), x = static_cast<GLuint>(groups_x),
          y = static_cast<GLuint>(groups_y), z = static_cast<GLuint>(groups_z)] {
    glUseProgram(program);
    bound.apply(*context_);
    glDispatchCompute(x, y, z);
  });
}

std::function<void()> EglCommandList::draw_of(const EglRaster& pipeline, const DrawCall& call) {
  const GLuint vertices = call.vertices ? own(*call.vertices, *context_).handle() : 0;
  const GLuint indices = call.indices ? own(*call.indices, *context_).handle() : 0;
  return [this, bound = bind(pipeline.objects(), call.bindings, call.params), array = pipeline.objects().vertex_array,
          stride = pipeline.desc().vertex_stride_bytes, vertices, indices,
          count = static_cast<GLsizei>(call.index_count)] {
    if (count == 0) return;
    bound.apply(*context_);
    if (vertices) glVertexArrayVertexBuffer(array, 0, vertices, 0, stride);
    if (indices) {
      glVertexArrayElementBuffer(array, indices);
      glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
    } else {
      glDrawArrays(GL_TRIANGLES, 0, count);
    }
  };
}

void EglCommandList::draw(const RasterPipeline& pipeline, std::span<const Attachment> colors, const Attachment* depth,
                          std::span<const DrawCall> calls, const Area* area) {
  const EglRaster& raster = own_object<const EglRaster>(pipeline, *context_, "a pipeline");
  check_draw(raster.objects().name, raster.desc(), colors, depth, calls, area);
  const Current current = context_->enter();

  Targets targets;
  const auto target_of = [&](const Attachment& attachment, GLenum point) -> Targets::Target {
    const TextureDesc& desc = attachment.texture->desc();
    targets.width = desc.width;
    targets.height = desc.height;
    return {point, own(*attachment.texture, *context_).handle(), attachment.clear, is_integer(desc.format),
            attachment.clear_color};
  };
  for (std::size_t i = 0; i < colors.size(); ++i) {
    targets.colors.push_back(target_of(colors[i], GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i)));
  }
  targets.has_depth = depth != nullptr;
  if (depth) targets.depth = target_of(*depth, GL_DEPTH_ATTACHMENT);
  targets.area = area ? *area : Area{0, 0, targets.width, targets.height};
  std::vector<std::function<void()>> draws;
  for (const DrawCall& call : calls) draws.push_back(draw_of(raster, call));

  record([this, targets = std::move(targets), draws = std::move(draws), program = raster.objects().program,
          array = raster.objects().vertex_array, depth_test = raster.desc().depth_test,
          cull = raster.desc().cull_back] {
    const GLuint framebuffer = context_->framebuffer();
    targets.attach(framebuffer);
    targets.clear(framebuffer);
    set(GL_DEPTH_TEST, depth_test);
    set(GL_CULL_FACE, cull);
    glUseProgram(program);
    glBindVertexArray(array);
    for (const auto& one : draws) one();
    targets.detach(framebuffer);
  });
}

void EglCommandList::fill(const Buffer& buffer, std::uint32_t value) {
  record([&target = own(buffer, *context_), value] { target.fill(value); });
}

void EglCommandList::clear(const Texture& texture, std::array<float, 4> value) {
  record([&target = own(texture, *context_), value] { target.clear(value); });
}

std::vector<PassTime> EglCommandList::run() {
  record([this] {
    if (!passes_.empty()) write_timestamp(passes_.size());
  });
  submitted_ = true;
  const Current current = context_->enter();
  if (!params_.empty()) {
    glNamedBufferData(context_->params(), static_cast<GLsizeiptr>(params_.size()), params_.data(), GL_STREAM_DRAW);
  }
  for (const auto& command : commands_) {
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    command();
  }
  glMemoryBarrier(GL_ALL_BARRIER_BITS);
  glFinish();
  context_->check("running a command list");

  std::vector<GLuint64> times_ns(passes_.empty() ? 0 : passes_.size() + 1);
  for (std::size_t i = 0; i < times_ns.size(); ++i) {
    glGetQueryObjectui64v(context_->timestamp(i), GL_QUERY_RESULT, &times_ns[i]);
  }
  std::vector<PassTime> times;
  for (std::size_t i = 0; i < passes_.size(); ++i) {
    times.push_back({passes_[i], static_cast<double>(times_ns[i + 1] - times_ns[i]) * 1e-6});
  }
  commands_.clear();
  return times;
}

}  // namespace lumigraft::relight::gpu::egl
