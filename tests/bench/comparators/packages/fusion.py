#!/usr/bin/env python3
"""Fusion of depth pictures with true poses, on sessions with a true surface: Open3D's VoxelBlockGrid and lumigraft.

  fusion.py SESSION... --program lumigraft --out DIR

Writes DIR/fusion.csv: CPU ms for each depth picture, how far the fused surface lies from truth/real_scene.ply in mm,
and how much of the true surface in the last picture is there, within 12 mm.
"""

import os
import tempfile
import time

import numpy as np
import open3d
import open3d.core

import session_files as files

COLUMNS = ["session", "method", "pictures", "cpu_ms", "cpu_ms_95", "surface_mm", "surface_mm_95", "covered_percent"]
FRAMES = 24
# Open3D takes the pixel below a projected point, so that centres lie at 0.5; those of sessions lie at 0. Without this its
# surface is six to nine times as far off.
PIXEL_CENTRE = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
VOXEL_M = 0.008  # lumigraft's finest
BLOCK = 8
COVERED_M = 1.5 * VOXEL_M  # points of a surface are a voxel apart
FAR_M = 2.0  # surfaces compared: as near the camera, where both have finest voxels


def fused_by_open3d(session, poses):
    """The surface's points, and CPU ms of each picture."""
    grid = open3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (open3d.core.float32, open3d.core.float32), ((1,), (1,)), VOXEL_M, BLOCK, 20000
    )
    K, costs = open3d.core.Tensor(files.camera_matrix(session) + PIXEL_CENTRE), []
    for index, T_tag_camera in poses.items():
        depth = open3d.t.geometry.Image(files.read_depth(session, index))
        T_camera_tag = open3d.core.Tensor(np.linalg.inv(T_tag_camera))
        start = time.process_time()
        blocks = grid.compute_unique_block_coordinates(depth, K, T_camera_tag, 1.0, FAR_M + 1)
        grid.integrate(blocks, depth, K, T_camera_tag, 1.0, FAR_M + 1)
        costs.append(1e3 * (time.process_time() - start))
    return grid.extract_point_cloud().point.positions.numpy(), costs


def fused_by_lumigraft(session, poses, program):
    with tempfile.TemporaryDirectory() as folder:  # with quick settings: only the surface is read
        frames = files.replay(
            program,
            session,
            folder,
            max(poses) + 1,
            "--dump",
            "--set",
            "plan.trace_scale=8",
            "--set",
            "plan.rays=8",
            "--oracle",
            "pose,light,albedo",
        )
        mesh = open3d.io.read_triangle_mesh(os.path.join(folder, "surface.ply"))
    return np.asarray(mesh.vertices), [frame["stage_cpu_ms"]["fuse"] for frame in frames]


def seen(points, session, T_tag_camera):
    """Points in the picture of a camera, nearer than FAR_M."""
    K, color = files.camera_matrix(session), session["toml"]["color"]
    p = (points - T_tag_camera[:3, 3]) @ T_tag_camera[:3, :3]
    z = np.maximum(p[:, 2], 1e-6)
    u, v = K[0, 0] * p[:, 0] / z + K[0, 2], K[1, 1] * p[:, 1] / z + K[1, 2]
    return points[(p[:, 2] > 0) & (p[:, 2] < FAR_M) & (u > 0) & (u < color["width"]) & (v > 0) & (v < color["height"])]


def true_points(session, truth, T_tag_camera):
    """What a camera sees of the true surface at every fourth row and column, nearer than FAR_M."""
    K, color = files.camera_matrix(session), session["toml"]["color"]
    v, u = np.mgrid[: color["height"] : 4, : color["width"] : 4].reshape(2, -1)
    towards = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(u.size)], -1) @ T_tag_camera[:3, :3].T
    rays = np.concatenate([np.broadcast_to(T_tag_camera[:3, 3], towards.shape), towards], -1).astype(np.float32)
    z = truth.cast_rays(open3d.core.Tensor(rays))["t_hit"].numpy()[:, None]
    return (T_tag_camera[:3, 3] + np.where(np.isfinite(z), z, 0) * towards)[z[:, 0] < FAR_M]


def cloud(points):
    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.astype(np.float64)))


def row_of(session, method, points, costs, poses, truth):
    last = max(poses)
    points = seen(points, session, poses[last])
    missing_m = np.asarray(cloud(true_points(session, truth, poses[last])).compute_point_cloud_distance(cloud(points)))
    off_mm = 1e3 * truth.compute_distance(open3d.core.Tensor(points.astype(np.float32))).numpy()
    row = {
        "session": session["toml"]["name"],
        "method": method,
        "pictures": len(costs),
        "cpu_ms": round(float(np.median(costs)), 1),
        "cpu_ms_95": round(float(np.quantile(costs, 0.95)), 1),
        "surface_mm": round(float(np.median(off_mm)), 2),
        "surface_mm_95": round(float(np.quantile(off_mm, 0.95)), 2),
        "covered_percent": round(100 * float(np.mean(missing_m < COVERED_M)), 1),
    }
    print(*(f"{key} {value}" for key, value in row.items()), sep=", ", flush=True)
    return row


def rows_of(session, program):
    truth = open3d.t.geometry.RaycastingScene()
    mesh = open3d.io.read_triangle_mesh(os.path.join(session["folder"], "truth", "real_scene.ply"))
    truth.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(mesh))
    count = min(FRAMES, len(files.listed(session, "color")))
    poses = {i: T for i in range(count) if (T := files.true_pose(session, i)) is not None}
    for method, (points, costs) in (
        ("Open3D VoxelBlockGrid", fused_by_open3d(session, poses)),
        ("lumigraft", fused_by_lumigraft(session, poses, program)),
    ):
        yield row_of(session, method, points, costs, poses, truth)


def main():
    arguments = files.argument_parser(__doc__, "--program").parse_args()
    files.write_table(arguments, "fusion.csv", COLUMNS, lambda session: rows_of(session, arguments.program))
    print(files.machine())


if __name__ == "__main__":
    main()
