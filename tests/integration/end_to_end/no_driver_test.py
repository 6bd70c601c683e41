#!/usr/bin/env python3
"""Browser tests whose driver does not start fail at once, and leave no process behind.

  no_driver_test.py PROGRAM RECORDING FAKE_CAMERA
"""
import os
import signal
import subprocess
import sys
import tempfile
import unittest

PROGRAM, RECORDING, CAMERA = (os.path.abspath(p) for p in sys.argv[1:4])
WITHIN_S = 60  # each takes a few seconds on a busy machine; a leaked process would run for minutes


class NoDriverTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lumigraft-no-driver-")
        self.addCleanup(folder.cleanup)
        self.temporary = os.path.join(folder.name, "tmp")
        os.mkdir(self.temporary)
        lock = "lumigraft-gige-camera.lock"  # shared by all programs that use such a camera
        os.symlink(os.path.join(tempfile.gettempdir(), lock), os.path.join(self.temporary, lock))
        driver = os.path.join(folder.name, "chromedriver")
        with open(driver, "w") as f:
            f.write("#!/bin/sh\nexit 1\n")
        os.chmod(driver, 0o755)
        self.environment = dict(os.environ, PATH=folder.name + os.pathsep + os.environ["PATH"], TMPDIR=self.temporary)

    def expect_to_end(self, test, *words):
        command = [sys.executable, "-B", os.path.join(os.path.dirname(os.path.abspath(__file__)), test), *words]
        process = subprocess.Popen(command, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   start_new_session=True)
        try:
            said, _ = process.communicate(timeout=WITHIN_S)  # like ctest, waits for all processes that hold the pipe
        except subprocess.TimeoutExpired as e:
            self.fail(f"{test} or what it started goes on after {WITHIN_S} s: {e.output}")
        finally:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
        self.assertIn("chromedriver unexpectedly exited", said)
        self.assertNotEqual(process.returncode, 0, said)
        self.assertEqual(os.listdir(self.temporary), ["lumigraft-gige-camera.lock"], "files are left behind")

    def test_browser(self):
        self.expect_to_end("browser_test.py", PROGRAM, RECORDING)

    def test_playback_page(self):
        self.expect_to_end("playback_page_test.py", PROGRAM, RECORDING)

    def test_record_page(self):
        self.expect_to_end("record_page_test.py", PROGRAM, CAMERA)

    def test_calibrate_page(self):
        self.expect_to_end("calibrate_page_test.py", PROGRAM)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
