"""Finished parts on disk, one JSON file each, named by what they depend on."""

import hashlib
import json
import os


def key_of(part):
    """Of program, session, and the words that choose settings and shard; not of where program and session lie."""
    words = [part["program_hash"], part["session_hash"], *part["choice"]]
    return hashlib.sha256(json.dumps(words).encode()).hexdigest()


class PartStore:
    def __init__(self, folder):
        self.folder = folder
        os.makedirs(folder, exist_ok=True)

    def _path(self, part):
        return os.path.join(self.folder, key_of(part) + ".json")

    def load(self, part):
        """None where the part is not finished."""
        try:
            with open(self._path(part), encoding="utf-8") as f:
                return json.load(f)
        except FileNotFoundError:
            return None

    def save(self, part, result):
        path = self._path(part)
        with open(path + ".partial", "w", encoding="utf-8") as f:
            json.dump(result, f, indent=1)
        os.replace(path + ".partial", path)
