"""The real scene of recordings/tabletop: geometry, textures, lamps, and where the cameras stand. Tag frame, metres."""

from dataclasses import dataclass

import cv2
import numpy as np

TAG_ID, TAG_SIZE_M = 5, 0.16
WIDTH, HEIGHT, FOCAL = 640, 480, 525.0
FRAMES, FRAMES_PER_SECOND = 24, 12
FISHEYE_SIZE, FISHEYE_FOV_DEGREES = 512, 190.0
FISHEYE_FOCAL = FISHEYE_SIZE / 2 / np.radians(FISHEYE_FOV_DEGREES / 2)

STATUE_POSITION_M = np.array([0.035, 0.215, -0.0005])
STATUE_TURN_DEGREES = -14.0
STATUE_COLOR = [0.70, 0.66, 0.58]

ENVIRONMENT = [0.052, 0.060, 0.072]
BULB = {"name": "amber bulb", "centre": [-0.74, -0.20, 0.66], "radius": 0.045, "radiance": [92.0, 56.0, 26.0]}
PANEL = {
    "name": "blue-white panel",
    "centre": [0.82, 0.05, 1.10],
    "normal": [-0.62, 0.13, -0.77],
    "size": [0.36, 0.24],
    "radiance": [8.5, 12.5, 18.0],
}

FLOOR_Z, WALL_Y, WALL_X = -0.74, 1.45, -1.70
TABLE = {"x": (-0.66, 0.78), "y": (-0.42, 0.86), "thickness": 0.035}
PAPER_EDGE_M = 0.20  # ten modules of 2 cm: the black square is eight of them


def use_pictures_of(width, fisheye_size):
    """The same views in pictures of another size."""
    global WIDTH, HEIGHT, FOCAL, FISHEYE_SIZE, FISHEYE_FOCAL
    WIDTH, HEIGHT, FOCAL = width, HEIGHT * width // WIDTH, FOCAL * width / WIDTH
    FISHEYE_SIZE, FISHEYE_FOCAL = fisheye_size, FISHEYE_FOCAL * fisheye_size / FISHEYE_SIZE


@dataclass
class Part:
    """Flat-shaded triangles of one material: a colour, or a texture (linear, row 0 at v = 1) with its mean beside it."""

    name: str
    triangles: np.ndarray  # n x 3 x 3
    albedo: np.ndarray
    uv: np.ndarray = None  # n x 3 x 2
    texture: np.ndarray = None
    nearest: bool = False


def about_z(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def quads(corners):
    """n x 4 x 3 corners, counter-clockwise from the lit side, to triangles."""
    c = np.asarray(corners, float)
    return np.concatenate([c[:, [0, 1, 2]], c[:, [0, 2, 3]]])


def box(low, high, turn_degrees=0.0, at=(0, 0, 0)):
    x, y, z = zip(low, high)
    p = lambda i, j, k: (x[i], y[j], z[k])  # noqa: E731
    sides = [
        [p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)],
        [p(0, 0, 0), p(0, 1, 0), p(1, 1, 0), p(1, 0, 0)],
        [p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)],
        [p(1, 1, 0), p(0, 1, 0), p(0, 1, 1), p(1, 1, 1)],
        [p(0, 1, 0), p(0, 0, 0), p(0, 0, 1), p(0, 1, 1)],
        [p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1)],
    ]
    return quads(sides) @ about_z(turn_degrees).T + np.asarray(at)


def smooth_noise(rng, shape, cells):
    """Gaussian noise on a coarse grid, enlarged; about unit variance."""
    return cv2.resize(rng.standard_normal(cells), shape[::-1], interpolation=cv2.INTER_CUBIC)


def wood_texture(size=1024, seed=11):
    """Planks along x: growth rings cut lengthwise, fine fibres, dark joints."""
    rng = np.random.default_rng(seed)
    wide, high = TABLE["x"][1] - TABLE["x"][0], TABLE["y"][1] - TABLE["y"][0]
    x, y = np.meshgrid((np.arange(size) + 0.5) / size * wide, (np.arange(size) + 0.5) / size * high)
    planks = 8
    plank = np.minimum((y / high * planks).astype(int), planks - 1)
    across = y / high * planks - plank
    out = np.zeros((size, size, 3))
    dark, light = np.array([0.21, 0.105, 0.048]), np.array([0.50, 0.305, 0.155])
    fibres = smooth_noise(rng, (size, size), (size, size // 48))
    for i in range(planks):
        wave = smooth_noise(rng, (size, size), (10, 7)) * 0.010 + smooth_noise(rng, (size, size), (40, 16)) * 0.0015
        heart = rng.uniform(-0.10, 0.10)
        rings = np.hypot(y - (i + 0.5) * high / planks - heart + wave, 0.04 + 0.05 * x * rng.uniform(-1, 1))
        band = (rings * rng.uniform(70, 110)) % 1.0
        band = np.where(band < 0.8, band / 0.8, (1 - band) / 0.2)
        tone = np.clip(0.72 - 0.42 * band**2 + 0.09 * fibres + rng.uniform(-0.12, 0.12), 0, 1)[..., None]
        out = np.where((plank == i)[..., None], dark + (light - dark) * tone, out)
    joint = np.minimum(across, 1 - across) * high / planks < 0.0012
    return np.where(joint[..., None], 0.45 * dark, out).astype(np.float32)


def tag_modules():
    """10 x 10 albedos of the printed sheet, row 0 at the top of the upright tag, one white module all round."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    black_square = cv2.aruco.generateImageMarker(dictionary, TAG_ID, 8, borderBits=1)
    sheet = np.full((10, 10), 255, np.uint8)
    sheet[1:9, 1:9] = black_square[::-1, ::-1]  # OpenCV draws these tags turned by 180° against the AprilTag library
    return np.where(sheet > 127, 0.78, 0.035).astype(np.float32)


def table_top():
    """The top with a hole for the sheet of paper, so that both lie exactly in z = 0."""
    (x0, x1), (y0, y1), h = TABLE["x"], TABLE["y"], PAPER_EDGE_M / 2
    outer = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]])
    inner = np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]])
    return quads([[outer[i], outer[(i + 1) % 4], inner[(i + 1) % 4], inner[i]] for i in range(4)]), inner


def real_parts():
    (x0, x1), (y0, y1), t = TABLE["x"], TABLE["y"], TABLE["thickness"]
    top, paper = table_top()
    wood, sheet = wood_texture(), np.repeat(tag_modules()[..., None], 3, -1)
    mean_wood = wood.mean((0, 1))
    sides = box((x0, y0, -t), (x1, y1, 0))
    sides = sides[~np.all(sides[:, :, 2] == 0, axis=1)]
    legs = np.concatenate(
        [box((x, y, FLOOR_Z), (x + 0.06, y + 0.06, -t)) for x in (x0 + 0.04, x1 - 0.10) for y in (y0 + 0.04, y1 - 0.10)]
    )
    far, near, ceiling = 3.6, -2.2, 1.75
    return [
        Part("table top", top, mean_wood, (top[..., :2] - [x0, y0]) / [x1 - x0, y1 - y0], wood),
        Part("paper", quads([paper]), sheet.mean((0, 1)), quads([paper])[..., :2] / PAPER_EDGE_M + 0.5, sheet, True),
        Part("table sides", sides, 0.8 * mean_wood),
        Part("table legs", legs, np.array([0.07, 0.05, 0.04])),
        Part(
            "blue box",
            box((-0.085, -0.065, 0), (0.085, 0.065, 0.21), 24, (-0.21, 0.36, 0)),
            np.array([0.06, 0.16, 0.48]),
        ),
        Part(
            "orange box",
            box((-0.11, -0.075, 0), (0.11, 0.075, 0.115), -17, (0.29, 0.35, 0)),
            np.array([0.72, 0.27, 0.04]),
        ),
        Part(
            "floor",
            quads([[[WALL_X, near, FLOOR_Z], [far, near, FLOOR_Z], [far, WALL_Y, FLOOR_Z], [WALL_X, WALL_Y, FLOOR_Z]]]),
            np.array([0.20, 0.19, 0.18]),
        ),
        Part(
            "wall behind",
            quads(
                [[[WALL_X, WALL_Y, FLOOR_Z], [far, WALL_Y, FLOOR_Z], [far, WALL_Y, ceiling], [WALL_X, WALL_Y, ceiling]]]
            ),
            np.array([0.50, 0.55, 0.52]),
        ),
        Part(
            "wall left",
            quads(
                [
                    [
                        [WALL_X, near, FLOOR_Z],
                        [WALL_X, WALL_Y, FLOOR_Z],
                        [WALL_X, WALL_Y, ceiling],
                        [WALL_X, near, ceiling],
                    ]
                ]
            ),
            np.array([0.60, 0.50, 0.33]),
        ),
    ]


def truth_mesh():
    """Vertices with normal and albedo, and triangles, for real_scene.ply: the paper by module, other textures by their mean."""
    rows, colors = [], []
    for part in real_parts():
        triangles, color = part.triangles, np.broadcast_to(part.albedo, (len(part.triangles), 3))
        if part.name == "paper":
            edge = np.linspace(-PAPER_EDGE_M / 2, PAPER_EDGE_M / 2, 11)
            cells = [
                [
                    [edge[i], edge[j], 0],
                    [edge[i + 1], edge[j], 0],
                    [edge[i + 1], edge[j + 1], 0],
                    [edge[i], edge[j + 1], 0],
                ]
                for j in range(10)
                for i in range(10)
            ]
            triangles, color = quads(cells), np.tile(np.repeat(tag_modules()[::-1].reshape(-1, 1), 3, 1), (2, 1))
        rows.append(triangles)
        colors.append(color)
    triangles, colors = np.concatenate(rows), np.concatenate(colors)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    per_corner = np.concatenate([triangles.reshape(-1, 3), np.repeat(normals, 3, 0), np.repeat(colors, 3, 0)], 1)
    vertices, index = np.unique(per_corner.astype("<f4"), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3).astype("<i4")


def looking_at(eye, target):
    """T_tag_camera of an OpenCV camera (x right, y down, z forward) that is held upright."""
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], -1), eye
    return T


def T_tag_camera(frame):
    """A slow quarter of an orbit: eased in azimuth, rising and coming nearer a little."""
    s = frame / (FRAMES - 1)
    eased = s * s * (3 - 2 * s)
    azimuth, elevation = np.radians(-112 + 42 * eased), np.radians(33 + 4 * np.sin(np.pi * s))
    target = np.array([0.035, 0.165, 0.055])
    distance = 0.98 - 0.06 * np.sin(np.pi * s)
    offset = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    return looking_at(target + distance * np.array(offset), target)


def T_tag_fisheye():
    """Beside the tag, looking up, tilted by 4° as nothing that is put on a table is quite level."""
    tilt = np.radians(4.0)
    T = np.eye(4)
    T[:3, :3] = about_z(-35) @ np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    T[:3, 3] = [0.215, -0.045, 0.04]
    return T


def T_tag_statue():
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = about_z(STATUE_TURN_DEGREES), STATUE_POSITION_M
    return T


def lights(bulb=BULB):
    """lights.json. A lamp that radiates evenly over its area A gives off pi A L per channel."""
    area = 4 * np.pi * bulb["radius"] ** 2
    normal = np.array(PANEL["normal"]) / np.linalg.norm(PANEL["normal"])
    panel_area = PANEL["size"][0] * PANEL["size"][1]
    power = lambda a, lamp: [round(np.pi * a * c, 6) for c in lamp["radiance"]]  # noqa: E731
    return {
        "lights": [
            {**bulb, "kind": "bulb", "area_m2": area, "power_W": power(area, bulb)},
            {
                **PANEL,
                "kind": "panel",
                "normal": normal.tolist(),
                "area_m2": panel_area,
                "power_W": power(panel_area, PANEL),
            },
        ],
        "environment": {"constant": ENVIRONMENT},
        "note": "emitted radiance is constant over each lamp; lamps reflect nothing; the panel shines from one side",
    }
