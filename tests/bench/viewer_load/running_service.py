"""A real `lumigraft serve` whose processor time is measured, and viewers on plain sockets that cost little themselves."""
import base64
import os
import pathlib
import selectors
import socket
import struct
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "integration/end_to_end"))
from browser_page import free_port  # noqa: E402
from child_process import interrupt, start  # noqa: E402

HEADER = struct.Struct("<4sBBHIHHqq")
PICTURE_KINDS = (2, 3, 4)


class Service:
    def __init__(self, program, recording, settings):
        self.port = free_port()
        words = [word for line in settings for word in ("--set", line)]
        self.process = start([program, "serve", "--session", recording, "--listen", f"127.0.0.1:{self.port}"] + words,
                             stderr=subprocess.DEVNULL)
        for _ in range(600):
            with socket.socket() as s:
                if s.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.1)
        raise RuntimeError("the service did not start")

    def cpu_s(self, thread=None):
        """Processor time so far, of the process or of its thread of this name."""
        folder = pathlib.Path(f"/proc/{self.process.pid}")
        if thread:
            folder = next(task for task in (folder / "task").iterdir() if (task / "comm").read_text().strip() == thread)
        fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self):
        return interrupt(self.process)


def masked(text):
    """A websocket text frame; the mask is zero."""
    payload = text.encode()
    head = struct.pack("!BB", 0x81, 0x80 | len(payload)) if len(payload) < 126 else struct.pack("!BBH", 0x81, 0xFE, len(payload))
    return head + bytes(4) + payload


class Viewer:
    """A websocket that reads what comes; notes sequence numbers of pictures."""

    def __init__(self, port, codec, acknowledges=True):
        self.socket = socket.create_connection(("127.0.0.1", port), 30)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            got = self.socket.recv(4096)
            if not got:
                raise ConnectionError("closed during the handshake")
            self.buffer += got
        reply, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        if b" 101 " not in reply.split(b"\r\n")[0]:
            raise ConnectionError(reply.split(b"\r\n")[0].decode())
        self.acknowledges = acknowledges
        self.skip, self.pictures, self.times = 0, [], []
        if codec:
            self.socket.sendall(masked('{"type":"want","codec":"%s"}' % codec))
        self.socket.setblocking(False)

    def read(self):
        """False where the service has closed."""
        try:
            got = self.socket.recv(1 << 20)
        except BlockingIOError:
            return True
        except OSError:
            return False
        if not got:
            return False
        if self.skip >= len(got):
            self.skip -= len(got)
            return True
        self.buffer, self.skip = self.buffer + got[self.skip:], 0
        while self.message():
            pass
        return True

    def message(self):
        """Takes a message's head from the buffer, and skips the rest of it."""
        if len(self.buffer) < 10:
            return False
        opcode, length, head = self.buffer[0] & 15, self.buffer[1] & 127, 2
        if length >= 126:
            head = 4 if length == 126 else 10
            length = int.from_bytes(self.buffer[2:head], "big")
        if len(self.buffer) < head + min(length, HEADER.size):
            return False
        if opcode == 2 and length >= HEADER.size:
            _, _, kind, _, sequence, _, _, captured_ns, _ = HEADER.unpack_from(self.buffer, head)
            if kind in PICTURE_KINDS:
                self.pictures.append(sequence)
                self.times.append((time.time(), time.time() - 1e-9 * captured_ns))
                if self.acknowledges:
                    self.socket.send(masked('{"type":"ack","sequence":%d}' % sequence))
        self.skip = max(0, head + length - len(self.buffer))
        self.buffer = self.buffer[head + length:]
        return True

    def close(self):
        self.socket.close()


def read_all(viewers, seconds):
    """Reads from all viewers for so long; closed ones are left out. Returns how many the service closed."""
    selector = selectors.DefaultSelector()
    for viewer in viewers:
        selector.register(viewer.socket, selectors.EVENT_READ, viewer)
    closed, end = 0, time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        for key, _ in selector.select(left):
            if not key.data.read():
                selector.unregister(key.fileobj)
                closed += 1
    return closed
