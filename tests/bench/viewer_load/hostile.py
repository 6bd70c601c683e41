#!/usr/bin/env python3
"""What a viewer loses while a thousand hostile sockets are connected to the service, on loopback.

  hostile.py PROGRAM RECORDING [--sockets 1000] [--seconds 20] [--set KEY=VALUE ...]

A quarter of them connects and says nothing, a quarter sends half a request, a quarter asks for pictures and never reads,
a quarter floods with commands and garbage; those that the service closes come again. A good viewer, who was there
before, counts the pictures that he misses and their age, before and meanwhile. Prints a line of JSON for each.
"""
import argparse
import json
import random
import socket
import threading
import time

from running_service import Service, Viewer, masked, read_all


def plain(port, text):
    client = socket.create_connection(("127.0.0.1", port), 10)
    if text:
        client.sendall(text)
    return client


class Attacker(threading.Thread):
    """Keeps so many sockets of each kind open until told to stop."""

    def __init__(self, port, sockets, seed):
        super().__init__(daemon=True)
        self.port, self.sockets, self.random = port, sockets, random.Random(seed)
        self.stop, self.opened, self.refused, self.sent = False, 0, 0, 0

    def open(self, kind):
        if kind == 0:
            return plain(self.port, b"")
        if kind == 1:
            return plain(self.port, b"GET / HTTP/1.1\r\nHost: loc")
        return Viewer(self.port, "jpeg" if kind == 2 else None).socket

    def attack(self, client):
        client.setblocking(False)
        command = masked(json.dumps({"type": "object", "index": 0, "yaw_degrees": self.random.uniform(-180, 180)}))
        garbage = bytes(self.random.randrange(256) for _ in range(200))
        data = self.random.choice([command * 20, command * 20, masked("nonsense"), garbage])
        self.sent += client.send(data)
        try:
            if client.recv(1 << 16) == b"":
                raise ConnectionError
        except BlockingIOError:
            pass

    def run(self):
        open_ones = [None] * self.sockets
        while not self.stop:
            for i, client in enumerate(open_ones):
                if self.stop:
                    break
                kind = i % 4
                try:
                    if client is None:
                        open_ones[i] = self.open(kind)
                        self.opened += 1
                    elif kind == 3:
                        self.attack(client)
                except BlockingIOError:
                    pass
                except OSError:
                    self.refused += 1
                    if client is not None:
                        client.close()
                    open_ones[i] = None
            time.sleep(0.05)
        for client in open_ones:
            if client is not None:
                client.close()


def watch(viewer, seconds):
    first = len(viewer.pictures)
    closed = read_all([viewer], seconds)
    pictures = viewer.pictures[first:]
    ages = sorted(age for _, age in viewer.times[first:])
    gaps = sorted(b - a for (a, _), (b, _) in zip(viewer.times[first:], viewer.times[first + 1:]))
    return {"closed": closed, "pictures": len(pictures), "missed": pictures[-1] - pictures[0] + 1 - len(pictures),
            "age_ms": {"median": round(1e3 * ages[len(ages) // 2]), "of95": round(1e3 * ages[int(0.95 * len(ages))])},
            "longest_gap_ms": round(1e3 * gaps[-1])}


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program")
    arguments.add_argument("recording")
    arguments.add_argument("--sockets", type=int, default=1000)
    arguments.add_argument("--seconds", type=float, default=20)
    arguments.add_argument("--set", action="append", default=["plan.method=rays", "plan.trace_scale=8"])
    given = arguments.parse_args()
    service = Service(given.program, given.recording, given.set)
    try:
        viewer = Viewer(service.port, "jpeg")
        read_all([viewer], 30)  # the room is learnt
        print(json.dumps({"alone": watch(viewer, given.seconds)}), flush=True)
        cpu = service.cpu_s()
        attackers = [Attacker(service.port, given.sockets // 4, seed) for seed in range(4)]
        for attacker in attackers:
            attacker.start()
        meanwhile = watch(viewer, given.seconds)
        cpu = (service.cpu_s() - cpu) / given.seconds
        for attacker in attackers:
            attacker.stop = True
        print(json.dumps({"attacked": meanwhile, "cores": round(cpu, 2), "opened": sum(a.opened for a in attackers),
                          "refused": sum(a.refused for a in attackers), "sent_mb": round(sum(a.sent for a in attackers) / 1e6, 1)}), flush=True)
        print(json.dumps({"after": watch(viewer, given.seconds)}), flush=True)
    finally:
        service.end()


if __name__ == "__main__":
    main()
