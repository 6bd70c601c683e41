"""A network of a test's own."""
import subprocess

from child_process import LIBC

CLONE_NEWNET = 0x40000000
NEAR_ADDRESS = "10.77.0.1"


def enter_network():
    """Moves this process, and what it starts, into a network namespace with an address that is no loopback: WebRTC uses none
    that is. False where that is not permitted."""
    if LIBC.unshare(CLONE_NEWNET) != 0:
        return False
    for command in ("link set lo up", "link add near type veth peer name far", f"address add {NEAR_ADDRESS}/24 dev near", "link set near up", "link set far up"):
        subprocess.run(["ip", *command.split()], check=True)
    return True
