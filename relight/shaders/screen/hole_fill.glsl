// Fills pixels without surface: no depth, because the sensor's projector does not reach them or the angle is too
// grazing, and nothing fused. Such a pixel is assigned to the nearby surface with the most similar colour, whose plane
// is extended. Before this is included, define: `depth`; vec3 camera_point(ivec2), camera frame; vec3 coded(ivec2), a
// perceptually uniform colour of a pixel from 0 to 1; and vec3 normal_at(ivec2 pixel, vec3 p), tag frame, 0: unknown.
#ifndef HOLE_FILL_GLSL
#define HOLE_FILL_GLSL

const float kSearchReach = 0.04;    // search radius, fraction of the image width
const float kUnlikeColor = 0.15;    // a larger colour difference means another surface
const float kNearerColor = 0.1;     // colour difference that counts as much as the search radius

bool in_image(ivec2 q) { return all(greaterThanEqual(q, ivec2(0))) && all(lessThan(q, frame.picture.xy)); }

// Whether depth at q and around it belongs to one surface.
bool on_one_surface(ivec2 q, int around) {
  float z = texelFetch(depth, q, 0).x;
  for (int i = 0; i < 4; ++i) {
    ivec2 e = q + around * ivec2(i < 2 ? 2 * i - 1 : 0, i < 2 ? 0 : 2 * i - 5);
    if (!in_image(e) || abs(texelFetch(depth, e, 0).x - z) > 0.03 * z) return false;
  }
  return z > 0.0;
}

// A pixel with depth on the surface that `at` most likely belongs to; negative: none.
ivec2 similar_pixel(ivec2 at) {
  const ivec2 kWays[8] = ivec2[](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1), ivec2(1, 1), ivec2(-1, 1),
                                 ivec2(1, -1), ivec2(-1, -1));
  vec3 own = coded(at);
  float reach = kSearchReach * float(frame.picture.x), min_unlike = kUnlikeColor;
  int apart = max(int(reach / 8.0), 1);
  ivec2 best = ivec2(-1);
  for (int i = 0; i < 8; ++i) {
    for (int s = apart; s <= int(reach); s += apart) {
      ivec2 q = at + s * kWays[i], farther = q + 2 * apart * kWays[i];
      if (!in_image(q)) break;
      if (!on_one_surface(q, apart)) continue;
      float unlike = length(coded(q) - own) + kNearerColor * float(s) / reach;
      if (unlike < min_unlike) {
        min_unlike = unlike;
        // Fused surfaces are rounded at their ends.
        best = in_image(farther) && on_one_surface(farther, apart) ? farther : q;
      }
      break;
    }
  }
  return best;
}

struct Plane {
  vec3 p, n;  // tag frame
  float z;    // of p in the camera frame, 0: none
};

// The plane of that pixel, if `needed`: software devices execute branches that no pixel takes, but not loops.
Plane similar_plane(ivec2 at, bool needed) {
  Plane plane = Plane(vec3(0), vec3(0), 0.0);
  for (int once = 0; once < (needed ? 1 : 0); ++once) {
    ivec2 q = similar_pixel(at);
    if (q.x < 0) break;
    vec3 in_camera = camera_point(q);
    plane.p = frame.T_tag_camera[3].xyz + mat3(frame.T_tag_camera) * in_camera;
    plane.n = normal_at(q, plane.p);
    plane.z = plane.n == vec3(0) ? 0.0 : in_camera.z;
  }
  return plane;
}

// Depth of the intersection with a ray from the camera, w per metre of depth; 0: none nearby.
float on_plane(Plane plane, vec3 w) {
  float fall = dot(plane.n, w);
  float z = fall < -0.05 * length(w) ? dot(plane.n, plane.p - frame.T_tag_camera[3].xyz) / fall : 0.0;
  return abs(z - plane.z) < 0.5 * plane.z ? z : 0.0;
}
#endif
