#!/usr/bin/env python3
"""Visitors at the page of a real `lumigraft serve`, in a real Chromium: fingers, keys, languages, and the kiosk.

  visitor_page_test.py PROGRAM RECORDING [FOLDER_FOR_SCREENSHOTS]

Checks that objects are chosen by tap, by key and in the gallery, moved by one finger and turned by two; that the page
is German for Germans; that errors stay until they are dismissed; that contrast and names suffice and that nothing is
read aloud while nothing changes; and that the kiosk's page shows the picture alone, and says when there is none.
"""
import json
import math
import os
import shutil
import signal
import sys
import tempfile
import time
import unittest

import numpy as np
import websocket
from selenium.webdriver.common.keys import Keys

from browser_page import Page, free_port
from child_process import interrupt, start
from still_session import still_session

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])
SCREENSHOTS = sys.argv[3] if len(sys.argv) > 3 else None
EXHIBIT = """
[[object]]
name = "owl"
model = "{model}"
position_m = [-0.05, 0.2, 0.0]

[[object]]
name = "Uhu"
model = "{model}"
position_m = [0.2, 0.2, 0.0]
"""
# Of all visible texts the least contrast with what is behind them, WCAG 2, and where it is.
CONTRAST = """
    const parse = (color) => color.match(/[\\d.]+/g).map(Number);
    const luminance = ([r, g, b]) => [r, g, b].map((v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
        .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
    const behind = (e) => { for (; e; e = e.parentElement) { const c = parse(getComputedStyle(e).backgroundColor); if (c.length < 4 || c[3] > 0.5) return c; } return [255, 255, 255]; };
    let least = [99, ""];
    for (const e of document.querySelectorAll("body *")) {
      const says = [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
      if (!says || !e.checkVisibility()) continue;
      const [a, b] = [luminance(parse(getComputedStyle(e).color)), luminance(behind(e))];
      const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      if (ratio < least[0]) least = [ratio, e.outerHTML.slice(0, 120)];
    }
    return least;"""
# Notes what is written to regions that screen readers read aloud although nothing but figures changed.
LISTEN = """
    window.spoken = [];
    const words = (region) => region.textContent.replace(/[\\d.,:]+/g, "");
    for (const region of document.querySelectorAll("[role=status], [role=alert], [aria-live], output")) {
      let before = words(region);
      new MutationObserver(() => {
        if (words(region) === before) window.spoken.push(region.outerHTML);
        before = words(region);
      }).observe(region, { childList: true, characterData: true, subtree: true });
    }"""


class VisitorPageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="lumigraft-visitor-page-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        exhibit = os.path.join(cls.folder, "two.toml")
        with open(exhibit, "w") as f:
            f.write(EXHIBIT.format(model=os.path.join(RECORDING, "models/statue.glb")))
        cls.port = free_port()
        cls.service = start([PROGRAM, "serve", "--session", still_session(RECORDING, cls.folder), "--exhibit", exhibit, "--listen",
                             f"127.0.0.1:{cls.port}", "--set", "plan.method=rays", "--set", "plan.trace_scale=8"])
        cls.addClassCleanup(interrupt, cls.service)
        cls.page = Page(os.path.join(cls.folder, "profile"), ["--accept-lang=de-AT,de", "--touch-events=enabled"])
        cls.addClassCleanup(cls.page.driver.quit)
        cls.page.wait(cls.opened, "the service")

    @classmethod
    def opened(cls):
        try:
            cls.page.open(cls.port)
            return True
        except Exception:
            return False

    def setUp(self):
        self.server = websocket.create_connection(f"ws://127.0.0.1:{self.port}/ws", timeout=60)
        self.addCleanup(self.server.close)
        self.objects = None
        self.page.wait(lambda: self.newest("hello"), "hello")
        self.camera = self.hello["camera"]
        stats = self.page.wait(lambda: self.newest("stats"), "a pose")
        self.T_tag_camera = np.array([*stats["T_tag_camera"], [0, 0, 0, 1]][:4], float)

    def newest(self, kind):
        """The next message of this kind from the service itself; objects are kept."""
        message = json.loads(self.server.recv())
        if message["type"] == "hello":
            self.hello = message
        self.objects = message.get("objects", self.objects)
        if kind == "stats" and message.get("T_tag_camera") is None:
            return None
        return message if message["type"] == kind else None

    def state(self, condition, what):
        """Waits for what the service says of the objects."""
        while not condition(self.objects):
            self.page.wait(lambda: self.newest("state"), what)

    def open(self, query=""):
        """The page with these settings; as the last test left it, if that had the same."""
        if not self.page.driver.current_url.endswith(f"/{query}"):
            self.page.open(self.port, query)
        self.page.wait(lambda: self.page.pictures() > 0, "a picture")
        time.sleep(1.2)  # the page knows the pose from the statistics, once a second

    def screenshot(self, name):
        if SCREENSHOTS:
            self.page.driver.save_screenshot(os.path.join(SCREENSHOTS, f"{name}.png"))

    def run_script(self, script, *values):
        return self.page.driver.execute_script(script, *values)

    def on_screen(self, index):
        """The point of the window that shows the middle of an object."""
        x, y, z = self.objects[index]["position_m"]
        p = np.linalg.inv(self.T_tag_camera) @ [x, y, z + 0.06, 1]
        pixel = [self.camera["fx"] * p[0] / p[2] + self.camera["cx"], self.camera["fy"] * p[1] / p[2] + self.camera["cy"]]
        left, top, width, height, wide, high = self.run_script("""
            const c = document.getElementById("picture"), b = c.getBoundingClientRect();
            return [b.left, b.top, b.width, b.height, c.width, c.height];""")
        scale = min(width / wide, height / high)
        return np.array([left + (width - wide * scale) / 2 + (pixel[0] + 0.5) * scale, top + (height - high * scale) / 2 + (pixel[1] + 0.5) * scale])

    def touch(self, kind, *points):
        self.page.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {
            "type": kind, "touchPoints": [{"x": float(x), "y": float(y), "id": i} for i, (x, y) in enumerate(points)]})

    def chosen(self):
        return self.run_script("return [...document.querySelectorAll('#gallery input')].findIndex((e) => e.checked)")

    def test_1_fingers(self):
        self.open()
        self.assertEqual(self.chosen(), 0)
        other = self.on_screen(1)
        before = self.objects
        self.touch("touchStart", other)
        self.touch("touchMove", other + [3, 2])
        self.touch("touchEnd")
        self.assertEqual(self.chosen(), 1, "a tap on an object chooses it")
        self.assertEqual(self.page.text("chosen"), "Uhu")
        self.screenshot("chosen")
        self.touch("touchStart", other)
        for step in range(1, 6):
            self.touch("touchMove", other + [0, 12 * step])
        self.touch("touchEnd")
        self.state(lambda o: o[1]["position_m"][1] < before[1]["position_m"][1] - 0.02, "the object to come nearer")
        self.assertEqual(self.objects[0]["position_m"], before[0]["position_m"])
        self.assertAlmostEqual(self.objects[1]["position_m"][2], before[1]["position_m"][2], places=6)

        centre = self.on_screen(1)
        finger = lambda degrees: centre + 50 * np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
        self.touch("touchStart", centre)
        self.touch("touchStart", centre, finger(0))
        for degrees in range(10, 91, 10):
            self.touch("touchMove", centre, finger(degrees))
        self.touch("touchEnd", centre)
        self.touch("touchEnd")
        self.state(lambda o: abs(o[1]["yaw_degrees"] + 90) < 1, "a quarter turn, clockwise as the fingers'")
        self.assertEqual(self.objects[0]["yaw_degrees"], 0)
        self.page.click("reset")
        self.state(lambda o: o[1]["position_m"] == before[1]["position_m"], "the object's first place")

    def test_2_gallery_and_keys(self):
        self.open()
        label = lambda i: self.page.driver.find_elements("css selector", "#gallery label")[i]
        label(0).click()
        label(1).click()
        self.assertEqual(self.chosen(), 1)
        self.page.click("only")
        self.state(lambda o: not o[0]["visible"] and o[1]["visible"], "only the chosen one to be shown")
        self.page.wait(lambda: label(0).text.split("\n")[-1].endswith("ausgeblendet"), "the gallery to say it")
        self.assertNotIn("ausgeblendet", label(1).text)
        self.page.driver.find_elements("css selector", "#gallery input")[1].send_keys(Keys.ARROW_UP)
        self.assertEqual(self.chosen(), 0, "the gallery works with the keyboard")
        self.page.click("visible")
        self.state(lambda o: o[0]["visible"], "both to be shown")
        picture = self.page.driver.find_element("id", "picture")
        picture.send_keys("n")
        self.assertEqual(self.chosen(), 1)
        x, yaw = self.objects[1]["position_m"][0], self.objects[1]["yaw_degrees"]
        picture.send_keys(Keys.ARROW_RIGHT, "q")
        self.state(lambda o: abs(o[1]["position_m"][0] - x - 0.01) < 1e-6 and o[1]["yaw_degrees"] == yaw + 5, "the keys' effect")
        self.page.click("reset")

    def test_3_languages(self):
        self.open()
        self.assertEqual(self.run_script("return document.documentElement.lang"), "de")
        self.page.wait(lambda: self.page.text("connection") == "verbunden", "the connection")
        self.assertEqual(self.page.text("only"), "Nur dieses zeigen")
        self.page.wait(lambda: "," in self.page.text("shown-fps"), "German numbers")
        self.screenshot("german")
        self.page.driver.find_element("css selector", "[data-language=en]").click()
        self.page.wait(lambda: self.page.text("connection") == "connected", "English")
        self.assertEqual(self.page.text("only"), "Show only this")
        self.page.wait(lambda: "." in self.page.text("shown-fps"), "English numbers")
        self.screenshot("english")
        self.page.open(self.port)
        self.assertEqual(self.run_script("return document.documentElement.lang"), "en", "the choice is kept")
        self.page.open(self.port, "?lang=de")
        self.assertEqual(self.run_script("return document.documentElement.lang"), "de", "the address goes first")

    def test_4_errors_stay_and_nothing_is_read_again(self):
        self.open("?lang=de")
        self.run_script("document.getElementById('put').click()")
        # The upper edge shows no level surface.
        canvas = self.run_script("const b = document.getElementById('picture').getBoundingClientRect(); return [b.left + b.width / 2, b.top + 3]")
        self.touch("touchStart", canvas)
        self.touch("touchEnd")
        self.page.wait(lambda: self.page.text("errors"), "an error")
        self.run_script(LISTEN)
        time.sleep(3)  # three statistics
        self.assertEqual(self.run_script("return window.spoken"), [])
        self.assertIn("Gelesen", self.page.text("errors"))
        self.screenshot("error")
        ratio, where = self.run_script(CONTRAST)
        self.assertGreaterEqual(ratio, 4.5, where)
        tree = self.page.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
        widgets = [n for n in tree if not n["ignored"] and n["role"]["value"] in
                   ("button", "checkbox", "combobox", "radio", "slider", "spinbutton", "textbox", "application")]
        self.assertGreater(len(widgets), 12)
        self.assertEqual([n for n in widgets if not n.get("name", {}).get("value")], [], "controls without a name")
        self.page.driver.find_element("css selector", "#errors button").click()
        self.assertEqual(self.page.text("errors"), "")

        self.page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 360, "height": 640, "deviceScaleFactor": 2, "mobile": True})
        try:
            self.assertLessEqual(self.run_script("return document.documentElement.scrollWidth"), 360, "fits on a phone")
            self.screenshot("phone")
            self.run_script("document.getElementById('object-panel').scrollIntoView()")
            self.screenshot("phone_panel")
        finally:
            self.page.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

    def test_5_kiosk(self):
        self.open("?kiosk&lang=de")
        visible = lambda: self.run_script("""
            return [...document.querySelectorAll("body *")].filter((e) => e.id && e.checkVisibility() && e.getBoundingClientRect().width > 1).map((e) => e.id)""")
        self.assertEqual(sorted(visible()), ["picture", "stage", "view"])
        box = self.run_script("const b = document.getElementById('picture').getBoundingClientRect(); return [b.width - innerWidth, b.height - innerHeight]")
        self.assertEqual(box, [0, 0])
        self.page.wait(lambda: self.run_script("return getComputedStyle(document.getElementById('picture')).cursor") == "none", "the cursor to go")
        self.assertEqual(self.run_script("return document.activeElement.id"), "picture")
        self.assertEqual([entry["message"] for entry in self.page.driver.get_log("browser") if "turn off" in entry["message"]], [])
        refused = self.run_script("""
            return [new MouseEvent("contextmenu", { bubbles: true, cancelable: true }), new KeyboardEvent("keydown", { key: "F1", bubbles: true, cancelable: true })]
                .map((event) => !document.getElementById("picture").dispatchEvent(event))""")
        self.assertEqual(refused, [True, True])
        self.page.driver.back()
        self.assertIn("kiosk", self.page.driver.current_url)
        before = self.objects[0]["position_m"][1]
        at = self.on_screen(0)
        self.touch("touchStart", at)
        for step in range(1, 6):
            self.touch("touchMove", at + [0, 8 * step])
        self.touch("touchEnd")
        self.state(lambda o: o[0]["position_m"][1] < before - 0.01, "the object to come nearer")
        self.screenshot("kiosk")

        self.service.send_signal(signal.SIGSTOP)
        try:
            self.page.wait(lambda: "waiting" in visible(), "the kiosk to say that there is no picture")
            self.assertEqual(self.page.text("waiting"), "Gleich ist das Bild wieder da.")
            time.sleep(0.5)
            self.screenshot("kiosk_waiting")
        finally:
            self.service.send_signal(signal.SIGCONT)
        self.page.wait(lambda: "waiting" not in visible(), "the picture to come back by itself")

    def test_6_maps_and_upload(self):
        page = self.page
        page.open(self.port)
        script = page.driver.execute_script
        choose = "const s = document.getElementById('map'); s.value = arguments[0]; s.onchange();"
        shown = "const c = document.getElementById('map-view'); return !c.hidden && Number(c.dataset.sequence)"
        middle = "const c = document.getElementById('map-view'); return [...c.getContext('2d').getImageData(c.width / 2 + arguments[0], 5, 1, 1).data]"
        script(choose, "depth")
        first = page.wait(lambda: script(shown), "the map of depth")
        page.wait(lambda: script(shown) > first, "a newer one")
        self.assertTrue(script("return document.querySelector('[data-map=depth]').checkVisibility()"))
        self.screenshot("depth")
        script(choose, "before-after")
        page.wait(lambda: script(shown), "the picture with and without objects")
        self.assertEqual(script(middle, 0), [240, 176, 96, 255], "the line is in the middle")
        divider = page.driver.find_element("id", "divider")
        divider.send_keys(*[Keys.ARROW_RIGHT] * 10)
        self.assertNotEqual(script(middle, 0), [240, 176, 96, 255])
        self.screenshot("before-after")
        script(choose, "")
        self.assertFalse(script("return document.getElementById('map-view').checkVisibility()"))

        model = os.path.join(self.folder, "vase.glb")
        shutil.copy(os.path.join(RECORDING, "models/statue.glb"), model)
        count = "return document.querySelectorAll('#gallery input').length"
        before = script(count)
        page.driver.find_element("id", "upload-file").send_keys(model)
        page.wait(lambda: script(count) == before + 1, "the model in the gallery")
        with open(model, "w") as f:
            f.write("no model")
        os.rename(model, os.path.join(self.folder, "broken.glb"))
        page.driver.find_element("id", "upload-file").send_keys(os.path.join(self.folder, "broken.glb"))
        page.wait(lambda: "not a model that can be read" in page.text("errors"), "the reason")

        stored = os.path.join(self.folder, "models/vase.glb")
        self.assertTrue(os.path.exists(stored))
        page.driver.find_elements("css selector", "#gallery input")[before].send_keys(Keys.SPACE)
        remove = page.driver.find_element("id", "remove")
        remove.click()
        page.driver.switch_to.alert.dismiss()
        self.assertEqual(script(count), before + 1, "nothing is removed by who does not confirm it")
        remove.click()
        self.assertIn("vase", page.driver.switch_to.alert.text)
        page.driver.switch_to.alert.accept()
        page.wait(lambda: script(count) == before, "the model to leave the gallery")
        page.wait(lambda: not os.path.exists(stored), "its file to be deleted")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
