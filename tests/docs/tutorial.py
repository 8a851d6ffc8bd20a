#!/usr/bin/env python3
"""Runs the commands of docs/tutorial.md or another page in an empty folder, and compares their output. Standard library
only.

usage: tests/docs/tutorial.py PROGRAM [--show] [--page PAGE] [--python INTERPRETER MODULES]

--show prints the output of each command. --python: the interpreter for `python3`, and the folder with the module
`grapnel`; without them Python commands of the tutorial are omitted. --page: a page whose Python commands need no
module.

`<!-- file: NAME -->` before a block: the block is that file. `<!-- replace in NAME: WORDS -->`: it replaces the line
with WORDS; `<!-- after in NAME: WORDS -->`: it is inserted after that line. ```console: commands after `$ `, and the
lines that they print, in this order; `...` matches any lines, at the end of a line the rest of it. `<!-- exit: N -->`:
the exit code (default 0). Numbers may differ by 1 %, since rounding differs between processors and affects the last
digits of plans; tiny numbers are rounding errors.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
TUTORIAL = ROOT / "docs" / "tutorial.md"
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def same(shown, printed):
    """Whether a line matches the shown output: the same words, numbers within 1 %."""
    if shown.endswith("..."):
        return printed.startswith(shown.removesuffix("..."))
    if [" ".join(part.split()) for part in NUMBER.split(shown)] != [" ".join(part.split()) for part in NUMBER.split(printed)]:
        return False
    pairs = zip(map(float, NUMBER.findall(shown)), map(float, NUMBER.findall(printed)))
    return all(abs(a - b) <= 0.01 * max(abs(a), abs(b)) or max(abs(a), abs(b)) < 1e-12 for a, b in pairs)


def blocks(text):
    """Fenced blocks: (the comment before, language, lines, line number)."""
    note, language, lines, begin = "", None, [], 0
    for number, line in enumerate(text.split("\n"), 1):
        if language is not None:
            if line == "```":
                yield note, language, lines, begin
                note, language = "", None
            else:
                lines.append(line)
        elif line.startswith("```"):
            language, lines, begin = line[3:], [], number
        elif line.startswith("<!--"):
            note = line.removeprefix("<!--").removesuffix("-->").strip()
        elif line:
            note = ""


def edit(note, lines, folder):
    kind, what = note.split(": ", 1)
    if kind == "file":
        (folder / what).write_text("\n".join(lines) + "\n")
        return None
    verb, _, name = kind.split(" ")
    old = (folder / name).read_text().split("\n")
    places = [i for i, line in enumerate(old) if what in line]
    if len(places) != 1:
        return f"'{what}' is in {len(places)} lines of {name}"
    at = places[0]
    old[at:at + 1] = lines if verb == "replace" else [old[at], *lines]
    (folder / name).write_text("\n".join(old))
    return None


def compare(shown, printed):
    """The first documented line missing from the output, or None."""
    at, gap = 0, False
    for line in shown:
        if line == "...":
            gap = True
            continue
        while at < len(printed) and not same(line, printed[at]):
            if not gap:
                return line
            at += 1
        if at == len(printed):
            return line
        at, gap = at + 1, False
    return None


def uses_module(command, folder):
    """Whether the command runs a file that imports grapnel."""
    words = command.split()
    if words[0] != "python3" or len(words) < 2:
        return False
    file = folder / words[1]
    return file.is_file() and "import grapnel" in file.read_text()


def main():
    arguments = argparse.ArgumentParser(usage=argparse.SUPPRESS)
    arguments.add_argument("program", type=lambda path: pathlib.Path(path).resolve())
    arguments.add_argument("--show", action="store_true")
    arguments.add_argument("--page", type=pathlib.Path, default=TUTORIAL)
    arguments.add_argument("--python", nargs=2, metavar=("INTERPRETER", "MODULES"))
    given = arguments.parse_args()
    page, is_tutorial = given.page, given.page == TUTORIAL
    faults = commands = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name) / "tutorial"
        binaries = pathlib.Path(name) / "bin"
        folder.mkdir()
        binaries.mkdir()
        (binaries / "grapnel").symlink_to(given.program)
        for shared in ("scenarios", "robots"):
            (folder / shared).symlink_to(ROOT / shared)
        environment = {**os.environ, "PATH": f"{binaries}:{os.environ['PATH']}"}
        if given.python:
            (binaries / "python3").write_text(f'#!/bin/sh\nexec "{given.python[0]}" "$@"\n')
            (binaries / "python3").chmod(0o755)
            environment.update(PYTHONPATH=given.python[1], PYTHONDONTWRITEBYTECODE="1")
        for note, language, lines, begin in blocks(page.read_text()):
            if language in ("yaml", "xml", "python") or (language == "bash" and note.startswith("file: ")):
                fault = edit(note, lines, folder) if note else "a file without a name"
                if fault:
                    print(f"{page}:{begin}: error: {fault}", file=sys.stderr)
                    faults += 1
            if language != "console":
                continue
            for part in re.split(r"^\$ ", "\n".join(lines), flags=re.MULTILINE)[1:]:
                command, *shown = part.rstrip("\n").split("\n")
                if not given.python and uses_module(command, folder):
                    print(f"not run, there is no module: {command}")
                    continue
                done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
                commands += 1
                printed = (done.stderr if done.returncode in (1, 2) else "") + done.stdout
                if given.show:
                    print(f"$ {command}\n{printed}[{done.returncode}] {done.stderr}")
                expected = int(note.split(": ")[1]) if note.startswith("exit") else 0
                if done.returncode != expected:
                    print(f"{page}:{begin}: error: '{command}' ends with {done.returncode}, not {expected}:\n{done.stderr}", file=sys.stderr)
                    faults += 1
                missing = compare(shown, printed.rstrip("\n").split("\n"))
                if missing is not None:
                    print(f"{page}:{begin}: error: '{command}' does not print '{missing}' there, but\n{printed}", file=sys.stderr)
                    faults += 1
    if commands < (10 if is_tutorial else 3):
        print(f"{page}: error: only {commands} commands were found", file=sys.stderr)
        faults += 1
    print(f"{commands} commands, {faults} faults")
    sys.exit(1 if faults else 0)


main()
