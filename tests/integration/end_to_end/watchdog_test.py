#!/usr/bin/env python3
"""What `lumigraft serve` tells systemd: that it is ready once pictures are made, that it lives, and that it ends.

  watchdog_test.py PROGRAM RECORDING
"""
import os
import shutil
import signal
import socket
import sys
import tempfile
import time
import unittest

from browser_page import free_port
from child_process import interrupt, start

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])


class WatchdogTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lumigraft-watchdog-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.systemd = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(self.systemd.close)
        self.systemd.bind(os.path.join(self.folder, "notify"))
        self.service = start([PROGRAM, "serve", "--session", RECORDING, "--listen", f"127.0.0.1:{free_port()}", "--set", "plan.method=rays",
                              "--set", "plan.trace_scale=8"], env={**os.environ, "NOTIFY_SOCKET": os.path.join(self.folder, "notify")})
        self.addCleanup(interrupt, self.service)

    def heard(self, seconds):
        """Messages within so many seconds."""
        messages = []
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.systemd.settimeout(left)
            try:
                messages += self.systemd.recv(4096).decode().splitlines()
            except TimeoutError:
                break
        return messages

    def wait_for(self, message, seconds=300):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if message in self.heard(0.5):
                return
        self.fail(f"waited {seconds} s for {message}")

    def test_ready_alive_and_ending(self):
        self.wait_for("READY=1")
        alive = self.heard(5)
        self.assertGreaterEqual(alive.count("WATCHDOG=1"), 3)
        self.assertNotIn("READY=1", alive)
        self.service.send_signal(signal.SIGSTOP)
        self.heard(1)
        self.assertEqual(self.heard(4), [], "a process that stands still says nothing: systemd starts it again")
        self.service.send_signal(signal.SIGCONT)
        self.wait_for("WATCHDOG=1", 30)
        self.service.send_signal(signal.SIGINT)
        self.wait_for("STOPPING=1", 30)
        self.assertEqual(self.service.wait(30), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
