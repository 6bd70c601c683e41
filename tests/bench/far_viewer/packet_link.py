"""A slow, far and lossy link between two network namespaces, packet by packet.

Each end is a TUN device; a thread carries the packets between them with the delay, rate, queue and random loss that
`tc netem` would give. It is used in its place since many kernels lack sch_netem. TCP at both ends is the kernel's. Needs
root, iproute2 and /dev/net/tun.
"""
import collections
import fcntl
import os
import random
import selectors
import struct
import subprocess
import threading
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 1, 0x1000
LARGEST_PACKET = 1500


def why_not():
    """Why there can be no link here; None if there can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if not os.path.exists("/dev/net/tun"):
        return "found no /dev/net/tun"
    tried = subprocess.run("ip netns add lumigraft-try && ip netns del lumigraft-try", shell=True, capture_output=True, text=True)
    return None if tried.returncode == 0 else f"ip netns: {tried.stderr.strip()}"


class Direction:
    """Packets of one direction: a queue in front of the link, and those that travel on it."""

    def __init__(self, to_fd, bytes_per_s, delay_s, loss, queue_s, chance):
        self.to_fd, self.bytes_per_s, self.delay_s, self.loss = to_fd, bytes_per_s, delay_s, loss
        self.queue_s, self.chance = queue_s, chance
        self.free_at = 0
        self.travelling = collections.deque()

    def take(self, packet, now):
        begin = max(now, self.free_at)
        if begin - now > self.queue_s or self.chance.random() < self.loss:
            return
        self.free_at = begin + len(packet) / self.bytes_per_s
        self.travelling.append((self.free_at + self.delay_s, packet))

    def deliver(self, now):
        while self.travelling and self.travelling[0][0] <= now:
            os.write(self.to_fd, self.travelling.popleft()[1])

    def next_at(self):
        return self.travelling[0][0] if self.travelling else float("inf")


class PacketLink:
    """`near` and `far` are namespaces; `address` is near's address as far sees it. loss: of each direction, 0 to 1."""

    def __init__(self, mbit_s, delay_s, loss=0.0, queue_s=0.3, tcp="reno", seed=1):
        name = f"lumigraft-{os.getpid()}"
        self.near, self.far, self.address = f"{name}-near", f"{name}-far", "10.77.0.1"
        self.fds = []
        for namespace, own, other in ((self.near, self.address, "10.77.0.2"), (self.far, "10.77.0.2", self.address)):
            self.ip("netns", "add", namespace)
            device = f"lg{os.getpid()}"
            fd = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
            self.fds.append(fd)
            fcntl.ioctl(fd, TUNSETIFF, struct.pack("16sH", device.encode(), IFF_TUN | IFF_NO_PI))
            self.ip("link", "set", device, "netns", namespace)
            self.ip("-n", namespace, "link", "set", "lo", "up")
            self.ip("-n", namespace, "addr", "add", own, "peer", other, "dev", device)
            self.ip("-n", namespace, "link", "set", device, "up", "mtu", str(LARGEST_PACKET))
            subprocess.run(["ip", "netns", "exec", namespace, "sysctl", "-qw", f"net.ipv4.tcp_congestion_control={tcp}"], check=True)
        chance = random.Random(seed)
        rate = mbit_s * 1e6 / 8
        self.ways = {self.fds[0]: Direction(self.fds[1], rate, delay_s, loss, queue_s, chance),
                     self.fds[1]: Direction(self.fds[0], rate, delay_s, loss, queue_s, chance)}
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.carry, daemon=True)
        self.thread.start()

    @staticmethod
    def ip(*words):
        subprocess.run(["ip", *words], check=True)

    def carry(self):
        with selectors.DefaultSelector() as ready:
            for fd in self.fds:
                ready.register(fd, selectors.EVENT_READ)
            while not self.ended.is_set():
                wait_s = min(way.next_at() for way in self.ways.values()) - time.monotonic()
                for key, _ in ready.select(min(max(wait_s, 0), 0.1)):
                    try:
                        while True:
                            self.ways[key.fd].take(os.read(key.fd, LARGEST_PACKET + 64), time.monotonic())
                    except BlockingIOError:
                        pass
                for way in self.ways.values():
                    way.deliver(time.monotonic())

    def change(self, mbit_s):
        """The rate of both directions, from now on."""
        for way in self.ways.values():
            way.bytes_per_s = mbit_s * 1e6 / 8

    def close(self):
        self.ended.set()
        self.thread.join()
        for fd in self.fds:
            os.close(fd)
        for namespace in (self.near, self.far):
            self.ip("netns", "del", namespace)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
