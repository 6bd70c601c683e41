#!/usr/bin/env python3
"""The clock of the machine is set an hour forward, then two back, while a real `lumigraft serve` runs.

  clock_jump_test.py PROGRAM RECORDING SHIFTED_CLOCK

SHIFTED_CLOCK, built from shifted_clock.c, moves the service's CLOCK_REALTIME alone. Checks that pictures go on with the new time in their headers,
that who logged in stays so, that /healthz and the measured age of pictures say nothing else, and that the time stamps
of what is published go on.
"""
import os
import shutil
import socket
import struct
import sys
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

import websocket

from browser_page import free_port
from child_process import interrupt, start
from still_session import still_session

PROGRAM, RECORDING, SHIFTED_CLOCK = (os.path.abspath(p) for p in sys.argv[1:4])
TOKEN = "0123456789abcdef"
HOUR_S = 3600
NEAR_S = 60  # of any duration here; the jumps are 60 times as long
RTP_HZ = 90_000
PICTURE_KINDS = (2, 3, 4)


class NoRedirect(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_):
        return None


class ClockJumpTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lumigraft-clock-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.offset_file = os.path.join(self.folder, "offset")
        self.set_clock(0)
        with open(os.path.join(self.folder, "token"), "w") as f:
            f.write(TOKEN + "\n")
        self.port = free_port()
        rtp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        rtp.bind(("127.0.0.1", 0))
        self.addCleanup(rtp.close)
        self.stamps = []  # of published pictures
        threading.Thread(target=self.read_rtp, args=(rtp,), daemon=True).start()
        config = os.path.join(self.folder, "kiosk.toml")
        with open(config, "w") as f:
            f.write(f'session = "{still_session(RECORDING, self.folder)}"\n[server]\npublish = "rtp://127.0.0.1:{rtp.getsockname()[1]}"\n'
                    f'[[server.listener]]\nlisten = "127.0.0.1:{self.port}"\ntoken_file = "token"\n'
                    '[plan]\nmethod = "rays"\ntrace_scale = 8\n')
        self.service = start([PROGRAM, "serve", "--config", config],
                             env={**os.environ, "LD_PRELOAD": SHIFTED_CLOCK, "SHIFTED_CLOCK_FILE": self.offset_file})
        self.addCleanup(interrupt, self.service)

    def set_clock(self, offset_s):
        with open(self.offset_file, "r+b" if os.path.exists(self.offset_file) else "wb") as f:
            f.write(struct.pack("=q", offset_s))

    def read_rtp(self, rtp):
        while True:
            try:
                packet = rtp.recv(4096)
            except OSError:
                return
            self.stamps.append(struct.unpack_from("!I", packet, 4)[0])

    def get(self, path, **headers):
        with urllib.request.urlopen(urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", headers=headers), timeout=30) as reply:
            return reply.read().decode()

    def log_in(self):
        form = urllib.parse.urlencode({"token": TOKEN}).encode()
        for _ in range(600):
            try:
                urllib.request.build_opener(NoRedirect).open(f"http://127.0.0.1:{self.port}/login", form, timeout=30)
            except urllib.error.HTTPError as reply:
                return reply.headers["Set-Cookie"].split(";")[0]
            except OSError:
                time.sleep(0.1)
        self.fail("the service did not start")

    def picture(self, viewer):
        """Capture time of the next picture, s; acknowledges it."""
        while True:
            message = viewer.recv()
            if isinstance(message, bytes) and message[5] in PICTURE_KINDS:
                sequence, captured_ns = struct.unpack_from("<I", message, 8)[0], struct.unpack_from("<q", message, 16)[0]
                viewer.send('{"type":"ack","sequence":%d}' % sequence)
                return 1e-9 * captured_ns

    def ages_sum_s(self, cookie):
        name = 'lumigraft_stage_seconds_sum{stage="capture_to_ack"} '
        return float(next(line for line in self.get("/metrics", Cookie=cookie).splitlines() if line.startswith(name)).removeprefix(name))

    def test_everything_goes_on(self):
        cookie = self.log_in()
        viewer = websocket.create_connection(f"ws://127.0.0.1:{self.port}/ws", timeout=NEAR_S, cookie=cookie)
        self.addCleanup(viewer.close)
        viewer.send('{"type":"want","codec":"h264"}')
        for offset_s in (0, HOUR_S, -HOUR_S):
            self.set_clock(offset_s)
            deadline = time.monotonic() + NEAR_S
            while abs(self.picture(viewer) - time.time() - offset_s) > NEAR_S:
                self.assertLess(time.monotonic(), deadline, f"no picture of the new time, {offset_s} s off")
            for _ in range(3):
                self.picture(viewer)
            health = self.get("/healthz")
            self.assertIn('"ok":true', health)
            self.assertIn("lumigraft", self.get("/", Cookie=cookie))
            age_s = self.ages_sum_s(cookie)
            self.assertTrue(0 < age_s < HOUR_S / 2, f"ages of all pictures together, {offset_s} s off: {age_s} s")
        steps_s = [((b - a) & 0xFFFFFFFF) / RTP_HZ for a, b in zip(self.stamps, self.stamps[1:])]
        self.assertGreater(len(set(self.stamps)), 10)
        self.assertLess(max(steps_s), NEAR_S, "time stamps that are published go on")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
