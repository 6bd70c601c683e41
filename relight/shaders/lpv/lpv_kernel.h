// Constants of delta light propagation volumes, shared by C++ and GLSL.
//
// A cell stores the light that is about to leave it, per colour in spherical harmonics of order 1, scaled to be its
// flux Φ = ∫ I dω and its direction J = ∫ I ω dω. A step moves all of it to the six neighbours (thesis §5.3.1;
// Kaplanyan and Dachsbacher 2010). Whatever the projection over faces and solid angles, a linear step that treats all
// axes and both directions of each alike has this form, for the next cell along the axis a:
//
//   Φ' = stay_flux Φ + ahead J·a,    J' = lift Φ a + along (J·a) a + across (J - (J·a) a)
//
// A sixth for the first conserves energy exactly, for either sign: the six neighbours together receive the cell's
// content. The other four depend on the projection: clamped cosines behind each face, as published, lose two thirds of
// their direction in every step, so that light diffuses; upwind fluxes ∫ Y Y max(ω·a, 0) / |ω|₁ lose none, and
// oscillate. The values here are between the two: with the two constants of the irradiance they are a least squares fit
// to the light that a Lambert sphere sends to the plane under it and to the wall next to it, B (r/d)² cos θ, and a
// Lambert patch to surfaces that face it and that do not (closed_lpv_test.cpp and lpv_propagate_test.cpp measure the
// residuals).
#ifndef LUMIGRAFT_LPV_KERNEL_H
#define LUMIGRAFT_LPV_KERNEL_H

#ifdef __cplusplus
namespace lumigraft::relight::shader {
#endif

const float kLpvStay = 1.0f / 6.0f;
const float kLpvAhead = 0.2923f;
const float kLpvLift = 0.0565f;
const float kLpvAlong = 0.2643f;
const float kLpvAcross = 0.1119f;

const float kLpvOver = 1.3f;  // over-relaxation; diverges beyond 1.4

// Irradiance of a surface with the normal n that is half a cell away: (even Φ - directed J·n) / cell².
const float kLpvEven = 0.1241f;
const float kLpvDirected = 0.2498f;

const float kLpvShift = 0.5f;           // offset along the normal in cells, for injection and look-up
const float kLpvLambert = 2.0f / 3.0f;  // |J| / Φ of a clamped cosine
const float kLpvMinOpen = 0.05f;        // minimum open fraction of a cell's volume; with less it holds no light

#ifdef __cplusplus
}  // namespace lumigraft::relight::shader
#endif
#endif
