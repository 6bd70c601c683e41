#!/usr/bin/env python3
"""Time per stage of `lumigraft replay`, at two picture sizes and two volume sizes.

  tests/bench/stage_times.py [--program build/release/lumigraft] [--session recordings/tabletop] [--frames 12]
                             [--out tests/bench/results/stage_times.md]

Replays the session at its own size and at half of it (made in a temporary folder: colour averaged, depth and fish-eye
taken as they are) with volumes of 64³ and 128³ voxels, for two settings: light traced for every pixel (trace_scale 1),
and the live one (trace_scale 4). Every figure is the median over the frames after the first four. CPU milliseconds are
user + system time of the whole process while the stage ran; wall milliseconds are what a clock shows.
"""
import argparse
import json
import os
import platform
import re
import shutil
import statistics
import subprocess
import tempfile

import cv2
import numpy as np

WARM_UP_FRAMES = 4


def half_size(session, folder):
    """A copy of the session at half the picture size; centre of pixel (u, v) at integers: c' = (c - 0.5) / 2."""
    copy = os.path.join(folder, "half")
    shutil.copytree(session, copy)
    with open(os.path.join(copy, "session.toml")) as f:
        text = f.read()
    head, rest = re.split(r"(?m)^(?=\[depth\])", text, maxsplit=1)
    for key in ("width", "height"):
        head = re.sub(rf"(?m)^{key} = (\d+)", lambda m, k=key: f"{k} = {int(m[1]) // 2}", head)
    for key in ("fx", "fy"):
        head = re.sub(rf"(?m)^{key} = ([\d.]+)", lambda m, k=key: f"{k} = {float(m[1]) / 2}", head)
    for key in ("cx", "cy"):
        head = re.sub(rf"(?m)^{key} = ([\d.]+)", lambda m, k=key: f"{k} = {(float(m[1]) - 0.5) / 2}", head)
    with open(os.path.join(copy, "session.toml"), "w") as f:
        f.write(head + rest)
    for stream, shrink in (("color", lambda a: cv2.resize(a, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)),
                           ("depth", lambda a: np.ascontiguousarray(a[::2, ::2]))):
        for name in os.listdir(os.path.join(copy, stream)):
            path = os.path.join(copy, stream, name)
            cv2.imwrite(path, shrink(cv2.imread(path, cv2.IMREAD_UNCHANGED)))
    return copy


def replay(program, session, out, frames, settings):
    command = [program, "replay", session, "--out", out, "--frames", str(frames)]
    for setting in settings:
        command += ["--set", setting]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(out, "frames.jsonl")) as f:
        return [json.loads(line) for line in f]


def difference(a, b, frames):
    """RMS and 99.9th percentile of |a - b| in code values over all pictures."""
    squares, worst, count = 0.0, [], 0
    for i in range(WARM_UP_FRAMES, frames):
        name = f"frame_{i:06d}.png"
        d = np.abs(cv2.imread(os.path.join(a, name)).astype(float) - cv2.imread(os.path.join(b, name)).astype(float))
        squares, count = squares + (d ** 2).sum(), count + d.size
        worst.append(np.percentile(d, 99.9))
    return (squares / count) ** 0.5, max(worst)


def processor():
    with open("/proc/cpuinfo") as f:
        return next((line.split(":", 1)[1].strip() for line in f if line.startswith("model name")), platform.processor())


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    root = os.path.dirname(os.path.dirname(here))
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--program", default=os.path.join(root, "build/release/lumigraft"))
    a.add_argument("--session", default=os.path.join(root, "recordings/tabletop"))
    a.add_argument("--frames", type=int, default=12)
    a.add_argument("--out", default=os.path.join(here, "results/stage_times.md"))
    args = a.parse_args()

    columns, rows, errors = [], {}, []
    with tempfile.TemporaryDirectory() as folder:
        sizes = [("320×240", half_size(args.session, folder)), ("640×480", args.session)]
        for size, session in sizes:
            for volume in (64, 128):
                pictures = {}
                for scale in (1, 4):
                    out = os.path.join(folder, f"{size}-{volume}-{scale}")
                    records = replay(args.program, session, out, args.frames,
                                     [f"plan.volume={volume}", f"plan.trace_scale={scale}"])[WARM_UP_FRAMES:]
                    pictures[scale] = out
                    column = f"{size}, {volume}³, 1/{scale}"
                    columns.append(column)
                    for stage in records[-1]["stage_ms"]:
                        median = lambda key, s=stage: statistics.median(r[key].get(s, 0.0) for r in records)  # noqa: E731
                        rows.setdefault(stage, {})[column] = (median("stage_cpu_ms"), median("stage_ms"))
                errors.append((size, volume, *difference(pictures[4], pictures[1], args.frames)))
    lines = ["# Time per stage", "",
             f"`tests/bench/stage_times.py` on {processor()}, {os.cpu_count()} cores, software Vulkan (lavapipe).",
             "Median CPU ms / wall ms a frame; picture size, volume, and trace_scale: 1/1 traces light for every pixel, 1/4 is",
             "the live setting.", "",
             "| stage | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for stage, cells in rows.items():
        lines.append(f"| {stage} | " + " | ".join("{:.1f} / {:.1f}".format(*cells[c]) if c in cells else "" for c in columns) + " |")
    lines += ["", "# Live setting against light traced for every pixel", "",
              "Difference of the pictures in 8-bit code values.", "",
              "| picture | volume | RMS | 99.9th percentile |", "|---|---|---|---|"]
    lines += [f"| {size} | {volume}³ | {rms:.2f} | {worst:.1f} |" for size, volume, rms, worst in errors]
    os.makedirs(os.path.dirname(args.out), exist_ok=True)
    with open(args.out, "w") as f:
        f.write("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
