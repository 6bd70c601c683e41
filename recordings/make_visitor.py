#!/usr/bin/env python3
"""Remakes recordings/visitor, a session with truth: python make_visitor.py [--out FOLDER] [--side N]

The room of tabletop/, where a lamp is carried and then a hand reaches in. As make_tabletop.py; about 20 minutes of
processor time at full quality.
"""

import time

import numpy as np

import hand
import render
import scene as world
from make_tabletop import make_fisheye, make_folders, make_frame, make_statue, parsed_arguments
from make_tabletop import write_descriptions, write_lists, write_ply

ABOUT = "the table of tabletop before a still camera: the amber bulb is carried along it, then a hand reaches in"
FRAMES = 48
VIEW_OF_TABLETOP = 8  # its frame whose camera stands still here
CARRIED = (8, 28)  # frames between which the bulb moves
BULB_TO_M = np.array([-0.58, 0.46, 0.50])
REACHES, STAYS, LEAVES, GONE = 27, 35, 38, 46  # frames
WRIST_AWAY_M, WRIST_NEAR_M = np.array([0.66, 0.06, 0.24]), np.array([0.23, 0.15, 0.13])


def eased(frame, first, last):
    s = np.clip((frame - first) / (last - first), 0, 1)
    return s * s * (3 - 2 * s)


def bulb(frame):
    """On an arc that rises by 6 cm."""
    s = eased(frame, *CARRIED)
    centre = np.array(world.BULB["centre"]) * (1 - s) + BULB_TO_M * s + np.array([0, 0, 0.24 * s * (1 - s)])
    return {**world.BULB, "centre": [round(float(x), 6) for x in centre]}


def arm(frame):
    """Empty while the hand is away."""
    if not REACHES < frame < GONE:
        return []
    s = eased(frame, REACHES, STAYS) * (1 - eased(frame, LEAVES, GONE))
    return hand.parts(WRIST_AWAY_M * (1 - s) + WRIST_NEAR_M * s)


def main():
    given = parsed_arguments(__doc__, "visitor")
    render.choose_variant()
    world.use_pictures_of(width=320, fisheye_size=256)
    out = given.out
    make_folders(out, FRAMES)
    write_descriptions(out, "visitor", ABOUT)
    write_lists(out, FRAMES, still_fisheye=False)
    write_ply(out / "truth/real_scene.ply", *world.truth_mesh())
    statue, T = make_statue(out), world.T_tag_camera(VIEW_OF_TABLETOP)
    for i in range(FRAMES):
        start = time.process_time()
        lamp, visitors = bulb(i), arm(i)
        real, augmented = render.build(None, lamp, visitors), render.build(statue, lamp, visitors)
        fisheye_noise = make_fisheye(out, real, given.side, i, lossy=True)
        noise = make_frame(out, real, augmented, i, given.side, fisheye_noise, T, world.lights(lamp))
        floors = {k: v["psnr_floor_db"] for k, v in noise.items() if isinstance(v, dict)}
        print(f"frame {i}: floors {floors} dB, {time.process_time() - start:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
