"""Media servers between a `lumigraft serve` and WebRTC viewers."""
import asyncio
import http.server
import json
import logging
import os
import shutil
import threading
import urllib.request

from aiortc import RTCPeerConnection, RTCRtpSender, RTCSessionDescription
from aiortc.contrib.media import MediaPlayer, MediaRelay

from child_process import interrupt, start

logging.getLogger("libav").setLevel(logging.CRITICAL)


class Loop(threading.Thread):
    """asyncio on a thread of its own."""

    def __init__(self):
        super().__init__(daemon=True)
        self.loop = asyncio.new_event_loop()
        self.start()

    def run(self):
        asyncio.set_event_loop(self.loop)
        self.loop.run_forever()

    def call(self, coroutine, timeout_s=60):
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(timeout_s)


class WhepServer:
    """Takes a stream by RTSP and serves it by WHEP, with aiortc. It passes the H.264 on as it is."""

    def __init__(self, rtsp_port, port):
        self.rtsp_port, self.peers, self.loop = rtsp_port, [], Loop()
        self.track, self.relay = None, MediaRelay()
        owner = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def answer(self, status, body=b"", **headers):
                self.send_response(status)
                for name, value in headers.items():
                    self.send_header(name.replace("_", "-"), value)
                self.send_header("Access-Control-Allow-Origin", "*")
                self.send_header("Access-Control-Allow-Headers", "*")
                self.send_header("Access-Control-Allow-Methods", "*")
                self.send_header("Access-Control-Expose-Headers", "Location")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def do_OPTIONS(self):
                self.answer(204)

            def do_POST(self):
                offer = self.rfile.read(int(self.headers["Content-Length"])).decode()
                if owner.track is None:
                    return self.answer(404)
                sdp = owner.loop.call(owner.view(offer)).encode()
                self.answer(201, sdp, Content_Type="application/sdp", Location=f"/whep/{len(owner.peers) - 1}")

            def do_DELETE(self):
                owner.loop.call(owner.peers[int(self.path.rsplit("/", 1)[1])].close())
                self.answer(200)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def listen(self):
        """Waits for what is published."""

        async def open_player():
            return MediaPlayer(f"rtsp://127.0.0.1:{self.rtsp_port}/kiosk", options={"rtsp_flags": "listen", "probesize": "100000"}, decode=False)

        self.player = self.loop.call(open_player(), 120)
        self.track = self.player.video

    async def view(self, offer):
        peer = RTCPeerConnection()
        self.peers.append(peer)
        peer.addTrack(self.relay.subscribe(self.track))
        h264 = [codec for codec in RTCRtpSender.getCapabilities("video").codecs if codec.mimeType == "video/H264"]
        peer.getTransceivers()[0].setCodecPreferences(h264)
        await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        return peer.localDescription.sdp

    def lose_viewers(self):
        """Ends all connections, as a server does that restarts."""
        for peer in list(self.peers):
            self.loop.call(peer.close())

    def close(self):
        self.lose_viewers()
        self.server.shutdown()
        self.server.server_close()


class Janus:
    """The Janus of Debian, with a streaming mountpoint as configs/ describes it."""

    PLUGINS = "/usr/lib/x86_64-linux-gnu/janus"

    def __init__(self, mountpoint, folder, port):
        self.port, self.loop = port, Loop()
        os.makedirs(folder)
        shutil.copy(mountpoint, folder)
        files = {
            "janus.jcfg": f'general: {{ configs_folder = "{folder}", plugins_folder = "{self.PLUGINS}/plugins", '
                          f'transports_folder = "{self.PLUGINS}/transports", debug_level = 2, session_timeout = 0 }}\n',
            "janus.transport.http.jcfg": f'general: {{ http = true, ip = "127.0.0.1", port = {port} }}\n',
        }
        for name, text in files.items():
            with open(os.path.join(folder, name), "w") as f:
                f.write(text)
        with open(os.path.join(folder, "log"), "w") as log:
            self.process = start(["janus", "-F", folder], stdout=log, stderr=log)

    def ask(self, path="", body=None):
        data = None if body is None else json.dumps({"transaction": "t", **body}).encode()
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}/janus{path}", data, {"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=60) as reply:
            return json.load(reply)

    def first_pictures(self, count):
        """The first pictures that a WebRTC viewer decodes."""
        session = self.ask("", {"janus": "create"})["data"]["id"]
        handle = self.ask(f"/{session}", {"janus": "attach", "plugin": "janus.plugin.streaming"})["data"]["id"]
        self.ask(f"/{session}/{handle}", {"janus": "message", "body": {"request": "watch", "id": 1}})
        offer = self.ask(f"/{session}?maxev=1")["jsep"]["sdp"]

        async def watch():
            peer = RTCPeerConnection()
            tracks = asyncio.Queue()
            peer.on("track", tracks.put_nowait)
            await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
            await peer.setLocalDescription(await peer.createAnswer())
            answer = {"janus": "message", "body": {"request": "start"}, "jsep": {"type": "answer", "sdp": peer.localDescription.sdp}}
            await asyncio.get_running_loop().run_in_executor(None, self.ask, f"/{session}/{handle}", answer)
            track = await tracks.get()
            pictures = [(await track.recv()).to_ndarray(format="bgr24") for _ in range(count)]
            await peer.close()
            return pictures

        return self.loop.call(watch(), 120)

    def close(self):
        interrupt(self.process)
