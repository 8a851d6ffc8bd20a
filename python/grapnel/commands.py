"""Campaigns, sweeps and optimizations, with the reports and figures of their folders."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping
from pathlib import Path as _Path
from typing import Any

from . import _grapnel
from ._arguments import Path, file_path, thread_count, whole_number
from .progress import ProgressChoice, reported
from .scenario import Problem


class CommandError(RuntimeError):
    """A command failed. `code` is the exit code of the equivalent `grapnel` command."""

    code: int

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> tuple[Any, ...]:
        return CommandError, (str(self), self.code)


def _report_outcome(done: tuple[int, list[str]], accepted: tuple[int, ...]) -> None:
    code, messages = done
    if code not in accepted:
        raise CommandError("\n".join(messages) or f"the command ended with exit code {code}", code)
    for message in messages:
        warnings.warn(message, stacklevel=3)


def _file_and_folder(what: Path | Mapping[str, Any], kind: str, out: Path | None) -> tuple[str, _Path]:
    """The file of a campaign, study or optimization, and its result folder. A dictionary is written to a file in this folder."""
    if not isinstance(what, Mapping):
        file = file_path("file", what)
        return file, _Path(file_path("out", out)) if out is not None else _Path("out") / _Path(file).stem
    if out is None:
        raise ValueError(f"out is missing; a {kind} given as a dictionary needs a folder for its results")
    folder = _Path(file_path("out", out))
    folder.mkdir(parents=True, exist_ok=True)
    values = {"schema": f"grapnel-{kind}/1", **what}
    scenario = values.get("scenario")
    if isinstance(scenario, Problem):
        scenario.write(folder / "scenario.yaml")
        values["scenario"] = "scenario.yaml"
    elif isinstance(scenario, (str, os.PathLike)):
        values["scenario"] = os.path.abspath(scenario)
    made = folder / f"{kind}.yaml"
    made.write_text(_grapnel.yaml_text(values), encoding="utf-8")
    return str(made), folder


def campaign(file: Path | Mapping[str, Any], out: Path | None = None, threads: int = 0, report: bool = True, csv: bool = True,
             extend: int = 0, progress: ProgressChoice = None) -> _Path:
    """Runs a campaign file (docs/formats/campaign.md) and returns its folder with table.h5, table.csv, campaign.json and the
    report, byte for byte as the program writes them. Repeat the call with the same file and folder to resume a campaign that was
    stopped, for example by Ctrl-C.

    `extend`: number of cases to add. `out`: None is out/ plus the file's name. `progress`: None shows a line on a terminal and a
    bar in a notebook, False nothing; a function gets a `Progress` several times per second. Messages, including the number of
    cases that are not ok, are Python warnings. `read_table` reads the table. Raises InputError for errors in the file, else
    CommandError.

    `file` may be a dictionary with the keys of a campaign file, whose `scenario` may be a Problem. The function writes it to
    campaign.yaml in `out`, and the problem to scenario.yaml beside it."""
    more, threads = whole_number("extend", extend, 0, 2**53), thread_count(threads)
    file, folder = _file_and_folder(file, "campaign", out)
    with reported(progress, "cases") as report_progress:
        done = _grapnel.campaign(file, folder, threads, bool(report), bool(csv), more, False, report_progress)
    _report_outcome(done, (0, 3))
    return folder


def success_map(file: Path | Mapping[str, Any], out: Path | None = None, threads: int = 0, report: bool = True, csv: bool = True,
                progress: ProgressChoice = None) -> _Path:
    """Runs a campaign at every point of one or two design values, as `grapnel map`; success_map.csv has the probabilities."""
    threads = thread_count(threads)
    file, folder = _file_and_folder(file, "campaign", out)
    with reported(progress, "cases") as report_progress:
        done = _grapnel.campaign(file, folder, threads, bool(report), bool(csv), 0, True, report_progress)
    _report_outcome(done, (0, 3))
    return folder


def sweep(file: Path | Mapping[str, Any], out: Path | None = None, threads: int = 0, report: bool = True,
          progress: ProgressChoice = None) -> _Path:
    """Runs a study file, a grid of captures (docs/formats/study.md), and returns its folder. Other arguments as for `campaign`."""
    threads = thread_count(threads)
    file, folder = _file_and_folder(file, "study", out)
    with reported(progress, "points") as report_progress:
        done = _grapnel.sweep(file, folder, threads, bool(report), report_progress)
    _report_outcome(done, (0, 3))
    return folder


def optimize(file: Path | Mapping[str, Any], out: Path | None = None, threads: int = 0, report: bool = True,
             progress: ProgressChoice = None) -> _Path:
    """Searches the best of many captures (docs/formats/optimization.md) and returns the folder; best.yaml is the best
    scenario. Other arguments as for `campaign`."""
    threads = thread_count(threads)
    file, folder = _file_and_folder(file, "optimization", out)
    with reported(progress, "evaluations") as report_progress:
        done = _grapnel.optimize(file, folder, threads, bool(report), report_progress)
    _report_outcome(done, (0,))
    return folder


def report(folder: Path, second: Path | None = None, file: Path | None = None) -> None:
    """Writes the report of a result folder, or with a second folder a comparison of two runs. `file`: None is report.html in
    the folder, or report-vs-SECOND.html."""
    _report_outcome(_grapnel.report(file_path("folder", folder), "" if second is None else file_path("second", second),
                         "" if file is None else file_path("file", file)), (0,))


def figure(folder: Path, what: str, file: Path, width: float = 0, height: float = 0) -> None:
    """Draws a publication figure from a result folder with gnuplot. `what`: a name that `grapnel figure --list` prints ('joints',
    'momentum', 'strobe', 'impulse-map', ...). `file`: a .pdf, .svg or .png. `width` and `height` in cm; 0: default size."""
    folder, file = file_path("folder", folder), file_path("file", file)
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{folder} is not a folder")
    if not isinstance(what, str):
        raise TypeError(f"what is {what!r}; expected a figure's name, such as 'joints'")
    for name, length in (("width", width), ("height", height)):
        if not (math.isfinite(length) and length >= 0):
            raise ValueError(f"{name} is {length!r}; expected a length in cm, or 0")
    _report_outcome(_grapnel.figure(folder, what, file, float(width), float(height)), (0,))
