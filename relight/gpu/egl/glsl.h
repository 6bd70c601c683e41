#pragma once
// SPIR-V to the GLSL that OpenGL 4.5 takes, by SPIRV-Cross. It is done when a pipeline is made and not when the program
// is built: descriptor slots become texture, image and buffer units (OpenGL counts each kind apart, and grants as few
// as eight), and the units of a raster pipeline are known only once its two stages are together.
#include <map>

#include "relight/gpu/shader_reflection.h"

namespace lumigraft::relight::gpu::egl {

/// By slot: the unit of its kind. The used slots of each kind are numbered from 0.
std::map<int, int> assign_units(const ShaderInterface& interface);

std::string glsl_of(const ShaderCode& shader, const std::map<int, int>& units);

}  // namespace lumigraft::relight::gpu::egl
