#!/usr/bin/env python3
"""A real Chromium seeks in the recording that a real `lumigraft serve` plays.

  playback_page_test.py PROGRAM RECORDING

Checks that the slider shows the position in the recording, that dragging it seeks, that a paused recording repeats its
frame while frames are still rendered, and that a step shows the next frame.
"""
import os
import re
import shutil
import sys
import tempfile
import time
import unittest

import numpy as np

from browser_page import Page, free_port
from child_process import interrupt, start

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])


class PlaybackPageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="lumigraft-playback-page-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.port = free_port()
        cls.service = start([PROGRAM, "serve", "--session", RECORDING, "--listen", f"127.0.0.1:{cls.port}", "--set", "plan.method=rays", "--set", "plan.trace_scale=8"])
        cls.addClassCleanup(interrupt, cls.service)
        cls.page = Page(os.path.join(cls.folder, "profile"))
        cls.addClassCleanup(cls.page.driver.quit)
        time.sleep(1)
        cls.page.wait(cls.opened, "the service")

    @classmethod
    def opened(cls):
        try:
            cls.page.open(cls.port)
            return True
        except Exception:
            return False

    def moment(self):
        said = re.match(r"(\d+):(\d\d\.\d) of (\d+):(\d\d\.\d)", self.page.text("moment"))
        return said and tuple(60 * int(said[i]) + float(said[i + 1]) for i in (1, 3))

    def go(self, seconds):
        self.page.driver.execute_script(
            "const e = document.getElementById('seek'); e.value = arguments[0]; e.dispatchEvent(new Event('input')); e.dispatchEvent(new Event('change'))",
            seconds)

    def settled(self):
        """The image once it no longer changes while the recording is paused."""
        before = self.page.fresh(3)
        for _ in range(40):
            now = self.page.fresh(3)
            if np.abs(now - before).mean() < 0.5:
                return now
            before = now
        self.fail("the picture never stood still")

    def test_to_and_fro(self):
        page = self.page
        page.wait(lambda: page.pictures() > 5 and self.moment(), "pictures and the bar")
        first = self.moment()
        self.assertAlmostEqual(first[1], 23 / 12, delta=0.1)
        page.wait(lambda: self.moment() != first, "the recording to go on")
        learnt = "return document.getElementById('learning').hidden"
        page.wait(lambda: page.driver.execute_script(learnt), "the room to be learnt: while it is, the same frame looks different later")
        page.click("pause")
        page.wait(lambda: page.text("pause") == "Play", "the pause")
        for seconds in (1.6, 0.5):  # both places once before, so that what is seen there is known
            self.go(seconds)
            page.wait(lambda: self.moment()[0] == seconds, "the moment")
            half = self.settled()
        stands = self.moment()
        self.go(1.6)
        page.wait(lambda: self.moment()[0] == 1.6, "another moment")  # the frame of 20/12 s
        late = self.settled()
        self.assertGreater(np.abs(late - half).mean(), 2.0, "the camera had moved on")
        page.click("step")
        page.wait(lambda: self.moment()[0] == 1.7, "the next picture")
        self.go(0.5)
        page.wait(lambda: self.moment() == stands, "the first moment again")
        self.assertLess(np.abs(self.settled() - half).mean(), 2.0, "the same picture")
        if len(sys.argv) > 3:
            page.driver.save_screenshot(sys.argv[3])
        page.click("pause")
        page.wait(lambda: page.text("pause") == "Pause", "the end of the pause")
        page.wait(lambda: self.moment() != stands, "the recording to go on")
        self.assertIsNone(self.service.poll())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
