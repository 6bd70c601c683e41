#!/usr/bin/env python3
"""A camera program (docs/helpers.md) that plays the colour and depth pictures of a recording in a loop.

  player.py RECORDING RATE_HZ UNPLUGGED STREAM WIDTH HEIGHT UNIT_M [...]

While the file UNPLUGGED exists the camera is away. Needs OpenCV.
"""
import os
import struct
import sys
import time
from pathlib import Path

import cv2

HEAD = struct.Struct("<4sIIIqQdd")
UNAVAILABLE, OPENED, FRAME = 0, 2, 3
PIPE = 3


def send(kind, payload=b"", stream=0, time_ns=0, sequence=0):
    view = memoryview(HEAD.pack(b"LGH1", kind, stream, len(payload), time_ns, sequence, 0, 0) + payload)
    while view:
        view = view[os.write(PIPE, view):]


def pictures(recording, name):
    """The pixels of all pictures of a stream, as the service expects them."""
    for line in (recording / f"{name}.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            picture = cv2.imread(str(recording / line.split()[1]), cv2.IMREAD_UNCHANGED)
            yield (picture if name == "depth" else cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)).tobytes()


def main():
    recording, rate_hz, unplugged = Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3])
    streams = ["depth" if word.endswith("depth") else word for word in sys.argv[4::4]]
    if unplugged.exists():
        send(UNAVAILABLE, b"found no camera")
        return
    played = [list(pictures(recording, name)) for name in streams]
    send(OPENED, b"player")
    sequence, due = 0, time.monotonic()
    while not unplugged.exists():
        now_ns = time.monotonic_ns()
        for stream, all_pictures in enumerate(played):
            send(FRAME, all_pictures[sequence % len(all_pictures)], stream, now_ns, sequence)
        sequence += 1
        due = max(due + 1 / rate_hz, time.monotonic() - 1)
        time.sleep(max(0, due - time.monotonic()))
    send(UNAVAILABLE, b"unplugged")


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:
        pass
