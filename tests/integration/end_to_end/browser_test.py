#!/usr/bin/env python3
"""A real Chromium opens the page of a real `lumigraft serve`.

  browser_test.py PROGRAM RECORDING [BrowserTest.test_NAME ...]

Checks that frames arrive, change and contain the object, that moving, hiding and repainting the object has the stated
effect, that JPEG works if H.264 is disabled, and that the page reconnects after the service was restarted.
"""
import json
import os
import re
import shutil
import socket
import sys
import tempfile
import time
import tomllib
import unittest

import cv2
import numpy as np

from browser_page import WAIT_S, Page, free_port
from child_process import interrupt, start
from still_session import still_session

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])
CHANGED = 12  # pixel values: above the codec's noise


class Service:
    def __init__(self, session, port):
        self.port = port
        self.process = start([PROGRAM, "serve", "--session", session, "--listen", f"127.0.0.1:{port}"])

    def stop(self):
        begin = time.monotonic()
        code = interrupt(self.process)
        return code, time.monotonic() - begin


def changed(a, b):
    """Mask of the pixels that differ between two images, without isolated pixels."""
    mask = (np.abs(a - b).max(-1) > CHANGED).astype(np.uint8)
    return cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0


class BrowserTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="lumigraft-browser-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.session = still_session(RECORDING, cls.folder)
        with open(os.path.join(cls.session, "session.toml"), "rb") as f:
            cls.color = tomllib.load(f)["color"]
        with open(os.path.join(RECORDING, "truth/000000/pose.json")) as f:
            cls.T_tag_camera = np.array(json.load(f)["T_tag_from_camera"])
        cls.port = free_port()
        cls.service = Service(cls.session, cls.port)
        cls.addClassCleanup(lambda: cls.service.stop())  # evaluated late: the service running then
        cls.page = Page(os.path.join(cls.folder, "profile"))
        cls.addClassCleanup(cls.page.driver.quit)
        end = time.monotonic() + WAIT_S
        while time.monotonic() < end:  # the service opens its port before it is warmed up
            with socket.socket() as s:
                if s.connect_ex(("127.0.0.1", cls.port)) == 0:
                    break
            time.sleep(0.1)
        cls.page.open(cls.port)

    def column_of(self, x_m, y_m, z_m):
        p = np.linalg.inv(self.T_tag_camera) @ [x_m, y_m, z_m, 1]
        return self.color["fx"] * p[0] / p[2] + self.color["cx"]

    def settle(self, grafted=True):
        """Waits until albedo is solved and the image no longer changes, with an object or without."""
        self.page.wait(lambda: self.page.data("settled") == "true", "the service to say that the room is learnt")
        self.page.wait(lambda: self.page.data("grafted") == str(grafted).lower(), f"pictures with grafted = {grafted}")
        before = self.page.fresh()
        for _ in range(40):
            after = self.page.fresh(4)
            if changed(before, after).sum() < 30:
                return after
            before = after
        self.fail("the picture of a still session does not come to rest")

    def test_1_object_is_in_the_picture_and_moves(self):
        page = self.page
        page.wait(lambda: page.pictures() >= 5, "the first pictures")
        self.assertEqual(page.data("codec"), "h264")
        with_object = self.settle()
        camera = cv2.imread(os.path.join(self.session, "color/000000.png")).astype(float)
        self.assertEqual(with_object.shape, camera.shape)

        page.click("visible")
        page.wait(lambda: not page.driver.execute_script("return document.getElementById('visible').checked"), "hidden")
        without = self.settle(grafted=False)
        self.assertLess(np.abs(without - camera).mean(), 4, "without the object the camera picture passes through")
        mask = changed(with_object, without)
        self.assertGreater(mask.sum(), 2000, "the object covers and changes pixels")

        page.click("visible")
        again = self.settle()
        self.assertLess(changed(again, with_object).sum(), 0.05 * mask.sum(), "switched on again it is the same picture")

        x, y, z = (float(page.driver.find_element("id", axis).get_attribute("value")) for axis in "xyz")
        page.set("x", f"{x + 0.1:.3f}")
        moved = self.settle()
        expected = self.column_of(x + 0.1, y, z + 0.1) - self.column_of(x, y, z + 0.1)
        columns = np.arange(camera.shape[1])
        brightness_free = [np.average(columns, weights=changed(p, without).sum(0) + 1e-9) for p in (with_object, moved)]
        shift = brightness_free[1] - brightness_free[0]
        self.assertGreater(shift, 0.4 * expected, f"moved by 0.1 m to the right: {expected:.0f} pixels are expected")
        self.assertLess(shift, 1.8 * expected)
        page.click("reset")
        back = self.settle()
        self.assertLess(changed(back, with_object).sum(), 0.05 * mask.sum(), "moved back it is the same picture")

    def test_1b_a_tap_puts_the_object_there(self):
        page = self.page
        page.wait(lambda: page.data("grafted") == "true", "pictures with the object")
        before = [float(page.driver.find_element("id", axis).get_attribute("value")) for axis in "xyz"]
        target = np.array([before[0] - 0.1, before[1] - 0.05, 0.0])
        p = np.linalg.inv(self.T_tag_camera) @ [*target, 1]
        pixel = [self.color["fx"] * p[0] / p[2] + self.color["cx"], self.color["fy"] * p[1] / p[2] + self.color["cy"]]
        page.click("put")
        self.assertEqual(page.driver.find_element("id", "put").get_attribute("aria-pressed"), "true")
        page.driver.execute_script("""
            const canvas = document.getElementById("picture"), box = canvas.getBoundingClientRect();
            const scale = Math.min(box.width / canvas.width, box.height / canvas.height);
            canvas.dispatchEvent(new PointerEvent("pointerdown", { pointerId: 1, pointerType: "touch", bubbles: true,
                clientX: box.left + (box.width - canvas.width * scale) / 2 + (arguments[0] + 0.5) * scale,
                clientY: box.top + (box.height - canvas.height * scale) / 2 + (arguments[1] + 0.5) * scale }));""", *pixel)
        place = lambda: [float(page.driver.find_element("id", axis).get_attribute("value")) for axis in "xyz"]
        page.wait(lambda: place() != before, "the object's new place")
        self.assertLess(np.linalg.norm(np.array(place())[:2] - target[:2]), 0.02)
        self.assertLess(abs(place()[2] - before[2]), 0.02, "it stands on the table as before")
        self.assertEqual(page.driver.find_element("id", "put").get_attribute("aria-pressed"), "false")
        page.click("reset")
        page.wait(lambda: place() == before, "the object's first place")

    def test_2_material(self):
        page = self.page
        before = self.settle()
        page.set("material", "terracotta")
        after = self.settle()
        self.assertGreater(changed(before, after).sum(), 500)
        page.set("material", "own")
        self.settle()

    def test_3_jpeg(self):
        page = self.page
        page.set("codec", "jpeg")
        page.wait(lambda: page.data("codec") == "jpeg", "a JPEG picture")
        page.fresh()
        page.set("codec", "auto")
        page.wait(lambda: page.data("codec") == "h264", "H.264 again")

    def test_4_figures(self):
        page = self.page
        page.wait(lambda: re.match(r"[\d.]+ fps", page.text("shown-fps")) and float(page.text("shown-fps").split()[0]) > 0, "frames a second")
        page.wait(lambda: page.text("end-to-end") not in ("", "–"), "latency from camera to screen")
        read = "return [...document.querySelectorAll('#stages tbody tr td:first-child')].map(e => e.textContent)"
        page.wait(lambda: "relight" in page.driver.execute_script(read), "the time of relight")
        stages = page.driver.execute_script(read)
        print("stages:", ", ".join(stages), "| shown", page.text("shown-fps"), "| camera to screen", page.text("end-to-end"))

    def test_5_moving_pictures_after_a_restart(self):
        page = self.page
        code, seconds = self.service.stop()
        self.assertEqual(code, 0)
        self.assertLess(seconds, 1.0, "Ctrl-C ends the service within a second")
        page.wait(lambda: "lost" in page.text("connection") or "connecting" in page.text("connection"), "the page to notice")
        type(self).service = Service(RECORDING, self.port)
        page.wait(lambda: page.text("connection") == "connected", "the page to come back by itself")
        count = page.pictures()
        page.wait(lambda: page.pictures() >= count + 5, "pictures again")
        first = page.fresh()
        page.wait(lambda: changed(first, page.fresh(1)).mean() > 0.02, "pictures of a moving camera to change")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
