#!/usr/bin/env python3
"""How old pictures are when a viewer of a real `lumigraft serve` has shown them.

  picture_age.py PROGRAM RECORDING [--codec jpeg] [--slower 1.1] [--stall 2] [--seconds 12] [--set KEY=VALUE ...]

The viewer acknowledges a picture once it has shown it, which takes it `slower` times the time in which the service makes
one (0: none). After `seconds` it stands still for `stall` seconds, and goes on for as long again. Prints a line of JSON:
the time between two pictures of a viewer who is fast, ms, and the age of those that were shown, median and 95 of 100, in
times between two pictures that the service made at that time: of the fast viewer, of the slow one before the stall, and
from 2 s after it.
"""
import argparse
import base64
import json
import os
import signal
import socket
import struct
import subprocess
import time

HEADER = struct.Struct("<4sBBHIHHqq")


class Viewer:
    """A websocket client of the stream."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.sendall(f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}\r\n\r\n".encode())
        self.input = self.socket.makefile("rb")
        while self.input.readline() not in (b"\r\n", b""):
            pass

    def send(self, message, opcode=1):
        data = message if isinstance(message, bytes) else json.dumps(message).encode()
        self.socket.sendall(bytes([0x80 | opcode, 0x80 | len(data)]) + bytes(4) + data)  # the mask is zero

    def picture(self):
        """(sequence, time of capture, time when it was encoded; s) of the next picture."""
        while True:
            first, length = self.input.read(2)
            if length == 126:
                length, = struct.unpack(">H", self.input.read(2))
            elif length == 127:
                length, = struct.unpack(">Q", self.input.read(8))
            data = self.input.read(length)
            if first & 15 == 9:
                self.send(data, 10)
            elif first & 15 == 2:
                _, _, kind, _, sequence, _, _, captured_ns, sent_ns = HEADER.unpack_from(data)
                if kind != 1:
                    return sequence, 1e-9 * captured_ns, 1e-9 * sent_ns


def watch(viewer, seconds, slower):
    """[(when shown, age, time between two pictures that are made)], s."""
    shown, made = [], []
    end = time.time() + seconds
    while time.time() < end:
        sequence, captured, sent = viewer.picture()
        made = (made + [(sequence, sent)])[-8:]
        period = (made[-1][1] - made[0][1]) / max(1, made[-1][0] - made[0][0])
        time.sleep(slower * period)
        viewer.send({"type": "ack", "sequence": sequence})
        shown.append((time.time(), time.time() - captured, period))
    return shown[3:]


def summary(shown):
    ages = sorted(age / period for _, age, period in shown)
    return {"median": round(ages[len(ages) // 2], 1), "of95": round(ages[int(0.95 * len(ages))], 1), "pictures": len(ages)}


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


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
    service = subprocess.Popen([given.program, "serve", "--session", given.recording, "--listen", f"127.0.0.1:{port}"] +
                               [word for line in given.set for word in ("--set", line)], stderr=subprocess.DEVNULL)
    try:
        for _ in range(600):
            with socket.socket() as s:
                if s.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        viewer = Viewer(port)
        viewer.send({"type": "want", "codec": given.codec})
        watch(viewer, 10, 0)  # the room is learnt
        fast = watch(viewer, given.seconds, 0)
        before = watch(viewer, given.seconds, given.slower)
        time.sleep(given.stall)
        stalled = time.time()
        late = [one for one in watch(viewer, given.seconds, given.slower) if one[0] > stalled + 2]
        period_ms = 1e3 * (fast[-1][0] - fast[0][0]) / max(1, len(fast) - 1)
        print(json.dumps({"period_ms": round(period_ms), "fast": summary(fast), "slow": summary(before), "after_stall": summary(late)}))
    finally:
        service.send_signal(signal.SIGINT)
        service.wait(20)


if __name__ == "__main__":
    main()
