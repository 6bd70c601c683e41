#!/usr/bin/env python3
"""A real `lumigraft serve` reads exhibit and listeners again at SIGHUP.

  reload_test.py PROGRAM RECORDING

Checks that a new object and other permissions come to a viewer whose pictures go on, that a wrong file is named in the
log and changes nothing, that new connections get a new certificate while those with the old one stay,
and that what an operator saves is the start after that.
"""
import json
import os
import shutil
import signal
import ssl
import subprocess
import sys
import tempfile
import time
import unittest

import websocket

from browser_page import free_port
from child_process import interrupt, start

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])
WAIT_S = 300  # on two busy cores; no test here measures time

CONFIG = """session = "{recording}"
exhibit = "exhibit.toml"
[plan]
method = "rays"
trace_scale = 8
[[server.listener]]
listen = "127.0.0.1:{port}"
permissions = {permissions}
[[server.listener]]
listen = "127.0.0.1:{https}"
certificate = "page.crt"
key = "page.key"
"""

OBJECT = """[[object]]
name = "{name}"
model = "cube.obj"
size_m = 0.05
position_m = [{x}, 0.0, 0.05]
"""

CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1)) + """f 1 2 4 3
f 5 7 8 6
f 1 5 6 2
f 3 4 8 7
f 1 3 7 5
f 2 6 8 4
"""


class Viewer:
    def __init__(self, port, scheme="ws"):
        trust = {"cert_reqs": ssl.CERT_NONE, "check_hostname": False}
        self.socket = websocket.create_connection(f"{scheme}://127.0.0.1:{port}/ws", timeout=WAIT_S, sslopt=trust)
        self.pictures = 0

    def send(self, message):
        self.socket.send(json.dumps(message))

    def text(self):
        """The next text message; pictures are counted."""
        while True:
            opcode, data = self.socket.recv_data()
            if opcode == websocket.ABNF.OPCODE_TEXT:
                return json.loads(data)
            self.pictures += opcode == websocket.ABNF.OPCODE_BINARY

    def wait(self, condition, what):
        end = time.monotonic() + WAIT_S
        while time.monotonic() < end:
            message = self.text()
            if condition(message):
                return message
        raise AssertionError(f"waited {WAIT_S} s for {what}")


class ReloadTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lumigraft-reload-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.port, self.https = free_port(), free_port()
        self.certify()
        self.write("cube.obj", CUBE)
        self.configure(["view", "control", "admin"])
        self.write("exhibit.toml", OBJECT.format(name="first", x=0))
        self.log = open(os.path.join(self.folder, "log"), "w+")
        self.addCleanup(self.log.close)
        self.service = start([PROGRAM, "serve", "--config", os.path.join(self.folder, "kiosk.toml")], stderr=self.log)
        self.addCleanup(interrupt, self.service)
        self.wait_for_log("serving")

    def write(self, name, text):
        with open(os.path.join(self.folder, name), "w") as f:
            f.write(text)

    def configure(self, permissions):
        self.write("kiosk.toml", CONFIG.format(recording=RECORDING, port=self.port, https=self.https,
                                                      permissions=json.dumps(permissions)))

    def certify(self):
        """Writes a new certificate and its key."""
        files = [os.path.join(self.folder, name) for name in ("page.key", "page.crt")]
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "90", "-subj", "/CN=localhost", "-keyout",
                        files[0], "-out", files[1]], check=True, capture_output=True)

    def served_certificate(self):
        return ssl.get_server_certificate(("127.0.0.1", self.https), timeout=WAIT_S).strip()

    def said(self):
        with open(os.path.join(self.folder, "log")) as f:
            return f.read()

    def wait_for_log(self, words, count=1):
        end = time.monotonic() + WAIT_S
        while self.said().count(words) < count:
            self.assertLess(time.monotonic(), end, f"waited for \"{words}\" in {self.said()}")
            time.sleep(0.1)

    def test_a_new_exhibit_and_permissions_without_a_gap(self):
        viewer = Viewer(self.port)
        hello = viewer.wait(lambda m: m["type"] == "hello", "hello")
        self.assertEqual([o["name"] for o in hello["objects"]], ["first"])
        viewer.send({"type": "want", "codec": "jpeg"})
        viewer.wait(lambda m: viewer.pictures > 3, "pictures")

        self.write("exhibit.toml", OBJECT.format(name="first", x=0) + OBJECT.format(name="second", x=0.1))
        self.configure(["view"])
        self.service.send_signal(signal.SIGHUP)
        hello = viewer.wait(lambda m: m["type"] == "hello" and len(m["objects"]) == 2, "the new object")
        self.assertEqual(hello["permissions"], ["view"])
        self.assertEqual(hello["objects"][1]["name"], "second")
        self.wait_for_log("read the exhibit and the listeners again")
        before = viewer.pictures
        viewer.wait(lambda m: viewer.pictures > before + 3, "pictures on the same connection")

        self.write("exhibit.toml", OBJECT.format(name="third", x="wrong"))
        self.service.send_signal(signal.SIGHUP)
        self.wait_for_log("what runs goes on")
        self.assertIn("exhibit.toml", self.said().rsplit("what runs goes on", 1)[1])
        before = viewer.pictures
        viewer.wait(lambda m: viewer.pictures > before + 3, "pictures after a wrong file")
        newcomer = Viewer(self.port)
        hello = newcomer.wait(lambda m: m["type"] == "hello", "hello")
        self.assertEqual([o["name"] for o in hello["objects"]], ["first", "second"])

        with open(os.path.join(self.folder, "page.crt")) as f:
            first_certificate = f.read().strip()
        self.assertEqual(self.served_certificate(), first_certificate)
        encrypted = Viewer(self.https, "wss")
        self.write("exhibit.toml", OBJECT.format(name="third", x=0.2))
        self.certify()
        self.service.send_signal(signal.SIGHUP)
        for one in (viewer, encrypted):
            one.wait(lambda m: m["type"] == "hello" and [o["name"] for o in m["objects"]] == ["third"], "the mended file")
        self.wait_for_log("read the exhibit and the listeners again", 2)
        self.assertNotEqual(self.served_certificate(), first_certificate, "who comes now gets the new certificate")

    def test_what_was_saved_is_the_start(self):
        viewer = Viewer(self.port)
        viewer.wait(lambda m: m["type"] == "hello", "hello")
        viewer.send({"type": "object", "index": 0, "position_m": [0.25, 0, 0.05], "visible": False})
        viewer.send({"type": "save"})
        self.assertEqual(viewer.wait(lambda m: m["type"] == "saved", "the answer")["error"], "")
        viewer.send({"type": "object", "index": 0, "position_m": [0, 0, 0.05], "visible": True})
        viewer.send({"type": "object", "index": 0, "reset": True})
        saved = lambda m: m["type"] in ("hello", "state") and m["objects"][0]["position_m"] == [0.25, 0, 0.05] and not m["objects"][0]["visible"]
        viewer.wait(saved, "the object where it was saved")
        viewer.send({"type": "object", "index": 0, "position_m": [0, 0, 0.05], "visible": True})
        viewer.wait(lambda m: m["type"] == "state" and m["objects"][0]["visible"], "the object elsewhere")
        self.service.send_signal(signal.SIGHUP)
        viewer.wait(saved, "the saved exhibit after SIGHUP")
        self.assertIn("exhibit.saved.toml is shown", self.said())

        os.mkdir(os.path.join(self.folder, "exhibit.saved.toml.partial")) # as on a disk that takes nothing more
        viewer.send({"type": "save"})
        error = viewer.wait(lambda m: m["type"] == "saved", "the answer")["error"]
        self.assertIn("cannot be saved", error)
        self.assertNotIn(self.folder, error)
        self.wait_for_log("exhibit.saved.toml.partial")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
