#!/usr/bin/env python3
"""Writes the comments and string literals of source files as text files with the same line numbers.

usage: prose_text.py FOLDER FILE...
FOLDER/FILE.txt has, at each line, what people read of that line of FILE: comments, and string literals of two words or
more. Lines without either are empty.
"""
import re
import sys
from pathlib import Path

STRING = re.compile(r'"(?:[^"\\]|\\.)*"|`[^`]*`')
SLASHES = re.compile(r"//+[/!<]*(.*)$|^\s*\*(?!/)(.*)$|/\*+(.*?)(?:\*/|$)")
HASH = re.compile(r"(?:^|\s)#+(?!!)(.*)$")
DOCSTRING = '"""'
HASHED = {".py", ".sh", ".cmake", ".yaml", ".yml", ""}


def text_of(line: str, hashed: bool) -> str:
    """What people read of a line."""
    strings = [s[1:-1] for s in STRING.findall(line) if " " in s.strip('"` ') and not line.lstrip().startswith("#include")]
    rest = STRING.sub(" ", line)
    comment = (HASH if hashed else SLASHES).search(rest)
    parts = [part for part in (comment.groups() if comment else ()) if part]
    return " ".join([*parts, *strings]).strip()


def main() -> int:
    folder = Path(sys.argv[1])
    for name in sys.argv[2:]:
        path = Path(name)
        hashed = path.suffix in HASHED or path.name == "CMakeLists.txt"
        lines, in_docstring = [], False
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            opens = hashed and line.count(DOCSTRING) % 2 == 1
            lines.append(line if in_docstring or opens else text_of(line, hashed))
            in_docstring ^= opens
        target = folder / (name + ".txt")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
