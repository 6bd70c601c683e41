#!/usr/bin/env python3
"""three.js in headless Chromium on sessions with truth: a web page that has lumigraft's pose, depth and light.

  three_js.py SESSION... --program lumigraft --measure picture_error --three FOLDER --out DIR

FOLDER is the npm package three. Image-based light from the environment without lamps, a shadow map of the strongest
lamp on the depth picture's surface, the other lamps without shadows. Writes DIR/three_js.csv, and a picture each.
"""

import base64
import functools
import http.server
import json
import os
import tempfile
import threading

import numpy as np
from selenium import webdriver
from selenium.webdriver.support.wait import WebDriverWait

import session_files as files
from session_files import cv2

METHOD, SETTING = "three.js", "shadow-map"
ENVIRONMENT = (64, 32)
WARM_UP, FRAMES = 2, 8
MOST_STEP = 0.03  # between depths of neighbours that are one surface, relative
UP = np.array([0, 0, 1.0])


def sh_basis(d):
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    return np.stack(
        [
            0.28209479 * np.ones_like(x),
            0.48860251 * y,
            0.48860251 * z,
            0.48860251 * x,
            1.09254843 * x * y,
            1.09254843 * y * z,
            0.31539157 * (3 * z * z - 1),
            1.09254843 * x * z,
            0.54627422 * (x * x - y * y),
        ],
        -1,
    )


def environment_of(sh, exposure):
    """Latitude-longitude in the layout of three.js, whose poles are on the y axis."""
    width, height = ENVIRONMENT
    longitude = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    latitude, longitude = np.meshgrid(latitude, longitude, indexing="ij")
    d = np.stack([np.cos(latitude) * np.cos(longitude), np.sin(latitude), np.cos(latitude) * np.sin(longitude)], -1)
    radiance = np.maximum(sh_basis(d) @ sh, 0) * exposure
    return {
        "width": width,
        "height": height,
        "rgba": np.concatenate([radiance, np.ones((height, width, 1))], -1).round(6).ravel().tolist(),
    }


def sh_irradiance(sh, normal):
    band = np.array([np.pi] + [2 * np.pi / 3] * 3 + [np.pi / 4] * 5)
    return np.maximum((sh_basis(normal) * band) @ sh, 0)


def lamps_of(lights, exposure, target, reach_m):
    """Lamps with known distance at their places, the others far away; `E` is the irradiance on the ground at the
    target."""
    lamps = []
    for light in lights:
        if light.get("position"):
            position, intensity = np.array(light["position"]), np.array(light["intensity"])
            away = target - position
            if light.get("normal"):
                intensity = intensity * max(0.0, away @ np.array(light["normal"]) / np.linalg.norm(away))
        else:
            far_m = 100.0
            position = target + far_m * np.array(light["direction"])
            intensity = np.array(light["irradiance"]) * far_m**2
            away = target - position
        distance = float(np.linalg.norm(away))
        lamps.append(
            {
                "position": position.tolist(),
                "intensity": (intensity * exposure).tolist(),
                "strongest": False,
                "E": intensity / distance**2 * max(0.0, float(-away @ UP) / distance),
                "target": target.tolist(),
                "half_angle": float(min(1.4, np.arctan2(reach_m, distance))),
                "near": max(0.1, distance - reach_m),
                "far": distance + reach_m,
            }
        )
    if lamps:
        max(lamps, key=lambda lamp: lamp["E"].sum())["strongest"] = True
    return lamps


def surface_of(depth_m, K, T_tag_camera):
    """A mesh of the depth picture in the tag's frame, torn where depth jumps."""
    height, width = depth_m.shape
    v, u = np.mgrid[:height, :width]
    points = np.stack([(u - K[0, 2]) / K[0, 0] * depth_m, (v - K[1, 2]) / K[1, 1] * depth_m, depth_m], -1)
    points = points @ T_tag_camera[:3, :3].T + T_tag_camera[:3, 3]
    index = np.arange(height * width).reshape(height, width)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    triangles = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    z = depth_m.ravel()[triangles]
    whole = (z.min(1) > 0) & (z.max(1) - z.min(1) < MOST_STEP * z.min(1))
    return points.reshape(-1, 3), triangles[whole]


def projection_of(session):
    """Of OpenGL's clip space; pixel centres are at whole numbers."""
    K, color = files.camera_matrix(session), session["toml"]["color"]
    width, height, near, far = color["width"], color["height"], 0.05, 50.0
    return [
        2 * K[0, 0] / width,
        0,
        1 - 2 * (K[0, 2] + 0.5) / width,
        0,
        0,
        2 * K[1, 1] / height,
        2 * (K[1, 2] + 0.5) / height - 1,
        0,
        0,
        0,
        -(far + near) / (far - near),
        -2 * far * near / (far - near),
        0,
        0,
        -1,
        0,
    ]


def objects_of(session):
    objects = []
    for item in files.read_toml(session["folder"], "exhibit.toml")["object"]:
        material = item.get("material")
        if material:
            material = {"base_color": [1, 1, 1], "metallic": 1.0, "roughness": 1.0, "specular": 1.0, **material}
        objects.append(
            {
                "model": item["model"],
                "position": item.get("position_m", [0, 0, 0]),
                "rotation": item.get("rotation_wxyz", [1, 0, 0, 0]),
                "scale": item.get("scale", 1.0),
                "up": item.get("up", "y" if item["model"].endswith((".glb", ".gltf")) else "z"),
                "material": material,
            }
        )
    return objects


def shadow_of(lamps, sh, color):
    """Colour and opacity of the shadow catcher, such that a surface of the picture's mean colour that faces up loses
    the strongest lamp's part of each channel."""
    total = sh_irradiance(sh, UP) + sum(lamp["E"] for lamp in lamps)
    lost = sum((lamp["E"] for lamp in lamps if lamp["strongest"]), np.zeros(3)) / total
    opacity = max(float(lost.max()), 1e-6)
    srgb = color.reshape(-1, 3) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return {"shadow_color": (linear.mean(0) * (1 - lost / opacity)).tolist(), "shadow_opacity": opacity}


def describe(session, frame, index, reach_m):
    """The content of scene.json."""
    exposure = session["toml"]["color"]["exposure"]
    T_tag_camera, sh = np.array(frame["T_tag_camera"]), np.array(frame["sh"])
    objects = objects_of(session)
    target = np.mean([item["position"] for item in objects], 0)
    lamps = lamps_of(frame["lights"], exposure, target, reach_m)
    color = cv2.imread(files.listed(session, "color")[index])[..., ::-1]
    shadow = shadow_of(lamps, sh, color)
    positions, triangles = surface_of(files.read_depth(session, index), files.camera_matrix(session), T_tag_camera)
    for lamp in lamps:
        del lamp["E"]
    return {
        "width": session["toml"]["color"]["width"],
        "height": session["toml"]["color"]["height"],
        "camera": {
            "T_tag_camera": (T_tag_camera @ np.diag([1.0, -1, -1, 1])).ravel().tolist(),
            "projection": projection_of(session),
        },
        "environment": environment_of(sh, exposure),
        "lamps": lamps,
        "objects": objects,
        "surface": {
            "positions": positions.round(5).ravel().tolist(),
            "triangles": triangles.ravel().tolist(),
            **shadow,
        },
    }


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def draw(folder):
    """The picture of the page in a folder as R G B, the cost of a frame, and what drew it."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        options = webdriver.ChromeOptions()
        for word in (
            "--headless=new",
            "--no-sandbox",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--force-color-profile=srgb",
        ):
            options.add_argument(word)
        with webdriver.Chrome(options=options) as browser:
            browser.set_script_timeout(300)
            browser.get(f"http://127.0.0.1:{server.server_port}/three_js.html")
            WebDriverWait(browser, 120).until(lambda _: browser.execute_script("return window.ready === true"))
            png = base64.b64decode(browser.execute_script("return window.picture()").split(",")[1])
            browser.execute_script(f"return window.frames({WARM_UP})")
            before_s = files.cpu_s(browser.service.process.pid)
            wall_ms = browser.execute_script(f"return window.frames({FRAMES})")
            cpu_ms = (files.cpu_s(browser.service.process.pid) - before_s) * 1e3 / FRAMES
            device = browser.execute_script("return window.device()")
        server.shutdown()
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)[..., ::-1], cpu_ms, wall_ms, device


def run(arguments, session):
    index = files.scored_frame(session)
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "replay")
        words = ["--oracle", arguments.oracle] if arguments.oracle else []
        frame = files.replay(arguments.program, session, out, index + 1, *words)[index]
        scene = describe(session, frame, index, arguments.reach_m)
        with open(os.path.join(folder, "scene.json"), "w", encoding="utf-8") as f:
            json.dump(scene, f)
        os.symlink(os.path.abspath(arguments.three), os.path.join(folder, "three"))
        os.symlink(files.listed(session, "color")[index], os.path.join(folder, "color.png"))
        os.symlink(
            os.path.join(os.path.dirname(os.path.abspath(__file__)), "three_js.html"),
            os.path.join(folder, "three_js.html"),
        )
        for item in scene["objects"]:
            path = os.path.join(folder, item["model"])
            os.makedirs(os.path.dirname(path), exist_ok=True)
            if not os.path.exists(path):
                os.symlink(os.path.join(session["folder"], item["model"]), path)
        picture, cpu_ms, wall_ms, device = draw(folder)
    row = {
        **files.measured(arguments.measure, session, index, picture),
        "method": METHOD,
        "setting": SETTING,
        "oracle": arguments.oracle.replace(",", "+") or "none",
        "cpu_ms": round(cpu_ms, 1),
        "wall_ms": round(wall_ms, 1),
    }
    cv2.imwrite(os.path.join(arguments.out, f"{row['session']}_three_js.png"), picture[..., ::-1])
    print(
        f"{row['session']}: relight_error {row['relight_error']:.3f}, object_error {row['object_error']:.3f}, "
        f"{cpu_ms:.0f} ms CPU, {wall_ms:.0f} ms wall; {device}",
        flush=True,
    )
    return row


def main():
    parser = files.argument_parser(__doc__, "--program", "--measure", "--three")
    parser.add_argument("--oracle", default=files.TRUE_ROOM, help="as of lumigraft replay; '' for the estimated room")
    parser.add_argument(
        "--reach-m", type=float, default=0.8, help="radius around the objects that the shadow map covers"
    )
    arguments = parser.parse_args()
    files.write_table(arguments, "three_js.csv", files.COLUMNS, lambda session: [run(arguments, session)])


if __name__ == "__main__":
    main()
