#!/usr/bin/python3
"""The Debian package: unpacked it serves its own recording, and has a manual page and completion.

    package_test.py BUILD_FOLDER
"""
import gzip
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request

from browser_page import free_port
from child_process import interrupt, start


def output(*command, **more):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300, **more)
    assert done.returncode == 0, f"{command}: exit code {done.returncode}\n{done.stdout}"
    return done.stdout


def check_serving(program, recording, folder):
    port = free_port()
    log = open(folder / "serve.log", "w+")
    serve = start([program, "serve", "--session", recording, "--listen", f"127.0.0.1:{port}"], stderr=log)
    try:
        for _ in range(120):
            time.sleep(1)
            assert serve.poll() is None, f"serve ended: {open(log.name).read()}"
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/healthz", timeout=5) as reply:
                    if json.load(reply)["frames"] > 0:
                        return
            except OSError:
                pass
        raise AssertionError(f"no picture within two minutes: {open(log.name).read()}")
    finally:
        interrupt(serve)


def check_help(program, usr):
    text = gzip.open(usr / "share/man/man1/lumigraft.1.gz", "rt").read().replace("\\-", "-")
    completion = (usr / "share/bash-completion/completions/lumigraft").read_text()
    commands = re.findall(r"^  (\w+)\s{2,}\w", output(program, "--help").split("Subcommands:")[1], re.M)
    assert "serve" in commands and "doctor" in commands, commands
    for command in commands:
        assert f".SS {command}\n" in text, f"{command} is not in the manual page"
        for option in re.findall(r"^  (?:-\w,)?(--[a-z-]+)", output(program, command, "--help"), re.M):
            assert option in text and option in completion, f"{command} {option} is not in manual page and completion"
    words = "COMP_WORDS=(lumigraft serve --backend v); COMP_CWORD=3; _lumigraft; echo ${COMPREPLY[*]}"
    assert output("bash", "-c", f"source {usr}/share/bash-completion/completions/lumigraft; {words}").strip() == "vulkan"


def main():
    build = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        output("cpack", "-G", "DEB", "--config", build / "CPackConfig.cmake", "-B", folder)
        package = next(folder.glob("lumigraft_*.deb"))
        control = output("dpkg-deb", "--info", package)
        for needed in ("libembree", "libopencv-core", "libcamera-ipa", "mesa-vulkan-drivers"):
            assert needed in control, f"{needed} is not in\n{control}"
        output("dpkg-deb", "--extract", package, folder / "root")
        usr = folder / "root/usr"
        program = usr / "bin/lumigraft"
        assert output(program, "--version").strip(), "no version"
        for helper in ("freenect", "libcamera", "oni"):
            assert os.access(usr / f"libexec/lumigraft/lumigraft_{helper}", os.X_OK), helper
        cameras = output(program, "devices")
        assert "No such file" not in cameras, f"a helper was not found: {cameras}"
        assert "ExecStart=/usr/bin/lumigraft serve" in (usr / "lib/systemd/system/lumigraft.service").read_text()
        screen = (usr / "lib/systemd/system/lumigraft-screen.service").read_text()
        policies = re.search(r"^BindReadOnlyPaths=/(usr/[^:]*):", screen, re.M)[1]
        assert (folder / "root" / policies).is_file(), policies
        check_help(program, usr)
        check_serving(program, usr / "share/lumigraft/recordings/tabletop", folder)
        if shutil.which("lintian"):
            said = output("lintian", "--fail-on", "error,warning", "--allow-root", package)
            assert not said.strip(), said
        else:
            print("without lintian the package is not checked by it")


if __name__ == "__main__":
    main()
