#!/usr/bin/env python3
"""Writes small pictures and models of each kind as first inputs of fuzzing: make_seeds.py tests/fuzz/corpus

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


def main():
    corpus = Path(sys.argv[1])
    for folder, seeds in [("picture", pictures()), ("ply", ply_models()), ("obj", obj_models())]:
        (corpus / folder).mkdir(parents=True, exist_ok=True)
        for name, content in seeds:
            (corpus / folder / name).write_bytes(content)


main()
