"""A recording of which only the first frame is played."""
import os


def still_session(recording, folder):
    """Writes a session that repeats the recording's first frame, so that only the objects change."""
    session = os.path.join(folder, "still")
    os.makedirs(session)
    for name in os.listdir(recording):
        if name not in ("truth", "color.txt", "depth.txt", "fisheye.txt"):
            os.symlink(os.path.join(recording, name), os.path.join(session, name))
    for stream in ("color", "depth", "fisheye"):
        with open(os.path.join(recording, f"{stream}.txt")) as f:
            lines = [line.split() for line in f if line.strip() and not line.startswith("#")]
        with open(os.path.join(session, f"{stream}.txt"), "w") as f:
            for line in lines:
                f.write(" ".join([line[0], *lines[0][1:]]) + "\n")
    return session
