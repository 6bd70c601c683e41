"""Programs that a test starts, which end with it however it ends."""
import ctypes
import signal
import subprocess

LIBC = ctypes.CDLL(None)
PR_SET_PDEATHSIG = 1


def end_with_parent():
    """For a new process: the kernel kills it when the process that started it has ended."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def start(command, before=None, **options):
    """A Popen. `before` is called in the new process."""

    def prepare():
        end_with_parent()
        if before:
            before()

    return subprocess.Popen(command, preexec_fn=prepare, **options)


def interrupt(process):
    """Ends a program as Ctrl-C does; kills it where it does not end by that. Its exit code."""
    try:
        process.send_signal(signal.SIGINT)
        return process.wait(10)
    finally:
        process.kill()
        process.wait()
