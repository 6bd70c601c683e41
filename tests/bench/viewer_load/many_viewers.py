#!/usr/bin/env python3
"""What viewers cost the service: processor time with 1, 64 and 500 of them, all on loopback.

  many_viewers.py PROGRAM RECORDING [--codec h264] [--viewers 1 64 500] [--seconds 20] [--set KEY=VALUE ...]

Prints a line of JSON for each number: cores in use by the service and by its network thread, and the share of pictures
that arrived at a viewer, on average and at the worst one. 0 viewers show the cost of a service that nobody has watched
for 20 s; then the time until the first picture after someone came is printed, too, ms.
"""
import argparse
import json
import statistics
import time

from running_service import Service, Viewer, read_all

UNWATCHED_S = 20  # after which the service rests


def measure(service, count, codec, seconds):
    viewers = []
    for _ in range(count):
        viewers.append(Viewer(service.port, codec))
    read_all(viewers, 3)
    for viewer in viewers:
        viewer.pictures.clear()
    if not viewers:
        time.sleep(UNWATCHED_S)
    cpu, network, began = service.cpu_s(), service.cpu_s("network"), time.monotonic()
    closed = read_all(viewers, seconds)
    took = time.monotonic() - began
    line = {"viewers": count, "cores": round((service.cpu_s() - cpu) / took, 3), "network_cores": round((service.cpu_s("network") - network) / took, 4),
            "closed": closed}
    if viewers:
        made = max(v.pictures[-1] for v in viewers if v.pictures) - min(v.pictures[0] for v in viewers if v.pictures) + 1
        shares = [len(v.pictures) / made for v in viewers]
        line.update({"pictures_per_s": round(made / seconds, 1),
                     "arrived": round(statistics.mean(shares), 4), "arrived_worst": round(min(shares), 4)})
    for viewer in viewers:
        viewer.close()
    return line


def first_picture_ms(service, codec):
    began = time.monotonic()
    viewer = Viewer(service.port, codec)
    while not viewer.pictures:
        read_all([viewer], 0.01)
    viewer.close()
    return round(1e3 * (time.monotonic() - began))


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program")
    arguments.add_argument("recording")
    arguments.add_argument("--codec", default="h264")
    arguments.add_argument("--viewers", type=int, nargs="+", default=[0, 1, 64, 500, 1])
    arguments.add_argument("--seconds", type=float, default=20)
    arguments.add_argument("--set", action="append", default=["plan.method=rays", "plan.trace_scale=8"])
    given = arguments.parse_args()
    service = Service(given.program, given.recording, given.set + [f"server.max_viewers={max(given.viewers) + 10}"])
    try:
        warm = Viewer(service.port, given.codec)
        read_all([warm], 30)  # the room is learnt
        warm.close()
        for count in given.viewers:
            line = measure(service, count, given.codec, given.seconds)
            if count == 0:
                line["first_picture_ms"] = []
                for _ in range(3):
                    line["first_picture_ms"].append(first_picture_ms(service, given.codec))
                    time.sleep(UNWATCHED_S)
            print(json.dumps(line), flush=True)
    finally:
        service.end()


if __name__ == "__main__":
    main()
