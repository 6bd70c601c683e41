#pragma once
// Memory of fusion while a camera walks about in a large hall for a day.

namespace lumigraft::test {

/// Fuses so many frames of a walk through a hall of 12 x 8 x 5 m with columns, a second apart, and prints memory eight
/// times.
void measure_walk(int frames);

}  // namespace lumigraft::test
