#!/usr/bin/env python3
"""Checks the order of modules and folders: include_order_test.py SOURCE_DIR

A module includes only those above it (capture, reconstruct, relight, server), a folder only those above it in the order
in which its module's CMakeLists.txt adds them, and there are no cycles. A file directly in a module's folder is ordered
by what it includes. The module's README.md names the same folders in the same order. No folder has more than 25 pairs of
files, and each lists its .cpp files in its own CMakeLists.txt.
"""
import collections
import os
import re
import sys
import tempfile

MODULES = ["capture", "reconstruct", "relight", "server"]
SOURCES = (".h", ".cpp", ".glsl", ".comp", ".frag", ".vert")
MOST_PAIRS = 25


def folder_order(root, folder):
    """The folders below this one in the order in which CMake adds them, each before its subfolders."""
    path = os.path.join(root, folder, "CMakeLists.txt")
    if not os.path.exists(path):
        return []
    order = []
    for name in re.findall(r"^\s*add_subdirectory\((\S+)\)", open(path).read(), re.M):
        inner = f"{folder}/{name}"
        order += [inner] + folder_order(root, inner)
    return order


def sources(root, module):
    for folder, _, names in os.walk(os.path.join(root, module)):
        for name in sorted(names):
            if name.endswith(SOURCES):
                yield os.path.relpath(os.path.join(folder, name), root)


def includes(root, file):
    """Paths, from the root, of the headers that a file includes, with line numbers."""
    for number, line in enumerate(open(os.path.join(root, file)), 1):
        match = re.match(r'\s*#\s*include "([^"]+)"', line)
        if not match:
            continue
        named = match.group(1)
        for base in ("", "relight/shaders/", os.path.dirname(file) + "/"):
            path = os.path.normpath(base + named)
            if os.path.exists(os.path.join(root, path)):
                yield number, path
                break


def listed(root, folder):
    """The words of a folder's CMakeLists.txt."""
    path = os.path.join(root, folder, "CMakeLists.txt")
    return re.split(r"[\s()]+", open(path).read()) if os.path.exists(path) else []


def node(file):
    """The unit that is ordered: a folder, or a file directly in a module's folder, without its extension."""
    folder = os.path.dirname(file)
    return folder if "/" in folder else os.path.splitext(file)[0]


def cycle_in(edges):
    state, path = {}, []

    def visit(at):
        state[at] = "open"
        path.append(at)
        for to in sorted(edges.get(at, ())):
            if state.get(to) == "open":
                return path[path.index(to):] + [to]
            if to not in state:
                found = visit(to)
                if found:
                    return found
        state[at] = "done"
        path.pop()
        return None

    for start in sorted(edges):
        if start not in state:
            found = visit(start)
            if found:
                return found
    return None


def problems(root):
    found, edges = [], collections.defaultdict(set)
    rank = {module: number for number, module in enumerate(MODULES)}
    place = {}
    for module in MODULES:
        order = folder_order(root, module)
        place.update({folder: number for number, folder in enumerate(order)})
        readme = os.path.join(root, module, "README.md")
        if os.path.exists(readme):
            first_level = [f.split("/")[1] for f in order if f.count("/") == 1]
            named = [n for n in re.findall(r"^[-|*\s]*`(\w+)/`", open(readme).read(), re.M) if n in first_level]
            if named != first_level:
                found.append(f"{module}/README.md lists the folders {named}, its CMakeLists.txt adds {first_level}")
    pairs = collections.defaultdict(set)
    for module in MODULES:
        for file in sources(root, module):
            folder = os.path.dirname(file)
            stem, ending = os.path.splitext(os.path.basename(file))
            pairs[folder].add(stem if ending in (".h", ".cpp") else stem)
            if "/" in folder and folder not in place:
                found.append(f"{file}: no CMakeLists.txt adds {folder}")
            if ending == ".cpp" and os.path.basename(file) not in listed(root, folder):
                found.append(f"{file}: not in {folder}/CMakeLists.txt")
            for line, other in includes(root, file):
                if other.split("/")[0] not in rank:
                    found.append(f"{file}:{line}: {other} belongs to no module")
                    continue
                if rank[other.split("/")[0]] > rank[module]:
                    found.append(f"{file}:{line}: {other} belongs to a module below {module}")
                a, b = node(file), node(other)
                if a != b:
                    edges[a].add(b)
                if a in place and b in place and a.split("/")[0] == b.split("/")[0] and place[b] > place[a]:
                    found.append(f"{file}:{line}: {b} comes after {a}")
    for folder, stems in sorted(pairs.items()):
        if len(stems) > MOST_PAIRS and not folder.startswith("relight/shaders"):
            found.append(f"{folder} has {len(stems)} pairs of files, allowed: {MOST_PAIRS}")
    cycle = cycle_in(edges)
    if cycle:
        found.append("cycle: " + " -> ".join(cycle))
    return found


def check_itself():
    """An include of a later folder, a wrong order of folders and a cycle are detected."""
    with tempfile.TemporaryDirectory() as root:
        def write(path, text):
            os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
            with open(os.path.join(root, path), "w") as out:
                out.write(text)

        write("capture/CMakeLists.txt", "add_subdirectory(first)\nadd_subdirectory(second)\n")
        write("capture/first/a.h", '#include "capture/second/b.h"\n')
        write("capture/second/b.h", '#include "capture/first/a.h"\n')
        write("capture/second/c.h", '#include "server/d.h"\n')
        write("server/d.h", "")
        write("server/CMakeLists.txt", "")
        text = "\n".join(problems(root))
        for expected in ("capture/first/a.h:1: capture/second comes after capture/first", "c.h:1: server/d.h belongs to a module below",
                         "cycle: capture/first -> capture/second -> capture/first"):
            if expected not in text:
                sys.exit(f"the check does not find: {expected}\nfound:\n{text}")


check_itself()
result = problems(sys.argv[1])
print("\n".join(result) or "every include goes up")
sys.exit(1 if result else 0)
