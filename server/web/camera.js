// Back-projection of pixels into the room.

/**
 * Intersection of the ray through a pixel with the horizontal plane z = height_m, in the tag frame; null if none.
 * camera: { fx, fy, cx, cy } in pixels; T_tag_camera: 4×4 rows (camera: x right, y down, z forward).
 */
export function pointOnPlane(camera, T_tag_camera, u, v, height_m) {
  const ray = [(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1];
  const direction = [0, 1, 2].map((i) => T_tag_camera[i][0] * ray[0] + T_tag_camera[i][1] * ray[1] + T_tag_camera[i][2] * ray[2]);
  const origin = [0, 1, 2].map((i) => T_tag_camera[i][3]);
  const along = (height_m - origin[2]) / direction[2];
  if (!(along > 0)) return null;
  return [origin[0] + along * direction[0], origin[1] + along * direction[1], height_m];
}
