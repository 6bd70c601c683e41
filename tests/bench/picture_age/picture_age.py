#!/usr/bin/env python3
"""How old pictures are when a viewer of a real `lumigraft serve` has shown them.

  picture_age.py PROGRAM RECORDING [--codec jpeg] [--slower 1.1] [--stall 2] [--seconds 12] [--set KEY=VALUE ...]

The viewer acknowledges each picture after `slower` times the time in which the service makes one (0: at once). After
`seconds` it stalls for `stall` seconds, and continues for as long again. Prints a line of JSON:
the time between two pictures of a viewer who is fast, ms, and the age of those that were shown, median and 95 of 100, in
times between two pictures that the service made at that time: of the fast viewer, of the slow one before the stall, and
from 2 s after it.
"""
import argparse
import json
import pathlib
import socket
import struct
import subprocess
import sys
import time

import websocket

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "integration/end_to_end"))
from browser_page import free_port  # noqa: E402
from child_process import interrupt, start  # noqa: E402

HEADER = struct.Struct("<4sBBHIHHqq")


def picture(viewer):
    """(sequence, time of capture, time when it was encoded; s) of the next picture."""
    while True:
        opcode, data = viewer.recv_data()
        if opcode != websocket.ABNF.OPCODE_BINARY:
            continue
        _, _, kind, _, sequence, _, _, captured_ns, sent_ns = HEADER.unpack_from(data)
        if kind != 1:
            return sequence, 1e-9 * captured_ns, 1e-9 * sent_ns


def watch(viewer, seconds, slower):
    """[(when shown, age, time between two pictures that are made)], s."""
    shown, made = [], []
    end = time.time() + seconds
    while time.time() < end:
        sequence, captured, sent = picture(viewer)
        made = (made + [(sequence, sent)])[-8:]
        period = (made[-1][1] - made[0][1]) / max(1, made[-1][0] - made[0][0])
        time.sleep(slower * period)
        viewer.send(json.dumps({"type": "ack", "sequence": sequence}))
        shown.append((time.time(), time.time() - captured, period))
    return shown[3:]


def summary(shown):
    ages = sorted(age / period for _, age, period in shown)
    return {"median": round(ages[len(ages) // 2], 1), "of95": round(ages[int(0.95 * len(ages))], 1), "pictures": len(ages)}


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program")
    arguments.add_argument("recording")
    arguments.add_argument("--codec", default="jpeg")
    arguments.add_argument("--slower", type=float, default=1.1)
    arguments.add_argument("--stall", type=float, default=2)
    arguments.add_argument("--seconds", type=float, default=20)
    arguments.add_argument("--set", action="append", default=["plan.method=rays", "plan.trace_scale=8"])
    given = arguments.parse_args()
    port = free_port()
    service = start([given.program, "serve", "--session", given.recording, "--listen", f"127.0.0.1:{port}"] +
                    [word for line in given.set for word in ("--set", line)], stderr=subprocess.DEVNULL)
    try:
        for _ in range(600):
            with socket.socket() as s:
                if s.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        viewer = websocket.create_connection(f"ws://127.0.0.1:{port}/ws")
        viewer.send(json.dumps({"type": "want", "codec": given.codec}))
        watch(viewer, 10, 0)  # the room is learnt
        fast = watch(viewer, given.seconds, 0)
        before = watch(viewer, given.seconds, given.slower)
        time.sleep(given.stall)
        stalled = time.time()
        late = [one for one in watch(viewer, given.seconds, given.slower) if one[0] > stalled + 2]
        period_ms = 1e3 * (fast[-1][0] - fast[0][0]) / max(1, len(fast) - 1)
        print(json.dumps({"period_ms": round(period_ms), "fast": summary(fast), "slow": summary(before), "after_stall": summary(late)}))
    finally:
        interrupt(service)


if __name__ == "__main__":
    main()
