#!/usr/bin/env python3
"""A viewer behind 2 Mbit/s, 200 ms round trip and 5 % loss has pictures all the time.

  far_viewer_test.py SERVE_PICTURES RECORDING

The bounds are wide, for a busy machine; tests/bench/far_viewer measures.
"""
import json
import os
import pathlib
import subprocess
import sys
import unittest

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])
BENCH = pathlib.Path(__file__).parents[2] / "bench/far_viewer"
sys.path.insert(0, str(BENCH))
from packet_link import why_not  # noqa: E402


@unittest.skipIf(why_not(), why_not())
class FarViewerTest(unittest.TestCase):
    def test_pictures_arrive_in_spite_of_loss(self):
        found = json.loads(subprocess.run([sys.executable, BENCH / "far_viewer.py", PROGRAM, RECORDING, "--loss", "0.05", "--seconds", "8"],
                                          check=True, stdout=subprocess.PIPE, timeout=120).stdout)
        print(found)
        self.assertGreater(found["received_hz"], 3)
        self.assertLess(found["longest_ms"], 3000)
        self.assertLess(found["age_ms"][0], 1500)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
