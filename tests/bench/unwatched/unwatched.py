#!/usr/bin/env python3
"""What a `lumigraft serve` does that nobody watches, and what somebody waits for who comes then.

  unwatched.py PROGRAM RECORDING [--visits 5] [--learns 30] [--seconds 60] [--set KEY=VALUE ...]

A viewer (H.264) stays while the room is learnt, and leaves; when /healthz says that the service rests, its processor time is
measured, then viewers come one by one, each when it rests again. Prints a line of JSON for each: milliseconds from the
connection to the first picture, to the first one that was made after the viewer came, and their ages in milliseconds.
"""
import argparse
import json
import pathlib
import statistics
import sys
import time
import urllib.error
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "viewer_load"))
from running_service import Service, Viewer, read_all  # noqa: E402

RESTS_WITHIN_S = 600  # pipeline/parameters.h: learns_unwatched


def rests(service):
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{service.port}/healthz", timeout=30) as reply:
            return json.load(reply)["resting"]
    except urllib.error.HTTPError:
        return False


def wait_for_rest(service):
    end = time.monotonic() + RESTS_WITHIN_S
    while not rests(service):
        if time.monotonic() > end:
            raise RuntimeError(f"the service does not rest after {RESTS_WITHIN_S} s")
        time.sleep(0.2)


def visit(service):
    came, since = time.time(), time.monotonic()
    viewer = Viewer(service.port, "h264")
    found = {}

    def wait_for(name, condition):
        while not condition():
            read_all([viewer], 0.005)
        found[f"{name}_ms"] = round(1e3 * (time.monotonic() - since))
        found[f"{name}_age_ms"] = round(1e3 * viewer.times[-1][1])

    wait_for("first", lambda: viewer.pictures)
    wait_for("new", lambda: viewer.times[-1][0] - viewer.times[-1][1] > came - 1 and viewer.pictures[-1] != viewer.pictures[0])
    viewer.close()
    return found


def main():
    arguments = argparse.ArgumentParser()
    for name in ("program", "recording"):
        arguments.add_argument(name)
    arguments.add_argument("--visits", type=int, default=5)
    arguments.add_argument("--learns", type=float, default=30)
    arguments.add_argument("--seconds", type=float, default=60)
    arguments.add_argument("--set", action="append", default=[], dest="settings")
    given = arguments.parse_args()
    service = Service(given.program, given.recording, ["plan.method=rays", *given.settings])
    try:
        viewer = Viewer(service.port, "h264")
        read_all([viewer], given.learns)
        viewer.close()
        wait_for_rest(service)
        if given.seconds > 0:
            used, began = service.cpu_s(), time.monotonic()
            time.sleep(given.seconds)
            print(json.dumps({"resting_cores": round((service.cpu_s() - used) / (time.monotonic() - began), 3)}), flush=True)
        visits = []
        for _ in range(given.visits):
            wait_for_rest(service)
            time.sleep(2)
            visits.append(visit(service))
            print(json.dumps(visits[-1]), flush=True)
        print(json.dumps({"medians": {key: statistics.median(one[key] for one in visits) for key in visits[0]}}))
    finally:
        service.end()


if __name__ == "__main__":
    main()
