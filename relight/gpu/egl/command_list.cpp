#include "relight/gpu/egl/command_list.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu::egl {
namespace {

/// Attaches the targets of a draw to the single framebuffer.
struct Targets {
  std::vector<GLuint> colors;
  GLuint depth = 0;
  int width = 0, height = 0;
  Area area;

  void attach(GLuint framebuffer) const {
    std::vector<GLenum> points;
    for (const GLuint color : colors) {
      points.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(points.size()));
      glNamedFramebufferTexture(framebuffer, points.back(), color, 0);
    }
    glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT, depth, 0);
    glNamedFramebufferDrawBuffers(framebuffer, static_cast<GLsizei>(points.size()), points.data());
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width, height);
    glEnable(GL_SCISSOR_TEST);
    glScissor(area.x, area.y, area.width, area.height);
  }

  void clear(GLuint framebuffer) const {
    const std::array<float, 4> nothing{};
    for (std::size_t i = 0; i < colors.size(); ++i) {
      glClearNamedFramebufferfv(framebuffer, GL_COLOR, static_cast<GLint>(i), nothing.data());
    }
    const float far_plane = 1;
    glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &far_plane);
  }

  /// Otherwise the framebuffer would keep textures alive.
  void detach(GLuint framebuffer) const {
    glDisable(GL_SCISSOR_TEST);
    for (std::size_t i = 0; i < colors.size(); ++i) {
      glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i), 0, 0);
    }
    glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT, 0, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
  }
};

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
      one.handle = own<EglBuffer>(*binding.buffer, *context_).handle();
      continue;
    }
    const EglTexture& texture = own<EglTexture>(*binding.texture, *context_);
    one.handle = texture.handle();
    if (binding.kind == Binding::Kind::sampled) {
      one.sampler = context_->sampler(binding.sampling);
    } else {
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
        glBindImageTexture(one.unit, one.handle, 0, one.is_volume, 0, GL_READ_WRITE, one.internal_format);
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
  const GLuint vertices = own<EglBuffer>(*call.vertices, *context_).handle();
  const GLuint indices = own<EglBuffer>(*call.indices, *context_).handle();
  return [this, bound = bind(pipeline.objects(), call.bindings, call.params), array = pipeline.objects().vertex_array,
          stride = pipeline.desc().vertex_stride_bytes, vertices, indices,
          count = static_cast<GLsizei>(call.index_count)] {
    if (count == 0) return;
    bound.apply(*context_);
    glVertexArrayVertexBuffer(array, 0, vertices, 0, stride);
    glVertexArrayElementBuffer(array, indices);
    glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
  };
}

void EglCommandList::draw(const RasterPipeline& pipeline, const std::vector<const Texture*>& colors,
                          const Texture& depth, std::span<const DrawCall> calls, const Area* area) {
  const EglRaster& raster = own_object<const EglRaster>(pipeline, *context_, "a pipeline");
  check_draw(raster.objects().name, raster.desc(), colors, depth, calls, area);
  const Current current = context_->enter();

  Targets targets;
  for (const Texture* color : colors) targets.colors.push_back(own<EglTexture>(*color, *context_).handle());
  targets.depth = own<EglTexture>(depth, *context_).handle();
  targets.width = depth.desc().width;
  targets.height = depth.desc().height;
  targets.area = area ? *area : Area{0, 0, targets.width, targets.height};
  std::vector<std::function<void()>> draws;
  for (const DrawCall& call : calls) draws.push_back(draw_of(raster, call));

  record([this, targets = std::move(targets), draws = std::move(draws), program = raster.objects().program,
          array = raster.objects().vertex_array] {
    const GLuint framebuffer = context_->framebuffer();
    targets.attach(framebuffer);
    targets.clear(framebuffer);
    glUseProgram(program);
    glBindVertexArray(array);
    for (const auto& one : draws) one();
    targets.detach(framebuffer);
  });
}

void EglCommandList::fill(const Buffer& buffer, std::uint32_t value) {
  record([&target = own<EglBuffer>(buffer, *context_), value] { target.fill(value); });
}

void EglCommandList::clear(const Texture& texture, std::array<float, 4> value) {
  if (texture_clear_ && texture_clear_->record(*this, texture, value)) return;
  record([&target = own<EglTexture>(texture, *context_), value] { target.clear(value); });
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
  context_->finish("running a command list");

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
