#!/usr/bin/env python3
"""The exhibit's own screen as configs/lumigraft-screen.service starts it, drawn without a display.

    screen_test.py PROGRAM RECORDING CONFIGS [SCREENSHOT.png]

Runs the unit's own command, as an unprivileged user without capabilities as there, and checks that the service's
picture fills the screen. Needs cage, Xwayland, grim and Chromium. cage draws in software on two outputs: a window of one
output's size would be shown as it is, which grim does not see.
"""
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request

import cv2
import numpy as np

from browser_page import WAIT_S, free_port
from child_process import interrupt, start
from still_session import still_session

PROGRAM, RECORDING, CONFIGS = (os.path.abspath(p) for p in sys.argv[1:4])
NEEDED = ("/usr/bin/cage", "/usr/bin/chromium", "/usr/bin/Xwayland", "/usr/bin/grim")
NOBODY = 65534
MOST_DIFFERENCE = 12  # pixel values: H.264, and two ways to scale


def wait(condition, what):
    end = time.monotonic() + WAIT_S
    while time.monotonic() < end:
        if (value := condition()) is not None:
            return value
        time.sleep(0.3)
    raise AssertionError(f"waited {WAIT_S} s for {what}")


def snapshot(port):
    """The newest picture of the service; None while there is none."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/snapshot.jpg", timeout=5) as reply:
            return cv2.imdecode(np.frombuffer(reply.read(), np.uint8), cv2.IMREAD_COLOR)
    except OSError:
        return None


def unit_command(folder, port):
    """What the unit starts, with this folder and port; without a GPU."""
    with open(os.path.join(CONFIGS, "lumigraft-screen.service")) as f:
        unit = f.read().replace("\\\n", " ")
    command = re.search(r"^ExecStart=(.*)$", unit, re.M)[1]
    for of_the_unit, here in (("/run/lumigraft-screen", folder), ("127.0.0.1:8080", f"127.0.0.1:{port}"), ("/usr/bin/chromium", "/usr/bin/chromium --disable-gpu")):
        assert of_the_unit in command, f"{of_the_unit} is not in {command}"
        command = command.replace(of_the_unit, here)
    with open(os.path.join(CONFIGS, "screen_policies.json")) as f:
        assert json.load(f)["URLAllowlist"] == ["http://127.0.0.1:8080"], "the page that the unit opens is not allowed"
    return shlex.split(command)


def screen_picture(folder):
    """What the screen shows; None while there is no screen."""
    done = subprocess.run(["/usr/bin/grim", "-"], capture_output=True, timeout=60,
                          env={"XDG_RUNTIME_DIR": folder, "WAYLAND_DISPLAY": "wayland-0"})
    return cv2.imdecode(np.frombuffer(done.stdout, np.uint8), cv2.IMREAD_COLOR) if done.returncode == 0 else None


def fills_the_screen(screen, picture):
    """Whether the screen shows this picture as high as itself, in its middle, and black beside it."""
    height, width = screen.shape[:2]
    wide = round(height * picture.shape[1] / picture.shape[0])
    left = (width - wide) // 2
    wanted = np.zeros(screen.shape)
    wanted[:, left:left + wide] = cv2.resize(picture, (wide, height), interpolation=cv2.INTER_LINEAR)
    difference = np.abs(screen - wanted).mean(-1)
    return difference[:, left + 2:left + wide - 2].mean() < MOST_DIFFERENCE and difference[:, :left - 2].max(initial=0) < 1


def main():
    missing = [path for path in NEEDED if not os.path.exists(path)]
    if missing:
        return print("skipped: the screen needs", *missing)
    if shutil.which("systemd-analyze"):
        subprocess.run(["systemd-analyze", "verify", os.path.join(CONFIGS, "lumigraft-screen.service")], check=True)
    with tempfile.TemporaryDirectory(prefix="lumigraft-screen-") as folder:
        os.chmod(folder, 0o755)
        port = free_port()
        service = start([PROGRAM, "serve", "--session", still_session(RECORDING, folder), "--listen", f"127.0.0.1:{port}",
                         "--set", "plan.method=rays", "--set", "plan.trace_scale=8"])
        wait(lambda: snapshot(port), "the service's first picture")
        own = os.path.join(folder, "run")
        os.mkdir(own, 0o700)
        command = unit_command(own, port)
        if os.geteuid() == 0:
            os.chown(own, NOBODY, NOBODY)
            command = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "--no-new-privs", "--bounding-set=-all", *command]
        environment = {"PATH": os.environ["PATH"], "HOME": own, "WLR_BACKENDS": "headless", "WLR_HEADLESS_OUTPUTS": "2",
                       "WLR_LIBINPUT_NO_DEVICES": "1", "WLR_RENDERER": "pixman"}
        with open(os.path.join(folder, "screen.log"), "w+") as log:
            screen = start(command, env=environment, stdout=log, stderr=log, start_new_session=True)
            try:

                def shown():
                    assert screen.poll() is None, f"the screen ended: {open(log.name).read()}"
                    seen, picture = screen_picture(own), snapshot(port)
                    return seen if seen is not None and picture is not None and fills_the_screen(seen, picture) else None

                seen = wait(shown, "the picture to fill the screen")
                print("the screen shows the picture,", "x".join(str(n) for n in seen.shape[1::-1]))
                if len(sys.argv) > 4:
                    cv2.imwrite(sys.argv[4], seen)
            finally:
                os.killpg(screen.pid, 9)
                screen.wait()
        assert interrupt(service) == 0


if __name__ == "__main__":
    main()
