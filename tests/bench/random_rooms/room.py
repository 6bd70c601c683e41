"""A room drawn from a seed: table, walls, boxes, lamps, camera, fish-eye and object. Tag frame, metres."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "recordings"))

import scene as world  # noqa: E402
import statue  # noqa: E402
from scene import Part, about_z, box, looking_at, quads  # noqa: E402

WARM, COOL = np.array([1.0, 0.55, 0.22]), np.array([0.72, 0.85, 1.0])  # lamps of about 2700 K and 8000 K
WALLS = ("left", "right", "behind", "front")
OPEN_M = 5.0  # how far the floor reaches where there is no wall
OBJECT_RADIUS_M = 0.13
LEG_M = 0.05


def lamp_color(rng):
    """Mean 1: white of some temperature, every seventh lamp saturated."""
    color = rng.uniform(0.25, 1.0, 3) if rng.random() < 0.15 else WARM + rng.uniform() * (COOL - WARM)
    return color / color.mean()


def albedo(rng, low=0.08, high=0.75, saturation=0.6):
    return np.clip(rng.uniform(low, high) * (1 + saturation * rng.uniform(-1, 1, 3)), 0.03, 0.85)


def patches(rng, ground, size):
    """Sheets of paper on an even table."""
    texture = np.tile(ground, (size, size, 1))
    for _ in range(rng.integers(4, 14)):
        row, column = rng.integers(0, size, 2)
        height, width = rng.integers(size // 16, size // 4, 2)
        texture[row : row + height, column : column + width] = albedo(rng)
    return texture.astype(np.float32)


def table_texture(rng, size=768):
    """Its kind, and size x size albedos."""
    kind = str(rng.choice(["plain", "grain", "checks", "stripes", "wood", "patches"]))
    a, b = albedo(rng), albedo(rng)
    y, x = np.mgrid[0:size, 0:size] / size
    cells = rng.integers(6, 20)
    if kind == "patches":
        return kind, patches(rng, a, size)
    if kind == "plain":
        blend = np.zeros((size, size))
    elif kind == "grain":
        b = a * rng.uniform(0.5, 0.9)
        coarse, fine = (world.smooth_noise(rng, (size, size), (n, n)) for n in (24, 96))
        blend = np.clip(0.5 + 0.25 * coarse + 0.15 * fine, 0, 1)
    elif kind == "checks":
        blend = (np.floor(x * cells) + np.floor(y * cells)) % 2
    elif kind == "stripes":
        blend = np.floor(x * cells) % 2
    else:
        b = a * 0.5
        blend = np.clip(0.5 + 0.5 * np.sin(60 * y + 3 * world.smooth_noise(rng, (size, size), (6, 10))), 0, 1)
    return kind, (a + (b - a) * blend[..., None]).astype(np.float32)


def closed_grid(points, normals, rows, columns):
    """Vertices, normals, triangles of a grid of points, z up; the triangles follow the normals."""
    i = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    triangles = np.concatenate(
        [np.stack([i, i + 1, i + columns], 1), np.stack([i + 1, i + columns + 1, i + columns], 1)]
    )
    a, b, c = points[triangles].transpose(1, 0, 2)
    face = np.cross(b - a, c - a)
    away = (face * normals[triangles].sum(1)).sum(1) < 0
    triangles[away] = triangles[away][:, [0, 2, 1]]
    return points, normals, triangles[np.linalg.norm(face, axis=1) > 1e-12]


def make_object(kind):
    """Vertices, unit normals, triangles; standing on z = 0."""
    if kind == "owl":
        return statue.make_owl()
    rows, columns = 49, 97
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, columns), np.linspace(0, 1, rows))
    if kind == "ring":
        v = 2 * np.pi * v
        radius, tube = 0.075, 0.03
        around = radius + tube * np.cos(v)
        points = np.stack([around * np.cos(u), -tube * np.sin(v), radius + tube + around * np.sin(u)], -1)
        normals = np.stack([np.cos(v) * np.cos(u), -np.sin(v), np.cos(v) * np.sin(u)], -1)
    else:
        v = np.pi * v
        normals = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), -np.cos(v)], -1)
        points = 0.08 * normals + [0, 0, 0.08]
    return closed_grid(points.reshape(-1, 3), normals.reshape(-1, 3), rows, columns)


@dataclass
class Room:
    seed: int
    table: dict = field(init=False)
    lamps: list = field(init=False)

    def __post_init__(self):
        rng = np.random.default_rng(self.seed)
        self.table = {
            "x": (-rng.uniform(0.4, 0.9), rng.uniform(0.5, 0.9)),
            "y": (-rng.uniform(0.3, 0.5), rng.uniform(0.6, 1.0)),
            "thickness": 0.03,
        }
        self.kind, self.texture = table_texture(rng)
        self.floor_z = -rng.choice([0.45, 0.74])
        self.walls = sorted(rng.choice(WALLS, rng.integers(1, 5), replace=False))
        self.ceiling = rng.random() < 0.4
        self.height = rng.uniform(1.2, 2.2)
        self.reach = {
            "left": -rng.uniform(1, 3),
            "right": rng.uniform(1, 3),
            "behind": rng.uniform(1.1, 3),
            "front": -rng.uniform(1.5, 3),
        }
        self.colors = {name: albedo(rng, 0.25, 0.75, 0.3) for name in (*WALLS, "ceiling", "floor", "legs")}
        self.object = str(rng.choice(["owl", "ball", "ring"]))
        self.object_color = [round(float(c), 4) for c in albedo(rng, 0.2, 0.75, 0.5)]
        self.object_turn = rng.uniform(-180, 180)
        self.object_at = np.array([rng.uniform(-0.12, 0.12), rng.uniform(0.2, 0.34), -0.0005])
        self.boxes = self.draw_boxes(rng)
        self.fisheye_at = np.array([rng.choice([-1, 1]) * rng.uniform(0.17, 0.25), rng.uniform(-0.1, 0.02), 0.035])
        self.fisheye_turn, self.fisheye_tilt = rng.uniform(-180, 180), rng.uniform(0, 8)
        self.lamps = self.draw_lamps(rng)
        self.environment = rng.uniform(0.01, 0.12) * lamp_color(rng)
        self.T_tag_camera = self.draw_camera(rng)

    def draw_boxes(self, rng):
        """Away from the tag, the object and each other."""
        boxes, taken = [], [((0.0, 0.0), 0.17), (self.object_at[:2], OBJECT_RADIUS_M)]
        for _ in range(rng.integers(0, 5)):
            half = rng.uniform(0.03, 0.11, 2)
            radius = np.hypot(*half)
            x0, x1 = self.table["x"]
            for _ in range(20):
                at = np.array([rng.uniform(x0 + 0.12, x1 - 0.12), rng.uniform(-0.05, self.table["y"][1] - 0.12)])
                if all(np.hypot(*(at - other)) > radius + reach for other, reach in taken):
                    taken.append((at, radius))
                    boxes.append((half, rng.uniform(0.04, 0.3), rng.uniform(0, 90), at, albedo(rng, 0.06, 0.7, 0.8)))
                    break
        return boxes

    def inside(self, point, margin=0.1):
        left, right, behind, front = (self.reach[w] if w in self.walls else None for w in WALLS)
        return (
            (left is None or point[0] > left + margin)
            and (right is None or point[0] < right - margin)
            and (behind is None or point[1] < behind - margin)
            and (front is None or point[1] > front + margin)
            and (not self.ceiling or point[2] < self.height - margin / 2)
        )

    def draw_lamps(self, rng):
        """One to four, 0.7 to 2.6 m from the tag, 15° apart; they share an irradiance of 1.5 to 3 W/m² at the tag."""
        count = int(rng.choice([1, 2, 2, 3, 4]))
        shares, total = rng.dirichlet(np.ones(count)), rng.uniform(1.5, 3.0)
        lamps = []
        for i in range(count):
            for _ in range(100):
                elevation, azimuth = np.radians(rng.uniform(22, 80)), rng.uniform(0, 2 * np.pi)
                distance = np.exp(rng.uniform(np.log(0.7), np.log(2.6)))
                level = np.cos(elevation)
                toward = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
                before_camera = distance < 1.3 and distance * toward[1] < -0.3 and abs(np.degrees(azimuth) - 270) < 50
                apart = all(toward @ lamp["toward"] < np.cos(np.radians(15)) for lamp in lamps)
                if self.inside(distance * toward) and apart and not before_camera:
                    break
            centre = distance * toward
            if rng.random() < 1 / 3:
                lamp = {"kind": "bulb", "radius": rng.uniform(0.025, 0.07)}
                at_tag = np.pi * lamp["radius"] ** 2 / distance**2 * toward[2]
            else:
                aim = np.array([rng.normal(0, 0.25), rng.normal(0.1, 0.25), 0]) - centre
                normal, size = aim / np.linalg.norm(aim), rng.uniform(0.1, 0.5, 2)
                lamp = {"kind": "panel", "normal": normal, "size": size}
                at_tag = size[0] * size[1] / distance**2 * toward[2] * max(0.1, -normal @ toward)
            lamp.update(name=f"{lamp['kind']} {i}", centre=centre, toward=toward)
            lamp["radiance"] = lamp_color(rng) * total * max(shares[i], 0.08) / at_tag
            lamps.append(lamp)
        return lamps

    @staticmethod
    def draw_camera(rng):
        azimuth, elevation = np.radians(rng.uniform(-125, -55)), np.radians(rng.uniform(24, 50))
        target = np.array([rng.uniform(-0.05, 0.05), rng.uniform(0.1, 0.16), 0.05])
        level = np.cos(elevation)
        toward = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
        return looking_at(target + rng.uniform(0.8, 1.15) * toward, target)

    def T_tag_fisheye(self):
        c, s = np.cos(np.radians(self.fisheye_tilt)), np.sin(np.radians(self.fisheye_tilt))
        T = np.eye(4)
        T[:3, :3] = about_z(self.fisheye_turn) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        T[:3, 3] = self.fisheye_at
        return T

    def T_tag_object(self):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = about_z(self.object_turn), self.object_at
        return T

    def parts(self):
        (x0, x1), (y0, y1), t = self.table["x"], self.table["y"], self.table["thickness"]
        world.TABLE = self.table
        top, paper = world.table_top()
        sheet = np.repeat(world.tag_modules()[..., None], 3, -1)
        on_paper = quads([paper])[..., :2] / world.PAPER_EDGE_M + 0.5
        mean = self.texture.mean((0, 1))
        sides = box((x0, y0, -t), (x1, y1, 0))
        corners = [(x, y) for x in (x0 + 0.03, x1 - 0.08) for y in (y0 + 0.03, y1 - 0.08)]
        legs = [box((x, y, self.floor_z), (x + LEG_M, y + LEG_M, -t)) for x, y in corners]
        return [
            Part("table top", top, mean, (top[..., :2] - [x0, y0]) / [x1 - x0, y1 - y0], self.texture),
            Part("paper", quads([paper]), sheet.mean((0, 1)), on_paper, sheet, True),
            Part("table sides", sides[~np.all(sides[:, :, 2] == 0, axis=1)], 0.8 * mean),
            Part("legs", np.concatenate(legs), self.colors["legs"]),
            *(
                Part(f"box {i}", box((-half[0], -half[1], 0), (*half, height), turn, (*at, 0)), color)
                for i, (half, height, turn, at, color) in enumerate(self.boxes)
            ),
            *self.room_parts(),
        ]

    def room_parts(self):
        x0, x1 = (self.reach[w] if w in self.walls else s * OPEN_M for w, s in (("left", -1), ("right", 1)))
        y0, y1 = (self.reach[w] if w in self.walls else s * OPEN_M for w, s in (("front", -1), ("behind", 1)))
        z, h = self.floor_z, self.height
        upright = {
            "left": [[x0, y0], [x0, y1]],
            "right": [[x1, y1], [x1, y0]],
            "behind": [[x0, y1], [x1, y1]],
            "front": [[x1, y0], [x0, y0]],
        }
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        parts = [Part("floor", quads([[[x, y, z] for x, y in corners]]), self.colors["floor"])]
        for wall in self.walls:
            a, b = upright[wall]
            parts.append(Part(wall, quads([[[*a, z], [*b, z], [*b, h], [*a, h]]]), self.colors[wall]))
        if self.ceiling:
            parts.append(Part("ceiling", quads([[[x, y, h] for x, y in corners]]), self.colors["ceiling"]))
        return parts
