"""A right arm that reaches over the table from its right edge: capsules, as parts of scene.py. Metres."""

import numpy as np

import scene as world

SKIN, SLEEVE = np.array([0.46, 0.27, 0.19]), np.array([0.05, 0.07, 0.12])
TURN_DEGREES = 78.0
SEGMENTS, RINGS = 20, 6  # around a capsule; along each of its caps


def capsule(a, b, radius_a, radius_b):
    """Triangles of a rounded cone, seen from outside counter-clockwise."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    along = (b - a) / np.linalg.norm(b - a)
    x = np.cross(along, [0, 0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0, 0])
    x /= np.linalg.norm(x)
    y = np.cross(along, x)
    centres = [a] * RINGS + [b] * RINGS
    radii = [radius_a] * RINGS + [radius_b] * RINGS
    angles = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    around = np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * y
    latitudes = np.concatenate([np.linspace(-np.pi / 2, 0, RINGS), np.linspace(0, np.pi / 2, RINGS)])
    rings = [c + r * (np.cos(t) * around + np.sin(t) * along) for c, r, t in zip(centres, radii, latitudes)]
    triangles = []
    for low, high in zip(rings, rings[1:]):
        for k in range(SEGMENTS):
            n = (k + 1) % SEGMENTS
            triangles += [[low[k], low[n], high[n]], [low[k], high[n], high[k]]]
    return np.array(triangles)


def chain(points, radii):
    return [capsule(points[i], points[i + 1], radii[i], radii[i + 1]) for i in range(len(points) - 1)]


def parts(wrist):
    """The arm with its wrist there, the hand half open and pointing to the left, thumb towards the camera."""
    palm, fingers = [], []
    for i, side in enumerate((-0.032, -0.011, 0.011, 0.032)):
        length = (0.9, 1.0, 0.95, 0.75)[i]
        knuckle = np.array([side, 0.085, 0.004])
        palm += chain([np.array([0.7 * side, 0.005, 0]), knuckle], [0.017, 0.014])
        middle = knuckle + length * np.array([0.15 * side, 0.042, -0.006])
        end = middle + length * np.array([0.05 * side, 0.034, -0.024])
        fingers += chain([knuckle, middle, end], [0.0115, 0.0095, 0.008])
    thumb = chain(
        [np.array([-0.022, 0.015, -0.006]), np.array([-0.055, 0.055, -0.016]), np.array([-0.052, 0.09, -0.026])],
        [0.017, 0.013, 0.010],
    )
    sleeve = chain([np.array([0.0, -0.03, 0.0]), np.array([0.10, -0.34, 0.05])], [0.036, 0.05])
    place = lambda triangles: np.concatenate(triangles) @ world.about_z(TURN_DEGREES).T + np.asarray(wrist)  # noqa: E731
    return [world.Part("hand", place(palm + fingers + thumb), SKIN), world.Part("sleeve", place(sleeve), SLEEVE)]
