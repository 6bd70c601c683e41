"""The exhibit: an owl on a plinth, as the zero set of a signed distance, meshed by marching cubes.

z is up and the owl looks along -y; metres; it stands on z = 0.
"""

import json
import struct

import numpy as np
from skimage.measure import marching_cubes

VOXEL_M = 0.0044


def length(*parts):
    return np.sqrt(sum(p * p for p in parts))


def smooth_min(a, b, radius):
    """Blends two distances over `radius` (polynomial smooth minimum, Quilez 2013)."""
    h = np.maximum(radius - np.abs(a - b), 0) / radius
    return np.minimum(a, b) - h * h * radius / 4


def ellipsoid(x, y, z, centre, radii):
    """First-order distance: exact at the surface, which is all that meshing and normals need."""
    p = [(x - centre[0]), (y - centre[1]), (z - centre[2])]
    k0 = length(*(c / r for c, r in zip(p, radii)))
    k1 = length(*(c / (r * r) for c, r in zip(p, radii)))
    return k0 * (k0 - 1) / np.maximum(k1, 1e-9)


def capsule(x, y, z, a, b, radius_a, radius_b):
    a, b = np.asarray(a), np.asarray(b)
    ab = b - a
    t = np.clip(((x - a[0]) * ab[0] + (y - a[1]) * ab[1] + (z - a[2]) * ab[2]) / (ab @ ab), 0, 1)
    away = length(x - a[0] - t * ab[0], y - a[1] - t * ab[1], z - a[2] - t * ab[2])
    return away - (radius_a + t * (radius_b - radius_a))


def slab(x, y, z, half, z_low, z_high, rounding):
    q = [
        np.abs(x) - half + rounding,
        np.abs(y) - half + rounding,
        np.abs(z - (z_low + z_high) / 2) - (z_high - z_low) / 2 + rounding,
    ]
    return length(*(np.maximum(c, 0) for c in q)) + np.minimum(np.maximum(np.maximum(q[0], q[1]), q[2]), 0) - rounding


def ring(x, y, z, centre, radius, thickness):
    """A torus whose axis is y."""
    dx, dy, dz = x - centre[0], y - centre[1], z - centre[2]
    return length(length(dx, dz) - radius, dy) - thickness


def owl_distance(x, y, z):
    side = np.abs(x)  # the owl is symmetric
    body = ellipsoid(x, y, z, (0, 0.002, 0.145), (0.050, 0.044, 0.078))
    head = ellipsoid(x, y, z, (0, -0.006, 0.226), (0.047, 0.040, 0.038))
    d = smooth_min(body, head, 0.022)
    d = smooth_min(d, capsule(side, y, z, (0.026, -0.004, 0.246), (0.043, 0.000, 0.284), 0.015, 0.004), 0.012)  # ears
    d = smooth_min(d, ellipsoid(side, y, z, (0.048, 0.010, 0.138), (0.014, 0.034, 0.066)), 0.008)  # wings
    d = smooth_min(d, capsule(x, y, z, (0, 0.034, 0.115), (0, 0.054, 0.064), 0.022, 0.014), 0.015)  # tail
    d = smooth_min(d, ring(side, y, z, (0.019, -0.041, 0.229), 0.0150, 0.0045), 0.004)  # rims of the eyes
    d = smooth_min(d, ellipsoid(side, y, z, (0.019, -0.039, 0.229), (0.0075, 0.0075, 0.0075)), 0.002)
    d = smooth_min(d, capsule(x, y, z, (0, -0.043, 0.222), (0, -0.052, 0.204), 0.0075, 0.0025), 0.004)  # beak
    d = smooth_min(d, capsule(side, y, z, (0.021, -0.016, 0.084), (0.025, -0.050, 0.076), 0.013, 0.009), 0.008)  # feet
    for row in range(3):  # the feathers of the breast: rows of low bumps
        for k in range(-row - 1, row + 2, 2):
            cx, cz = 0.0125 * k, 0.180 - 0.019 * row
            cy = -0.038 - 0.004 * row + 0.004 * abs(k)
            d = smooth_min(d, ellipsoid(x, y, z, (cx, cy, cz), (0.0085, 0.0075, 0.0105)), 0.005)
    plinth = slab(x, y, z, 0.060, -0.02, 0.040, 0.006)
    plinth = smooth_min(plinth, slab(x, y, z, 0.050, 0.02, 0.072, 0.006), 0.010)
    return np.maximum(np.minimum(d, plinth), -z)


def make_owl():
    """Vertices, unit normals and triangles (counter-clockwise from outside)."""
    low, high = np.array([-0.078, -0.078, -1.5 * VOXEL_M]), np.array([0.078, 0.088, 0.300])
    axes = [np.arange(lo, hi, VOXEL_M) for lo, hi in zip(low, high)]
    grid = owl_distance(*np.meshgrid(*axes, indexing="ij"))
    vertices, triangles, _, _ = marching_cubes(grid, 0.0, spacing=(VOXEL_M,) * 3, gradient_direction="ascent")
    vertices = (vertices + [a[0] for a in axes]).astype(np.float32)
    step = 5e-4
    p = vertices.astype(np.float64).T
    normals = np.stack(
        [owl_distance(*(p + step * e[:, None])) - owl_distance(*(p - step * e[:, None])) for e in np.eye(3)], -1
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corners = vertices[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if np.mean(np.sum(face * normals[triangles[:, 0]], -1) > 0) < 0.5:
        triangles = triangles[:, ::-1]
    return vertices, normals.astype(np.float32), np.ascontiguousarray(triangles.astype(np.uint32))


def write_glb(path, vertices, normals, triangles, base_color):
    """One node, one Lambert material; glTF is y up, so (x, y, z) becomes (x, z, -y) and the owl looks along +z."""
    turn = lambda a: np.stack([a[:, 0], a[:, 2], -a[:, 1]], -1).astype("<f4")  # noqa: E731
    positions = turn(vertices)
    blobs = [positions.tobytes(), turn(normals).tobytes(), triangles.astype("<u2").tobytes()]
    assert len(vertices) < 65536 and all(len(b) % 4 == 0 for b in blobs[:2])
    offsets = np.cumsum([0] + [len(b) for b in blobs]).tolist()
    binary = b"".join(blobs)
    binary += b"\0" * (-len(binary) % 4)
    document = {
        "asset": {"version": "2.0", "generator": "lumigraft recordings/make_tabletop.py"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "owl"}],
        "meshes": [
            {"name": "owl", "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0}]}
        ],
        "materials": [
            {
                "name": "stone",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*base_color, 1.0],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 1.0,
                },
                "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}},
            }
        ],
        "extensionsUsed": ["KHR_materials_specular"],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": offsets[i], "byteLength": len(b), "target": 34963 if i == 2 else 34962}
            for i, b in enumerate(blobs)
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(vertices),
                "type": "VEC3",
                "min": positions.min(0).tolist(),
                "max": positions.max(0).tolist(),
            },
            {"bufferView": 1, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "count": triangles.size, "type": "SCALAR"},
        ],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as f:
        f.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary)))
        f.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
        f.write(struct.pack("<II", len(binary), 0x004E4942) + binary)
