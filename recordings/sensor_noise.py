"""What sensors make of true pictures: a colour camera with blur, shot and read noise; a structured-light depth camera."""

import cv2
import numpy as np

import render
import scene as world

BLUR_SIGMA_PX = 0.5
FULL_WELL_ELECTRONS = 14000  # at linear 1.0; with read noise 1.0 to 1.3 code values over most of the range
READ_NOISE = 0.0004  # of linear 1.0; 1.3 code values at black
PROJECTOR_BASELINE_M = 0.075  # along the camera's x: objects cast depth shadows to their left
NEAREST_M, FARTHEST_M, STEEPEST_DEGREES = 0.4, 4.5, 82.0


def srgb(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)


def color_picture(radiance, exposure, rng):
    """8-bit sRGB: blur by the lens, then noise of the sensor in linear light, then the curve and rounding."""
    x = np.clip(cv2.GaussianBlur(radiance.astype(np.float64), (5, 5), BLUR_SIGMA_PX) * exposure, 0, None)
    x += rng.standard_normal(x.shape) * np.sqrt(x / FULL_WELL_ELECTRONS + READ_NOISE**2)
    return np.round(255 * srgb(x)).astype(np.uint8)


def axial_sigma_m(z, theta):
    """Nguyen, Izadi and Lovell 2012, eq. 3 to 5: Kinect's noise along z, for distance z and angle of incidence."""
    steep = 0.0001 / np.sqrt(z) * theta**2 / (np.pi / 2 - theta) ** 2
    return 0.0012 + 0.0019 * (z - 0.4) ** 2 + np.where(theta > np.pi / 3, steep, 0)


def lateral_sigma_px(theta):
    """The same paper, eq. 2."""
    return 0.8 + 0.035 * theta / (np.pi / 2 - theta)


def depth_picture(built, T_tag_camera, rng):
    """Millimetres along the camera's z, 0 where there is no measurement. Returns it and the true hits it came from."""
    shape = (world.HEIGHT, world.WIDTH)
    v, u = np.mgrid[0 : shape[0], 0 : shape[1]].astype(float)
    eye, directions = render.camera_rays(T_tag_camera, u, v)
    truth = render.trace(built, eye, directions)
    cosine = -np.sum(truth["normal"] * directions, 0) / np.linalg.norm(directions, axis=0)
    theta = np.arccos(np.clip(cosine, 0, 1)).clip(0, np.radians(STEEPEST_DEGREES)).reshape(shape)

    # Lateral noise: at an edge a pixel may answer for its neighbour. Within a surface it is part of the axial noise.
    jitter = rng.standard_normal((2, *shape)) * lateral_sigma_px(theta)
    _, moved = render.camera_rays(T_tag_camera, u + jitter[0], v + jitter[1])
    other = render.trace(built, eye, moved)
    off_plane = np.abs(np.sum((other["point"] - truth["point"]) * truth["normal"], 0))
    crossed = off_plane > 0.01
    z = np.where(crossed, other["z"], truth["z"]).reshape(shape)
    point = np.where(crossed, other["point"], truth["point"])

    projector = T_tag_camera[:3, 3] + PROJECTOR_BASELINE_M * T_tag_camera[:3, 0]
    lit = render.sees(built, point, projector).reshape(shape)
    z_noisy = z + rng.standard_normal(shape) * axial_sigma_m(np.maximum(z, NEAREST_M), theta)
    measured = lit & (z > NEAREST_M) & (z < FARTHEST_M) & (theta < np.radians(STEEPEST_DEGREES))
    return np.where(measured, np.round(1000 * z_noisy), 0).astype(np.uint16), truth
