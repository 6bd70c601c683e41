"""Mitsuba 3: the parts of scene.py as a scene, path traced without a limit on bounces."""

import os
import glob

import mitsuba as mi
import numpy as np

import scene as world


def choose_variant():
    """Vectorised on the processor. DRJIT_LIBLLVM_PATH wins; else the newest LLVM that lies where Debian puts it."""
    found = sorted(glob.glob("/usr/lib/*/libLLVM*.so*"))
    if "DRJIT_LIBLLVM_PATH" not in os.environ and found:
        os.environ["DRJIT_LIBLLVM_PATH"] = found[-1]
    mi.set_variant("llvm_ad_rgb")


def mesh(name, vertices, triangles, bsdf, normals=None, uv=None):
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    shape = mi.Mesh(
        name,
        len(vertices),
        len(triangles),
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=uv is not None,
        props=properties,
    )
    values = mi.traverse(shape)
    values["vertex_positions"] = np.ravel(vertices).astype(np.float32)
    values["faces"] = np.ravel(triangles).astype(np.uint32)
    if normals is not None:
        values["vertex_normals"] = np.ravel(normals).astype(np.float32)
    if uv is not None:
        values["vertex_texcoords"] = np.ravel(uv).astype(np.float32)
    values.update()
    return shape


def lambert(albedo):
    return {"type": "twosided", "inner": {"type": "diffuse", "reflectance": albedo}}


def rgb(values):
    return {"type": "rgb", "value": [float(v) for v in values]}


def texture(part):
    picture = mi.Bitmap(np.ascontiguousarray(part.texture[::-1] if part.nearest else part.texture))
    return {
        "type": "bitmap",
        "bitmap": picture,
        "raw": True,
        "filter_type": "nearest" if part.nearest else "bilinear",
        "wrap_mode": "clamp",
    }


def build(statue=None, bulb=world.BULB, visitors=()):
    """The real scene, with the lamp at its place of the moment and further parts that come and go; with `statue`
    (vertices, normals, triangles in the tag frame) the augmented one."""
    black = {"type": "diffuse", "reflectance": rgb([0, 0, 0])}
    panel = world.PANEL
    centre, normal = np.array(panel["centre"]), np.array(panel["normal"])
    stand = mi.ScalarTransform4f().look_at(origin=centre.tolist(), target=(centre + normal).tolist(), up=[0, 0, 1])
    out = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": 5},
        "bulb": {
            "type": "sphere",
            "center": bulb["centre"],
            "radius": bulb["radius"],
            "bsdf": black,
            "emitter": {"type": "area", "radiance": rgb(bulb["radiance"])},
        },
        "panel": {
            "type": "rectangle",
            "to_world": stand @ mi.ScalarTransform4f().scale([s / 2 for s in panel["size"]] + [1]),
            "bsdf": black,
            "emitter": {"type": "area", "radiance": rgb(panel["radiance"])},
        },
        "environment": {"type": "constant", "radiance": rgb(world.ENVIRONMENT), "sampling_weight": 0.03},
    }
    for i, part in enumerate([*world.real_parts(), *visitors]):
        albedo = rgb(part.albedo) if part.texture is None else texture(part)
        index = np.arange(3 * len(part.triangles)).reshape(-1, 3)
        out[f"part{i}"] = mesh(part.name, part.triangles, index, lambert(albedo), uv=part.uv)
    if statue:
        vertices, normals, triangles = statue
        out["statue"] = mesh("statue", vertices, triangles, lambert(rgb(world.STATUE_COLOR)), normals=normals)
    return mi.load_dict(out)


def sensor(T_tag_camera, samples):
    to_world = T_tag_camera @ np.diag([-1.0, -1.0, 1.0, 1.0])  # Mitsuba's camera has x to the left and y up
    return mi.load_dict(
        {
            "type": "perspective",
            "fov_axis": "x",
            "fov": float(np.degrees(2 * np.arctan(world.WIDTH / 2 / world.FOCAL))),
            "near_clip": 0.01,
            "far_clip": 100.0,
            "to_world": mi.ScalarTransform4f(to_world.tolist()),
            "film": {
                "type": "hdrfilm",
                "width": world.WIDTH,
                "height": world.HEIGHT,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "multijitter", "sample_count": samples},
        }
    )


def render_halves(built, T_tag_camera, side, seed):
    """Two independent pictures of side² samples a pixel. The same seed in two scenes draws the same numbers, so paths
    that never meet the statue are the same in both and their noise drops out of the difference."""
    camera = sensor(T_tag_camera, side * side)
    return [np.array(mi.render(built, sensor=camera, spp=side * side, seed=2 * seed + half)) for half in (0, 1)]


def render_fisheye(built, side, seed):
    """One picture of side² samples a pixel: r = f theta, by handing the integrator our own rays; 0 outside the view."""
    size, samples, T = world.FISHEYE_SIZE, side * side, world.T_tag_fisheye()
    sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
    sampler.set_samples_per_wavefront(samples)
    sampler.seed(seed, size * size * samples)
    jitter = np.array(sampler.next_2d()).reshape(2, size, size, samples) - np.float32(0.5)
    v, u = np.mgrid[0:size, 0:size].astype(np.float32) - np.float32((size - 1) / 2)
    x, y = u[..., None] + jitter[0], v[..., None] + jitter[1]
    r = np.hypot(x, y)
    theta = r / np.float32(world.FISHEYE_FOCAL)
    inside = theta <= np.radians(world.FISHEYE_FOV_DEGREES / 2)
    s = np.sin(theta) / np.maximum(r, np.float32(1e-6))
    d = T[:3, :3].astype(np.float32) @ np.stack([s * x, s * y, np.cos(theta)]).reshape(3, -1)
    ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(*(float(c) for c in T[:3, 3])), mi.Vector3f(d)))
    radiance, _, _ = built.integrator().sample(built, sampler, ray)
    return (np.array(radiance).reshape(3, size, size, samples) * inside).mean(-1).transpose(1, 2, 0)


def camera_rays(T_tag_camera, u, v):
    """Origin and directions (unit z in the camera) through pixel coordinates, centres at integers."""
    d = np.stack(
        [(u - (world.WIDTH - 1) / 2) / world.FOCAL, (v - (world.HEIGHT - 1) / 2) / world.FOCAL, np.ones_like(u)]
    )
    return T_tag_camera[:3, 3], T_tag_camera[:3, :3] @ d.reshape(3, -1)


def trace(built, origin, directions):
    """First hits along directions of unit camera z: depth z, and point, normal and albedo in the tag frame (3 x n)."""
    lengths = np.linalg.norm(directions, axis=0)
    unit = directions / lengths
    ray = mi.Ray3f(mi.Point3f(*(float(c) for c in origin)), mi.Vector3f(unit.astype(np.float32)))
    hit = built.ray_intersect(ray)
    valid, normal = np.array(hit.is_valid()), np.array(hit.n)
    normal *= np.where(np.sum(normal * unit, 0) > 0, -1, 1)
    return {
        "z": np.where(valid, np.array(hit.t) / lengths, 0),
        "point": np.array(hit.p),
        "normal": normal,
        "albedo": np.array(hit.bsdf().eval_diffuse_reflectance(hit, hit.is_valid())),
    }


def sees(built, points, eye):
    """Whether the eye sees each point (3 x n), but for a millimetre."""
    d = points - np.asarray(eye)[:, None]
    ray = mi.Ray3f(mi.Point3f(*(float(c) for c in eye)), mi.Vector3f(d.astype(np.float32)))
    ray.maxt = mi.Float(0.998)
    return ~np.array(built.ray_test(ray))


def coverage(built, T_tag_camera, grid=4):
    """What part of each pixel the statue covers, by grid x grid rays."""
    target = [s for s in built.shapes() if s.id() == "statue"]
    v, u = np.mgrid[0 : world.HEIGHT, 0 : world.WIDTH].astype(float)
    total = np.zeros((world.HEIGHT, world.WIDTH))
    for i in range(grid * grid):
        du, dv = (i % grid + 0.5) / grid - 0.5, (i // grid + 0.5) / grid - 0.5
        origin, d = camera_rays(T_tag_camera, u + du, v + dv)
        ray = mi.Ray3f(mi.Point3f(*(float(c) for c in origin)), mi.Vector3f(d.astype(np.float32)))
        found = built.ray_intersect_preliminary(ray)
        total += np.array(found.is_valid() & (found.shape == mi.ShapePtr(target[0]))).reshape(total.shape)
    return total / grid**2
