#!/usr/bin/env python3
"""What `lumigraft serve` publishes arrives at real receivers: ffmpeg, by RTSP and by SRT.

  publish_test.py PROGRAM RECORDING

The pictures that ffmpeg decodes are those that the service shows. A receiver that ends and comes again gets them again;
one that accepts and never answers holds up nothing; the log contains no password.
"""
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np
import websocket

from browser_page import free_port
from child_process import interrupt, start
from published import Service, psnr_db, wait

PROGRAM, RECORDING = (os.path.abspath(p) for p in sys.argv[1:3])
MIN_PSNR_DB = 30  # of H.264 against a JPEG of the same picture; the next picture of a moving camera is below


class Receiver(threading.Thread):
    """ffmpeg, which listens at `url` and decodes. Keeps the newest pictures."""

    def __init__(self, url, size, options=()):
        super().__init__(daemon=True)
        self.width, self.height = size
        self.pictures, self.count = [], 0
        self.process = start(["ffmpeg", "-nostdin", "-loglevel", "error", "-probesize", "100000", "-analyzeduration", "100000", *options,
                              "-i", url, "-vsync", "passthrough", "-f", "rawvideo", "-pix_fmt", "bgr24", "pipe:1"], stdout=subprocess.PIPE)
        self.start()

    def run(self):
        length = self.width * self.height * 3
        while len(data := self.process.stdout.read(length)) == length:
            self.pictures = (self.pictures + [np.frombuffer(data, np.uint8).reshape(self.height, self.width, 3)])[-60:]
            self.count += 1

    def end(self):
        self.process.kill()
        self.process.wait()
        self.join()
        self.process.stdout.close()

    def wait_for_more(self, count):
        target = self.count + count
        wait(lambda: self.count >= target, f"{count} pictures")


class PublishTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="lumigraft-publish-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)

    def serve(self, url):
        service = Service(PROGRAM, RECORDING, free_port(), os.path.join(self.folder, "log"), [f"server.publish={url}"])
        self.addCleanup(interrupt, service.process)
        return service

    def receive(self, *args):
        if shutil.which("ffmpeg") is None:
            self.skipTest("needs ffmpeg (Debian package ffmpeg)")
        receiver = Receiver(*args)
        self.addCleanup(receiver.end)
        return receiver

    def expect_what_is_shown(self, service, receiver):
        receiver.wait_for_more(3)
        shown = service.snapshot()[:receiver.height, :receiver.width]
        best = wait(lambda: max((p for p in (psnr_db(shown, one) for one in receiver.pictures) if p >= MIN_PSNR_DB), default=None),
                    "the picture of the snapshot")
        print(f"\n  PSNR {best:.1f} dB", end=" ", flush=True)

    def test_1_rtsp_server_that_restarts(self):
        port = free_port()
        url = f"rtsp://127.0.0.1:{port}/kiosk"
        service = self.serve(url.replace("://", "://kiosk:secret@"))
        size = service.size()
        self.assertEqual(service.metric("lumigraft_publish_connected"), 0)
        wait(lambda: "Connection refused; tried again" in service.said(), "the reason why nothing is published")
        receiver = self.receive(url, size, ["-rtsp_flags", "listen"])
        self.expect_what_is_shown(service, receiver)
        self.assertEqual(service.metric("lumigraft_publish_connected"), 1)
        receiver.end()
        service.wait_connected(False)
        again = self.receive(url, size, ["-rtsp_flags", "listen"])
        self.expect_what_is_shown(service, again)
        self.assertGreater(service.metric("lumigraft_published_pictures_total"), 6)
        self.assertEqual(interrupt(service.process), 0)
        self.assertIn(f"publishing to {url}\n", service.said())
        self.assertNotIn("secret", service.said())

    def test_2_srt_with_a_passphrase(self):
        url = f"srt://127.0.0.1:{free_port()}?passphrase=secret-secret"
        service = self.serve(url)
        receiver = self.receive(url + "&mode=listener", service.size(), ["-f", "mpegts"])
        self.expect_what_is_shown(service, receiver)
        self.assertEqual(interrupt(service.process), 0)
        self.assertNotIn("secret", service.said())

    def test_3_server_that_never_answers(self):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            service = self.serve(f"rtsp://127.0.0.1:{silent.getsockname()[1]}/kiosk")
            held, _ = silent.accept()
            with held:
                viewer = websocket.create_connection(f"ws://127.0.0.1:{service.port}/ws", timeout=120)
                viewer.send(json.dumps({"type": "want", "codec": "h264"}))
                pictures = 0
                while pictures < 10:
                    opcode, _ = viewer.recv_data()
                    pictures += opcode == websocket.ABNF.OPCODE_BINARY
                self.assertEqual(service.metric("lumigraft_publish_connected"), 0)
                self.assertEqual(interrupt(service.process), 0, "and it ends while it waits for an answer")

    def test_4_what_is_no_address_is_refused_at_the_start(self):
        for url in ("rtmp://kiosk:secret@127.0.0.1/live", "rtp://127.0.0.1", "secret"):
            run = subprocess.run([PROGRAM, "serve", "--session", RECORDING, "--set", f"server.publish={url}"], capture_output=True, text=True, timeout=60)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn("server.publish: found ", run.stderr)
            self.assertIn('allowed: "rtsp://HOST/PATH", "srt://HOST:PORT?streamid=..." or "rtp://HOST:PORT"', run.stderr)
            self.assertNotIn("secret", run.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
