#!/usr/bin/env python3
"""What viewers through a media server cost a real `lumigraft serve`.

  publish.py PROGRAM RECORDING VIEWERS [--server janus|go2rtc|mediamtx] [--counts 0,1,50,200] [--seconds 15] [--rounds 3]

VIEWERS is viewers/ built (`go build -o VIEWERS .` there). The media server is the Janus of Debian, or what
tests/integration/end_to_end/build_media_servers.sh built, as configs/ configures it. Two services run one after the other:
one with a viewer of its websocket (H.264), one that publishes to the media server, with so many WebRTC viewers there, in turn. The exhibit is empty: pictures that cost little are those of which the stream is a large part. Runs in a network namespace of its own (root). Prints a line of JSON for each case and round:
processor time for a picture, ms, of the whole service, and of its threads that encode and publish; pictures a second; and
packets that the viewers received, the least and the median.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time

import websocket

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path.insert(0, str(ROOT / "tests/integration/end_to_end"))
from child_process import interrupt, start  # noqa: E402
from media_servers import Janus  # noqa: E402
from own_network import enter_network  # noqa: E402
from published import Service, listening, wait  # noqa: E402
from whep_programs import Go2rtc, MediaMtx  # noqa: E402

PORT, JANUS = 8080, 8088
WARM_UP_S = 20  # the room is learnt


def used_s(pid):
    """Processor time of all threads; and of those that encode and publish."""
    threads = [((task / "comm").read_text().strip(), 1e-9 * int((task / "schedstat").read_text().split()[0]))
               for task in pathlib.Path(f"/proc/{pid}/task").iterdir()]
    return sum(s for _, s in threads), sum(s for name, s in threads if name in ("encode", "publish"))


def measure(service, seconds):
    began, frames = time.monotonic(), service.metric("lumigraft_frames_total")
    used = used_s(service.process.pid)
    time.sleep(seconds)
    made = service.metric("lumigraft_frames_total") - frames
    whole, stream = (1e3 * (b - a) / made for a, b in zip(used, used_s(service.process.pid)))
    return {"cpu_ms": round(whole, 1), "encode_and_publish_ms": round(stream, 2), "pictures_per_s": round(made / (time.monotonic() - began), 1)}


def watch_websocket(stop):
    viewer = websocket.create_connection(f"ws://127.0.0.1:{PORT}/ws", timeout=60)
    viewer.send(json.dumps({"type": "want", "codec": "h264"}))
    while not stop.is_set():
        opcode, data = viewer.recv_data()
        if opcode == websocket.ABNF.OPCODE_BINARY:
            viewer.send(json.dumps({"type": "ack", "sequence": int.from_bytes(data[8:12], "little")}))
    viewer.close()


def run_media_server(name, folder):
    """The media server, the address to publish to, and its viewers' way to it."""
    if name == "janus":
        server = Janus(str(ROOT / "configs/janus.plugin.streaming.jcfg"), f"{folder}/janus", JANUS)
        wait(lambda: listening(JANUS), "Janus")
        return server, "rtp://127.0.0.1:5004", ["janus", f"http://127.0.0.1:{JANUS}/janus"]
    configs = str(ROOT / "configs")
    server = Go2rtc(configs, folder) if name == "go2rtc" else MediaMtx(configs, folder, f"http://127.0.0.1:{PORT}")
    wait(lambda: listening(server.PORT), name)
    return server, server.publish, ["whep", server.watch]


def with_viewers(command, count, service, seconds):
    viewers = start([*command, str(count)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert viewers.stdout.readline().split() == ["connected", str(count)]
        found = measure(service, seconds)
        viewers.stdin.close()
        line = viewers.stdout.readline().split()
        return {**found, "packets": [int(n) for n in line[1:]]}
    finally:
        viewers.kill()
        viewers.wait()


def main():
    arguments = argparse.ArgumentParser()
    for name in ("program", "recording", "viewers"):
        arguments.add_argument(name)
    arguments.add_argument("--server", choices=("janus", "go2rtc", "mediamtx"), default="janus")
    arguments.add_argument("--counts", default="0,1,50,200")
    arguments.add_argument("--seconds", type=float, default=15)
    arguments.add_argument("--rounds", type=int, default=3)
    given = arguments.parse_args()
    if not enter_network():
        sys.exit("publish.py: needs a network namespace of its own, which takes root")
    found = {}

    def say(case, result):
        found.setdefault(case, []).append(result)
        print(json.dumps({"case": case, **result}), flush=True)

    with tempfile.TemporaryDirectory(prefix="lumigraft-publish-") as folder:
        exhibit = pathlib.Path(folder) / "exhibit.toml"
        exhibit.write_text("")
        service = Service(given.program, given.recording, PORT, f"{folder}/log", [f"exhibit={exhibit}"])
        wait(lambda: listening(PORT), "the service")
        stop = threading.Event()
        viewer = threading.Thread(target=watch_websocket, args=(stop,))
        viewer.start()
        time.sleep(WARM_UP_S)
        for _ in range(given.rounds):
            say("websocket 1", measure(service, given.seconds))
        stop.set()
        viewer.join()
        interrupt(service.process)
        server, address, way = run_media_server(given.server, folder)
        service = Service(given.program, given.recording, PORT, f"{folder}/log", [f"exhibit={exhibit}", f"server.publish={address}"])
        service.wait_connected()
        time.sleep(WARM_UP_S)
        for _ in range(given.rounds):
            for count in (int(n) for n in given.counts.split(",")):
                say(f"published {count}", with_viewers([given.viewers, *way], count, service, given.seconds))
        interrupt(service.process)
        server.close()
    medians = {case: {key: statistics.median(r[key] for r in all_rounds) for key in all_rounds[0] if key != "packets"} for case, all_rounds in found.items()}
    print(json.dumps({"medians": medians}))


if __name__ == "__main__":
    main()
