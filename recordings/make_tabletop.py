#!/usr/bin/env python3
"""Remakes recordings/tabletop, a session with truth: python make_tabletop.py [--out FOLDER] [--side N]

Needs requirements.txt and an LLVM library (Debian: libllvm15). About 25 minutes of processor time at full quality.
"""

import argparse
import json
import time
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import oxipng

import render
import scene as world
import sensor_noise
import statue

ABOUT = (
    "wooden table in an open room, two coloured boxes, an amber bulb and a blue-white panel, a stone owl as exhibit"
)
EXPOSURE = 3.6
TRUTH_DWA_LEVEL = 75.0

SESSION = """\
format = 1
name = "{name}"
about = "{about}"

[color]
source = "images:color.txt"
width = {width}
height = {height}
fx = {focal}
fy = {focal}
cx = {cx}
cy = {cy}
distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
exposure = {exposure}
response = "srgb"
readout_ms = 0

[depth]
source = "images:depth.txt"
unit_m = 0.001
registered = true

[fisheye]
source = "images:fisheye.txt"
width = {fisheye}
height = {fisheye}
model = "equidistant"
f = {fisheye_focal:.6f}
cx = {fisheye_centre}
cy = {fisheye_centre}
fov_degrees = {fov}
exposure = 1.0    # its pictures are radiance already
response = "linear"
T_tag_fisheye = {T_tag_fisheye}

[tag]
family = "tag36h11"
id = {tag}
size_m = {tag_size}
"""

EXHIBIT = """\
[[object]]
name = "owl"
model = "models/statue.glb"    # glTF: its up axis is y
position_m = {position}
rotation_wxyz = {rotation}
scale = 1.0

[object.material]
base_color = {color}
metallic = 0.0
roughness = 1.0
specular = 0.0
"""


def write_exr(path, picture, lossy=False):
    """Half floats (depth: float32); DWA where what it loses is mostly noise."""
    header = {
        "compression": OpenEXR.DWAB_COMPRESSION if lossy else OpenEXR.PIZ_COMPRESSION,
        "type": OpenEXR.scanlineimage,
    }
    if lossy:
        header["dwaCompressionLevel"] = TRUTH_DWA_LEVEL
    name = "RGB" if picture.ndim == 3 else "Y"
    OpenEXR.File(header, {name: np.ascontiguousarray(picture)}).write(str(path))


def write_png(path, picture):
    """RGB or grey, as small as PNG goes without patience."""
    picture = picture[..., ::-1] if picture.ndim == 3 else picture
    path.write_bytes(oxipng.optimize_from_memory(cv2.imencode(".png", picture)[1].tobytes(), level=2))


def write_json(path, value):
    path.write_text(json.dumps(value, indent=1) + "\n")


def write_ply(path, vertices, triangles):
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in "x y z nx ny nz r g b".split()]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header\n"]
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("index", "<i4", 3)])
    faces["n"], faces["index"] = 3, triangles
    path.write_bytes("\n".join(header).encode() + vertices.tobytes() + faces.tobytes())


def rounded(matrix):
    return [[round(float(x), 9) + 0.0 for x in row] for row in matrix]


def psnr(a, b):
    error = np.mean((a - b) ** 2)
    return float("inf") if error == 0 else float(-10 * np.log10(error))


def noise_of(halves, samples, mask=None):
    """Halves differ by noise alone; their mean, which is the truth, has a quarter of that noise power: 6 dB better."""
    a, b = (sensor_noise.srgb(EXPOSURE * h) for h in halves)
    between = psnr(a, b) if mask is None else psnr(a[mask], b[mask])
    return {"spp": 2 * samples, "psnr_between_halves_db": round(between, 2), "psnr_floor_db": round(between + 6.02, 2)}


def write_lists(out, frames=world.FRAMES, still_fisheye=True):
    times = [i / world.FRAMES_PER_SECOND for i in range(frames)]
    for kind in ("color", "depth"):
        lines = [f"{t:.6f} {kind}/{i:06d}.png" for i, t in enumerate(times)]
        (out / f"{kind}.txt").write_text("\n".join(["# timestamp_s path", *lines]) + "\n")
    # Where nothing in the room moves, one picture for all.
    lines = [f"{t:.6f} fisheye/{0 if still_fisheye else i:06d}.exr" for i, t in enumerate(times)]
    (out / "fisheye.txt").write_text("\n".join(["# timestamp_s path", *lines]) + "\n")


def write_descriptions(out, name="tabletop", about=ABOUT):
    turn = np.radians(world.STATUE_TURN_DEGREES) / 2
    (out / "session.toml").write_text(
        SESSION.format(
            name=name,
            about=about,
            width=world.WIDTH,
            height=world.HEIGHT,
            focal=world.FOCAL,
            cx=(world.WIDTH - 1) / 2,
            cy=(world.HEIGHT - 1) / 2,
            exposure=EXPOSURE,
            fisheye=world.FISHEYE_SIZE,
            fisheye_focal=world.FISHEYE_FOCAL,
            fov=world.FISHEYE_FOV_DEGREES,
            fisheye_centre=(world.FISHEYE_SIZE - 1) / 2,
            T_tag_fisheye=rounded(world.T_tag_fisheye()),
            tag=world.TAG_ID,
            tag_size=world.TAG_SIZE_M,
        )
    )
    (out / "exhibit.toml").write_text(
        EXHIBIT.format(
            position=world.STATUE_POSITION_M.tolist(),
            rotation=[round(float(x), 9) for x in (np.cos(turn), 0, 0, np.sin(turn))],
            color=world.STATUE_COLOR,
        )
    )


def make_fisheye(out, real, side, frame=0, lossy=False):
    halves = [render.render_fisheye(real, side, 900 + 2 * frame + i) for i in (0, 1)]
    picture = ((halves[0] + halves[1]) / 2).astype(np.float16)
    write_exr(out / f"fisheye/{frame:06d}.exr", picture, lossy)
    return noise_of(halves, side * side)


def make_frame(out, real, augmented, i, side, fisheye_noise, T, lights):
    rng = np.random.default_rng(1000 + i)
    mu, rho = render.render_halves(real, T, side, i), render.render_halves(augmented, T, side, i)
    background, with_statue = (mu[0] + mu[1]) / 2, (rho[0] + rho[1]) / 2
    mask = render.coverage(augmented, T)
    write_png(out / f"color/{i:06d}.png", sensor_noise.color_picture(background, EXPOSURE, rng))
    depth, hits = sensor_noise.depth_picture(real, T, rng)
    write_png(out / f"depth/{i:06d}.png", depth)

    truth = out / f"truth/{i:06d}"
    write_exr(truth / "background.exr", background.astype(np.float16), lossy=True)
    write_exr(truth / "augmented.exr", with_statue.astype(np.float16), lossy=True)
    write_png(truth / "object_mask.png", np.round(255 * mask).astype(np.uint8))
    write_json(
        truth / "pose.json", {"T_tag_from_camera": rounded(T), "T_tag_from_fisheye": rounded(world.T_tag_fisheye())}
    )
    write_json(truth / "lights.json", lights)
    affected = (
        np.abs(sensor_noise.srgb(EXPOSURE * with_statue) - sensor_noise.srgb(EXPOSURE * background)).max(-1) > 2 / 255
    )
    on_grey = noise_of([r - m + 0.25 / EXPOSURE for r, m in zip(rho, mu)], side * side)  # the change, shown on mid-grey
    noise = {
        "background": noise_of(mu, side * side),
        "augmented": noise_of(rho, side * side),
        "augmented_affected": noise_of(rho, side * side, affected),
        "delta": on_grey,
        "fisheye": fisheye_noise,
        "affected_fraction": round(float(affected.mean()), 4),
        "object_fraction": round(float(mask.mean()), 4),
    }
    write_json(truth / "noise.json", noise)
    if i == 0:
        maps = {
            k: hits[k].reshape(3, world.HEIGHT, world.WIDTH).transpose(1, 2, 0).astype(np.float16)
            for k in ("normal", "albedo")
        }
        z = np.round(hits["z"] * 2**14) / 2**14  # to 0.06 mm: a third of the bytes
        write_exr(truth / "depth.exr", z.reshape(world.HEIGHT, world.WIDTH).astype(np.float32))
        write_exr(truth / "normals.exr", maps["normal"])
        write_exr(truth / "albedo.exr", maps["albedo"], lossy=True)
        write_exr(truth / "f0.exr", np.zeros_like(maps["albedo"]))
        write_exr(truth / "roughness.exr", np.ones((world.HEIGHT, world.WIDTH), np.float16))
    return noise


def parsed_arguments(description, name):
    arguments = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", type=Path, default=Path(__file__).parent / name)
    arguments.add_argument("--side", type=int, default=5, help="2 side² samples a pixel (default 5: 50)")
    return arguments.parse_args()


def make_folders(out, frames):
    for folder in ("color", "depth", "fisheye", "models", *(f"truth/{i:06d}" for i in range(frames))):
        (out / folder).mkdir(parents=True, exist_ok=True)


def make_statue(out):
    """Writes its model; returns it at its place."""
    vertices, normals, triangles = statue.make_owl()
    statue.write_glb(out / "models/statue.glb", vertices, normals, triangles, world.STATUE_COLOR)
    T = world.T_tag_statue()
    return vertices @ T[:3, :3].T + T[:3, 3], normals @ T[:3, :3].T, triangles


def main():
    given = parsed_arguments(__doc__, "tabletop")
    render.choose_variant()
    out = given.out
    make_folders(out, world.FRAMES)
    write_descriptions(out)
    write_lists(out)
    write_ply(out / "truth/real_scene.ply", *world.truth_mesh())
    real, augmented = render.build(), render.build(make_statue(out))
    fisheye_noise = make_fisheye(out, real, given.side)
    print("fisheye", fisheye_noise, flush=True)
    for i in range(world.FRAMES):
        start = time.process_time()
        noise = make_frame(
            out, real, augmented, i, given.side, fisheye_noise, world.T_tag_camera(i), world.lights()
        )
        floors = {k: v["psnr_floor_db"] for k, v in noise.items() if isinstance(v, dict)}
        print(f"frame {i}: floors {floors} dB, {time.process_time() - start:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
