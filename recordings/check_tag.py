#!/usr/bin/env python3
"""Compares the poses that truth/ claims with what the AprilTag library detects in the colour pictures.

It looks at linear light: a blurred edge lies a quarter of a pixel towards the dark in sRGB values, which at every edge of
the black square together makes this tag seem 5 mm farther away.
"""

import json
import sys
import tomllib
from pathlib import Path

import cv2
import numpy as np
from pupil_apriltags import Detector


def linear_grey(path):
    x = cv2.imread(str(path)) / 255.0
    x = np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).mean(-1)
    return np.round(255 * x / x.max()).astype(np.uint8)


def main():
    session = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "tabletop")
    settings = tomllib.loads((session / "session.toml").read_text())
    color, tag = settings["color"], settings["tag"]
    # The library has pixel centres at halves, the session at integers.
    camera = [color["fx"], color["fy"], color["cx"] + 0.5, color["cy"] + 0.5]
    detector, worst = Detector(families=tag["family"], quad_decimate=1.0), (0.0, 0.0)
    for path in sorted((session / "color").glob("*.png")):
        found = [d for d in detector.detect(linear_grey(path), True, camera, tag["size_m"]) if d.tag_id == tag["id"]]
        if len(found) != 1:
            sys.exit(f"check_tag.py: {path}: found {len(found)} tags with id {tag['id']}, expected one")
        # Its tag frame is ours turned by 180° about x.
        R, t = found[0].pose_R @ np.diag([1.0, -1.0, -1.0]), found[0].pose_t[:, 0]
        T = np.array(json.loads((session / "truth" / path.stem / "pose.json").read_text())["T_tag_from_camera"])
        turn = R.T @ T[:3, :3].T
        angle = float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))))
        away = float(np.linalg.norm(t + T[:3, :3].T @ T[:3, 3]))
        print(f"{path.stem}: {1000 * away:.2f} mm, {angle:.3f} degrees")
        worst = max(worst[0], away), max(worst[1], angle)
    print(f"worst: {1000 * worst[0]:.2f} mm, {worst[1]:.3f} degrees")
    sys.exit(worst[0] > 0.002 or worst[1] > 0.3)


if __name__ == "__main__":
    main()
