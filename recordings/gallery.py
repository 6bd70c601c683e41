"""Writes gallery/: objects of different materials for the table of tabletop/, each a small .glb.

A glazed pot with textures, a brass bell, a glass paperweight, a paper lantern that shines, and birds that circle a
post. Metres; z is up here and y in the files.

    python gallery.py
"""

import json
import pathlib
import struct

import cv2
import numpy as np

FOLDER = pathlib.Path(__file__).parent / "gallery" / "models"
SEGMENTS = 48


def lathe(profile, segments=SEGMENTS):
    """Surface of revolution: positions, normals, texture coordinates, triangles. `profile`: (radius, height) along the
    outside from below, counter-clockwise; a point that is there twice makes an edge."""
    profile = np.asarray(profile, float)
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    slopes = np.empty_like(profile)
    for i in range(len(profile)):
        before = i if i == 0 or (profile[i - 1] == profile[i]).all() else i - 1
        after = i if i == len(profile) - 1 or (profile[i + 1] == profile[i]).all() else i + 1
        slopes[i] = profile[after] - profile[before]
    slopes /= np.linalg.norm(slopes, axis=1, keepdims=True)
    angles = np.linspace(0, 2 * np.pi, segments + 1)
    around = np.stack([np.cos(angles), np.sin(angles)], -1)
    around[-1] = around[0]  # exactly, so that the surface is closed
    positions, normals, texcoords = [], [], []
    for (radius, height), (dr, dz), v in zip(profile, slopes, along / along[-1]):
        positions.append(np.column_stack([radius * around, np.full(segments + 1, height)]))
        normals.append(np.column_stack([dz * around, np.full(segments + 1, -dr)]))
        texcoords.append(np.column_stack([angles / (2 * np.pi), np.full(segments + 1, 1 - v)]))
    triangles = []
    for i in range(len(profile) - 1):
        if (profile[i] == profile[i + 1]).all():
            continue
        for k in range(segments):
            a, b = i * (segments + 1) + k, (i + 1) * (segments + 1) + k
            if profile[i, 0] > 0:
                triangles.append([a, a + 1, b + 1])
            if profile[i + 1, 0] > 0:
                triangles.append([a, b + 1, b])
    return np.concatenate(positions), np.concatenate(normals), np.concatenate(texcoords), np.array(triangles)


def curve(points, steps=6):
    """Catmull-Rom through the points."""
    points = np.asarray(points, float)
    padded = np.concatenate([[2 * points[0] - points[1]], points, [2 * points[-1] - points[-2]]])
    found = []
    for i in range(len(points) - 1):
        p0, p1, p2, p3 = padded[i : i + 4]
        for t in np.arange(steps) / steps:
            found.append(
                0.5 * (2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2 + (3 * p1 - p0 - 3 * p2 + p3) * t**3)
            )
    found = np.array(found + [points[-1]])
    found[:, 0] = np.maximum(found[:, 0], 0)
    return found


class Glb:
    """A glTF document under construction."""

    def __init__(self):
        self.blob = bytearray()
        self.json = {
            "asset": {"version": "2.0", "generator": "lumigraft recordings/gallery.py"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            **{key: [] for key in ("nodes", "meshes", "materials", "bufferViews", "accessors")},
        }

    def view(self, data):
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)})
        self.blob += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values, kind, component=5126):
        values = np.ascontiguousarray(values, "<f4" if component == 5126 else "<u2")
        entry = {
            "bufferView": self.view(values.tobytes()),
            "componentType": component,
            "count": int(values.size if kind == "SCALAR" else len(values)),
            "type": kind,
        }
        if component == 5126:
            entry["min"] = np.atleast_1d(values.min(0)).tolist()
            entry["max"] = np.atleast_1d(values.max(0)).tolist()
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def texture(self, rgb):
        """`rgb`: values from 0 to 1."""
        coded = cv2.imencode(".png", np.round(255 * rgb).clip(0, 255).astype(np.uint8)[..., ::-1])[1].tobytes()
        for key in ("images", "textures"):
            self.json.setdefault(key, [])
        self.json["images"].append({"bufferView": self.view(coded), "mimeType": "image/png"})
        self.json["textures"].append({"source": len(self.json["images"]) - 1})
        return {"index": len(self.json["textures"]) - 1}

    def material(self, name, extensions=None, **keys):
        entry = {"name": name, **keys}
        if extensions:
            entry["extensions"] = extensions
            self.json["extensionsUsed"] = sorted({*self.json.get("extensionsUsed", []), *extensions})
        self.json["materials"].append(entry)
        return len(self.json["materials"]) - 1

    def mesh(self, name, shape, material):
        positions, normals, texcoords, triangles = shape
        turn = lambda a: np.stack([a[:, 0], a[:, 2], -a[:, 1]], -1)  # noqa: E731
        attributes = {
            "POSITION": self.accessor(turn(positions), "VEC3"),
            "NORMAL": self.accessor(turn(normals), "VEC3"),
            "TEXCOORD_0": self.accessor(texcoords, "VEC2"),
        }
        indices = self.accessor(np.asarray(triangles).reshape(-1), "SCALAR", 5123)
        self.json["meshes"].append(
            {"name": name, "primitives": [{"attributes": attributes, "indices": indices, "material": material}]}
        )
        return len(self.json["meshes"]) - 1

    def node(self, root=True, **keys):
        self.json["nodes"].append(keys)
        if root:
            self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)
        return len(self.json["nodes"]) - 1

    def write(self, name):
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        document = {key: value for key, value in self.json.items() if value != []}
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.blob) + b"\0" * (-len(self.blob) % 4)
        with open(FOLDER / name, "wb") as f:
            f.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary)))
            f.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            f.write(struct.pack("<II", len(binary), 0x004E4942) + binary)


def pot():
    """Thrown clay: raw below, a running glaze above, grooves of the potter's fingers."""
    outside = curve([(0.032, 0), (0.046, 0.02), (0.058, 0.06), (0.05, 0.11), (0.033, 0.135), (0.037, 0.15)])
    inside = curve([(0.033, 0.15), (0.029, 0.135), (0.046, 0.11), (0.053, 0.06), (0.04, 0.02), (0.0, 0.006)])
    shape = lathe(np.concatenate([[(0, 0), (0.032, 0)], outside, [(0.035, 0.152)], inside]))
    size = 256
    v, u = np.mgrid[0:size, 0:size] / size
    rng = np.random.default_rng(3)
    waves = sum(0.012 * np.sin(2 * np.pi * (k * u + rng.random())) for k in (2, 5, 9))
    height = 1 - v  # along the profile: the outside ends at about a half
    glazed = 1 / (1 + np.exp(-(height - 0.24 - waves) / 0.004))[..., None]
    grain = np.pad(rng.standard_normal((size, size)), 8, mode="wrap")
    grain = cv2.GaussianBlur(grain, (0, 0), 1.2)[8:-8, 8:-8, None]
    clay = np.array([0.56, 0.33, 0.22]) + 0.05 * grain
    glaze = np.array([0.10, 0.36, 0.38]) + 0.03 * grain + 0.12 * np.sin(40 * height)[..., None] ** 8
    color = clay + glazed * (glaze - clay)
    roughness = 0.85 + glazed[..., 0] * (0.22 - 0.85)
    groove = 0.35 * np.cos(2 * np.pi * 60 * height)
    normal = np.stack([np.zeros_like(u), groove * (1 - 0.7 * glazed[..., 0]), np.ones_like(u)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    glb = Glb()
    material = glb.material(
        "glazed clay",
        pbrMetallicRoughness={
            "baseColorTexture": glb.texture(color),
            "metallicRoughnessTexture": glb.texture(np.stack([np.ones_like(u), roughness, np.ones_like(u)], -1)),
            "metallicFactor": 0.0,
        },
        normalTexture=glb.texture(0.5 + 0.5 * normal),
    )
    glb.node(name="pot", mesh=glb.mesh("pot", shape, material))
    glb.write("pot.glb")


def bell():
    body = curve([(0.055, 0), (0.045, 0.012), (0.036, 0.04), (0.03, 0.07), (0.018, 0.088), (0.009, 0.092)])
    knob = curve([(0.006, 0.096), (0.013, 0.106), (0.011, 0.118), (0, 0.123)])
    hollow = [(0, 0.08), (0.015, 0.08), (0.026, 0.066), (0.032, 0.038), (0.041, 0.012), (0.05, 0)]
    glb = Glb()
    brass = glb.material(
        "brass",
        pbrMetallicRoughness={"baseColorFactor": [0.89, 0.72, 0.38, 1], "metallicFactor": 1.0, "roughnessFactor": 0.28},
    )
    glb.node(name="bell", mesh=glb.mesh("bell", lathe(np.concatenate([hollow, body, knob])), brass))
    glb.write("bell.glb")


def paperweight():
    radius, flat = 0.045, 0.006  # a ball that stands on a facet
    angles = np.linspace(np.arcsin(-(radius - flat) / radius), np.pi / 2, 28)
    rim = np.column_stack([radius * np.cos(angles), radius * np.sin(angles) + radius - flat])
    rim[-1, 0] = 0
    glb = Glb()
    glass = glb.material(
        "green glass",
        pbrMetallicRoughness={"metallicFactor": 0.0, "roughnessFactor": 0.0},
        extensions={
            "KHR_materials_transmission": {"transmissionFactor": 1.0},
            "KHR_materials_ior": {"ior": 1.52},
            "KHR_materials_volume": {
                "thicknessFactor": 2 * radius,
                "attenuationDistance": 0.08,
                "attenuationColor": [0.35, 0.8, 0.5],
            },
        },
    )
    glb.node(name="paperweight", mesh=glb.mesh("ball", lathe(np.concatenate([[(0, 0), rim[0]], rim])), glass))
    glb.write("paperweight.glb")


def lantern():
    """Ribbed paper around a light, between two wooden rings."""
    heights = np.linspace(0.014, 0.136, 41)
    bulge = 0.036 + 0.022 * np.sin(np.pi * (heights - 0.014) / 0.122) + 0.0012 * np.cos(2 * np.pi * heights / 0.0122)
    wall = np.column_stack([bulge, heights])
    glb = Glb()
    paper = glb.material(
        "paper",
        pbrMetallicRoughness={"baseColorFactor": [0.9, 0.82, 0.66, 1], "metallicFactor": 0.0, "roughnessFactor": 1.0},
        emissiveFactor=[1.0, 0.62, 0.28],
        extensions={
            "KHR_materials_emissive_strength": {"emissiveStrength": 0.9},
            "KHR_materials_specular": {"specularFactor": 0.0},
        },
    )
    wood = glb.material(
        "wood",
        pbrMetallicRoughness={"baseColorFactor": [0.16, 0.09, 0.05, 1], "metallicFactor": 0.0, "roughnessFactor": 0.6},
    )
    ring = lambda low, high, r: [(0, low), (r, low), (r, low), (r, high), (r, high), (0, high)]  # noqa: E731
    glb.node(name="paper", mesh=glb.mesh("paper", lathe(wall), paper))
    glb.node(name="foot", mesh=glb.mesh("foot", lathe(ring(0, 0.014, 0.038)), wood))
    glb.node(name="lid", mesh=glb.mesh("lid", lathe(ring(0.136, 0.146, 0.034)), wood))
    glb.write("lantern.glb")


def carousel():
    """Three birds on arms that turn around a post and rise and fall."""
    glb = Glb()
    matt = {"KHR_materials_specular": {"specularFactor": 0.0}}

    def paint(name, color):
        factors = {"baseColorFactor": [*color, 1], "metallicFactor": 0.0, "roughnessFactor": 1.0}
        return glb.material(name, pbrMetallicRoughness=factors, extensions=matt)

    post = [(0, 0), (0.04, 0), (0.04, 0), (0.04, 0.01), (0.04, 0.01), (0.005, 0.014), (0.005, 0.15), (0, 0.155)]
    glb.node(name="post", mesh=glb.mesh("post", lathe(post), paint("wood", (0.42, 0.27, 0.15))))
    bird_shape = lathe(curve([(0, -0.022), (0.009, -0.012), (0.012, 0), (0.008, 0.014), (0, 0.03)]), 20)
    arm_shape = lathe([(0, 0), (0.0018, 0), (0.0018, 0), (0.0018, 0.06), (0.0018, 0.06), (0, 0.06)], 10)
    arm_mesh = glb.mesh("arm", arm_shape, paint("wire", (0.2, 0.2, 0.2)))
    half = np.sqrt(0.5)
    birds, arms = [], []
    for k, color in enumerate([(0.75, 0.12, 0.08), (0.9, 0.62, 0.1), (0.1, 0.3, 0.65)]):
        # The bird's axis, y of the file, along the tangent of its circle; the arm's along the radius.
        mesh = glb.mesh(f"bird {k + 1}", bird_shape, paint(f"paint {k + 1}", color))
        bird = glb.node(False, mesh=mesh, translation=[0.06, 0, 0], rotation=[half, 0, 0, half])
        rod = glb.node(False, mesh=arm_mesh, rotation=[0, 0, -half, half])
        angle = 2 * np.pi * k / 3
        arms.append(
            glb.node(
                False,
                name=f"arm {k + 1}",
                children=[bird, rod],
                rotation=[0, float(np.sin(angle / 2)), 0, float(np.cos(angle / 2))],
            )
        )
        birds.append(bird)
    top = glb.node(name="top", translation=[0, 0.145, 0], children=arms)
    times = np.linspace(0, 6, 13)
    turns = 2 * np.pi * times / 6
    time = glb.accessor(times, "SCALAR")
    rotation = glb.accessor(
        np.column_stack([0 * turns, np.sin(turns / 2), 0 * turns, np.cos(turns / 2)]), "VEC4"
    )
    samplers = [{"input": time, "output": rotation}]
    channels = [{"sampler": 0, "target": {"node": top, "path": "rotation"}}]
    for k, bird in enumerate(birds):
        rise = 0.012 * np.sin(2 * turns + 2 * np.pi * k / 3)
        rises = glb.accessor(np.column_stack([np.full_like(rise, 0.06), rise, 0 * rise]), "VEC3")
        samplers.append({"input": time, "output": rises})
        channels.append({"sampler": k + 1, "target": {"node": bird, "path": "translation"}})
    glb.json["animations"] = [{"name": "circling", "samplers": samplers, "channels": channels}]
    glb.write("carousel.glb")


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for make in (pot, bell, paperweight, lantern, carousel):
        make()
