"""`python -m grapnel ...` is the program `grapnel ...`."""

import os
import shutil
import sys
from pathlib import Path


def program() -> str:
    """The program of this package, else the one that PATH names."""
    own = Path(__file__).parent / "program" / "bin" / "grapnel"
    if own.is_file():
        return str(own)
    found = shutil.which("grapnel")
    if found is None:
        sys.exit("grapnel: error: this package has no program, and PATH has none; use a self-contained wheel (scripts/wheel), "
                 "or install the package grapnel")
    return found


def main() -> None:
    """Replaces this process by the program."""
    file = program()
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(file, [file, *sys.argv[1:]])


if __name__ == "__main__":
    main()
