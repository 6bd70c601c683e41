#!/usr/bin/env python3
"""A real Chromium opens the page of `lumigraft calibrate --listen`, which reads images of a board.

  calibrate_page_test.py PROGRAM

Checks that the page shows where corners were detected and what is missing, and the result or the reason for a failure.
"""
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest

import cv2
import numpy as np

from browser_page import Page, free_port
from child_process import interrupt, start

PROGRAM = os.path.abspath(sys.argv[1])
ROWS, COLUMNS, SIZE_M, SPACING_M = 3, 4, 0.05, 0.0125
WIDTH, HEIGHT, F = 320, 240, 262.5


def board_picture(pixels_per_m=4000):
    """The printed board with a margin of paper. OpenCV draws these tags upside down."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    draw = getattr(cv2.aruco, "generateImageMarker", None) or cv2.aruco.drawMarker
    edge, pitch = int(SIZE_M * pixels_per_m), int((SIZE_M + SPACING_M) * pixels_per_m)
    margin = int(SPACING_M * pixels_per_m)
    board = np.full((margin + ROWS * pitch, margin + COLUMNS * pitch), 235, np.uint8)
    for row in range(ROWS):
        for column in range(COLUMNS):
            tag = np.rot90(draw(dictionary, row * COLUMNS + column, edge), 2)
            y, x = margin + row * pitch, margin + column * pitch
            board[y:y + edge, x:x + edge] = np.where(tag > 0, 235, 20)
    return board, pixels_per_m


def seen_from(board, pixels_per_m, tilt, place_m):
    """Image of the board by a pinhole camera, rendered at four times the resolution and averaged."""
    r, _ = cv2.Rodrigues(np.array(tilt, float))
    k = np.array([[4 * F, 0, 2 * WIDTH], [0, 4 * F, 2 * HEIGHT], [0, 0, 1]])
    h, w = board.shape
    to_board = np.array([[1 / pixels_per_m, 0, -w / 2 / pixels_per_m], [0, 1 / pixels_per_m, -h / 2 / pixels_per_m], [0, 0, 1]])
    homography = k @ np.column_stack([r[:, 0], r[:, 1], place_m]) @ to_board
    large = cv2.warpPerspective(board, homography, (4 * WIDTH, 4 * HEIGHT), flags=cv2.INTER_AREA, borderValue=110)
    small = cv2.resize(cv2.GaussianBlur(large, (0, 0), 1.6), (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    noisy = small + np.random.default_rng(7).normal(0, 1.0, small.shape)
    return cv2.cvtColor(np.clip(noisy, 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR)


def session(folder, views, rounds=1):
    os.makedirs(os.path.join(folder, "color"))
    board = board_picture()
    rng = np.random.default_rng(3)
    with open(os.path.join(folder, "color.txt"), "w") as f:
        for i in range(views):
            x, y = 0.09 * (i % 3 - 1), 0.055 * (i // 3 % 3 - 1)
            cv2.imwrite(os.path.join(folder, f"color/{i:02}.png"), seen_from(*board, rng.uniform(-0.5, 0.5, 3), (x, y, 0.34 + 0.03 * (i % 4))))
        for i in range(rounds * views):
            f.write(f"{i} color/{i % views:02}.png\n")
    with open(os.path.join(folder, "session.toml"), "w") as f:
        f.write(f'format = 1\n[color]\nsource = "images:color.txt"\nwidth = {WIDTH}\nheight = {HEIGHT}\nfx = 300\nfy = 300\ncx = 160\n'
                'cy = 120\nexposure = 1\n[tag]\nid = 40\nsize_m = 0.16\n')
    with open(os.path.join(folder, "board.toml"), "w") as f:
        f.write(f"rows = {ROWS}\ncolumns = {COLUMNS}\nsize_m = {SIZE_M}\nspacing_m = {SPACING_M}\n")


class CalibratePageTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lumigraft-calibrate-page-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.page = Page(os.path.join(self.folder, "profile"))
        self.addCleanup(self.page.driver.quit)

    def calibrate(self, views, rounds=1):
        recorded = os.path.join(self.folder, "session")
        session(recorded, views, rounds)
        port = free_port()
        program = self.enterContext(start([PROGRAM, "calibrate", "--board", os.path.join(recorded, "board.toml"), recorded, "--out",
                                           os.path.join(self.folder, "calibration.toml"), "--listen", f"127.0.0.1:{port}"],
                                          stdout=subprocess.PIPE, text=True))
        self.addCleanup(program.kill)  # if a test fails before
        self.assertIn("guiding on", program.stdout.readline())
        self.page.open(port)
        return program

    def end(self, program, code):
        self.assertEqual(interrupt(program), code)

    def test_a_result_is_told(self):
        page = self.page
        program = self.calibrate(27)
        page.wait(lambda: page.text("doing") == "done", "the result")
        self.assertIn("residual", page.text("report"))
        self.assertEqual(page.text("verdict"), f"written to {self.folder}/calibration.toml")
        text = page.text("color.jpg")
        self.assertRegex(text, r"\d\d views, 15 needed; corners in \d+ % of the picture")
        cells = page.driver.execute_script("return ['seen', 'unseen'].map((c) => document.querySelectorAll('.map .' + c).length)")
        self.assertEqual(sum(cells), 48)
        self.assertGreater(cells[0], 24)
        self.end(program, 0)
        with open(os.path.join(self.folder, "calibration.toml"), "rb") as f:
            found = tomllib.load(f)["color"]
        self.assertAlmostEqual(found["fx"], F, delta=0.01 * F)

    def test_the_button_ends_it_once_there_are_views_enough(self):
        page = self.page
        program = self.calibrate(27, rounds=2000)  # not run to its end
        button = page.driver.find_element("id", "finish")

        def pressed_until_done():  # a press that is too early is rejected, and collection continues
            if button.is_enabled():
                button.click()
            return page.text("doing") == "done"

        page.wait(pressed_until_done, "the result")
        self.assertFalse(button.is_displayed())
        self.end(program, 0)
        self.assertTrue(os.path.exists(os.path.join(self.folder, "calibration.toml")))

    def test_a_refusal_is_told_with_its_reason(self):
        page = self.page
        program = self.calibrate(3)
        page.wait(lambda: page.text("doing") == "refused", "the refusal")
        self.assertIn("too few views: found 3 pictures", page.text("refusal"))
        self.end(program, 1)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "calibration.toml")))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
