"""Logs of measurements: comparison with a run, impulses at grasps, and parameters that explain the logs."""

from __future__ import annotations

import contextlib
import csv
import json
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path as _Path
from typing import Any

import numpy as np

from . import _grapnel
from ._arguments import Array, Path, file_path, thread_count
from .commands import CommandError, _report_outcome

_COMPONENTS = ("angular x", "angular y", "angular z", "linear x", "linear y", "linear z")


def _number_or_nan(text: str) -> float:
    return float(text) if text else math.nan


class _LogResult:
    """Results in a folder, with the contents of its JSON file."""

    _file: str
    _verdict: str

    def __init__(self, folder: Path) -> None:
        self.folder = _Path(file_path("folder", folder))  #: of the results
        self.summary: dict[str, Any] = json.loads((self.folder / self._file).read_text(encoding="utf-8"))  #: of the JSON file

    @property
    def verdict(self) -> str:
        """'yes', 'no' or 'not checked'."""
        return str(self.summary[self._verdict])

    @property
    def warnings(self) -> list[str]:
        """Doubts about the result."""
        return list(self.summary.get("warnings", []))

    def _rows(self, file: str) -> list[dict[str, str]]:
        with open(self.folder / file, newline="", encoding="utf-8") as stream:
            return list(csv.DictReader(stream))

    def momentum(self, body: str = "robot") -> dict[str, Array]:
        """Momentum and energy of the measured motion over time, with a column `uncertainty of ...` beside each: 'time [s]',
        'linear x [N s]', ...; nan where the log does not determine them. `body`: 'robot' or a target's name."""
        every = self._rows("momentum.csv") if (self.folder / "momentum.csv").exists() else []
        rows = [row for row in every if row["body"] == body]
        if not rows:
            names = list(dict.fromkeys(row["body"] for row in every))
            raise ValueError(f"body is {body!r}; the log has a momentum of {', '.join(names) or 'no body'}")
        return {name: np.array([_number_or_nan(row[name]) for row in rows]) for name in rows[0] if name != "body"}

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.folder}, {self._verdict}: {self.verdict}>"


@dataclass(frozen=True)
class Residuals:
    """Measured minus simulated values of one component of a quantity."""

    time: Array  #: of the run [s], (n,)
    log_time: Array  #: of the log [s], (n,)
    residual: Array  #: (n,), in `unit`; nan where a sample is missing or outside the run
    compared: Array  #: (n,), bool: whether the sample counts in the statistics
    unit: str


class Comparison(_LogResult):
    """Result of `compare`. `summary` has the keys of comparison.json (docs/formats/comparison.md).

    `comparison["gyro"]` is the entry of a quantity, by its name in the mapping: rms, peak, lag, chi_square, agrees, reason, ..."""

    _file, _verdict = "comparison.json", "agrees"

    def __getitem__(self, quantity: str) -> dict[str, Any]:
        found = {one["name"]: one for one in self.summary["quantities"]}
        if quantity not in found:
            raise KeyError(f"{quantity!r} is not a quantity of the comparison; expected one of {', '.join(found)}")
        return dict(found[quantity])

    @property
    def offset(self) -> float:
        """Time of the run minus time of the log [s]."""
        return float(self.summary["clock"]["offset"])

    def residuals(self, quantity: str, component: str | None = None) -> Residuals:
        """The residuals of a quantity, by its name. `component`: 'x', a joint's name, ...; None for a quantity with one component."""
        components = [one["name"] for one in self[quantity]["components"]]
        if component is None and len(components) == 1:
            component = components[0]
        if component not in components:
            raise ValueError(f"component is {component!r}; {quantity} has {', '.join(components)}")
        rows = [row for row in self._rows("comparison.csv") if row["quantity"] == quantity and row["component"] == component]

        def numbers(key: str) -> Array:
            return np.array([_number_or_nan(row[key]) for row in rows])

        return Residuals(numbers("time [s]"), numbers("log time [s]"), numbers("residual"),
                         np.array([row["status"] == "compared" for row in rows], dtype=bool), str(self[quantity]["unit"]))


@dataclass(frozen=True)
class GraspImpulse:
    """The impulse on the robot at a grasp, [angular; linear] about the end-effector's origin, in W [N m s; N s].

    Components that no measurement determines, or that the grasp does not transmit, are nan."""

    end_effector: str
    target: str
    value: Array  #: (6,)
    uncertainty: Array  #: standard, (6,)
    covariance: Array  #: (6, 6)
    simulated: Array  #: of the run, (6,)


@dataclass(frozen=True)
class MeasuredContact:
    """A contact in a log. `summary` has the keys of `contacts[]` in impulses.json (docs/formats/impulses.md)."""

    time: float  #: of the run's clock [s]; the beginning of a contact with a duration
    end: float  #: [s]
    verdict: str  #: whether the changes satisfy the momentum balance: 'yes', 'no' or 'not checked'
    chi_square: float  #: of the balance, per degree of freedom; nan without redundant measurements
    grasps: tuple[GraspImpulse, ...]
    summary: dict[str, Any]

    def __getitem__(self, end_effector: str) -> GraspImpulse:
        """The impulse at the grasp of an end-effector, by its name."""
        for grasp in self.grasps:
            if grasp.end_effector == end_effector:
                return grasp
        raise KeyError(f"{end_effector!r} has no grasp; expected one of {', '.join(one.end_effector for one in self.grasps)}")


class MeasuredImpulses(_LogResult):
    """Result of `impulses`. `summary` has the keys of impulses.json (docs/formats/impulses.md)."""

    _file, _verdict = "impulses.json", "consistent"

    @property
    def contacts(self) -> list[MeasuredContact]:
        """The contacts, in the order of time."""
        return [MeasuredContact(float(one["time"]), float(one["end"]), str(one["consistent"]),
                                float(one.get("chi_square", math.nan)), tuple(map(_grasp_impulse, one["grasps"])), one)
                for one in self.summary["contacts"]]


def _grasp_impulse(grasp: dict[str, Any]) -> GraspImpulse:
    value, uncertainty, simulated = np.full(6, np.nan), np.full(6, np.nan), np.full(6, np.nan)
    covariance = np.full((6, 6), np.nan)
    determined = []
    for one in grasp["components"]:
        k = _COMPONENTS.index(one["name"])
        simulated[k] = one.get("simulated", math.nan)
        if one["determined"]:
            value[k], uncertainty[k] = one["value"], one["uncertainty"]
            determined.append(k)
    n = len(determined)
    covariance[np.ix_(determined, determined)] = np.reshape(grasp["covariance"], (n, n))
    return GraspImpulse(grasp["end_effector"], grasp["target"], value, uncertainty, covariance, simulated)


class FittedParameters(_LogResult):
    """Result of `identify_from_logs`. `summary` has the keys of identification.json (docs/formats/identification.md).

    `fitted["mass"]` is the value of a parameter; nan if the logs do not determine it."""

    _file, _verdict = "identification.json", "agrees"

    @property
    def scenario(self) -> _Path:
        """The scenario with the fitted values."""
        return self.folder / "fitted.yaml"

    @property
    def names(self) -> list[str]:
        """The parameters, in the order of the file."""
        return [str(one["name"]) for one in self.summary["parameters"]]

    def __getitem__(self, parameter: str) -> float:
        one = self.parameter(parameter)
        return math.nan if one["status"] == "not_identifiable" else float(one["value"])

    def parameter(self, name: str) -> dict[str, Any]:
        """The entry of a parameter: value, uncertainty, interval, status, unit, ..."""
        for one in self.summary["parameters"]:
            if one["name"] == name:
                return dict(one)
        raise KeyError(f"{name!r} is not a parameter; expected one of {', '.join(self.names)}")

    @property
    def covariance(self) -> Array:
        """Of all parameters, (n, n); nan for those without an uncertainty."""
        names, known = self.names, list(self.summary["covariance_parameters"])
        covariance = np.full((len(names), len(names)), np.nan)
        at = [names.index(name) for name in known]
        covariance[np.ix_(at, at)] = np.reshape(self.summary["covariance"], (len(known), len(known)))
        return covariance

    def comparison(self, log: str) -> Comparison:
        """The comparison of a log with the fitted run, by the log's name."""
        for one in self.summary["logs"]:
            if one["name"] == log:
                return Comparison(self.folder / one["folder"])
        raise KeyError(f"{log!r} is not a log; expected one of {', '.join(one['name'] for one in self.summary['logs'])}")


_MADE = "# Made by grapnel in Python from a dictionary.\n"


@contextlib.contextmanager
def _inputs(command: str, run: Path, log: Path, mapping: Path | Mapping[str, Any] | None,
            out: Path | None) -> Iterator[tuple[str, str, str, _Path]]:
    """Run, log, mapping file and result folder. A mapping that is a dictionary is a temporary file, which is in the folder
    afterwards, unless the command failed."""
    run, log = file_path("run", run), file_path("log", log)
    folder = _Path(file_path("out", out)) if out is not None else _Path(run) / f"{command}-{_Path(log).stem}"
    if not isinstance(mapping, Mapping):
        yield run, log, "" if mapping is None else file_path("map", mapping), folder
        return
    text = _MADE + _grapnel.yaml_text({"schema": "grapnel-mapping/1", **mapping})
    kept = folder / "mapping.yaml"
    if kept.exists() and not kept.read_text(encoding="utf-8", errors="replace").startswith(_MADE):
        raise CommandError(f"{kept} is not of an earlier call, and would be replaced; choose another folder", 2)
    with tempfile.TemporaryDirectory() as place:
        made = _Path(place) / "mapping.yaml"
        made.write_text(text, encoding="utf-8")
        yield run, log, str(made), folder
        kept.write_text(text, encoding="utf-8")


def _seconds(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is {value!r}; expected a number") from None
    if isinstance(value, str) or not math.isfinite(number):
        raise ValueError(f"{name} is {value!r}; expected a finite number")
    return number


def _contacts(at: Any) -> list[tuple[float, float]]:
    """Times and durations."""
    contacts = []
    for one in ([at] if np.ndim(at) == 0 else at):
        if np.ndim(one) == 0:
            contacts.append((_seconds("at", one), 0.0))
        elif np.shape(one) == (2,) and _seconds("at", one[1]) >= 0:
            contacts.append((_seconds("at", one[0]), _seconds("at", one[1])))
        else:
            raise ValueError(f"at has {one!r}; expected a time [s], or (time, duration)")
    return contacts


def _overrides(changes: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Values as texts of YAML: strings as for --set, all others as JSON."""

    def plain(value: Any) -> Any:
        if isinstance(value, (np.ndarray, np.generic)):
            return value.tolist()
        raise TypeError(f"a {type(value).__name__}")

    texts = []
    for path, value in (changes or {}).items():
        try:
            texts.append((path, value if isinstance(value, str) else json.dumps(value, default=plain, allow_nan=False)))
        except (TypeError, ValueError) as error:
            raise ValueError(f"set has {value!r} for {path!r}; expected a finite number, text, or lists and dictionaries of them ({error})") from None
    return texts


def compare(run: Path, log: Path, map: Path | Mapping[str, Any] | None = None, out: Path | None = None, report: bool = True) -> Comparison:
    """Compares a run's folder with a log of measurements, as `grapnel compare` (docs/how-to/compare.md).

    `log`: a CSV, HDF5, MAT, MCAP or rosbag file. `map`: the mapping between log and run, a file or a dictionary with its keys, which
    is then in mapping.yaml in `out`; None: the columns have the names of the run's series. `out`: None is
    compare-LOG in the run's folder. Without `report` no page is written. Raises InputError with all errors of the inputs; a
    disagreement is a result: `verdict` is 'no'."""
    with _inputs("compare", run, log, map, out) as (run, log, mapping, folder):
        _report_outcome(_grapnel.compare(run, log, mapping, folder, bool(report)), (0,))
    return Comparison(folder)


def impulses(run: Path, log: Path, map: Path | Mapping[str, Any], out: Path | None = None, *,
             at: float | Iterable[float | tuple[float, float]] = (), window: float | None = None, false_alarms: float = 0.01,
             scenario: Path | None = None, set: Mapping[str, Any] | None = None, report: bool = True) -> MeasuredImpulses:
    """Estimates the impulse at each grasp and the momentum over time from a log, as `grapnel impulses` (docs/how-to/impulses.md).

    `at`: times of contacts [s of the run], or (time, duration); empty: detected. `window`: length of the polynomials before and after a
    contact [s]; None: chosen. `false_alarms`: bound on the expected number of contacts in the log that are noise alone.
    `scenario`, `set`: the model; None is that of the run. Other arguments as for `compare`."""
    contacts, changes = _contacts(at), _overrides(set)
    if window is not None and _seconds("window", window) <= 0:
        raise ValueError(f"window is {window!r}; expected a length > 0 in s, or None")
    if _seconds("false_alarms", false_alarms) <= 0:
        raise ValueError(f"false_alarms is {false_alarms!r}; expected a number > 0")
    model = "" if scenario is None else file_path("scenario", scenario)
    with _inputs("impulses", run, log, map, out) as (run, log, mapping, folder):
        _report_outcome(_grapnel.impulses(run, log, mapping, folder, bool(report), contacts, window, float(false_alarms), model, changes), (0,))
    return MeasuredImpulses(folder)


def identify_from_logs(file: Path, out: Path | None = None, threads: int = 0, report: bool = True) -> FittedParameters:
    """Fits parameters of a scenario to logs, as `grapnel identify` (docs/how-to/identify-from-logs.md). `file`: an identification file
    (docs/formats/identification.md). `out`: None is out/ plus the file's name. A disagreement is a result: `verdict` is 'no'."""
    threads, file = thread_count(threads), file_path("file", file)
    folder = _Path(file_path("out", out)) if out is not None else _Path("out") / _Path(file).stem
    _report_outcome(_grapnel.identify_from_logs(file, folder, threads, bool(report)), (0,))
    return FittedParameters(folder)
