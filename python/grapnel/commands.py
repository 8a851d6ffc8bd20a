"""Campaigns, sweeps and searches as the program runs them, and what is made of their folders."""

from __future__ import annotations

import os
import warnings
from pathlib import Path as _Path
from typing import Union

from . import _grapnel

Path = Union[str, "os.PathLike[str]"]


class CommandError(RuntimeError):
    """A command that could not do what was asked. `code` is the exit code that the program would have ended with."""

    code: int

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


def _say(done: tuple[int, str], accepted: tuple[int, ...]) -> None:
    code, lines = done
    if code not in accepted:
        raise CommandError(lines.strip() or f"the command ended with exit code {code}", code)
    for line in lines.splitlines():
        warnings.warn(line, stacklevel=4)


def _folder(file: Path, out: Path | None) -> _Path:
    return _Path(out) if out is not None else _Path("out") / _Path(file).stem


def _threads(threads: int) -> int:
    if isinstance(threads, bool) or not isinstance(threads, int) or not 0 <= threads <= 4096:
        raise ValueError(f"threads is {threads!r}; expected is a whole number from 0 to 4096")
    return threads


def campaign(file: Path, out: Path | None = None, threads: int = 0, report: bool = True, csv: bool = True,
             extend: int = 0) -> _Path:
    """Runs a campaign file (docs/formats/campaign.md) and returns its folder: table.h5, table.csv, campaign.json and the
    report, the same bytes as the program's. Called again with the same file and folder it goes on where it was stopped, by
    Ctrl-C for instance. `extend` adds so many cases. `out`: None is out/ and the file's name. Warnings are Python's; cases
    that are not ok are one. `read_table` reads the table. Raises InputError (the file), CommandError (the rest)."""
    _grapnel.check_campaign(file)
    folder = _folder(file, out)
    _say(_grapnel.campaign(file, folder, _threads(threads), report, csv, extend, False), (0, 3))
    return folder


def success_map(file: Path, out: Path | None = None, threads: int = 0, report: bool = True, csv: bool = True) -> _Path:
    """A campaign at every point of one or two design values, as `grapnel map`; success_map.csv has the probabilities."""
    _grapnel.check_campaign(file)
    folder = _folder(file, out)
    _say(_grapnel.campaign(file, folder, _threads(threads), report, csv, 0, True), (0, 3))
    return folder


def sweep(file: Path, out: Path | None = None, threads: int = 0, report: bool = True) -> _Path:
    """Runs a study file, a grid of captures (docs/formats/study.md), and returns its folder. Else as `campaign`."""
    _grapnel.check_study(file)
    folder = _folder(file, out)
    _say(_grapnel.sweep(file, folder, _threads(threads), report), (0, 3))
    return folder


def optimize(file: Path, out: Path | None = None, threads: int = 0, report: bool = True) -> _Path:
    """Looks for the best of many captures (docs/formats/optimization.md) and returns the folder: best.yaml is a scenario
    ready to be loaded. Else as `campaign`."""
    _grapnel.check_optimization(file)
    folder = _folder(file, out)
    _say(_grapnel.optimize(file, folder, _threads(threads), report), (0,))
    return folder


def report(folder: Path, second: Path | None = None, file: Path | None = None) -> None:
    """Writes the report of a result folder; with a second folder a comparison of two runs. `file`: None is report.html in
    the folder, or report-vs-SECOND.html."""
    _say(_grapnel.report(folder, "" if second is None else second, "" if file is None else file), (0,))


def figure(folder: Path, what: str, file: Path, width: float = 0, height: float = 0) -> None:
    """Draws a figure for a paper from a result folder by gnuplot: `what` as `grapnel figure --list` says ('joints',
    'momentum', 'strobe', 'impulse-map', ...), into a .pdf, .svg or .png, `width` and `height` in cm, 0: by the figure."""
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{os.fspath(folder)} is no folder")
    _say(_grapnel.figure(folder, what, file, width, height), (0,))
