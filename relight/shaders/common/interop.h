// The uniform block of all passes, shared by C++ and GLSL (std140). All members have 16-byte alignment, so that both
// layouts agree.
//
// Lengths are metres in the tag frame, radiance W/sr/m² per channel. "Virtual": objects of the exhibit; "real":
// surfaces observed by the camera.
#ifndef LUMIGRAFT_INTEROP_H
#define LUMIGRAFT_INTEROP_H

#ifdef __cplusplus
#include <Eigen/Core>
namespace lumigraft::relight::shader {
using vec4 = Eigen::Vector4f;
using ivec4 = Eigen::Vector4i;
using mat4 = Eigen::Matrix4f;
#endif

const int kMaxLamps = 32;
const int kMaxSurfaces = 32;
const int kMaxMirrors = 8;
const int kMaxImages = 8;
const int kMaxGlass = 7;  // objects with transmissive materials of their own; further ones share the last
const int kOutline = 64;  // texels along an edge of a mirror's outline mask
const int kCascades = 2;
const int kMaxSides = 12;      // of the enclosure
const int kBrickCells = 8;     // voxels along the edge of a brick of the real distance field
const int kChunkEdge = 8;      // texels along the edge of a chunk of the volumes
const int kVertexFloats = 17;  // of objects: position, normal, both texture coordinates, colour, tangent
const int kChunkRow = 16;      // chunks per row along x and y of a pool

// A sphere or flat disc of uniform radiance. A lamp of unknown distance is placed very far away.
struct Lamp {
  vec4 position_radius;  // m, m
  vec4 facing;           // normal of a flat lamp; a: its intensity over n·ω; 0: not flat
  vec4 intensity;        // W/sr; a: number of its maps (LampMap); the maps are stored in the order of the lamps
};

// A shadow map's view of the objects, from a point of a lamp.
struct LampMap {
  vec4 from;     // that point; index of its first bounds
  vec4 x, y, z;  // axes; x and y are scaled by 1 / tan of the half angle; a of x: the near plane of its map of what
                 // moved in the room, m, whose depth is 1 - near / z; 0: there is none; a of y: texels down to that map
  vec4 place;    // first texel; a, b: depth is a - b / z
  vec4 more;     // texels along the edge; width of a texel at the objects, m; radius of its part of the lamp, m times
                 // texels per unit of x / z; rotation of the filter taps on that disc
};

// The shadow of a lamp that the colour camera sees (reconstruct/light/lamp_shadows.h).
struct ObservedShadow {
  vec4 origin;   // of the projection; a: 1: parallel, of a lamp that is infinitely far
  vec4 x, y, z;  // two axes across the light, and along it
  vec4 place;    // projected centre of the first cell; edge of a cell
  ivec4 cells;   // along x and y, 0: none; first value
};

// A known material of a real surface ([[real_surface]] of the session).
struct Surface {
  vec4 base_color_roughness;
  vec4 metallic_specular;  // x metallic, y specular
};

// Transmissive parts of an object.
struct Glass {
  vec4 ior_refracts;  // index of refraction; y: 1: it refracts
  vec4 absorption;    // of its volume, 1/m
};

// A flat piece of a surface with known material.
struct Mirror {
  vec4 plane;   // unit normal n of the reflecting side; n·p on the plane
  vec4 centre;  // of the bounding rectangle; number of its surface
  vec4 along;   // axes of the rectangle, divided by half its edges: coordinates from -1 to 1 inside
  vec4 across;
};

// A lamp's view of the objects: a square image of the sphere around them and of the surrounding penumbra.
struct ShadowView {
  vec4 x_scale;  // axes in the tag frame; 1 / tan of the half angle
  vec4 y;
  vec4 z_far;  // unit, towards the sphere's centre; distance of that, m
};

struct FrameParams {
  mat4 T_camera_tag;
  mat4 T_tag_camera;
  vec4 pinhole;     // fx fy cx cy
  vec4 distortion;  // k1 k2 p1 p2
  vec4 camera;      // k3, near plane in metres
  vec4 exposure;    // rgb: linear pixel value over radiance; a: highest pixel value that objects emit
  vec4 lens;        // x: maximum of |x, y| / z for which the distortion does not fold back
  vec4 emission;    // rgb: of all objects that emit, mean over all directions, W/sr
  vec4 blocked;     // rgb: fraction of the light that the objects do not let pass, in the mean over their surfaces
  Glass glass[kMaxGlass];
  ivec4 picture;      // width, height, trace scale, supersampling of the object
  vec4 cascade[2];    // centre of voxel (0, 0, 0), voxel size
  vec4 virtual_grid;  // the same for the virtual distance volume
  ivec4 grid;         // cascade voxels along the edge; virtual volume's voxels along x, y, z
  ivec4 bricks_low;   // first brick of the field's index
  ivec4 bricks_size;  // bricks along x, y, z; w: 1 when there is a field
  vec4 field;         // voxel and truncation of the real field, m; factor of the flux accumulators; inverse
  vec4 depth_noise;   // what noise explains of a difference from depth t, m: x + y t + z t²
  vec4 sphere;        // bounding sphere of all virtual objects
  ivec4 counts;       // lamps, cones towards the objects, cones over the hemisphere, shadow cones per lamp
  ivec4 counts2;      // cones of a glossy lobe, mips of the environment, surfaces of known material, voxel mips
  Lamp lamps[kMaxLamps];
  ShadowView shadow_views[kMaxLamps];
  Surface surfaces[kMaxSurfaces];
  Mirror mirrors[8];
  ivec4 mirror_counts;  // mirrors, images of lamps in mirrors
  ivec4 images[2];      // lamp + kMaxLamps × mirror, strongest first
  vec4 sh[9];           // residual environment of the fish-eye image, spherical harmonics of radiance
  vec4 probe;           // where the environment was captured; a: number of sides of the enclosure, 0: unknown
  vec4 enclosure;       // a point well inside the enclosure, origin of its map of change; a: number of measured sides
  vec4 sides[12];       // inward normals; offset: n·p + a > 0 inside
  vec4 gone;            // corner of the cells of surface that is gone; a: their edge, m, 0: none is
  ivec4 gone_cells;     // along x, y, z; w: differs between grids
  ivec4 observed;       // x: lamps with an ObservedShadow
  vec4 tag;             // x: half the edge of the printed tag including its white border
  ivec4 pass_i;         // parameters of a single pass
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
  vec4 tint;        // x: weight of the vertex colours; y: number of its Glass + 1, 0: opaque;
              // z: fraction of the light under the layer that passes the surface, or the factor of its texture; w:
              // radiance of the base colour 1 of an unlit surface, W/sr/m², 0: it is lit
  vec4 material;  // roughness, metallic, specular, object's number + 1
  vec4 emission;  // rgb: radiance of the front, W/sr/m²; a: 1 when a texture multiplies it
  vec4 maps;      // 1: a texture multiplies roughness (x), metallic (y); scale of the normal map (z), 0: none;
                  // 1: layer and body mixed as in glTF (w)
  vec4 coat;      // intensity and roughness of the clearcoat, or the factors of their textures; anisotropy², 0
  vec4 sheen;     // rgb: added to the base colour in place of sheen; a: what multiplies it before
  // The transform of each texture's coordinates, two rows of three each, in the order of TextureUse
  // (objects/texture.h); a of the first row: the set of coordinates; a of the second: 1 when the texture counts, for
  // those without a flag above.
  vec4 texture_rows[14];
};

#ifdef __cplusplus
static_assert(sizeof(FrameParams) <= 8192 && sizeof(FrameParams) % 16 == 0);
}  // namespace lumigraft::relight::shader
#endif
#endif
