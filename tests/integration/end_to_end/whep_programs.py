"""go2rtc and MediaMTX as configs/ configures them, changed as somebody would who installs them."""
import os
import shutil
import subprocess

from child_process import interrupt, start
from own_network import NEAR_ADDRESS

PASSWORD = "a-password"  # without characters that an address or YAML would have to escape


def program(name):
    """Path of what build_media_servers.sh built, or of what is installed; None without."""
    return shutil.which(name, path=os.pathsep.join([os.environ.get("LUMIGRAFT_MEDIA_SERVERS", ""), os.environ["PATH"]]))


def adapted(text, changes):
    for of_document, here in changes.items():
        assert of_document in text, of_document
        text = text.replace(of_document, here)
    return text


def self_signed(folder):
    """Certificate and key."""
    certificate, key = (os.path.join(folder, name) for name in ("media.crt", "media.key"))
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "90", "-subj", "/CN=localhost",
                    "-addext", "subjectAltName=DNS:localhost", "-keyout", key, "-out", certificate], check=True, capture_output=True)
    return certificate, key


class WhepProgram:
    """One that runs. `publish` and `watch` are the service's settings."""

    def __init__(self, words, folder, changes):
        name, example = words[0], words[-1]
        self.log = os.path.join(folder, name + ".log")
        with open(example) as f:
            text = adapted(f.read(), changes)
        configuration = os.path.join(folder, os.path.basename(example))
        with open(configuration, "w") as f:
            f.write(text)
        self.command = [program(name), *words[1:-1], configuration]
        self.run()

    def run(self):
        with open(self.log, "a") as log:
            self.process = start(self.command, stdout=log, stderr=log)

    def said(self):
        with open(self.log) as f:
            return f.read()

    def close(self):
        interrupt(self.process)


class Go2rtc(WhepProgram):
    PORT = 1984
    publish = "rtsp://127.0.0.1:8554/hall"
    watch = f"http://127.0.0.1:{PORT}/api/webrtc?src=hall"  # the proxy that adds https is left out

    def __init__(self, configs, folder):
        super().__init__(["go2rtc", "-config", os.path.join(configs, "go2rtc.yaml")], folder, {"media.example:8555": f"{NEAR_ADDRESS}:8555"})


class MediaMtx(WhepProgram):
    PORT = 8889
    watch = f"https://127.0.0.1:{PORT}/hall/whep"
    publish = f"rtsp://kiosk:{PASSWORD}@127.0.0.1:8554/hall"

    def __init__(self, configs, folder, page_origin, changes={}):
        certificate, key = self_signed(folder)
        super().__init__(["mediamtx", os.path.join(configs, "mediamtx.yml")], folder, {
            "pass: PASSWORD": f"pass: {PASSWORD}",
            "/etc/ssl/media.example.key": key,
            "/etc/ssl/media.example.crt": certificate,
            "https://museum.example": page_origin,
            "[media.example]": f"[{NEAR_ADDRESS}]",
            **changes,
        })


class MediaMtxBySrt(MediaMtx):
    publish = f"srt://127.0.0.1:8890?streamid=publish:hall:kiosk:{PASSWORD}&pkt_size=1316"

    def __init__(self, configs, folder, page_origin):
        super().__init__(configs, folder, page_origin, {"\nsrt: no\n# srt: yes\n# srtAddress": "\nsrt: yes\nsrtAddress"})
