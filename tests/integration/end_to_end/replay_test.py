#!/usr/bin/env python3
"""`lumigraft replay` twice gives the same bytes.

  replay_test.py PROGRAM RECORDING

All PNG files must be identical; frames.jsonl must be identical except for durations. Also checks the structure of the
records, and that the images contain the object.
"""
import json
import os
import subprocess
import sys
import tempfile
import unittest

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])
FRAMES = 3
# Small, so that software rendering takes seconds; all stages and passes run.
SETTINGS = ["plan.volume=32", "plan.trace_scale=4", "plan.rsm=64"]
TIMES = ("stage_ms", "stage_cpu_ms", "pass_ms")


def replay(out, *more):
    command = [PROGRAM, "replay", RECORDING, "--out", out, "--frames", str(FRAMES), *more]
    for setting in SETTINGS:
        command += ["--set", setting]
    subprocess.run(command, check=True)
    with open(os.path.join(out, "frames.jsonl"), encoding="utf-8") as f:
        return [json.loads(line) for line in f]


def read(*parts):
    with open(os.path.join(*parts), "rb") as f:
        return f.read()


class ReplayTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lumigraft-replay-")
        cls.one, cls.two = (os.path.join(cls.folder.name, name) for name in ("one", "two"))
        cls.records = replay(cls.one), replay(cls.two)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_same_bytes(self):
        pictures = [f"frame_{i:06d}.png" for i in range(FRAMES)]
        self.assertEqual(sorted(os.listdir(self.one)), sorted([*pictures, "frames.jsonl"]))
        for name in pictures:
            self.assertEqual(read(self.one, name), read(self.two, name), name)

    def test_same_records_but_for_times(self):
        for one, two in zip(*self.records):
            for key in one:
                if key not in TIMES:
                    self.assertEqual(one[key], two[key], f"frame {one['index']}: {key}")

    def test_records(self):
        for i, record in enumerate(self.records[0]):
            self.assertEqual(record["index"], i)
            self.assertEqual([len(row) for row in record["T_tag_camera"]], [4] * 4)
            self.assertEqual([len(row) for row in record["sh"]], [3] * 9)
            self.assertGreaterEqual(len(record["lights"]), 2)
            self.assertEqual(record["plan"]["volume"], 32)
            for stage in ("pose", "light", "fuse", "relight"):
                self.assertIn(stage, record["stage_ms"])
                self.assertIn(stage, record["stage_cpu_ms"])
        self.assertIn("albedo", self.records[0][0]["stage_ms"], "the first picture uses the solved albedo")

    def test_dump_adds_maps_and_the_surface(self):
        out = os.path.join(self.folder.name, "dump")
        replay(out, "--dump")
        for name in ("albedo", "normals", "depth", "delta", "mask"):
            self.assertIn(f"frame_000000_{name}.exr", os.listdir(out))
        header = read(out, "surface.ply").split(b"end_header")[0].decode().split()
        vertices = int(header[header.index("vertex") + 1])
        self.assertGreater(vertices, 10_000)  # the table alone is 1 m² with voxels of 8 mm
        replay(out)  # files of an earlier replay are removed
        self.assertNotIn("surface.ply", os.listdir(out))

    def test_without_objects_the_camera_picture_passes_through(self):
        empty = os.path.join(self.folder.name, "none.toml")
        open(empty, "w", encoding="utf-8").close()
        out = os.path.join(self.folder.name, "empty")
        replay(out, "--exhibit", empty)
        self.assertNotEqual(read(out, "frame_000000.png"), read(self.one, "frame_000000.png"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
