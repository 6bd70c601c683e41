#!/usr/bin/env python3
"""A viewer behind 2 Mbit/s, 200 ms round trip and 5 % loss has pictures all the time; one behind 0.6 Mbit/s gets the smaller
stream, though a near viewer keeps the larger one.

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
    def measure(self, *options):
        """What each viewer saw, by its name."""
        out = subprocess.run([sys.executable, BENCH / "far_viewer.py", PROGRAM, RECORDING, *options], check=True, stdout=subprocess.PIPE, timeout=120).stdout
        print(out.decode())
        return {found["viewer"]: found for found in map(json.loads, out.splitlines())}

    def test_pictures_arrive_in_spite_of_loss(self):
        found = self.measure("--loss", "0.05", "--seconds", "8")["far"]
        self.assertGreater(found["received_hz"], 3)
        self.assertLess(found["longest_ms"], 3000)
        self.assertLess(found["age_ms"][0], 1500)

    def test_half_size_beside_a_near_viewer(self):
        found = self.measure("--mbit", "0.6", "--viewers", "both", "--seconds", "10")
        width = max(map(int, found["near"]["widths"]))
        self.assertEqual(set(found["near"]["widths"]), {str(width)})
        self.assertIn(str(width // 2), found["far"]["widths"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
