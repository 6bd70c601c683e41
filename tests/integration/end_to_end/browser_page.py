"""The page of `lumigraft serve` in a real Chromium."""
import base64
import json
import socket
import time

import cv2
import numpy as np
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

from child_process import end_with_parent

WAIT_S = 300  # software rendering on two busy cores: no test here measures time, so timeouts are long


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Page:
    def __init__(self, profile, flags=()):
        options = Options()
        options.binary_location = "/usr/bin/chromium"
        for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
                     "--disable-component-update", "--disable-sync", "--window-size=1280,900", f"--user-data-dir={profile}", *flags):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service(popen_kw={"preexec_fn": end_with_parent}), options=options)

    def open(self, port, query=""):
        self.driver.get(f"http://127.0.0.1:{port}/{query}")

    def data(self, key):
        return self.driver.execute_script(f"return document.getElementById('picture').dataset.{key} ?? null")

    def pictures(self):
        return int(self.data("pictures") or 0)

    def wait(self, condition, what):
        end = time.monotonic() + WAIT_S
        while time.monotonic() < end:
            value = condition()
            if value:
                return value
            time.sleep(0.1)
        logs = json.dumps(self.driver.get_log("browser"))
        raise AssertionError(f"waited {WAIT_S} s for {what}; the browser said {logs}")

    def fresh(self, count=3):
        """The image after `count` further frames were drawn."""
        target = self.pictures() + count
        self.wait(lambda: self.pictures() >= target, "pictures")
        url = self.driver.execute_script("return document.getElementById('picture').toDataURL('image/png')")
        data = base64.b64decode(url.split(",", 1)[1])
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).astype(float)

    def set(self, control, value):
        self.driver.execute_script(
            "const e = document.getElementById(arguments[0]); e.value = arguments[1]; e.dispatchEvent(new Event('change'))", control, value)

    def click(self, control):
        self.driver.find_element("id", control).click()

    def text(self, element):
        return self.driver.find_element("id", element).text
