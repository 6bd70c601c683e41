#pragma once
// LDR-FLIP: how much a viewer who flips between two pictures would see.
// Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild 2020, "FLIP: A Difference Evaluator for Alternating
// Images".
#include "capture/image.h"

namespace lumigraft::server {

/// 67 pixels per degree: a 0.7 m wide screen of 3840 pixels viewed from 0.7 m.
constexpr double kFlipPixelsPerDegree = 67.02;

/// Mean over the picture, from 0 (identical) to 1. Both pictures are R G B of equal size with displayed sRGB values in
/// [0, 1].
double mean_flip(const capture::Image<float>& reference, const capture::Image<float>& test);

}  // namespace lumigraft::server
