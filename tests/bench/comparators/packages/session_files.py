"""What the scripts here read of a session, and of lumigraft's replay of it."""

import argparse
import csv
import json
import os
import subprocess
import tempfile
import tomllib

import numpy as np

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
import cv2  # noqa: E402  reads the variable when it is imported

BENCH_FRAMES = 24  # as lumigraft bench
TRUE_ROOM = "pose,geometry,light,albedo"
COLUMNS = [
    "session",
    "method",
    "setting",
    "oracle",
    "relight_error",
    "object_error",
    "psnr",
    "psnr_affected",
    "psnr_object",
    "psnr_relit",
    "flip",
    "cpu_ms",
    "wall_ms",
]


def argument_parser(description, *options):
    """Of sessions, --out, and these options, all of them required."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sessions", nargs="+", metavar="SESSION")
    for option in (*options, "--out"):
        parser.add_argument(option, required=True)
    return parser


def write_table(arguments, name, columns, rows_of):
    """Writes OUT/name with the rows of each session, complete after every session."""
    os.makedirs(arguments.out, exist_ok=True)
    with open(os.path.join(arguments.out, name), "w", encoding="utf-8", newline="") as f:
        table = csv.DictWriter(f, columns)
        table.writeheader()
        for folder in arguments.sessions:
            table.writerows(rows_of(open_session(folder)))
            f.flush()


def read_toml(*path):
    with open(os.path.join(*path), "rb") as f:
        return tomllib.load(f)


def listed(session, stream):
    """Paths of a stream's pictures."""
    name = session["toml"][stream]["source"].removeprefix("images:")
    with open(os.path.join(session["folder"], name), encoding="utf-8") as f:
        lines = [line.split() for line in f if line.strip() and not line.startswith("#")]
    return [os.path.join(session["folder"], line[1]) for line in lines]


def open_session(folder):
    session = {"folder": os.path.abspath(folder), "toml": read_toml(folder, "session.toml")}
    if any(session["toml"]["color"].get("distortion", [])):
        raise SystemExit(f"{folder}: found a distorted colour picture, allowed: distortion of zeros")
    return session


def camera_matrix(session):
    color = session["toml"]["color"]
    return np.array([[color["fx"], 0, color["cx"]], [0, color["fy"], color["cy"]], [0, 0, 1]])


def truth_folder(session, index):
    return os.path.join(session["folder"], "truth", f"{index:06d}")


def scored_frame(session):
    """The last of the bench's frames that has truth."""
    known = [i for i in range(BENCH_FRAMES) if os.path.exists(os.path.join(truth_folder(session, i), "augmented.exr"))]
    if not known:
        raise SystemExit(f"{session['folder']}: found no truth/000000/augmented.exr, allowed: a session with truth")
    return known[-1]


def true_pose(session, index):
    """T_tag_camera, or None."""
    path = os.path.join(truth_folder(session, index), "pose.json")
    if not os.path.exists(path):
        return None
    with open(path, encoding="utf-8") as f:
        return np.array(json.load(f)["T_tag_from_camera"])


def read_depth(session, index):
    """Metres along z in the colour picture's pixels, 0 where there is none."""
    depth = session["toml"]["depth"]
    if not depth.get("registered"):
        raise SystemExit(f"{session['folder']}: found depth in its own pixels, allowed: registered = true")
    counts = cv2.imread(listed(session, "depth")[index], cv2.IMREAD_UNCHANGED)
    return counts.astype(np.float32) * np.float32(depth["unit_m"])


def replay(program, session, out, frames, *words):
    """Runs lumigraft replay; the lines of frames.jsonl."""
    ended = subprocess.run(
        [program, "replay", session["folder"], "--out", out, "--frames", str(frames), *words],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    if ended.returncode:
        raise SystemExit(ended.stderr.strip())
    with open(os.path.join(out, "frames.jsonl"), encoding="utf-8") as f:
        return [json.loads(line) for line in f]


def measured(measure, session, index, srgb):
    """The bench's measures of an 8-bit R G B picture; `measure` is the program picture_error."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "picture.png")
        cv2.imwrite(path, srgb[..., ::-1])
        row = json.loads(
            subprocess.run([measure, session["folder"], str(index), path], check=True, stdout=subprocess.PIPE).stdout
        )
    return {key: round(value, 4) if isinstance(value, float) else value for key, value in row.items()}


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as f:
        name = next(line.split(":")[1].strip() for line in f if line.startswith("model name"))
    return f"{name}, {os.cpu_count()} threads"


def cpu_s(pid):
    """Processor time of a process, its threads, and of all processes below it."""
    ticks, parents = {}, {}
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{entry}/stat", encoding="utf-8") as f:
                fields = f.read().rsplit(")", 1)[1].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        parents[int(entry)], ticks[int(entry)] = int(fields[1]), int(fields[11]) + int(fields[12])
    chosen = {pid}
    while added := {child for child, parent in parents.items() if parent in chosen} - chosen:
        chosen |= added
    return sum(ticks.get(process, 0) for process in chosen) / os.sysconf("SC_CLK_TCK")
