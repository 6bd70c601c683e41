#include "relight/gpu/egl/pipelines.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/egl/glsl.h"

namespace lumigraft::relight::gpu::egl {
namespace {

/// `read` is glGetShaderInfoLog or glGetProgramInfoLog.
std::string info_log(void (*read)(GLuint, GLsizei, GLsizei*, GLchar*), GLuint handle) {
  std::string log(4096, '\0');
  GLsizei length = 0;
  read(handle, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<std::size_t>(length));
  return log;
}

/// A compiled stage, needed only until its program is linked.
class Stage {
 public:
  Stage(GLenum type, const ShaderCode& shader, const std::map<int, int>& units) : handle(glCreateShader(type)) {
    const std::string source = glsl_of(shader, units);
    const char* text = source.c_str();
    glShaderSource(handle, 1, &text, nullptr);
    glCompileShader(handle);
    GLint compiled = 0;
    glGetShaderiv(handle, GL_COMPILE_STATUS, &compiled);
    if (compiled) return;
    const std::string log = info_log(glGetShaderInfoLog, handle);
    glDeleteShader(handle);
    throw GpuError("shader " + std::string(shader.name) + ": " + log);
  }
  ~Stage() { glDeleteShader(handle); }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  GLuint handle;
};

}  // namespace

PipelineObjects::~PipelineObjects() {
  const Current current(context->handle(), std::nothrow);
  if (!current.good()) return;
  glDeleteVertexArrays(1, &vertex_array);
  glDeleteProgram(program);
}

void PipelineObjects::link(std::span<const std::pair<GLenum, const ShaderCode*>> stages) {
  units = assign_units(interface);
  const GLuint made = glCreateProgram();
  try {
    for (const auto& [type, shader] : stages) {
      const Stage stage(type, *shader, units);
      glAttachShader(made, stage.handle);  // the program keeps a reference
    }
    glLinkProgram(made);
    GLint linked = 0;
    glGetProgramiv(made, GL_LINK_STATUS, &linked);
    if (!linked) throw GpuError("shader " + name + ": " + info_log(glGetProgramInfoLog, made));
    context->check("pipeline of shader " + name);
  } catch (...) {
    glDeleteProgram(made);
    throw;
  }
  program = made;
}

EglCompute::EglCompute(std::shared_ptr<Context> context, const ShaderCode& shader)
    : shader_(shader), objects_(std::move(context)) {
  objects_.name = shader.name;
  objects_.interface = reflect_shader(shader);
}

const PipelineObjects& EglCompute::objects() const {
  if (objects_.program != 0) return objects_;
  const Current current = objects_.context->enter();
  const std::pair<GLenum, const ShaderCode*> stages[] = {{GL_COMPUTE_SHADER, &shader_}};
  objects_.link(stages);
  return objects_;
}

EglRaster::EglRaster(std::shared_ptr<Context> context, const RasterDesc& desc, const ShaderCode& vertex,
                     const ShaderCode& fragment)
    : objects_(std::move(context)), desc_(desc) {
  objects_.name = std::string(vertex.name) + " + " + std::string(fragment.name);
  objects_.interface = join_stages(objects_.name, reflect_shader(vertex), reflect_shader(fragment));
  check_raster_desc(objects_.name, objects_.interface, desc_);
  const Current current = objects_.context->enter();
  const std::pair<GLenum, const ShaderCode*> stages[] = {{GL_VERTEX_SHADER, &vertex}, {GL_FRAGMENT_SHADER, &fragment}};
  objects_.link(stages);
  create_vertex_array();
}

void EglRaster::create_vertex_array() {
  GLuint& array = objects_.vertex_array;
  glCreateVertexArrays(1, &array);
  for (const VertexAttribute& attribute : desc_.attributes) {
    const auto location = static_cast<GLuint>(attribute.location);
    glEnableVertexArrayAttrib(array, location);
    glVertexArrayAttribFormat(array, location, attribute.floats, GL_FLOAT, GL_FALSE,
                              static_cast<GLuint>(attribute.offset_bytes));
    glVertexArrayAttribBinding(array, location, 0);
  }
  objects_.context->check("pipeline of shaders " + objects_.name);
}

}  // namespace lumigraft::relight::gpu::egl
