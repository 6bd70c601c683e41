#!/usr/bin/env python3
"""A real Chromium presses the record button of a real `lumigraft serve` with a GigE Vision camera.

  record_page_test.py PROGRAM FAKE_CAMERA

Checks that the page shows that it records, for how long and as what, that frames are still streamed, that the
recording can be replayed, and that a full disk ends the recording but not the stream.
"""
import fcntl
import os
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

from browser_page import Page, free_port
from child_process import interrupt, start

PROGRAM, CAMERA = (os.path.abspath(p) for p in sys.argv[1:3])
CONFIG = """format = 1
[color]
source = "aravis:Aravis-Fake-GV78"
pixel_format = "rgb8"
rate_hz = 15
width = 320
height = 240
fx = 300
fy = 300
cx = 160
cy = 120
exposure = 1
[tag]
id = 1
size_m = 0.1
[server]
recordings = "recorded"
"""


class RecordPageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # GigE Vision uses one port per address: tests with such a camera run one after another.
        cls.turn = cls.enterClassContext(open(os.path.join(tempfile.gettempdir(), "lumigraft-gige-camera.lock"), "a"))
        fcntl.flock(cls.turn, fcntl.LOCK_EX)

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lumigraft-record-page-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        camera = self.enterContext(start([CAMERA, "127.0.0.1", "GV78", "0"], stdout=subprocess.PIPE))
        self.addCleanup(camera.kill)
        camera.stdout.readline()
        self.config = os.path.join(self.folder, "kiosk.toml")
        with open(self.config, "w") as f:
            f.write(CONFIG)
        self.page = Page(os.path.join(self.folder, "profile"))
        self.addCleanup(self.page.driver.quit)

    def serve(self, before=None):
        port = free_port()
        service = start([PROGRAM, "serve", "--config", self.config, "--listen", f"127.0.0.1:{port}"], before)
        self.addCleanup(lambda: self.assertEqual(interrupt(service), 0))

        def answers():
            with socket.socket() as s:
                return s.connect_ex(("127.0.0.1", port)) == 0

        self.page.wait(answers, "the service")
        self.page.open(port)
        self.page.wait(lambda: self.page.pictures() > 0, "pictures")
        self.page.wait(lambda: self.page.text("record") == "Record", "the button")

    def doing(self):
        return self.page.driver.execute_script("return document.getElementById('record-state').dataset.doing")

    def state(self):
        return self.page.text("record-state")

    def test_what_is_recorded_replays(self):
        page = self.page
        self.serve()
        page.click("record")
        page.wait(lambda: re.match(r"recording 0:0[3-9], ", self.state()), "three seconds of it")
        before = page.pictures()
        page.wait(lambda: page.pictures() > before + 5, "pictures beside the recording")
        self.assertEqual(page.text("record"), "Stop")
        page.click("record")
        said = page.wait(lambda: re.match(r"recorded 0:\d\d, (\d+) pictures(, \d+ lost)?, to (\S+)", self.state()), "the end of it")
        print(said[0])
        self.assertNotIn("/", said[3], "viewers learn its name, not where this machine keeps it")
        folder = os.path.join(self.folder, "recorded", said[3])
        again = subprocess.run([PROGRAM, "record", "--config", os.path.join(folder, "session.toml"), "--out", os.path.join(self.folder, "again")],
                               capture_output=True, text=True, check=True)
        self.assertIn(f"colour: {said[1]} pictures\n", again.stdout + again.stderr)
        self.assertGreater(int(said[1]), 20)

    def test_a_full_disk_ends_the_recording_and_not_the_picture(self):
        page = self.page

        def small_disk():  # simulated by the file size limit
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (4_000_000, 4_000_000))

        self.serve(small_disk)
        page.click("record")
        page.wait(lambda: self.state().startswith("the recording ended: "), "the disk to be full")
        self.assertIn("color.mkv: File too large", self.state())
        self.assertEqual(page.text("record"), "Record")
        before = page.pictures()
        page.wait(lambda: page.pictures() > before + 5, "pictures after it")
        folder, = os.listdir(os.path.join(self.folder, "recorded"))
        kept = os.path.join(self.folder, "recorded", folder)
        again = subprocess.run([PROGRAM, "record", "--config", os.path.join(kept, "session.toml"), "--out", os.path.join(self.folder, "again")],
                               capture_output=True, text=True, check=True)
        self.assertRegex(again.stdout + again.stderr, r"colour: 1[67] pictures")  # 230 kB each


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
