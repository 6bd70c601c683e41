#!/usr/bin/env python3
"""A real Chromium whose network dies: nothing arrives any more, but no connection ends.

  network_page_test.py PROGRAM RECORDING

Checks that the page says so, prints after how long, and that it shows pictures again by itself once the network is back.
"""
import os
import select
import shutil
import socket
import sys
import tempfile
import threading
import unittest

from browser_page import Page, free_port
from child_process import interrupt, start

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])

WATCH = """
window.states = [];
const element = document.getElementById("connection");
new MutationObserver(() => window.states.push([element.dataset.state, performance.now()]))
    .observe(element, { attributes: true, attributeFilter: ["data-state"] });
"""


class Network(threading.Thread):
    """A proxy that can stop passing anything on."""

    def __init__(self, to_port):
        super().__init__(daemon=True)
        self.to_port = to_port
        self.dead = threading.Event()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]

    def run(self):
        while True:
            near, _ = self.listener.accept()
            threading.Thread(target=self.carry, args=(near,), daemon=True).start()

    def carry(self, near):
        """What was under way when the network died is lost, and so is what comes later on the same connection."""
        with near, socket.create_connection(("127.0.0.1", self.to_port)) as far:
            died = self.dead.is_set()
            while True:
                ready, _, _ = select.select([near, far], [], [], 0.1)
                died = died or self.dead.is_set()
                for one in ready:
                    try:
                        data = one.recv(65536)
                        if not data:
                            return
                        if not died:
                            (far if one is near else near).sendall(data)
                    except OSError:
                        return


class NetworkPageTest(unittest.TestCase):
    def test_a_dead_network_is_said_and_survived(self):
        folder = tempfile.mkdtemp(prefix="lumigraft-network-page-")
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        port = free_port()
        service = start([PROGRAM, "serve", "--session", RECORDING, "--listen", f"127.0.0.1:{port}", "--set", "plan.method=rays", "--set",
                         "plan.trace_scale=8"])
        self.addCleanup(interrupt, service)
        page = Page(os.path.join(folder, "profile"))
        self.addCleanup(page.driver.quit)

        def answers():
            with socket.socket() as s:
                return s.connect_ex(("127.0.0.1", port)) == 0

        page.wait(answers, "the service")
        network = Network(port)
        network.start()
        page.open(network.port)
        page.wait(lambda: page.pictures() > 3, "pictures")
        page.driver.execute_script(WATCH)
        page.wait(lambda: page.pictures() > 10, "more of them")

        network.dead.set()
        died_ms = page.driver.execute_script("return performance.now()")
        page.wait(lambda: any(state == "lost" for state, _ in page.driver.execute_script("return window.states")), "the page to say so")
        said_ms = next(when for state, when in page.driver.execute_script("return window.states") if state == "lost")
        print(f"said {said_ms - died_ms:.0f} ms after nothing arrived any more")
        self.assertIn("is lost", page.text("lost"))
        self.assertFalse(page.driver.execute_script("return document.getElementById('lost').hidden"), "over the picture, too")

        network.dead.clear()
        before = page.pictures()
        page.wait(lambda: page.pictures() > before + 3, "pictures, by itself")
        self.assertTrue(page.driver.execute_script("return document.getElementById('lost').hidden"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
