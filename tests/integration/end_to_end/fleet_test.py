#!/usr/bin/env python3
"""Runs the bench over a Dask scheduler and two workers on this machine, and kills a worker in the middle.

  fleet_test.py PROGRAM RECORDING FLEET

FLEET is tests/bench/fleet/fleet.py; LUMIGRAFT_FLEET_PYTHON names a Python with the packages of its requirements.txt.
"""

import contextlib
import glob
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from child_process import start

PROGRAM, RECORDING, FLEET = (os.path.abspath(p) for p in sys.argv[1:4])
PYTHON = os.environ.get("LUMIGRAFT_FLEET_PYTHON", sys.executable)
DEADLINE_S = 240
SESSIONS = 2


def missing_package():
    """The last line of Python's complaint, or nothing."""
    found = subprocess.run(
        [PYTHON, "-c", "import dask, distributed, plotly, pyarrow.parquet"],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    return found.stderr.strip().splitlines()[-1] if found.returncode else ""


def until(what, condition):
    end = time.monotonic() + DEADLINE_S
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.01)
    raise TimeoutError(f"after {DEADLINE_S} s: {what}")


def first_picture(folder, name):
    """A session of the recording's first colour picture, with its truth."""
    session = os.path.join(folder, name)
    os.makedirs(os.path.join(session, "truth"))
    for file in os.listdir(RECORDING):
        if file not in ("truth", "color.txt"):
            os.symlink(os.path.join(RECORDING, file), os.path.join(session, file))
    os.symlink(os.path.join(RECORDING, "truth/000000"), os.path.join(session, "truth/000000"))
    with open(os.path.join(RECORDING, "color.txt"), encoding="utf-8") as f:
        line = next(line for line in f if not line.startswith("#"))
    with open(os.path.join(session, "color.txt"), "w", encoding="utf-8") as f:
        f.write(f"# {name}\n{line}")  # the name makes contents differ
    return session


def address_in(scheduler_file):
    """None before the scheduler has written all of it."""
    with contextlib.suppress(FileNotFoundError, json.JSONDecodeError), open(scheduler_file, encoding="utf-8") as f:
        return json.load(f)["address"]
    return None


def bench_below(worker):
    """Of a worker, the process that runs the program; None where there is none."""
    for children in glob.glob(f"/proc/{worker.pid}/task/*/children"):
        with contextlib.suppress(FileNotFoundError), open(children, encoding="utf-8") as f:  # processes and threads end
            for child in f.read().split():
                if os.path.basename(os.readlink(f"/proc/{child}/exe")).startswith("lumigraft"):
                    return int(child)
    return None


def ended(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as f:
            return f.read().rsplit(")", 1)[1].split()[0] == "Z"
    except FileNotFoundError:
        return True


class FleetTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="lumigraft-fleet-test-")
        self.folder = self.temporary.name
        self.addCleanup(self.temporary.cleanup)
        self.out = os.path.join(self.folder, "out")
        self.sessions = [first_picture(self.folder, f"session-{i}") for i in range(SESSIONS)]
        self.after = os.path.join(self.folder, "lumigraft-after")
        shutil.copy(PROGRAM, self.after)
        with open(self.after, "ab") as f:
            f.write(b"\0")  # another program by its hash alone
        scheduler_file = os.path.join(self.folder, "scheduler.json")
        self.dask(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", scheduler_file
        )
        self.address = until("no scheduler", lambda: address_in(scheduler_file))
        self.workers = [
            self.dask(
                "worker",
                self.address,
                "--host",
                "127.0.0.1",
                "--nthreads",
                "1",
                "--no-nanny",
                "--no-dashboard",
                "--local-directory",
                self.folder,
            )
            for _ in range(2)
        ]

    def dask(self, *words):
        process = start([PYTHON, "-m", "dask", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(lambda: (process.kill(), process.wait()))
        return process

    def fleet(self, after, *sessions):
        return start(
            [
                PYTHON,
                FLEET,
                *self.sessions,
                *sessions,
                "--program",
                PROGRAM,
                "--program",
                after,
                "--out",
                self.out,
                "--scheduler",
                self.address,
                "--methods",
                "rays",
                "--settings",
                "live-8-rays",
                "--oracle",
                "pose,geometry,light,albedo",
            ],
            stdout=subprocess.PIPE,
            text=True,
        )

    def rows(self):
        code = "import sys, json, pyarrow.parquet as p; print(json.dumps(p.read_table(sys.argv[1]).to_pylist()))"
        return json.loads(
            subprocess.run(
                [PYTHON, "-c", code, os.path.join(self.out, "results.parquet")],
                check=True,
                stdout=subprocess.PIPE,
                text=True,
            ).stdout
        )

    def parts(self):
        folder = os.path.join(self.out, "parts")
        return {name: os.stat(os.path.join(folder, name)).st_mtime_ns for name in os.listdir(folder)}

    def test_a_worker_dies_and_the_run_is_repeated(self):
        fleet = self.fleet(self.after)
        bench = until("no worker runs the bench", lambda: bench_below(self.workers[0]))
        self.workers[0].send_signal(signal.SIGKILL)
        until("the bench outlives its worker", lambda: ended(bench))
        self.assertIn(f"0 parts kept, {2 * SESSIONS} to run", fleet.communicate(timeout=DEADLINE_S)[0])
        self.assertEqual(fleet.returncode, 0)
        rows = self.rows()
        self.assertEqual(
            sorted((row["folder"], row["version"]) for row in rows),
            sorted((session, version) for session in self.sessions for version in ("before", "after")),
        )
        for row in rows:
            self.assertIsNone(row["error"])
            self.assertEqual((row["method"], row["setting"]), ("rays", "live-8-rays"))
            self.assertLess(row["relight_error"], 0.7)
            self.assertGreater(row["cpu_ms"], 0)
        self.check_report("live-8-rays", *self.sessions)

        # Again: nothing of it runs twice. A program that crashes and a folder without truth are failed rows.
        kept = self.parts()
        self.assertEqual(len(kept), 2 * SESSIONS)
        crashes = os.path.join(self.folder, "crashes")
        with open(crashes, "w", encoding="utf-8") as f:
            f.write("#!/bin/sh\necho about to crash >&2\nkill -SEGV $$\n")
        os.chmod(crashes, 0o755)
        empty = os.path.join(self.folder, "empty")
        os.mkdir(empty)
        fleet = self.fleet(crashes, empty)
        self.assertIn(f"{SESSIONS} parts kept, {SESSIONS} to run", fleet.communicate(timeout=DEADLINE_S)[0])
        self.assertEqual(fleet.returncode, 1)
        self.assertEqual(self.parts(), kept)
        errors = [(row["folder"], row["version"], row["error"]) for row in self.rows() if row["error"]]
        self.assertEqual(len(errors), SESSIONS + 2)
        for folder, version, error in errors:
            self.assertIn("found no file" if folder == empty else "signal 11: about to crash", error, version)
        self.check_report("about to crash", empty)

    def check_report(self, *words):
        with open(os.path.join(self.out, "report.html"), encoding="utf-8") as f:
            text = f.read()
        self.assertNotIn("<script src", text)
        for word in words:
            self.assertIn(word, text)


if __name__ == "__main__":
    if missing := missing_package():
        print(
            f"skipped: {PYTHON} lacks packages of {os.path.dirname(FLEET)}/requirements.txt ({missing}); "
            "LUMIGRAFT_FLEET_PYTHON names a Python that has them"
        )
        sys.exit(0)
    unittest.main(argv=sys.argv[:1], verbosity=2)
