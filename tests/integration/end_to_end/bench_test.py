#!/usr/bin/env python3
"""Runs `lumigraft bench` with one quick setting on a recording with truth.

  bench_test.py PROGRAM RECORDING

Checks that the tables are complete and consistent, and that the rendered images have less error than the camera's.
"""
import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest

import cv2

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])
COLUMNS = ["session", "method", "setting", "oracle", "relight_error", "object_error", "psnr", "psnr_affected", "flip",
           "cpu_ms", "wall_ms", "gpu_ms"]
TRUE = "pose,geometry,light,albedo"


class BenchTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lumigraft-bench-")
        cls.out = os.path.join(cls.folder.name, "out")
        subprocess.run([PROGRAM, "bench", RECORDING, "--out", cls.out, "--methods", "dvct", "--settings", "live-32",
                        "--oracle", TRUE, "--charts", "error-time"], check=True)
        with open(os.path.join(cls.out, "results.csv"), encoding="utf-8") as f:
            cls.rows = list(csv.DictReader(f))
        with open(os.path.join(cls.out, "results.json"), encoding="utf-8") as f:
            cls.json = json.load(f)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_table(self):
        self.assertEqual(len(self.rows), 1)
        row = self.rows[0]
        for column in COLUMNS:
            self.assertIn(column, row)
        self.assertEqual((row["session"], row["method"], row["setting"]), ("tabletop", "dvct", "live-32"))
        self.assertEqual(row["oracle"], TRUE.replace(",", "+"))
        self.assertLess(float(row["relight_error"]), 0.7)
        self.assertGreater(float(row["psnr"]), 30)
        self.assertLess(float(row["flip"]), 0.1)
        for cost in ("cpu_ms", "wall_ms"):
            self.assertGreater(float(row[cost]), 0)

    def test_larger_pictures_of_simpler_objects(self):
        out = os.path.join(self.folder.name, "large")
        subprocess.run([PROGRAM, "bench", RECORDING, "--out", out, "--methods", "rays", "--settings", "live-8-rays",
                        "--oracle", TRUE, "--charts", "error-time", "--enlarge", "2", "--triangles", "5000"], check=True)
        with open(os.path.join(out, "results.json"), encoding="utf-8") as f:
            large = json.load(f)
        self.assertEqual((large["enlarged"], large["most_triangles"]), (2, 5000))
        self.assertLess(large["results"][0]["relight_error"], 0.4)

    def test_parts_make_the_table(self):
        chosen = []
        for k in (1, 2):
            out = os.path.join(self.folder.name, f"part-{k}")
            subprocess.run([PROGRAM, "bench", RECORDING, "--out", out, "--methods", "rays", "--settings",
                            "live-8-rays,quarter-8-rays", "--oracle", TRUE, "--shard", f"{k}/2"], check=True)
            with open(os.path.join(out, "results.csv"), encoding="utf-8") as f:
                chosen += [row["setting"] for row in csv.DictReader(f)]
            self.assertFalse(os.path.exists(os.path.join(out, "cost_work.csv")))
        self.assertEqual(chosen, ["live-8-rays", "quarter-8-rays"])
        wrong = subprocess.run([PROGRAM, "bench", RECORDING, "--out", self.out, "--shard", "1/2",
                                "--charts", "cost-work"], stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("--charts with --shard: found \"cost-work\", allowed: error-time", wrong.stderr)

    def test_json_agrees(self):
        self.assertEqual(len(self.json["results"]), 1)
        row = self.json["results"][0]
        for column in COLUMNS:
            if column != "gpu_ms" and isinstance(row[column], float):
                self.assertAlmostEqual(row[column], float(self.rows[0][column]), delta=0.06, msg=column)
        self.assertEqual(row["plan"]["volume"], 32)
        for key in ("cpu", "cores", "device", "program"):
            self.assertTrue(self.json["machine"][key], key)
        for stage in ("pose", "light", "fuse", "albedo"):
            self.assertIn(stage, self.json["stages"]["tabletop"])

    def test_chart(self):
        with open(os.path.join(self.out, "error_time.svg"), encoding="utf-8") as f:
            self.assertIn("<svg", f.read())
        picture = cv2.imread(os.path.join(self.out, "error_time.png"))
        self.assertGreater(picture.shape[1], picture.shape[0])
        self.assertEqual(picture[0, 0].tolist(), [255, 255, 255])
        self.assertLess(picture.min(), 100)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
