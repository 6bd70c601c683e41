"""Processes that a test starts and that end when it ends, for whatever reason."""
import ctypes
import signal
import subprocess

LIBC = ctypes.CDLL(None)
PR_SET_PDEATHSIG = 1


def end_with_parent():
    """Called in a new process: the kernel kills it when its parent ends."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def start(command, before=None, **options):
    """A Popen. `before` is called in the new process."""

    def prepare():
        end_with_parent()
        if before:
            before()

    return subprocess.Popen(command, preexec_fn=prepare, **options)


def interrupt(process):
    """Ends a program with SIGINT, and kills it if that has no effect. Returns its exit code."""
    try:
        process.send_signal(signal.SIGINT)
        return process.wait(10)
    finally:
        process.kill()
        process.wait()
