"""`python -m grapnel ...` is the program `grapnel ...`."""

import os
import sys
from pathlib import Path


def program() -> str:
    """The program of this package or of the build that contains it, else the one that PATH names."""
    package = Path(__file__).resolve().parent
    places = [package / "program" / "bin" / "grapnel", package.parent.parent / "bin" / "grapnel"]
    places += [Path(folder) / "grapnel" for folder in os.environ.get("PATH", "").split(os.pathsep) if folder]
    for place in places:
        if os.access(place, os.X_OK) and place.is_file() and not _is_script(place):
            return str(place)
    sys.exit("grapnel: error: this package has no program, and PATH has none; use a self-contained wheel (scripts/wheel), or install "
             "the package grapnel")


def _is_script(file: Path) -> bool:
    """Whether a file is a script, such as the command of a wheel, which would call this module again."""
    with open(file, "rb") as stream:
        return stream.read(2) == b"#!"


def main() -> None:
    """Replaces this process by the program."""
    file = program()
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(file, [file, *sys.argv[1:]])


if __name__ == "__main__":
    main()
