"""What a worker does: hashes of programs and sessions, and one part of the bench. Standard library alone: the module is
sent to the workers."""

import csv
import functools
import hashlib
import json
import os
import platform
import subprocess
import tempfile

CHUNK_BYTES = 1 << 20


def hash_file(path):
    digest = hashlib.sha256()
    with open(path, "rb") as f:
        while chunk := f.read(CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()


def hash_session(folder):
    """Of the names and contents of all files."""
    digest = hashlib.sha256()
    files = [os.path.join(at, name) for at, _, names in os.walk(folder, followlinks=True) for name in names]
    if not files:
        raise FileNotFoundError(f"{folder}: found no file, allowed: a session's folder")
    for path in sorted(files):
        digest.update(f"{os.path.relpath(path, folder)}\0{hash_file(path)}\n".encode())
    return digest.hexdigest()


@functools.lru_cache
def _hash_unchanged(path, _size, _time_ns):
    return hash_file(path)


def check_program(path, expected):
    """Machines may have other programs under the same path."""
    status = os.stat(path)
    if _hash_unchanged(path, status.st_size, status.st_mtime_ns) != expected:
        raise RuntimeError(f"{path} on {platform.node()} is not the program of this run")


def last_line(text):
    lines = text.strip().splitlines()
    return lines[-1] if lines else "no output"


def run_bench(program, arguments, timeout_s):
    """The rows of results.csv, and the machine."""
    with tempfile.TemporaryDirectory(prefix="lumigraft-fleet-") as out:
        # The bench ends with its worker: left alone it would lengthen the times of others.
        command = ["setpriv", "--pdeathsig", "KILL", program, "bench", *arguments, "--out", out]
        ended = subprocess.run(
            command,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
        )
        if ended.returncode < 0:
            raise RuntimeError(f"ended by signal {-ended.returncode}: {last_line(ended.stderr)}")
        if ended.returncode > 0:
            raise RuntimeError(f"exit code {ended.returncode}: {last_line(ended.stderr)}")
        with open(os.path.join(out, "results.csv"), encoding="utf-8", newline="") as f:
            rows = list(csv.DictReader(f))
        with open(os.path.join(out, "results.json"), encoding="utf-8") as f:
            machine = json.load(f)["machine"]
    return {"rows": rows, "machine": {"host": platform.node(), **machine}}


def run_parts(parts, timeout_s):
    """The same part by each version, one after the other on one machine, so that their costs can be compared. A failure
    of one is its result."""
    results = []
    for part in parts:
        try:
            check_program(part["program"], part["program_hash"])
            results.append(run_bench(part["program"], part["arguments"], timeout_s))
        except Exception as error:  # whatever it is, it is a row of the table and does not end the run
            results.append({"error": f"{type(error).__name__}: {error}"})
    return results
