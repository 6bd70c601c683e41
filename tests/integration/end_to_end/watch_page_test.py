#!/usr/bin/env python3
"""What `lumigraft serve` publishes is watched by WebRTC, through a media server.

  watch_page_test.py PROGRAM RECORDING CONFIGS

A real Chromium plays it on /watch.html, by WHEP of aiortc, and again after the media server lost its viewers; and a viewer
of the Janus of Debian, with the mountpoint of configs/, decodes what the service shows. Chromium also plays by WHEP of go2rtc
and of MediaMTX with the configurations of configs/, where these programs are (build_media_servers.sh). Runs in a network
namespace of its own, since WebRTC uses no loopback addresses.
"""
import base64
import concurrent.futures
import os
import shutil
import sys
import tempfile
import time
import unittest

import cv2
import numpy as np

from browser_page import Page
from child_process import interrupt
from own_network import enter_network
from published import Service, listening, psnr_db, wait
from whep_programs import PASSWORD, Go2rtc, MediaMtx, MediaMtxBySrt, program

try:
    from media_servers import Janus, WhepServer
    AIORTC = True
except ImportError:
    AIORTC = False

PROGRAM, RECORDING, CONFIGS = (os.path.abspath(p) for p in sys.argv[1:4])
SERVICE, RTSP, WHEP, JANUS = 8080, 8554, 8889, 8088
PAGE_ORIGIN = f"http://127.0.0.1:{SERVICE}"
PLAYED_S = 60
MIN_PSNR_DB = 30  # of H.264 against a JPEG of the same picture
STATE = "return document.getElementById('connection').dataset.state"
SHOWN = "return document.getElementById('picture').getVideoPlaybackQuality().totalVideoFrames"
VIDEO = """const video = document.getElementById("picture"), canvas = document.createElement("canvas");
canvas.width = video.videoWidth;
canvas.height = video.videoHeight;
canvas.getContext("2d").drawImage(video, 0, 0);
return canvas.toDataURL("image/png");"""


def needs(name):
    return unittest.skipUnless(program(name), f"needs {name} (build_media_servers.sh)")


class WatchPageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if not enter_network():
            raise unittest.SkipTest("needs a network namespace of its own, which takes root")
        cls.folder = tempfile.mkdtemp(prefix="lumigraft-watch-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)

    def serve(self, *settings):
        service = Service(PROGRAM, RECORDING, SERVICE, os.path.join(self.folder, "log"), settings)
        self.addCleanup(interrupt, service.process)
        wait(lambda: listening(SERVICE), "the service")
        return service

    def open(self, *flags):
        page = Page(os.path.join(self.folder, "profile"), flags)
        self.addCleanup(page.driver.quit)
        page.driver.get(f"{PAGE_ORIGIN}/watch.html")
        return page

    @unittest.skipUnless(AIORTC, "needs aiortc (Debian package python3-aiortc)")
    def test_1_chromium_plays_whep(self):
        server = WhepServer(RTSP, WHEP)
        self.addCleanup(server.close)
        self.serve(f"server.publish=rtsp://127.0.0.1:{RTSP}/kiosk", f"server.watch=http://127.0.0.1:{WHEP}/whep")
        page = self.open()
        page.wait(lambda: "not published" in page.text("lost"), "the page to say that nothing is published")
        server.listen()
        page.wait(lambda: page.driver.execute_script(SHOWN) >= 5, "pictures")
        page.wait(lambda: page.driver.execute_script(STATE) == "open" and not page.text("lost"), "the page to say that it plays")
        server.lose_viewers()
        page.wait(lambda: page.driver.execute_script(STATE) == "lost", "the loss to be seen")
        page.wait(lambda: page.driver.execute_script(STATE) == "open", "pictures again")

    def test_2_without_a_media_server_the_page_says_so(self):
        self.serve()
        page = self.open()
        page.wait(lambda: "server.watch is not set" in page.text("lost"), "the reason")

    @unittest.skipUnless(AIORTC, "needs aiortc (Debian package python3-aiortc)")
    def test_3_viewer_of_janus(self):
        if shutil.which("janus") is None:
            self.skipTest("needs janus (Debian package janus)")
        janus = Janus(os.path.join(CONFIGS, "janus.plugin.streaming.jcfg"), os.path.join(self.folder, "janus"), JANUS)
        self.addCleanup(janus.close)
        wait(lambda: listening(JANUS), "Janus")
        service = self.serve("server.publish=rtp://127.0.0.1:5004")
        service.wait_connected()
        width, height = service.size()
        with concurrent.futures.ThreadPoolExecutor() as pool:
            watching = pool.submit(janus.first_pictures, 8)
            shown = []
            while not watching.done():
                shown = [*shown, service.snapshot()[:height, :width]][-20:]  # one of each picture, at most five times a second
                time.sleep(0.2)
        pictures = watching.result()
        self.assertEqual(pictures[-1].shape, (height, width, 3))
        best = max(psnr_db(a, b) for a in shown for b in pictures)
        print(f"\n  PSNR {best:.1f} dB", end=" ", flush=True)
        self.assertGreater(best, MIN_PSNR_DB)

    def expect_played(self, server, *flags):
        """Chromium plays what `server` serves, and it is what the service shows."""
        self.addCleanup(server.close)
        wait(lambda: listening(server.PORT), "the media server")
        service = self.serve(f"server.publish={server.publish}", f"server.watch={server.watch}")
        service.wait_connected()
        width, height = service.size()
        page = self.open(*flags)
        page.wait(lambda: page.driver.execute_script(SHOWN) >= 5, f"pictures; the media server said {server.said()}")
        page.wait(lambda: page.driver.execute_script(STATE) == "open" and not page.text("lost"), "the page to say that it plays")
        shown, best = [], 0
        end = time.monotonic() + PLAYED_S
        while best < MIN_PSNR_DB and time.monotonic() < end:
            shown = [*shown, service.snapshot()[:height, :width]][-20:]  # one of each picture, at most five times a second
            data = base64.b64decode(page.driver.execute_script(VIDEO).split(",", 1)[1])
            played = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
            self.assertEqual(played.shape, (height, width, 3))
            best = max(best, *(psnr_db(one, played) for one in shown))
        print(f"\n  PSNR {best:.1f} dB", end=" ", flush=True)
        self.assertGreater(best, MIN_PSNR_DB)
        self.assertNotIn(PASSWORD, service.said())
        return page

    @needs("go2rtc")
    def test_4_go2rtc_that_restarts(self):
        server = Go2rtc(CONFIGS, self.folder)
        page = self.expect_played(server)
        server.close()
        page.wait(lambda: page.driver.execute_script(STATE) == "lost", "the loss to be seen")
        server.run()
        page.wait(lambda: page.driver.execute_script(STATE) == "open", "pictures again")

    @needs("mediamtx")
    def test_5_mediamtx(self):
        self.expect_played(MediaMtx(CONFIGS, self.folder, PAGE_ORIGIN), "--ignore-certificate-errors")

    @needs("mediamtx")
    def test_6_mediamtx_by_srt(self):
        self.expect_played(MediaMtxBySrt(CONFIGS, self.folder, PAGE_ORIGIN), "--ignore-certificate-errors")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
