// The numbers of delta light propagation volumes, shared by C++ and GLSL.
//
// A cell holds the light that is about to leave it, each colour in spherical harmonics of order 1, scaled to be its
// flux Φ = ∫ I dω and its direction J = ∫ I ω dω. One step moves all of it to the six cells around (thesis §5.3.1;
// Kaplanyan and Dachsbacher 2010). Whatever the projection over faces and solid angles is, a linear step that treats
// all axes and both directions of each alike has this form, for the cell ahead along the axis a:
//
//   Φ' = stay_flux Φ + ahead J·a,    J' = lift Φ a + along (J·a) a + across (J - (J·a) a)
//
// A sixth for the first keeps the energy exactly, of either sign: what six cells receive is what one held. The other
// four come out of the projection: clamped cosines behind each face as published lose two thirds of their direction
// every step, so that light creeps like heat; upwind fluxes ∫ Y Y max(ω·a, 0) / |ω|₁ keep all of it, and ring. These
// lie between the two: they and the two of the irradiance are the least squares fit to what a Lambert ball sends to the
// plane under it and to the wall beside it, B (r/d)² cos θ, and a Lambert patch to what faces it and what does not
// (closed_lpv_test.cpp and lpv_propagate_test.cpp measure what is left).
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

const float kLpvOver = 1.3f;  // over-relaxation; beyond 1.4 it no longer converges

// Irradiance of a surface with the normal n that is half a cell away: (even Φ - directed J·n) / cell².
const float kLpvEven = 0.1241f;
const float kLpvDirected = 0.2498f;

const float kLpvShift = 0.5f;           // cells along the normal, for what is injected and what is looked up
const float kLpvLambert = 2.0f / 3.0f;  // |J| / Φ of a clamped cosine
const float kLpvLeastOpen = 0.05f;      // open part of a cell's volume: less holds no light

#ifdef __cplusplus
}  // namespace lumigraft::relight::shader
#endif
#endif
