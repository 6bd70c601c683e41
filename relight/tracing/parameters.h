#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.

namespace lumigraft::relight {
inline constexpr struct TracingParameters {
  float between_layers = 1e-5f;                        ///< least distance of surfaces along a ray, relative
  float lift = 3e-5f, before_lamp_m = 1e-4f;           ///< ray origins, m within 1 m of the origin; ends of shadow rays
  float same_depth = 0.004f, same_surface_voxels = 2;  ///< relative difference up to which a pixel shows the point
  int sky_width = 128, sky_height = 64;                ///< of spherical harmonics as an image, pixels
  int cells = 12, cell_rays = 96, rays_around = 8;     ///< along a side of the enclosure; per cell; at a shadow's rim
  float behind_voxels = 3, cell_offset_m = 1e-3f;      ///< of the enclosure behind the surfaces; of its rays' origins
  float min_footprint_cosine = 0.05f;  ///< bound of a ray's footprint, which is infinite at the silhouette
  float wider = 1.1f;                  ///< margin on the region of a shadow that the rays find
  // Objects that emit: a triangle's mean emission is that of so many points squared; a patch is the mean of as many.
  int emission_edge_points = 4, emission_patch_points = 16;
  float min_emission = 0.01f;  ///< of a textured triangle over its factor: the points may miss what is small and bright
  float emission_rays = 16;    ///< over the hemisphere: other numbers of rays are weighted as these, the default plan's
  float near_radii = 3;        ///< within them light is the sum of all patches, farther away so many are one: 1 % off
  int merged_patches = 4;
  // Photons. Of k neighbours, the noise of their density is about 1.15 / √k: 16 %, at a distance that a fraction k of
  // all spreads over.
  int photon_neighbours = 50, photons_per_leaf = 8, photon_block = 1024;
  float min_photon_radius_m = 1e-4f;  ///< where photons coincide: the origins of rays are no nearer to surfaces
  int beam_pilots = 64, min_beam_photons = 256, max_photon_bounces = 64;
  float max_albedo = 1;  ///< of enclosure cells: the centre of the range over which enclosure_light.comp fades out
} kTracing;
}  // namespace lumigraft::relight
