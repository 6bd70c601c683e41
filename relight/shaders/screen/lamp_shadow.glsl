// Look-up in the results of lamp_shadow.comp.
#ifndef LAMP_SHADOW_GLSL
#define LAMP_SHADOW_GLSL
#include "lamps/lamp_maps.glsl"
layout(binding = 10) uniform sampler2D lamp_shadows;

// Fraction of a lamp's light that objects occlude at p. A point farther from the lamp than the receiving surface by
// more than `slack` is already in that surface's shadow.
float lamp_hidden(int lamp, vec3 p, float slack) {
  ShadowView view = frame.shadow_views[lamp];
  vec3 to = p - frame.lamps[lamp].position_radius.xyz;
  float z = dot(to, view.z_far.xyz), edge = float(textureSize(lamp_shadows, 0).x);
  float images = float(textureSize(lamp_shadows, 0).y / textureSize(lamp_shadows, 0).x);
  vec2 q = vec2(dot(to, view.x_scale.xyz), dot(to, view.y.xyz)) * (view.x_scale.w / max(z, 1e-4));
  vec2 uv = clamp(0.5 + 0.5 * q, vec2(0.5 / edge), vec2(1.0 - 0.5 / edge));
  vec2 s = textureLod(lamp_shadows, vec2(uv.x, (uv.y + float(lamp)) / images), 0.0).xy;
  float inside = z > 0.0 ? clamp(16.0 * (1.0 - max(abs(q.x), abs(q.y))), 0.0, 1.0) : 0.0;
  return inside * s.x * clamp(2.0 - (z - view.z_far.w - s.y) / slack, 0.0, 1.0);
}

// How far what moved is in front of a surface to occlude it: not what is that surface itself.
float moved_before(LiveReal r) { return r.came ? r.slack : kBefore_m; }

// Irradiance of lamps that a real surface loses to the objects: where what moved occludes a lamp it is lost already.
vec3 lamps_lost(LiveReal r) {
  vec3 p = r.p, n = r.n;
  vec3 lost = vec3(0);
  for (int i = 0, map = 0; i < frame.counts.x; ++i) {
    Lamp lamp = frame.lamps[i];
    int maps = int(lamp.intensity.a), first = map;
    map += maps;
    vec3 to = lamp.position_radius.xyz - p;
    float far2 = dot(to, to);
    vec3 w = to * inversesqrt(far2);
    // What came is no receiver, and may be between the lamp and the objects.
    float hidden = r.came ? 0.0 : lamp_hidden(i, p, r.slack);
    for (int k = first; k < (r.came ? map : first); ++k)
      hidden += disc_hidden(lamp_views[k], p, kBefore_m) / float(maps);
    if (hidden > 0.0) hidden *= moved_open(first, maps, p, moved_before(r)) * shadow_open(i, p);
    lost += lamp.intensity.rgb * (emission(lamp, -w) * max(dot(n, w), 0.0) * hidden / far2);
  }
  return frame.blocked.rgb * lost;
}
#endif
