#pragma once
// The GPU interface of all passes. Implemented by Vulkan and by OpenGL through EGL; requires compute, 3D storage images
// and integer atomics.
//
// Shaders are referred to by name; their SPIR-V is built into the program. Every shader uses descriptor set 0 with
// explicit bindings. Binding 0 is always the uniform block of the pass (std140, at most 8192 bytes, one struct from
// relight/shaders/common/interop.h shared by C++ and GLSL); the command list copies it at record time. Every slot that
// a shader reads or writes requires a binding; one that it only declares (in a header) may be left out.
//
// A CommandList records; submit() executes it once and waits. Every command sees all writes of the previous ones (the
// list inserts the barriers), for any combination of storage, sampled, attachment and copy use. Resources used by a
// list must live until it is submitted. Textures and buffers are initialized to zero.
//
// Orientation: row 0 of a texture is the top of the image, clip-space y = -1 (so a camera with x right, y down, z
// forward needs no flip), gl_FragCoord.y = 0.5, texture coordinate v = 0. Clip-space depth runs from 0 (near) to w
// (far). Front faces are counter-clockwise as seen in that image. Texels are ordered x fastest, then y, then z.
//
// Errors: device failures throw GpuError, or DeviceLost if only another device helps; misuse throws std::logic_error
// that names the shader and the slot. Objects of a lost device may and must still be destroyed. One that hangs, which
// hang.h defines, keeps its memory. A device and its objects may be used by one thread at a time.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "relight/gpu/holdings.h"

namespace lumigraft::relight::gpu {

class GpuError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The device hung, crashed or was removed, and its contents are lost.
class DeviceLost : public GpuError {
 public:
  using GpuError::GpuError;
};

/// Its work did not end, and what it held is never freed.
class DeviceHung : public DeviceLost {
 public:
  using DeviceLost::DeviceLost;
};

enum class Format {
  r8_unorm,
  rgba8_unorm,
  rgba8_srgb,  ///< decoded before it is filtered; to be sampled alone
  r16_float,
  rgba16_float,
  r32_float,
  rg32_float,
  rgba32_float,
  depth32_float
};
std::size_t bytes_per_texel(Format format);

/// nearest and linear use the nearest mip. depth32_float supports nearest only.
enum class Filter { nearest, linear, linear_mip_linear };
/// What a sampled texture shows where its coordinates are outside 0 to 1.
enum class Wrap { clamp_to_edge, repeat, mirrored_repeat };

/// How a texture is sampled.
struct Sampling {
  Filter filter = Filter::nearest;
  Wrap wrap_u = Wrap::clamp_to_edge, wrap_v = Wrap::clamp_to_edge;  ///< that of a third coordinate clamps

  static constexpr std::size_t kCount = 3 * 3 * 3;
  constexpr std::size_t index() const {
    return (static_cast<std::size_t>(filter) * 3 + static_cast<std::size_t>(wrap_u)) * 3 +
           static_cast<std::size_t>(wrap_v);
  }
  static constexpr Sampling at(std::size_t index) {
    return {static_cast<Filter>(index / 9), static_cast<Wrap>(index / 3 % 3), static_cast<Wrap>(index % 3)};
  }
};

struct TextureDesc {
  std::string name;
  int width = 1, height = 1, depth = 1;  ///< depth > 1 or volume = true makes a 3D texture
  bool volume = false;
  int mips = 1;
  Format format = Format::rgba16_float;
  bool host_written = false;  ///< often, by upload_rgb: kept where the host can write it, if the device has such memory
  bool attachment = false;  ///< mip 0 may be drawn to; textures can always be sampled, stored to (not depth32), copied
};

inline TextureDesc volume_desc(std::string name, int width, int height, int depth, Format format) {
  return {.name = std::move(name), .width = width, .height = height, .depth = depth, .volume = true, .format = format};
}

class Texture {
 public:
  virtual ~Texture();
  const TextureDesc& desc() const { return desc_; }

 protected:
  Texture(TextureDesc desc, std::shared_ptr<Holdings> holdings);
  TextureDesc desc_;

 private:
  std::shared_ptr<Holdings> holdings_;
};

class Buffer {
 public:
  virtual ~Buffer();
  std::size_t size_bytes() const { return size_bytes_; }
  const std::string& name() const { return name_; }

 protected:
  Buffer(std::size_t size_bytes, std::string name, std::shared_ptr<Holdings> holdings);
  std::size_t size_bytes_;
  std::string name_;

 private:
  std::shared_ptr<Holdings> holdings_;
};

class ComputePipeline {
 public:
  virtual ~ComputePipeline() = default;
};
class RasterPipeline {
 public:
  virtual ~RasterPipeline() = default;
};

struct VertexAttribute {
  int location;
  int floats;  ///< 2 to 4
  int offset_bytes;
};

struct RasterDesc {
  std::string vertex_shader, fragment_shader;
  int vertex_stride_bytes = 0;
  std::vector<VertexAttribute> attributes;
  std::vector<Format> color_formats;
};

struct Binding {
  enum class Kind { sampled, storage_image, storage_buffer };
  Kind kind;
  int slot;  ///< layout(binding = slot), 1 and up
  const Texture* texture = nullptr;
  const Buffer* buffer = nullptr;
  Sampling sampling = {};  ///< if sampled
};
Binding sampled(int slot, const Texture& texture, Filter filter = Filter::nearest, Wrap wrap_u = Wrap::clamp_to_edge,
                Wrap wrap_v = Wrap::clamp_to_edge);
Binding image(int slot, const Texture& texture);  ///< mip 0
Binding storage(int slot, const Buffer& buffer);

/// Part of a target, in texels.
struct Area {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Part of mip 0 of a 2D texture.
struct TexturePart {
  const Texture* texture = nullptr;
  Area area;
};

struct DrawCall {
  std::vector<Binding> bindings;
  std::span<const std::byte> params;  ///< copied at record time
  const Buffer* vertices = nullptr;
  const Buffer* indices = nullptr;  ///< 32-bit, triangles
  std::uint32_t index_count = 0;
};

struct PassTime {
  std::string name;
  double gpu_ms = 0;  ///< between the device's timestamps
};

class CommandList {
 public:
  virtual ~CommandList() = default;
  virtual bool is_software() const = 0;  ///< a software device runs it: threads without work cost time
  /// Starts a named time span; it ends at the next one or at the end of the list.
  virtual void begin_pass(std::string_view name) = 0;
  virtual void dispatch(const ComputePipeline& pipeline, std::span<const Binding> bindings,
                        std::span<const std::byte> params, int groups_x, int groups_y = 1, int groups_z = 1) = 0;
  /// Clears mip 0 of the colours to 0 and of the depth to 1, the far plane, and draws what is not farther than the
  /// depth. `area`: the region cleared and drawn to; null: the whole targets.
  virtual void draw(const RasterPipeline& pipeline, const std::vector<const Texture*>& colors, const Texture& depth,
                    std::span<const DrawCall> calls, const Area* area = nullptr) = 0;
  virtual void fill(const Buffer& buffer, std::uint32_t value) = 0;
  virtual void clear(const Texture& texture, std::array<float, 4> value) = 0;  ///< all mips
};

class Device {
 public:
  virtual ~Device() = default;
  virtual std::string name() const = 0;
  virtual bool is_software() const = 0;          ///< it draws on the processor
  virtual const Holdings& holdings() const = 0;  ///< of textures and buffers
  virtual std::unique_ptr<Texture> create_texture(const TextureDesc& desc) = 0;
  virtual std::unique_ptr<Buffer> create_buffer(std::size_t size_bytes, std::string_view name) = 0;
  /// The shader is compiled at the pipeline's first use; the driver's errors are thrown there.
  virtual std::unique_ptr<ComputePipeline> create_compute(std::string_view shader) = 0;
  virtual std::unique_ptr<RasterPipeline> create_raster(const RasterDesc& desc) = 0;

  // Uploads are seen by every list that is submitted and every download after them, which may also be what reports that
  // one of them failed.
  virtual void upload(const Texture& texture, int mip, std::span<const std::byte> texels) = 0;
  /// RGB of 8 bits to an rgba8_unorm texture, with alpha 1; straight into the texture where the device allows it.
  virtual void upload_rgb(const Texture& texture, std::span<const std::uint8_t> rgb) = 0;
  virtual void upload(const Buffer& buffer, std::size_t offset, std::span<const std::byte> bytes) = 0;
  virtual std::vector<std::byte> download(const Texture& texture, int mip = 0) = 0;
  virtual std::vector<std::byte> download(const Buffer& buffer) = 0;
  /// Texels by part, rows in order, in one transfer.
  virtual std::vector<std::vector<std::byte>> download(std::span<const TexturePart> parts) = 0;

  virtual std::unique_ptr<CommandList> begin() = 0;
  virtual std::vector<PassTime> submit(CommandList& list) = 0;  ///< executes and waits
};

/// A compiled shader, made by lumigraft_shaders() of cmake/Shaders.cmake.
struct ShaderCode {
  std::string_view name;  ///< the file's name without its folder, e.g. "compose.comp"
  std::span<const std::uint32_t> spirv;
};

struct DeviceOptions {
  bool validation = false;  ///< messages of the validation layer are thrown as GpuError; slow, for tests
  std::span<const ShaderCode> more_shaders = {};              ///< in addition to the product's own
  std::optional<std::chrono::milliseconds> hangs_after = {};  ///< instead of what hang.h says of such a device
};
/// Selects a discrete GPU, else an integrated one, else a software one; if the environment variable
/// LUMIGRAFT_VULKAN_DEVICE is set, among those whose name contains it. Throws GpuError with the reason for each
/// rejection.
std::unique_ptr<Device> create_vulkan_device(const DeviceOptions& options);
/// The first hardware device of EGL, else a software one; if the environment variable LUMIGRAFT_EGL_DEVICE is set,
/// among those whose name contains it. Throws GpuError with the reason for each rejection.
std::unique_ptr<Device> create_egl_device(const DeviceOptions& options);

/// best: a hardware GPU before software, then Vulkan before EGL.
enum class Backend { best, vulkan, egl };
std::string_view name_of(Backend backend);  ///< "best", "vulkan", "egl"
std::optional<Backend> backend_named(std::string_view name);
Backend best_backend();  ///< vulkan or egl; throws GpuError with the reason for each rejected device
std::unique_ptr<Device> create_device(Backend backend, const DeviceOptions& options);

struct DeviceListing {
  Backend backend = Backend::best;
  std::string name;
  bool software = false;
  std::string rejection_reason = {};  ///< empty: usable
};
/// Every device of this machine, and one entry for each backend without devices. Never throws.
std::vector<DeviceListing> list_devices();

/// The bytes of a uniform struct, for `params`.
template <typename T>
std::span<const std::byte> bytes_of(const T& value) {
  return std::as_bytes(std::span<const T, 1>(&value, 1));
}

}  // namespace lumigraft::relight::gpu
