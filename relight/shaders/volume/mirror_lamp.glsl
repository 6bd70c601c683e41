// Light of lamps reflected by a flat piece of a surface with known material: lamp, q on the piece, p.
//
// For a point of the lamp the microfacet slope that reflects it to p is proportional to the distance of q from the
// point of perfect reflection: with the factor (1/a + 1/b) cos θ / 2 along the plane of incidence and (1/a + 1/b) / (2
// cos θ) across, where a and b are the distances from there to lamp and p. So slopes sampled from GGX (Walter et al.
// 2007, eq. 35: tan θ = α √(u/(1-u))) give sample points on the piece, and the BRDF over their density is close to its
// Fresnel factor for every sample.
#ifndef MIRROR_LAMP_GLSL
#define MIRROR_LAMP_GLSL
#include "volume/cone.glsl"
#include "lamps/lamp_maps.glsl"

struct MirrorSample {
  vec3 q;           // on the piece
  vec3 w;           // unit, from p to q
  float far;        // m, from p to q
  vec3 irradiance;  // W/m² on a plane facing q; 0: no light
  float tan_half;   // aperture of this sample's cone
  vec3 from;        // point of the lamp
  int map;          // index of the map with the lamp's view from there; -1: none
};

const float kMinSlant = 0.05;  // at smaller cosines the lobe on the piece gets no wider
const float kMinHeight_m = 1e-4;

MirrorSample mirror_sample(int mirror, int lamp_number, int first_map, vec3 p, int i, int n, float turn) {
  Mirror m = frame.mirrors[mirror];
  Lamp lamp = frame.lamps[lamp_number];
  BsdfParams bsdf = mirror_bsdf(m);
  vec3 normal = m.plane.xyz;
  MirrorSample s;
  s.irradiance = vec3(0);
  // A point of the lamp. Its order is uncorrelated with that of the slopes.
  int maps = int(lamp.intensity.a);
  float other = fract((float(i) + 0.5) * 0.61803399 + turn);
  s.map = maps > 0 ? first_map + min(int(other * float(maps)), maps - 1) : -1;
  vec3 x, y;
  basis(lamp.facing.a > 0.0 ? lamp.facing.xyz : normal, x, y);
  float phi = 2.0 * kPi * fract(float(i) * 0.75487767 + 0.5);
  s.from = maps > 0 ? lamp_views[s.map].from.xyz
                    : lamp.position_radius.xyz + lamp.position_radius.w * sqrt(other) * (cos(phi) * x + sin(phi) * y);

  float height = max(dot(normal, p) - m.plane.w, kMinHeight_m), from_height = dot(normal, s.from) - m.plane.w;
  vec3 foot = p - (dot(normal, p) - m.plane.w) * normal, from_foot = s.from - from_height * normal;
  vec3 glass = mix(foot, from_foot, height / (height + max(from_height, kMinHeight_m)));
  float a = length(s.from - glass), b = length(foot + height * normal - glass), slant = max(from_height / a, kMinSlant);
  vec3 along = from_foot - glass;
  basis(normal, x, y);
  along = dot(along, along) > 1e-8 * a * a ? normalize(along) : x;
  float u = (float(i) + 0.5) / float(n), slope = bsdf.alpha * sqrt(u / (1.0 - u)), spread = 2.0 / (1.0 / a + 1.0 / b);
  phi = 2.39996323 * float(i) + 2.0 * kPi * turn;
  s.q = glass + spread * slope * (cos(phi) / slant * along + sin(phi) * slant * cross(normal, along));

  vec3 to_lamp = s.from - s.q, to_p = foot + height * normal - s.q;
  float lamp_far = length(to_lamp), far = length(to_p);
  vec3 l = to_lamp / lamp_far, v = to_p / far;
  s.w = -v;
  s.far = far;
  // Angular size of the sample's blurred image: the lamp's own size, and the lobe's.
  float wide = lamp.position_radius.w / (a + b) + 2.0 * bsdf.alpha * a / (a + b);
  s.tan_half = min(kLampConeScale * inversesqrt(float(n)) * wide, 0.3);
  float nl = dot(normal, l), nv = dot(normal, v);
  if (from_height <= 0.0 || dot(normal, p) < m.plane.w - 0.5 * frame.virtual_grid.w || nl <= 0.0 || nv <= 0.0 || !on_mirror(mirror, s.q)) return s;
  // D as a function of the slope: the cosine has too few digits for a polished surface.
  vec3 h = l + v;
  float nh = dot(normal, h), a2 = bsdf.alpha * bsdf.alpha;
  vec3 flat_h = h - nh * normal;
  float tan2 = dot(flat_h, flat_h) / (nh * nh), cos2 = 1.0 / (1.0 + tan2);
  float d_over_slopes = (1.0 / (cos2 * cos2)) * pow((a2 + slope * slope) / (a2 + tan2), 2.0);
  float g = 1.0 / (1.0 + smith_lambda(bsdf.alpha, nv) + smith_lambda(bsdf.alpha, nl));
  // Relative to perfect reflection over the whole distance a + b.
  float along_ways = a * b / (lamp_far * far);
  float rough = d_over_slopes * g * along_ways * along_ways;
  s.irradiance = lamp.intensity.rgb * fresnel(bsdf, dot(v, normalize(h))) *
                 (emission(lamp, -l) * rough / ((a + b) * (a + b) * float(n)));
  return s;
}

// Occlusion of the two segments of a sample. `from_p` is the origin of other cones from p.
struct MirrorWays {
  Cone down, up;  // from p to the piece, from there to the lamp
  float room_end; // end of the first segment for real surfaces: the piece's own distances would close the cone
  float lamp_far;
};
MirrorWays mirror_ways(int mirror, MirrorSample s, Cone from_p) {
  vec3 normal = frame.mirrors[mirror].plane.xyz, to = s.from - s.q;
  float lift = cone_start_m(), falls = max(-dot(normal, s.w), 0.05);
  MirrorWays ways;
  ways.down = from_p;
  ways.down.w = s.w;
  ways.down.tan_half = ways.up.tan_half = s.tan_half;
  ways.room_end = s.far - (lift + s.tan_half * s.far) / falls;
  ways.lamp_far = length(to);
  ways.up.from_virtual = s.q;
  ways.up.from_real = s.q + lift * normal;
  ways.up.w = to / ways.lamp_far;
  return ways;
}
// Fraction that virtual surfaces occlude, on either segment.
float mirror_hidden(MirrorSample s, MirrorWays ways) {
  float hidden = s.map >= 0 ? map_hidden(lamp_views[s.map], s.q, kBefore_m) : virtual_shadow(ways.up, ways.lamp_far);
  return 1.0 - (1.0 - hidden) * (1.0 - virtual_shadow(ways.down, hidden < 0.995 ? s.far : 0.0));
}
// Fraction that real surfaces let pass; `asked` false: not evaluated, as the result is unused.
float mirror_open(MirrorWays ways, bool asked) {
  return (1.0 - real_shadow(ways.down, asked ? ways.room_end : 0.0)) *
         (1.0 - real_shadow(ways.up, asked ? ways.lamp_far : 0.0));
}

// An image of a lamp: index of its mirror, of the lamp, and of the first of the lamp's maps.
ivec3 image_of(int i) {
  int image = frame.images[i >> 2][i & 3], lamp = image % kMaxLamps;
  return ivec3(image / kMaxLamps, lamp, first_map_of(lamp));
}

// Irradiance by images of lamps on a virtual surface; and the part of it that objects occlude at a real one.
vec3 mirrored_irradiance(vec3 p, vec3 n, Cone from_p, int count, float turn) {
  vec3 e = vec3(0);
  for (int j = 0; j < frame.mirror_counts.y; ++j) {
    ivec3 image = image_of(j);
    for (int i = 0; i < count; ++i) {
      MirrorSample s = mirror_sample(image.x, image.y, image.z, p, i, count, turn);
      float cosine = dot(n, s.w);
      if (cosine <= 0.0 || s.irradiance == vec3(0)) continue;
      MirrorWays ways = mirror_ways(image.x, s, from_p);
      float passed = 1.0 - mirror_hidden(s, ways);
      e += s.irradiance * (cosine * passed * mirror_open(ways, passed > 0.005));
    }
  }
  return e;
}
vec3 mirrored_lost(vec3 p, vec3 n, Cone from_p, int count, float turn) {
  vec3 lost = vec3(0);
  for (int j = 0; j < frame.mirror_counts.y; ++j) {
    ivec3 image = image_of(j);
    vec4 plane = frame.mirrors[image.x].plane;
    bool away = dot(plane.xyz, p) - plane.w > frame.cascade[0].w;  // offset from the mirror itself
    for (int i = 0; i < (away ? count : 0); ++i) {
      MirrorSample s = mirror_sample(image.x, image.y, image.z, p, i, count, turn);
      float cosine = dot(n, s.w);
      if (cosine <= 0.0 || s.irradiance == vec3(0)) continue;
      MirrorWays ways = mirror_ways(image.x, s, from_p);
      float hidden = mirror_hidden(s, ways);
      lost += s.irradiance * (cosine * hidden * mirror_open(ways, hidden > 0.0));
    }
  }
  return lost;
}
#endif
