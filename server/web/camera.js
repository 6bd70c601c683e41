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
