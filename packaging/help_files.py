#!/usr/bin/env python3
"""Manual page and Bash completion of lumigraft, from what `lumigraft --help` and `lumigraft COMMAND --help` print.

    help_files.py PROGRAM VERSION FOLDER    # writes lumigraft.1.gz and lumigraft.bash there
"""
import gzip
import pathlib
import re
import subprocess
import sys

DESCRIPTION = """lumigraft captures RGB-D and fish-eye frames, reconstructs the room, its lamps and its colours, and
renders the change of light that virtual objects make to it. Pictures are streamed to browsers (serve) or written to
files (replay)."""
EXIT_STATUS = [("0", "Success; also after SIGINT and SIGTERM."), ("2", "Bad input: one line says where and what is allowed."),
               ("1", "Another failure.")]
FILES = [("/var/lib/lumigraft/kiosk.toml", "Configuration of the system service, lumigraft.service."),
         ("/usr/share/lumigraft/configs", "Examples: a kiosk, a board for calibration, Caddy, nginx, media servers."),
         ("/usr/share/lumigraft/recordings/tabletop", "A recorded session, for a first try with serve \\-\\-session."),
         ("/usr/share/doc/lumigraft", "Documentation: configuration, cameras, the service, the protocol of the page.")]
SIGNALS = [("SIGHUP", "serve reads its exhibit and the permissions, tokens and certificates of its listeners again."),
           ("SIGINT, SIGTERM", "The program writes what it keeps, and ends.")]


def help_of(program, *command):
    return subprocess.run([program, *command, "--help"], check=True, capture_output=True, text=True).stdout


def sections(text):
    """[(heading, [(term, description)])] of what CLI11 prints."""
    found = []
    for line in text.splitlines():
        heading = re.fullmatch(r"(\w[\w ]*):", line)
        entry = re.fullmatch(r"  (\S.*?)(?:\s{2,}(\S.*))?", line)
        continued = re.fullmatch(r"\s{20,}(\S.*)", line)
        if heading:
            found.append((heading[1], []))
        elif continued and found and found[-1][1]:
            term, description = found[-1][1][-1]
            found[-1][1][-1] = (term, f"{description} {continued[1]}".strip())
        elif entry and found:
            found[-1][1].append((entry[1], entry[2] or ""))
    return found


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text)


def definitions(entries, escaped=True):
    return [line for term, description in entries
            for line in (".TP", ".B " + roff(term), roff(description) if escaped else description)]


def page(version, commands):
    lines = [f'.TH LUMIGRAFT 1 "" "lumigraft {version}" "User Commands"', ".SH NAME",
             "lumigraft \\- graft virtual objects into a live camera picture, light included", ".SH SYNOPSIS",
             ".B lumigraft", ".I COMMAND", "[\\fIOPTIONS\\fR]", ".SH DESCRIPTION", DESCRIPTION, ".SH COMMANDS"]
    for name, about, text in commands:
        lines += [f".SS {name}", roff(about) + "."]
        for _, entries in sections(text):
            lines += definitions(entries)
    for heading, entries in (("EXIT STATUS", EXIT_STATUS), ("SIGNALS", SIGNALS), ("FILES", FILES)):
        lines += [f".SH {heading}", *definitions(entries, escaped=False)]
    return "\n".join(lines) + "\n"


def completion(commands):
    cases, choices = [], {}
    for name, _, text in commands:
        options = []
        for heading, entries in sections(text):
            for term, _ in entries if heading == "Options" else []:
                flags = re.findall(r"-{1,2}[a-z][a-z-]*", term.split(" ")[0])
                options += flags
                if among := re.search(r":\{([^}]*)\}", term):
                    choices[flags[-1]] = among[1].replace(",", " ")
        cases.append(f'    {name}) options="{" ".join(options)}" ;;')
    names = " ".join(name for name, _, _ in commands)
    of_options = "\n".join(f'    {flag}) COMPREPLY=($(compgen -W "{words}" -- "$word")); return ;;'
                           for flag, words in sorted(choices.items()))
    return f"""# Bash completion of lumigraft
_lumigraft() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} options=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "{names} --help --version" -- "$word"))
    return
  fi
  case ${{COMP_WORDS[COMP_CWORD - 1]}} in
{of_options}
  esac
  case ${{COMP_WORDS[1]}} in
{chr(10).join(cases)}
  esac
  if [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
  else
    COMPREPLY=($(compgen -f -- "$word"))
    compopt -o filenames
  fi
}}
complete -F _lumigraft lumigraft
"""


def main():
    program, version, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    names = next(entries for heading, entries in sections(help_of(program)) if heading == "Subcommands")
    commands = [(name, about, help_of(program, name)) for name, about in names]
    with open(folder / "lumigraft.1.gz", "wb") as file, gzip.GzipFile(fileobj=file, mode="wb", filename="", mtime=0) as packed:
        packed.write(page(version, commands).encode())
    (folder / "lumigraft.bash").write_text(completion(commands))


if __name__ == "__main__":
    main()
