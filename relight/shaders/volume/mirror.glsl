// Flat pieces of real surfaces with known material (relight/upload/mirrors.h). For passes that include volume.glsl.
#ifndef MIRROR_GLSL
#define MIRROR_GLSL
#include "common/brdf.glsl"

BsdfParams mirror_bsdf(Mirror m) { return bsdf_of(frame.surfaces[int(m.centre.w)]); }

// Whether a point of the plane is on the piece. The tag's paper covers the surface below it.
bool on_mirror(int i, vec3 p) {
  vec3 d = p - frame.mirrors[i].centre.xyz;
  vec2 q = vec2(dot(frame.mirrors[i].along.xyz, d), dot(frame.mirrors[i].across.xyz, d));
  float half_texel = 0.5 / float(kOutline);
  vec2 uv = clamp(0.5 + 0.5 * q, vec2(half_texel), vec2(1.0 - half_texel));
  bool covered = textureLod(mirror_outlines, vec2(uv.x, (uv.y + float(i)) / float(kMaxMirrors)), 0.0).r > 0.5;
  bool on_tag = all(lessThan(abs(p), vec3(frame.tag.xx, 0.01)));
  return covered && !on_tag && all(lessThan(abs(q), vec2(1.0)));
}

// Index of the piece that a cone along w hits at a point of a real surface; -1: none.
int mirror_at(vec3 p, vec3 w, float within_m) {
  int found = -1;
  for (int i = 0; i < frame.mirror_counts.x; ++i) {
    vec3 n = frame.mirrors[i].plane.xyz;
    float off = dot(n, p) - frame.mirrors[i].plane.w;
    if (found < 0 && dot(n, w) < 0.0 && abs(off) < within_m && on_mirror(i, p - off * n)) found = i;
  }
  return found;
}

// Continuation of a cone after reflection at a piece: the factor of the radiance it finds, its direction and aperture.
struct Bend {
  vec3 factor, w;
  float tan_half, metallic;
};
Bend bend_at(int mirror, vec3 w, float tan_half) {
  Mirror m = frame.mirrors[mirror];
  BsdfParams bsdf = mirror_bsdf(m);
  return Bend(fresnel(bsdf, -dot(m.plane.xyz, w)), reflect(w, m.plane.xyz), tan_half + 2.0 * bsdf.alpha,
              frame.surfaces[int(m.centre.w)].metallic_specular.x);
}
#endif
