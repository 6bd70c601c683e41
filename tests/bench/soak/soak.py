#!/usr/bin/env python3
"""Months of a kiosk in minutes: a real `lumigraft serve` with a camera, while everything around it comes and goes.

  soak.py PROGRAM RECORDING [--minutes 60] [--rate-hz 5] [--set KEY=VALUE ...]

Viewers come, go, stand still and leave without a word; they move objects; recordings start and stop; the exhibit is
reloaded (SIGHUP), sometimes with an error in it; the camera is unplugged, and its program killed. One viewer stays and
measures. Prints every minute and at the end a line of JSON: descriptors, threads and resident memory of the service
(MB; growth is from the median of the second tenth of the time to that of the last), the age of pictures on arrival, the
longest time without a picture while a camera was there, and for how many pictures in a row at most they were older
than 200 ms and two periods. Needs OpenCV and websocket-client.
"""
import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

import websocket

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "integration/end_to_end"))
from browser_page import free_port  # noqa: E402
from child_process import interrupt, start  # noqa: E402

HEADER = struct.Struct("<4sBBHIHHqq")
PLAYER = pathlib.Path(__file__).with_name("player.py").resolve()


def configuration(recording, folder, rate_hz):
    """Writes kiosk.toml and exhibit.toml. The first lens keys and the tag are those of the recording."""
    text = (recording / "session.toml").read_text()
    text = text[:text.index("[fisheye]")] + text[text.index("[tag]"):]
    source = f'source = "helper:{sys.executable} {PLAYER} {recording} {rate_hz} {folder}/unplugged"'
    text = text.replace('source = "images:color.txt"', source).replace('source = "images:depth.txt"', source)
    server = '\n[server]\nrecordings = "recorded"\nmax_recording_s = 20\nmax_recordings_gb = 0.5\n'
    (folder / "kiosk.toml").write_text(f'exhibit = "exhibit.toml"\n{text}{server}')
    exhibit = (recording / "exhibit.toml").read_text().replace("models/", f"{recording}/models/")
    (folder / "exhibit.toml").write_text(exhibit)
    return exhibit


class Soak:
    def __init__(self, given):
        self.recording = pathlib.Path(given.recording).resolve()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="lumigraft-soak-"))
        self.exhibit = configuration(self.recording, self.folder, given.rate_hz)
        self.port = free_port()
        self.random = random.Random(1)
        self.ends = time.monotonic() + 60 * given.minutes
        self.away_until = 0.0
        self.done = {}
        self.samples, self.ages = [], []
        self.log = open(self.folder / "log", "w")
        self.service = start([given.program, "serve", "--config", str(self.folder / "kiosk.toml"), "--listen", f"127.0.0.1:{self.port}"] +
                             [word for line in given.set for word in ("--set", line)], stderr=self.log)

    def count(self, what):
        self.done[what] = self.done.get(what, 0) + 1

    def running(self):
        return time.monotonic() < self.ends and self.service.poll() is None

    def connect(self, timeout=20):
        return websocket.create_connection(f"ws://127.0.0.1:{self.port}/ws", timeout=timeout)

    def rest(self, low_s, high_s):
        end = min(time.monotonic() + self.random.uniform(low_s, high_s), self.ends)
        while time.monotonic() < end and self.running():
            time.sleep(0.1)

    # What happens around the service; each in a thread of its own.

    def stay_and_measure(self):
        viewer = None
        while self.running():
            try:
                if viewer is None:
                    viewer = self.connect()
                    viewer.send(json.dumps({"type": "want", "codec": "jpeg"}))
                opcode, data = viewer.recv_data()
                if opcode == websocket.ABNF.OPCODE_BINARY:
                    _, _, kind, _, sequence, _, _, captured_ns, _ = HEADER.unpack_from(data)
                    viewer.send(json.dumps({"type": "ack", "sequence": sequence}))
                    if kind == 4:
                        self.ages.append((time.monotonic(), time.time() - 1e-9 * captured_ns))
            except (OSError, websocket.WebSocketException):
                viewer = None
                self.count("the staying viewer was disconnected")
                time.sleep(1)

    def visit(self):
        while self.running():
            self.rest(0.5, 6)
            try:
                viewer = self.connect()
                viewer.send(json.dumps({"type": "want", "codec": self.random.choice(["h264", "jpeg"])}))
                manner = self.random.choice(["acknowledges", "does not acknowledge", "does not read", "leaves at once"])
                end = time.monotonic() + self.random.uniform(1, 8)
                while self.running() and time.monotonic() < end and manner != "leaves at once":
                    if manner == "does not read":
                        time.sleep(0.2)
                        continue
                    opcode, data = viewer.recv_data()
                    if opcode == websocket.ABNF.OPCODE_BINARY and manner == "acknowledges":
                        viewer.send(json.dumps({"type": "ack", "sequence": HEADER.unpack_from(data)[4]}))
                viewer.sock.close() if self.random.random() < 0.5 else viewer.close(timeout=1)
                self.count("visits")
            except (OSError, websocket.WebSocketException):
                self.count("visits that failed")

    def move_objects(self):
        while self.running():
            self.rest(1, 10)
            try:
                viewer = self.connect()
                command = {"type": "object", "index": 0, "position_m": [self.random.uniform(-0.1, 0.1), 0.2, 0], "yaw_degrees": self.random.uniform(-90, 90)}
                viewer.send(json.dumps(command if self.random.random() < 0.8 else {"type": "object", "index": 0, "reset": True}))
                viewer.close(timeout=1)
                self.count("commands")
            except (OSError, websocket.WebSocketException):
                self.count("commands that failed")

    def record(self):
        while self.running():
            self.rest(10, 40)
            try:
                viewer = self.connect()
                viewer.send('{"type":"record","on":true}')
                self.rest(2, 8)
                viewer.send('{"type":"record","on":false}')
                viewer.close(timeout=1)
                self.count("recordings")
            except (OSError, websocket.WebSocketException):
                self.count("recordings that failed")

    def reload(self):
        while self.running():
            self.rest(15, 45)
            good = self.random.random() < 0.8
            (self.folder / "exhibit.toml").write_text(self.exhibit if good else self.exhibit + "\nnonsense = 1\n")
            self.service.send_signal(signal.SIGHUP)
            self.count("reloads" if good else "reloads of an invalid exhibit")

    def unplug(self):
        while self.running():
            self.rest(30, 90)
            if self.random.random() < 0.5:
                subprocess.run(["pkill", "-KILL", "-P", str(self.service.pid), "-f", PLAYER.name], check=False)
                self.away_until = time.monotonic() + 5
                self.count("camera programs killed")
                continue
            (self.folder / "unplugged").touch()
            self.away_until = time.monotonic() + 1e9
            self.rest(1, 8)
            (self.folder / "unplugged").unlink()
            self.away_until = time.monotonic() + 5
            self.count("cameras unplugged")

    def sample(self):
        status = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{self.service.pid}/status").read_text().splitlines())
        return {"rss_mb": int(status["VmRSS"].split()[0]) / 1024, "threads": int(status["Threads"]),
                "descriptors": len(os.listdir(f"/proc/{self.service.pid}/fd"))}

    def watch_resources(self):
        started, told = time.monotonic(), 0
        while self.running():
            self.samples.append(self.sample())
            if time.monotonic() - started > 60 * told:
                told += 1
                print(json.dumps({"minute": told - 1, **self.samples[-1], **self.done}), flush=True)
            time.sleep(5)

    def run(self):
        for _ in range(600):
            try:
                self.connect().close()
                break
            except OSError:
                time.sleep(0.1)
        parts = [self.stay_and_measure, self.visit, self.visit, self.visit, self.move_objects, self.record, self.reload, self.unplug]
        threads = [threading.Thread(target=part, daemon=True) for part in parts]
        for thread in threads:
            thread.start()
        absences = threading.Thread(target=self.note_absences, daemon=True)
        absences.start()
        self.watch_resources()
        ended_itself = self.service.poll() is not None
        code = interrupt(self.service)
        print(json.dumps({**self.summary(), "ended_itself": ended_itself, "exit_code": code}))

    def note_absences(self):
        self.absent = []
        while self.running():
            if time.monotonic() < self.away_until:
                self.absent.append(time.monotonic())
            time.sleep(0.05)

    def summary(self):
        tenth = max(1, len(self.samples) // 10)

        def growth(key):
            first = statistics.median(s[key] for s in self.samples[tenth:2 * tenth])
            last = statistics.median(s[key] for s in self.samples[-tenth:])
            return {"first": round(first, 1), "last": round(last, 1), "max": round(max(s[key] for s in self.samples), 1)}

        warm = self.ages[len(self.ages) // 50:]
        gaps = [b - a for (a, _), (b, _) in zip(warm, warm[1:])]
        period = statistics.median(gaps)
        absent = set(round(t) for t in self.absent)
        gaps_with_camera = [b - a for (a, _), (b, _) in zip(warm, warm[1:]) if not any(round(t) in absent for t in (a, b))]
        old_in_row, longest = 0, 0
        for shown, age in warm:
            old_in_row = old_in_row + 1 if age > 0.2 + 2 * period and round(shown) not in absent else 0
            longest = max(longest, old_in_row)
        ages = sorted(age for _, age in warm)
        return {"pictures": len(warm), "period_ms": round(1e3 * period), "age_ms": {"median": round(1e3 * ages[len(ages) // 2]), "of95": round(1e3 * ages[int(0.95 * len(ages))])},
                "longest_gap_s": round(max(gaps_with_camera), 2), "old_in_a_row": longest, "descriptors": growth("descriptors"), "threads": growth("threads"), "rss_mb": growth("rss_mb"), **self.done}


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program")
    arguments.add_argument("recording")
    arguments.add_argument("--minutes", type=float, default=60)
    arguments.add_argument("--rate-hz", type=float, default=5)
    arguments.add_argument("--set", action="append", default=[])
    soak = Soak(arguments.parse_args())
    try:
        soak.run()
    finally:
        soak.service.kill()
        print((soak.folder / "log").read_text()[-2000:], file=sys.stderr)
        shutil.rmtree(soak.folder, ignore_errors=True)


if __name__ == "__main__":
    main()
