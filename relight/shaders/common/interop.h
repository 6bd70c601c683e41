// The one uniform block of every pass, shared by C++ and GLSL (std140). Only 16-byte members, so both agree.
//
// Lengths are metres in the tag frame, radiance W/sr/m² per channel. "Virtual" is what the exhibit adds, "real" what
// the camera saw.
#ifndef LUMIGRAFT_INTEROP_H
#define LUMIGRAFT_INTEROP_H

#ifdef __cplusplus
#include <Eigen/Core>
namespace lumigraft::relight::shader {
using vec4 = Eigen::Vector4f;
using ivec4 = Eigen::Vector4i;
using mat4 = Eigen::Matrix4f;
#endif

const int kMaxLamps = 8;
const int kMaxSurfaces = 32;
const int kMaxMirrors = 8;
const int kMaxImages = 8;
const int kOutline = 64;  // texels along an edge of the picture of a mirror's outline
const int kCascades = 2;
const int kMaxSides = 12;   // of the enclosure
const int kBrickCells = 8;  // voxels along a brick of the real distance field
const int kChunkEdge = 8;   // texels along a chunk of the volumes
const int kChunkRow = 16;   // chunks along x and y of a pool of them

// A lamp as a sphere or a flat disc of even radiance. A lamp without a known distance stands very far away.
struct Lamp {
  vec4 position_radius;  // m, m
  vec4 facing;           // normal of a flat lamp; a: what its intensity is over n·ω; 0: not flat
  vec4 intensity;        // W/sr; a: how many maps it has (LampMap), the lamps' maps following each other
};

// The view of a point of a lamp over the objects.
struct LampMap {
  vec4 from;     // that point; where its bounds begin
  vec4 x, y, z;  // axes; x and y times 1 / tan of the half angle
  vec4 place;    // first texel; a, b: depth is a - b / z
  vec4 more;  // texels along the edge; width of one where the objects are, m; radius of its share of the lamp, m times
              // texels per unit of x / z; turn of the taps over that
};

// A known material of a real surface ([[real_surface]] of the session).
struct Surface {
  vec4 base_color_roughness;
  vec4 metallic_specular;  // x metallic, y specular
};

// A flat piece of a known surface.
struct Mirror {
  vec4 plane;   // unit normal n of the side that mirrors; n·p on the plane
  vec4 centre;  // of the rectangle around it; number of its surface
  vec4 along;   // axes of the rectangle, over half its edges: from -1 to 1 inside
  vec4 across;
};

// What a lamp sees of the objects: a square picture of the sphere around them, and of the penumbra beside it.
struct ShadowView {
  vec4 x_scale;  // axes in the tag frame; 1 / tan of the half angle
  vec4 y;
  vec4 z_far;  // towards the middle of the sphere; how far away that is, m
};

struct FrameParams {
  mat4 T_camera_tag;
  mat4 T_tag_camera;
  vec4 pinhole;       // fx fy cx cy
  vec4 distortion;    // k1 k2 p1 p2
  vec4 camera;        // k3, exposure, 1 when pictures are sRGB-coded, near plane in metres
  vec4 lens;          // x: of |x, y| / z, up to which the distortion does not fold back
  ivec4 picture;      // width, height, trace scale, supersampling of the object
  vec4 cascade[2];    // centre of voxel (0, 0, 0), voxel size
  vec4 virtual_grid;  // the same for the virtual distance volume
  ivec4 grid;         // cascade voxels along the edge; virtual volume's voxels along x, y, z
  ivec4 bricks_low;   // first brick of the field's index
  ivec4 bricks_size;  // bricks along x, y, z; w: 1 when there is a field
  vec4 field;         // voxel and truncation of the real distance field, m; factor of the flux accumulators; 1/it
  vec4 sphere;        // around every virtual object
  ivec4 counts;       // lamps, cones to the object, cones over the hemisphere, shadow cones per lamp
  ivec4 counts2;      // cones of a glossy lobe, mips of the environment, surfaces, voxel mips
  Lamp lamps[8];
  ShadowView shadow_views[8];
  Surface surfaces[kMaxSurfaces];
  Mirror mirrors[8];
  ivec4 mirror_counts;  // mirrors, images of lamps in them
  ivec4 images[2];      // lamp + 8 × mirror, strongest first
  vec4 sh[9];           // remainder of the fish-eye picture, radiance
  vec4 probe;           // where the environment was seen from; a: how many sides the enclosure has, 0: it is unknown
  vec4 enclosure;  // a point well inside of it, around which its change is laid out; a: how many sides were measured
  vec4 sides[12];  // normals to the inside; offset: n·p + a > 0 inside
  vec4 tag;        // x: half the edge of the printed tag with its white border
  ivec4 pass_i;    // what one pass alone needs
  vec4 pass_f;
  vec4 pass_g;
  mat4 pass_m;
};

struct DrawParams {
  mat4 T_tag_model;
  mat4 T_view_tag;  // camera or lamp
  vec4 projection;  // pinhole: fx fy cx cy in the target's pixels; lamp: 1 / tan of the half angle in x
  vec4 distortion;  // k1 k2 p1 p2
  vec4 more;        // k3, near plane, target width, target height
  vec4 lens;        // as in FrameParams
  vec4 base_color;  // rgb; a: 1 when there is a texture
  vec4 tint;        // x: share of the vertex colours
  vec4 material;    // roughness, metallic, specular, object's number + 1
};

#ifdef __cplusplus
static_assert(sizeof(FrameParams) <= 4096 && sizeof(FrameParams) % 16 == 0);
}  // namespace lumigraft::relight::shader
#endif
#endif
