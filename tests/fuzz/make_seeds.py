#!/usr/bin/env python3
"""Writes small inputs of each kind as first ones of fuzzing: make_seeds.py tests/fuzz/corpus

Needs numpy and OpenCV (recordings/requirements.txt). libFuzzer changes them; what it found is kept beside them.
"""

import sys
from pathlib import Path

import cv2
import numpy as np


def pictures():
    """Names and bytes: colour, grey, alpha and 16 bits, in the formats that models have."""
    v, u = np.mgrid[0:9, 0:7]
    colour = np.stack([30 * u, 25 * v, 20 * (u + v) % 255], -1).astype(np.uint8)
    alpha = np.dstack([colour, (36 * u).astype(np.uint8)])
    for name, extension, image, options in [
        ("colour", ".png", colour, []),
        ("grey", ".png", colour[..., 0], []),
        ("alpha", ".png", alpha, []),
        ("bits16", ".png", colour.astype(np.uint16) * 257, []),
        ("alpha16", ".png", alpha.astype(np.uint16) * 257, []),
        ("bilevel", ".png", colour[..., 0], [cv2.IMWRITE_PNG_BILEVEL, 1]),
        ("colour", ".jpg", colour, []),
        ("grey", ".jpg", colour[..., 0], []),
        ("progressive", ".jpg", colour, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]),
        ("restarts", ".jpg", colour, [cv2.IMWRITE_JPEG_RST_INTERVAL, 1]),
        ("lossy", ".webp", colour, [cv2.IMWRITE_WEBP_QUALITY, 50]),
        ("lossy_alpha", ".webp", alpha, [cv2.IMWRITE_WEBP_QUALITY, 50]),
        ("lossless", ".webp", alpha, [cv2.IMWRITE_WEBP_QUALITY, 101]),
        ("lzw", ".tif", colour, [cv2.IMWRITE_TIFF_COMPRESSION, 5]),
        ("bits16", ".tif", colour.astype(np.uint16) * 257, []),
        ("colour", ".bmp", colour, []),
        ("colour", ".ppm", colour, []),
    ]:
        yield name + extension, cv2.imencode(extension, image, options)[1].tobytes()


PLY_HEADER = """ply
format {} 1.0
element vertex 3
property float x
property float y
property float z
property float nx
property float ny
property float nz
property uchar red
property uchar green
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
"""


def ply_models():
    rows = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    text = "".join("{} {} {} 0 0 1 200 100 50\n".format(*row) for row in rows)
    yield "ascii.ply", (PLY_HEADER.format("ascii") + text + "3 0 1 2\n").encode()
    for name, order in [("little", "<"), ("big", ">")]:
        body = b"".join(
            np.array([*row, 0, 0, 1], order + "f4").tobytes() + bytes([200, 100, 50]) for row in rows
        ) + b"\x03" + np.arange(3).astype(order + "i4").tobytes()  # fmt: skip
        yield f"{name}.ply", PLY_HEADER.format(f"binary_{name}_endian").encode() + body


def obj_models():
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
    yield "triangle.obj", (corners + "f 1/1/1 2/2/1 3/3/1\n").encode()
    yield "quad.obj", (corners + "o one\ng all\ns 1\nf 1//1 2//1 4//1 3//1\nf -4 -3 -2\nl 1 2\n").encode()
    yield "material.obj", ("mtllib none.mtl\n" + corners + "usemtl paint\nf 1 2 3\n").encode()


def picture_lists():
    tum = "# timestamp filename\n1305031102.175304 rgb/1.png\n1305031102.211214 rgb/2.png\n"
    yield "plain", b"\0" + tum.encode()
    yield "exposures", b"\1" + b"0.0 a.png 1.5\n0.5 b.png\n"
    yield "brackets", b"\3" + b"1 a.png 1\n1 b.png .25\n2 c.png 4e0\n"
    yield "spaces", b"\0" + b" -1.5\ta.png \r\n\n#\n2 b.png\r\n"


def responses():
    yield "grey", "".join(f"{i / 255:.4f}\n" for i in range(256)).encode()
    yield "colour", "".join(f"{i / 255:.3f} {(i / 255) ** 2:.3f} {(i / 255) ** 0.5:.3f}\n" for i in range(256)).encode()


def exhibits():
    yield "place", b'bounds_m = [-1, -1, 0, 1, 1, 1]\nreset_after_s = 60\n[[object]]\nmodel = "model.ply"\nsize_m = 0.2\n'
    yield "material", b"""[[object]]
name = "one"
model = "model.ply"
up = "x"
on = "table"
visible = false
position_m = [0.1, 0, 0]
rotation_wxyz = [1, 0, 0, 0.5]
scale = 2
[object.material]
base_color = [0.2, 0.4, 0.6]
metallic = 1.0
roughness = 0.3
emission = [1, 0, 0]
clearcoat = 1
clearcoat_roughness = 0.1
"""
    yield "glass", b"""[[object]]
model = "model.ply"
[object.material]
transmission = 1
ior = 1.5
thin_walled = false
attenuation_color = [0.5, 1, 1]
attenuation_distance_m = 0.1
"""
    yield "motion", b"""[[object]]
model = "model.ply"
variant = "red"
[object.animation]
name = "walk"
playing = true
loop = false
at_s = 0.5
[[object.motion]]
time_s = 0
position_m = [0, 0, 0]
[[object.motion]]
time_s = 2.5
position_m = [0.1, 0, 0]
rotation_wxyz = [0, 0, 0, 1]
"""


CAMERAS = """
[color]
source = "v4l2:"
width = 640
height = 480
fx = 500
fy = 500
cx = 320
cy = 240
exposure = 1
[tag]
id = 0
size_m = 0.16
"""


def services():
    server = """[server]
listen = "127.0.0.1:8080"
max_viewers = 64
jpeg_quality = 85
recordings = "recorded"
max_recording_s = 60
max_recordings_gb = 5
min_free_disk_gb = 1
backend = "egl"
room = "hall.room"
max_field_memory_mb = 512
"""
    listeners = """[[server.listener]]
listen = "[::1]:8443"
permissions = ["view", "control", "record", "admin"]
allowed_hosts = ["museum.example"]
allowed_origins = ["https://museum.example"]
reserved_viewers = 2
[[server.listener]]
listen = "unix:lumigraft.sock"
permissions = ["view"]
[[server.listener]]
listen = "0.0.0.0:80"
token_file = "none"
certificate = "none"
key = "none"
"""
    plan = '[plan]\nmethod = "rays"\ntrace_scale = 8\nvolume = 64\nrsm = 128\nlook = "camera"\n'
    yield "server", (CAMERAS + server + plan).encode()
    yield "listeners", (CAMERAS + listeners).encode()
    yield "session", b'session = "nowhere"\nexhibit = "exhibit.toml"\n'
    yield "plan", (CAMERAS + plan).encode()


COMMANDS = [
    '{"type":"want","codec":"h264"}',
    '{"type":"object","index":0,"position_m":[0.1,-0.2,0],"yaw_degrees":30,"visible":true}',
    '{"type":"object","name":"owl","on_pixel":[320,240.5],"material":{"base_color":[1,0,0],"roughness":null,'
    '"emission":[0,0,0],"transmission":1,"ior":1.5,"thin_walled":true,"attenuation_color":[1,1,1],'
    '"attenuation_distance_m":1,"metallic":0,"specular":1,"clearcoat":0,"clearcoat_roughness":0}}',
    '{"type":"object","index":0,"reset":true,"rotation_wxyz":[1,0,0,0],"material":null,"variant":null}',
    '{"type":"object","index":1,"animation":{"name":"walk","playing":true,"loop":false,"at_s":1.5},"variant":"red"}',
    '{"type":"record","on":true}',
    '{"type":"playback","at_s":12.5,"paused":true,"step":true}',
    '{"type":"key"}',
    '{"type":"ack","sequence":123}',
]


def commands():
    for i, text in enumerate(COMMANDS):
        yield f"command{i}", text.encode()


def requests():
    for i, text in enumerate(
        [
            "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
            "GET /healthz HTTP/1.0\r\n\r\n",
            "HEAD /main.js HTTP/1.1\r\nHost: [::1]:8080\r\nConnection: close\r\n\r\nGET / HTTP/1.1\r\n\r\n",
            "POST /login HTTP/1.1\r\nHost: localhost\r\nContent-Length: 7\r\nOrigin: http://localhost\r\n\r\ntoken=1",
            "POST /login HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n",
            "GET /ws HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhl\r\n"
            "Sec-WebSocket-Version: 12\r\n\r\n",
            "GET /a%20b?x=1#y HTTP/1.1\r\nHost: localhost\r\nCookie: a=b; c=d\r\nAuthorization: Bearer x\r\n\r\n",
        ]
    ):
        yield f"request{i}", text.encode()


def frame(opcode, payload, first=0x80):
    """A masked frame; the mask is zero, so that the payload can be read."""
    return bytes([first | opcode, 0x80 | len(payload)]) + bytes(4) + payload


def websocket_messages():
    for i, text in enumerate(c for c in COMMANDS if len(c) < 126):
        yield f"text{i}", frame(1, text.encode())
    yield "fragments", frame(1, b'{"type":', 0) + frame(9, b"ping") + frame(0, b'"key"}') + frame(8, b"\x03\xe8bye")
    yield "binary", frame(2, b"\0\1\2") + frame(10, b"")
    yield "bad", frame(1, b"no") + frame(1, b"\xff\xfe")


def main():
    corpus = Path(sys.argv[1])
    for folder, seeds in [
        ("picture", pictures()),
        ("ply", ply_models()),
        ("obj", obj_models()),
        ("picture_list", picture_lists()),
        ("response", responses()),
        ("exhibit", exhibits()),
        ("service", services()),
        ("command", commands()),
        ("http", requests()),
        ("websocket", websocket_messages()),
    ]:
        (corpus / folder).mkdir(parents=True, exist_ok=True)
        for name, content in seeds:
            (corpus / folder / name).write_bytes(content)


main()
