// Pixels and the room. camera: { fx, fy, cx, cy } in pixels; T_tag_camera: rows (camera: x right, y down, z forward).

/** Intersection of the ray through a pixel with the horizontal plane z = height_m, in the tag frame; null if none. */
export function pointOnPlane(camera, T_tag_camera, u, v, height_m) {
  const ray = [(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1];
  const direction = [0, 1, 2].map((i) => T_tag_camera[i][0] * ray[0] + T_tag_camera[i][1] * ray[1] + T_tag_camera[i][2] * ray[2]);
  const origin = [0, 1, 2].map((i) => T_tag_camera[i][3]);
  const along = (height_m - origin[2]) / direction[2];
  if (!(along > 0)) return null;
  return [origin[0] + along * direction[0], origin[1] + along * direction[1], height_m];
}

/** The pixel that shows a point of the tag frame; null behind the camera. */
export function pixelOf(camera, T_tag_camera, point) {
  const from = [0, 1, 2].map((i) => point[i] - T_tag_camera[i][3]);
  const [x, y, z] = [0, 1, 2].map((j) => T_tag_camera[0][j] * from[0] + T_tag_camera[1][j] * from[1] + T_tag_camera[2][j] * from[2]);
  if (!(z > 0)) return null;
  return [camera.cx + (camera.fx * x) / z, camera.cy + (camera.fy * y) / z];
}

/** Rotates a vector by a unit quaternion. */
function rotated([w, ...q], v) {
  const cross = ([ax, ay, az], [bx, by, bz]) => [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
  const t = cross(q, v).map((value) => 2 * value);
  return cross(q, t).map((value, i) => v[i] + w * t[i] + value);
}

/** The corners of the box around an object, in the tag frame; its place alone while its model is not known. */
export function cornersOf({ position_m, rotation_wxyz, bounds_m }) {
  if (!bounds_m) return [position_m];
  return [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
    const offset = rotated(rotation_wxyz, [0, 1, 2].map((i) => bounds_m[(corner >> i) & 1][i]));
    return position_m.map((value, i) => value + offset[i]);
  });
}
