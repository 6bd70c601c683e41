#!/usr/bin/env python3
"""Renders sessions with truth of random rooms: make_rooms.py --out FOLDER [--seeds FIRST LAST] [--side N]

As recordings/make_tabletop.py (its requirements.txt): 320x240 pixels, a still camera with sensor noise, twelve frames;
the fish-eye as radiance (fisheye.txt) and as 8-bit images in which lamps are clipped (fisheye-ldr.txt). About 40
seconds of processor time a room. Then `lumigraft replay` or `lumigraft bench` on each.
"""

import argparse
import time
from pathlib import Path

import cv2
import mitsuba as mi
import numpy as np

from room import Room, make_object, world  # first: it finds the recordings' modules
import make_tabletop as session
import render
import sensor_noise
import statue

FRAMES = 12
WHITE = 0.7  # linear value that only a tenth of an image exceeds


def use_room(room):
    """The modules of recordings/ describe one scene; it is this one from here on."""
    world.T_tag_fisheye, world.real_parts = room.T_tag_fisheye, room.parts
    world.STATUE_POSITION_M, world.STATUE_TURN_DEGREES = room.object_at, room.object_turn
    world.STATUE_COLOR = room.object_color


def lamp_shape(lamp):
    emitter = {"type": "area", "radiance": render.rgb(lamp["radiance"])}
    shape = {"bsdf": {"type": "diffuse", "reflectance": render.rgb([0, 0, 0])}, "emitter": emitter}
    centre = lamp["centre"]
    if lamp["kind"] == "bulb":
        return {"type": "sphere", "center": centre.tolist(), "radius": float(lamp["radius"]), **shape}
    up = [0, 0, 1] if abs(lamp["normal"][2]) < 0.95 else [0, 1, 0]
    stand = mi.ScalarTransform4f().look_at(origin=centre.tolist(), target=(centre + lamp["normal"]).tolist(), up=up)
    scale = mi.ScalarTransform4f().scale([*(float(s) / 2 for s in lamp["size"]), 1])
    return {"type": "rectangle", "to_world": stand @ scale, **shape}


def build(room, placed=None):
    """The room as a Mitsuba scene, with the object `placed` in it (vertices, normals, triangles)."""
    environment = {"type": "constant", "radiance": render.rgb(room.environment), "sampling_weight": 0.05}
    out = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": 5},
        "environment": environment,
        **{f"lamp{i}": lamp_shape(lamp) for i, lamp in enumerate(room.lamps)},
    }
    for i, part in enumerate(room.parts()):
        color = render.rgb(part.albedo) if part.texture is None else render.texture(part)
        index = np.arange(3 * len(part.triangles)).reshape(-1, 3)
        out[f"part{i}"] = render.mesh(part.name, part.triangles, index, render.lambert(color), uv=part.uv)
    if placed:
        vertices, normals, triangles = placed
        color = render.lambert(render.rgb(room.object_color))
        out["statue"] = render.mesh("statue", vertices, triangles, color, normals=normals)
    return mi.load_dict(out)


def lights(room):
    """lights.json."""
    rows = []
    for lamp in room.lamps:
        area = 4 * np.pi * lamp["radius"] ** 2 if lamp["kind"] == "bulb" else np.prod(lamp["size"])
        row = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in lamp.items() if k != "toward"}
        rows.append({**row, "area_m2": float(area), "power_W": (np.pi * area * lamp["radiance"]).tolist()})
    return {"lights": rows, "environment": {"constant": room.environment.tolist()}}


def read_radiance(path):
    return next(iter(session.OpenEXR.File(str(path)).channels().values())).pixels[..., :3].astype(float)


def write_clipped_fisheye(out):
    radiance = read_radiance(out / "fisheye/000000.exr")
    lit = radiance.max(-1)[radiance.max(-1) > 0]
    exposure = WHITE / np.percentile(lit, 90)
    shown = sensor_noise.srgb(exposure * radiance)
    cv2.imwrite(str(out / "fisheye/000000.png"), np.round(255 * shown).astype(np.uint8)[..., ::-1])
    (out / "fisheye-ldr.txt").write_text((out / "fisheye.txt").read_text().replace(".exr", ".png"))
    text = (out / "session.toml").read_text()
    head, fisheye = text.split("[fisheye]")
    fisheye = fisheye.replace("exposure = 1.0    # its pictures are radiance already", f"exposure = {exposure:.3f}")
    fisheye = fisheye.replace('response = "linear"', 'response = "srgb"', 1)
    (out / "session.toml").write_text(head + "[fisheye]" + fisheye)


def make(room, out, side):
    use_room(room)
    session.make_folders(out, 1)
    vertices, normals, triangles = make_object(room.object)
    T = room.T_tag_object()
    real = build(room)
    augmented = build(room, (vertices @ T[:3, :3].T + T[:3, 3], normals @ T[:3, :3].T, triangles))
    metered = np.array(mi.render(real, sensor=render.sensor(room.T_tag_camera, 16), spp=16, seed=7))
    session.EXPOSURE = round(float(WHITE / np.percentile(metered.max(-1), 90)), 3)
    about = f"{room.kind} table, {room.object}, {len(room.lamps)} lamps, walls: {', '.join(room.walls)}"
    session.write_descriptions(out, f"room {room.seed}", about)
    session.write_lists(out, FRAMES)
    statue.write_glb(out / "models/statue.glb", vertices, normals, triangles, room.object_color)
    session.write_ply(out / "truth/real_scene.ply", *world.truth_mesh())
    noise = session.make_fisheye(out, real, side)
    write_clipped_fisheye(out)
    session.make_frame(out, real, augmented, 0, side, noise, room.T_tag_camera, lights(room))
    background = read_radiance(out / "truth/000000/background.exr")
    for i in range(1, FRAMES):
        rng = np.random.default_rng(1000 + i)
        session.write_png(out / f"color/{i:06d}.png", sensor_noise.color_picture(background, session.EXPOSURE, rng))
        session.write_png(out / f"depth/{i:06d}.png", sensor_noise.depth_picture(real, room.T_tag_camera, rng)[0])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", type=Path, required=True)
    arguments.add_argument("--seeds", type=int, nargs=2, default=(1, 24), metavar=("FIRST", "LAST"))
    arguments.add_argument("--side", type=int, default=10, help="2 side² samples a pixel (default 10: 200)")
    given = arguments.parse_args()
    render.choose_variant()
    world.use_pictures_of(width=320, fisheye_size=256)
    session.TRUTH_DWA_LEVEL = 5.0  # noise of compression would hide the program's errors
    for seed in range(given.seeds[0], given.seeds[1] + 1):
        start = time.process_time()
        make(Room(seed), given.out / f"room{seed:03d}", given.side)
        print(f"room {seed}: {time.process_time() - start:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
