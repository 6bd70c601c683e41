#!/usr/bin/env python3
"""Runs `lumigraft bench` on many sessions over many machines, and compares two versions.

  fleet.py SESSION... --program BEFORE [--program AFTER] --out DIR      @FILE: sessions of a file, one a line

Writes DIR/results.parquet and DIR/report.html. Finished parts are kept in DIR/parts and are not run again.
"""

import argparse
import os
import sys

import dask.distributed

import part_run
import report
import results
from part_store import PartStore

VERSIONS = ("before", "after")


def parse():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, fromfile_prefix_chars="@"
    )
    parser.add_argument("sessions", nargs="+", metavar="SESSION", help="folder of a session with truth")
    parser.add_argument("--program", action="append", required=True, help="lumigraft; twice: before and after")
    parser.add_argument("--out", required=True)
    parser.add_argument("--scheduler", help="ADDRESS of a Dask scheduler; without: workers on this machine")
    parser.add_argument("--workers", type=int, default=1, help="on this machine; more lengthen each other's times")
    parser.add_argument("--shards", type=int, default=1, help="parts that the settings of a session are divided into")
    parser.add_argument("--timeout-s", type=float, default=3600, help="of one part")
    for option in ("methods", "settings", "oracle"):
        parser.add_argument("--" + option, help="as for lumigraft bench")
    arguments = parser.parse_args()
    if len(arguments.program) > len(VERSIONS):
        parser.error(f"--program: found {len(arguments.program)}, allowed: one or two")
    for option in ("workers", "shards", "timeout_s"):
        if getattr(arguments, option) <= 0:
            parser.error(f"--{option.replace('_', '-')}: found {getattr(arguments, option)}, allowed: more than 0")
    return arguments


def connect(arguments):
    if arguments.scheduler:
        client = dask.distributed.Client(arguments.scheduler)
    else:
        cluster = dask.distributed.LocalCluster(
            n_workers=arguments.workers, threads_per_worker=1, dashboard_address=None
        )
        client = dask.distributed.Client(cluster)
    client.upload_file(part_run.__file__)
    return client


def hash_sessions(client, folders):
    """By folder: the hash, or the exception."""
    futures = {folder: client.submit(part_run.hash_session, folder, pure=False) for folder in folders}
    dask.distributed.wait(list(futures.values()))
    return {folder: future.exception() or future.result() for folder, future in futures.items()}


def parts_of(arguments, folder, session_hash, program_hashes):
    """For each shard: the part by each version."""
    words = ["--charts", "error-time"]
    for option in ("methods", "settings", "oracle"):
        if getattr(arguments, option):
            words += ["--" + option, getattr(arguments, option)]
    for number in range(1, arguments.shards + 1):
        choice = [*words, "--shard", f"{number}/{arguments.shards}"] if arguments.shards > 1 else words
        yield [
            {
                "version": version,
                "program": program,
                "program_hash": program_hash,
                "folder": folder,
                "session_hash": session_hash,
                "choice": choice,
                "arguments": [folder, *choice],
                "shard": f"{number}/{arguments.shards}",
            }
            for version, program, program_hash in zip(VERSIONS, arguments.program, program_hashes)
        ]


def outcome(future, count):
    """The results of `count` parts. A worker that died, and again with each other that tried, is a failure of them."""
    try:
        return future.result()
    except Exception as error:
        return [{"error": f"{type(error).__name__}: {error}"}] * count


def run(client, jobs, timeout_s, finish):
    """`jobs` are lists of parts; calls finish(part, result) for each part as its job ends."""
    futures = {client.submit(part_run.run_parts, job, timeout_s, pure=False): job for job in jobs}
    for future in dask.distributed.as_completed(futures):
        job = futures[future]
        for part, result in zip(job, outcome(future, len(job))):
            finish(part, result)
        future.release()


def main():
    arguments = parse()
    arguments.program = [os.path.abspath(program) for program in arguments.program]
    folders = list(dict.fromkeys(os.path.abspath(folder) for folder in arguments.sessions))
    store = PartStore(os.path.join(arguments.out, "parts"))
    client = connect(arguments)
    program_hashes = [part_run.hash_file(program) for program in arguments.program]
    finished, jobs, failed = [], [], 0
    for folder, session_hash in hash_sessions(client, folders).items():
        unreadable = isinstance(session_hash, Exception)
        for job in parts_of(arguments, folder, None if unreadable else session_hash, program_hashes):
            missing = []
            for part in job:
                result = {"error": str(session_hash)} if unreadable else store.load(part)
                failed += 1 if unreadable else 0
                if result:
                    finished.append((part, result))
                else:
                    missing.append(part)
            if missing:
                jobs.append(missing)
    kept, left = len(finished) - failed, sum(len(job) for job in jobs)
    print(f"fleet: {kept} parts kept, {left} to run", flush=True)

    def finish(part, result):
        nonlocal failed
        finished.append((part, result))
        if "error" in result:
            failed += 1
        else:
            store.save(part, result)
        print(
            f"fleet: {len(finished)} of {kept + left}, {part['folder']} {part['shard']}, {part['version']}: "
            f"{result.get('error', 'done')}",
            flush=True,
        )

    run(client, jobs, arguments.timeout_s, finish)
    client.close()
    rows = results.rows_of(finished)
    results.write_parquet(rows, os.path.join(arguments.out, "results.parquet"))
    report.write(rows, os.path.join(arguments.out, "report.html"))
    print(f"fleet: {len(finished)} parts, {failed} failed; {arguments.out}/report.html")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
