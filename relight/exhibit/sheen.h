#pragma once
// Sheen of KHR_materials_sheen: the fibres of cloth (Estevez & Kulla 2017, "Production Friendly Microfacet Sheen
// BRDF"). `alpha`: sheenRoughness². All functions without the sheen's colour. Directional albedos are those of a table,
// made at the first call, interpolated: up to 0.006 off.

namespace lumigraft::relight {

constexpr float kMinSheenAlpha = 0.01f;  ///< reflects 2 % of even light; smaller ones are drawn as this

/// BRDF, 1/sr: microfacets of the distribution "Charlie" (eq. 2), with its fitted masking (eq. 3) without the
/// terminator of eq. 4, as in the extension. Cosines of both directions and of the halfway vector with the normal.
float sheen_brdf(float alpha, float cos_v, float cos_w, float cos_half);

/// Reflectance of light from all sides to a direction.
float sheen_albedo(float alpha, float cos_v);
/// Its mean, weighted by the cosine, and that of the larger one of two directions, of which one is given.
float sheen_albedo_evenly(float alpha);
float larger_sheen_albedo(float alpha, float cos_v);
/// And over both.
float larger_sheen_albedo_evenly(float alpha);

}  // namespace lumigraft::relight
