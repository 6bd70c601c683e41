#!/usr/bin/env python3
"""Poses from the tag alone, on sessions with true poses: OpenCV's aruco, AprilTag's library, and lumigraft.

  tag_pose.py SESSION... --program lumigraft --out DIR

Every picture by itself, but for lumigraft, which also uses depth and earlier pictures. Writes DIR/tag_pose.csv: the
error of the camera's place in mm and of its direction in degrees, median and 95 % over the pictures with a true pose.
"""

import os
import tempfile
import time

import numpy as np
import pupil_apriltags

import session_files as files
from session_files import cv2

COLUMNS = [
    "session",
    "method",
    "pictures",
    "found",
    "position_mm",
    "position_mm_95",
    "angle_deg",
    "angle_deg_95",
    "cpu_ms",
]
FRAMES = 24
CORNERS = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])  # in the order of SOLVEPNP_IPPE_SQUARE
TURN_Z = np.diag([-1.0, -1, 1, 1])  # OpenCV's tags of AprilTag's families stand on their heads
TURN_X = np.diag([1.0, -1, -1])  # AprilTag's frame of the tag is turned about x
PIXEL_CENTRE = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])  # of AprilTag, also in OpenCV; of sessions 0


def homogeneous(R, t):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, np.ravel(t)
    return T


class Aruco:
    name = "OpenCV aruco"

    def __init__(self, session, refine):
        tag = session["toml"]["tag"]
        parameters = cv2.aruco.DetectorParameters()
        if refine:
            parameters.cornerRefinementMethod = getattr(cv2.aruco, refine)
            self.name += ", " + {"CORNER_REFINE_SUBPIX": "subpixel", "CORNER_REFINE_APRILTAG": "AprilTag edges"}[refine]
        dictionary = cv2.aruco.getPredefinedDictionary(
            getattr(cv2.aruco, "DICT_APRILTAG_" + tag["family"].removeprefix("tag").upper())
        )
        self.detector = cv2.aruco.ArucoDetector(dictionary, parameters)
        self.id, self.K = tag["id"], files.camera_matrix(session)
        if refine == "CORNER_REFINE_APRILTAG":
            self.K = self.K + PIXEL_CENTRE
        self.points = (CORNERS * tag["size_m"] / 2).astype(np.float64)

    def locate(self, grey):
        corners, ids, _ = self.detector.detectMarkers(grey)
        for found, number in zip(corners, [] if ids is None else ids.ravel()):
            if number == self.id:
                ok, r, t = cv2.solvePnP(
                    self.points, found.reshape(4, 2).astype(np.float64), self.K, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
                )
                return TURN_Z @ np.linalg.inv(homogeneous(cv2.Rodrigues(r)[0], t)) if ok else None
        return None


class AprilTag:
    name = "AprilTag library"

    def __init__(self, session):
        self.tag, self.K = session["toml"]["tag"], files.camera_matrix(session) + PIXEL_CENTRE
        self.detector = pupil_apriltags.Detector(families=self.tag["family"], quad_decimate=1.0)

    def locate(self, grey):
        K = self.K
        for found in self.detector.detect(grey, True, (K[0, 0], K[1, 1], K[0, 2], K[1, 2]), self.tag["size_m"]):
            if found.tag_id == self.tag["id"]:
                return np.linalg.inv(homogeneous(found.pose_R @ TURN_X, found.pose_t))
        return None


def error_of(T, truth):
    """mm and degrees."""
    R = T[:3, :3].T @ truth[:3, :3]
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return 1e3 * np.linalg.norm(T[:3, 3] - truth[:3, 3]), np.degrees(np.arctan2(sine, (np.trace(R) - 1) / 2))


def row_of(session, method, poses, truths, cpu_ms):
    errors = np.array([error_of(T, truth) for T, truth in zip(poses, truths) if T is not None]).reshape(-1, 2)
    row = {
        "session": session["toml"]["name"],
        "method": method,
        "pictures": len(truths),
        "found": len(errors),
        "cpu_ms": round(cpu_ms, 2),
    }
    for i, name in enumerate(("position_mm", "angle_deg")):
        row[name] = round(float(np.median(errors[:, i])), 4) if len(errors) else ""
        row[name + "_95"] = round(float(np.quantile(errors[:, i], 0.95)), 4) if len(errors) else ""
    print(*(f"{key} {value}" for key, value in row.items()), sep=", ", flush=True)
    return row


def rows_of(session, program):
    paths = files.listed(session, "color")
    true = {i: files.true_pose(session, i) for i in range(min(FRAMES, len(paths)))}
    chosen = [i for i, T in true.items() if T is not None]
    truths = [true[i] for i in chosen]
    pictures = [cv2.imread(paths[i], cv2.IMREAD_GRAYSCALE) for i in chosen]
    for method in (
        Aruco(session, None),
        Aruco(session, "CORNER_REFINE_SUBPIX"),
        Aruco(session, "CORNER_REFINE_APRILTAG"),
        AprilTag(session),
    ):
        method.locate(pictures[0])  # what is made once
        start = time.process_time()
        poses = [method.locate(grey) for grey in pictures]
        yield row_of(session, method.name, poses, truths, 1e3 * (time.process_time() - start) / len(pictures))
    with tempfile.TemporaryDirectory() as folder:  # with quick settings: only the poses are read
        frames = files.replay(
            program,
            session,
            folder,
            chosen[-1] + 1,
            "--set",
            "plan.trace_scale=8",
            "--set",
            "plan.rays=8",
            "--oracle",
            "light,albedo",
        )
    poses = [frames[i]["T_tag_camera"] for i in chosen]
    cpu_ms = float(np.mean([frames[i]["stage_cpu_ms"]["pose"] for i in chosen]))
    yield row_of(session, "lumigraft", [None if T is None else np.array(T) for T in poses], truths, cpu_ms)


def main():
    arguments = files.argument_parser(__doc__, "--program").parse_args()
    cv2.setNumThreads(1)
    files.write_table(arguments, "tag_pose.csv", COLUMNS, lambda session: rows_of(session, arguments.program))
    print(files.machine())


if __name__ == "__main__":
    main()
