"""A `lumigraft serve` that publishes, and comparisons with what it shows."""
import re
import socket
import time
import urllib.request

import cv2
import numpy as np

from child_process import start

WAIT_S = 120  # on two busy cores; nothing here measures time


def wait(condition, what, wait_s=WAIT_S):
    end = time.monotonic() + wait_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.1)
    raise AssertionError(f"waited {wait_s} s for {what}")


def psnr_db(a, b):
    return 10 * np.log10(255**2 / max(1e-9, np.mean((a.astype(float) - b.astype(float))**2)))


class Service:
    def __init__(self, program, recording, port, log, settings):
        self.port, self.log = port, log
        words = [word for line in ("plan.method=rays", "plan.trace_scale=8", *settings) for word in ("--set", line)]
        with open(log, "w") as stderr:
            self.process = start([program, "serve", "--session", recording, "--listen", f"127.0.0.1:{port}", *words], stderr=stderr)

    def said(self):
        with open(self.log) as f:
            return f.read()

    def get(self, path):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.port}{path}", timeout=WAIT_S) as reply:
            return reply.read()

    def metric(self, name):
        """0 before the service answers."""
        try:
            return float(re.search(rf"^{name} (\S+)$", self.get("/metrics").decode(), re.M).group(1))
        except OSError:
            return 0.0

    def wait_connected(self, connected=True):
        wait(lambda: self.metric("lumigraft_publish_connected") == float(connected), "the connection" if connected else "its end")

    def snapshot(self):
        return cv2.imdecode(np.frombuffer(self.get("/snapshot.jpg"), np.uint8), cv2.IMREAD_COLOR)

    def size(self):
        """Width and height of what is published: 4:2:0 has even sizes."""
        wait(lambda: self.metric("lumigraft_frames_total") > 0, "pictures")
        height, width, _ = self.snapshot().shape
        return width & ~1, height & ~1


def listening(port):
    with socket.socket() as s:
        return s.connect_ex(("127.0.0.1", port)) == 0
