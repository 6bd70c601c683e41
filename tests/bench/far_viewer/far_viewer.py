#!/usr/bin/env python3
"""What a viewer far from the service sees.

  far_viewer.py PROGRAM RECORDING [--hz 15] [--mbit 2] [--delay-ms 100] [--loss 0] [--tcp reno] [--codec h264] [--size auto]
                [--viewers far|near|both] [--chromium] [--seconds 30] [--set KEY=VALUE ...]

PROGRAM is lumigraft, or serve_pictures, which sends the recording's pictures `hz` times a second, so that the result does
not depend on how fast this machine renders. The service runs in one network namespace, the viewer in another behind a link of that rate, one-way delay and loss in
each direction (packet_link.py), with the given congestion control. The viewer acknowledges each picture as it arrives;
with --chromium it is the page in a real browser. --viewers both: a second one is in the service's namespace. Prints a
line of JSON per viewer, over the time after the first 5 s: pictures per second that were received and that were made, age
at arrival (median, 95 of 100, most), ms, longest time without a picture, ms, rate, kbit/s, sizes, and pictures missed.
"""
import argparse
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time

import websocket

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "integration/end_to_end"))
from child_process import interrupt, start  # noqa: E402
from packet_link import PacketLink, why_not  # noqa: E402

HEADER = struct.Struct("<4sBBHIHHqq")
PORT, SETTLES_S = 8080, 5
KINDS = {1: "config", 2: "key", 3: "delta", 4: "jpeg"}


def connect(address):
    for _ in range(300):
        try:
            return websocket.create_connection(f"ws://{address}:{PORT}/ws", timeout=10, sockopt=((6, 1, 1),))
        except OSError:
            time.sleep(0.2)
    raise SystemExit("the service does not answer")


def view(address, codec, size, seconds):
    """[(when it came, age, sequence, kind, width, bytes)], s, of every picture."""
    viewer = connect(address)
    viewer.send(json.dumps({"type": "want", "codec": codec, **({"size": size} if size else {})}))
    begin = time.time()
    seen = []
    while time.time() < begin + seconds + SETTLES_S:
        try:
            opcode, data = viewer.recv_data()
        except websocket.WebSocketTimeoutException:
            continue
        if opcode != websocket.ABNF.OPCODE_BINARY:
            continue
        _, _, kind, _, sequence, width, _, captured_ns, _ = HEADER.unpack_from(data)
        if kind == 1:
            continue
        now = time.time()
        viewer.send(json.dumps({"type": "ack", "sequence": sequence}))
        seen.append((now - begin, now - 1e-9 * captured_ns, sequence, KINDS[kind], width, len(data)))
    return seen


WATCH = """
window.seen = [];
const origin = performance.timeOrigin;
const Native = window.WebSocket;
window.WebSocket = class extends Native {
  constructor(url) {
    super(url);
    const sizes = new Map();
    this.addEventListener("message", ({ data }) => {
      if (typeof data === "string") return;
      const view = new DataView(data);
      if (view.getUint8(5) === 1) return;
      const captured_s = Number(view.getBigInt64(16, true)) / 1e9;
      sizes.set(view.getUint32(8, true), [captured_s, view.getUint8(5), view.getUint16(12, true), data.byteLength]);
    });
    this.shown = (sequence) => {
      const [captured_s, kind, width, bytes] = sizes.get(sequence);
      const now_s = (origin + performance.now()) / 1e3;
      window.seen.push([now_s, now_s - captured_s, sequence, kind, width, bytes]);
    };
  }
  send(text) {
    const message = JSON.parse(text);
    if (message.type === "ack") this.shown(message.sequence);
    super.send(text);
  }
};
"""


def browse(address, codec, size, seconds):
    """As view(), once the page has drawn them. WebCodecs needs a secure context, so its address is declared to be one."""
    from browser_page import Page
    with tempfile.TemporaryDirectory(prefix="lumigraft-far-viewer-") as profile:
        page = Page(profile, (f"--unsafely-treat-insecure-origin-as-secure=http://{address}:{PORT}",))
        try:
            page.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WATCH})
            page.driver.get(f"http://{address}:{PORT}/")
            page.set("codec", codec)
            if size:
                page.set("size", size)
            time.sleep(SETTLES_S + seconds)
            seen = page.driver.execute_script("return window.seen")
        finally:
            page.driver.quit()
    return [(when - seen[0][0], age, sequence, KINDS[kind], width, size) for when, age, sequence, kind, width, size in seen]


def summary(seen):
    first = seen[0][0]
    seen = [one for one in seen if one[0] >= SETTLES_S]
    if len(seen) < 2:
        return {"pictures": len(seen)}
    ages = sorted(1e3 * age for _, age, *_ in seen)
    times = [when for when, *_ in seen]
    span = times[-1] - times[0]
    made = seen[-1][2] - seen[0][2]
    sizes = {}
    for *_, width, _ in seen:
        sizes[width] = sizes.get(width, 0) + 1
    return {
        "first_s": round(first, 2), "received_hz": round((len(seen) - 1) / span, 1), "made_hz": round(made / span, 1),
        "age_ms": [round(ages[len(ages) // 2]), round(ages[int(0.95 * len(ages))]), round(ages[-1])],
        "longest_ms": round(1e3 * max(b - a for a, b in zip(times, times[1:]))),
        "kbit_s": round(8e-3 * sum(one[5] for one in seen) / span), "keys": sum(one[3] == "key" for one in seen),
        "widths": sizes, "missed": made - len(seen) + 1,
    }


def in_namespace(namespace, given, address, name):
    """This program as a viewer there."""
    words = ["ip", "netns", "exec", namespace, sys.executable, __file__, given.program, given.recording, "--view", address,
             "--codec", given.codec, "--seconds", str(given.seconds), "--size", given.size if name == "far" else ""]
    if given.chromium and name == "far":
        words.append("--chromium")
    return start(words, stdout=subprocess.PIPE, text=True)


def command(given):
    if "serve_pictures" in given.program:
        return [given.program, given.recording, f"0.0.0.0:{PORT}", str(given.hz), str(given.seconds + 60)]
    return [given.program, "serve", "--session", given.recording, "--listen", f"0.0.0.0:{PORT}"] + [
        word for line in given.set for word in ("--set", line)]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program")
    arguments.add_argument("recording")
    arguments.add_argument("--hz", type=float, default=15)
    arguments.add_argument("--mbit", type=float, default=2)
    arguments.add_argument("--delay-ms", type=float, default=100)
    arguments.add_argument("--loss", type=float, default=0)
    arguments.add_argument("--queue-ms", type=float, default=300)
    arguments.add_argument("--tcp", default="reno")
    arguments.add_argument("--codec", default="h264")
    arguments.add_argument("--size", default="")
    arguments.add_argument("--viewers", default="far")
    arguments.add_argument("--chromium", action="store_true")
    arguments.add_argument("--seconds", type=float, default=30)
    arguments.add_argument("--set", action="append", default=[])
    arguments.add_argument("--view")
    arguments.add_argument("--trace")
    given = arguments.parse_args()
    if given.view:
        print(json.dumps((browse if given.chromium else view)(given.view, given.codec, given.size, given.seconds)))
        return
    if why_not():
        raise SystemExit(why_not())
    with PacketLink(given.mbit, given.delay_ms / 1e3, given.loss, given.queue_ms / 1e3, given.tcp) as link:
        service = start(["ip", "netns", "exec", link.near, *command(given)],
                        stderr=None if os.environ.get("VERBOSE") else subprocess.DEVNULL)
        try:
            if "serve_pictures" not in given.program:
                learning = in_namespace(link.near, given, "127.0.0.1", "near")
                learning.communicate()  # the room is learnt
            viewers = {name: in_namespace(namespace, given, address, name)
                       for name, namespace, address in (("near", link.near, "127.0.0.1"), ("far", link.far, link.address))
                       if given.viewers in (name, "both")}
            for name, viewer in viewers.items():
                seen = json.loads(viewer.communicate()[0])
                if given.trace:
                    pathlib.Path(f"{given.trace}.{name}.json").write_text(json.dumps(seen))
                print(json.dumps({"viewer": name, "mbit": given.mbit, "delay_ms": given.delay_ms, "loss": given.loss,
                                  "tcp": given.tcp, "codec": given.codec, **summary(seen)}), flush=True)
        finally:
            interrupt(service)


if __name__ == "__main__":
    main()
