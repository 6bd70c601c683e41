#pragma once
// Converts SPIR-V to GLSL for OpenGL 4.5, by SPIRV-Cross. Done when a pipeline is created, not at build time:
// descriptor slots become texture, image and buffer units (OpenGL numbers each kind separately, and guarantees as few
// as eight), and the units of a raster pipeline are known only once its two stages are combined.
#include <map>

#include "relight/gpu/shader_reflection.h"

namespace lumigraft::relight::gpu::egl {

/// By slot: the unit within its kind. The used slots of each kind are numbered from 0.
std::map<int, int> assign_units(const ShaderInterface& interface);

std::string glsl_of(const ShaderCode& shader, const std::map<int, int>& units);

}  // namespace lumigraft::relight::gpu::egl
