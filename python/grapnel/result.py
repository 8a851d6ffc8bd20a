"""Results of a simulated capture."""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any

from . import _grapnel, display
from ._arguments import Array, Path, file_path


class SimulationError(RuntimeError):
    """A simulation failed, or its conservation checks failed. `result` has the results up to the failure."""

    result: Result | None  #: None in other processes than that of the simulation

    def __init__(self, message: str, result: Result | None) -> None:
        super().__init__(message)
        self.result = result

    def __reduce__(self) -> tuple[Any, ...]:
        return SimulationError, (str(self), None)


def _meant(name: object, names: Iterable[str]) -> str:
    """A suggestion for an unknown name, as the end of a message."""
    names = list(names)
    text = str(name)
    last = text.rsplit("/", 1)[-1]
    near = difflib.get_close_matches(text, names, n=1, cutoff=0.75)
    if near:
        return f"; did you mean {near[0]!r}?"
    near = [own for own in names if text in own or own.rsplit("/", 1)[-1] == last]
    return f"; available: {', '.join((near or names)[:6])}" + ("" if near else ", ...")


class Ledger(Mapping[str, _grapnel.Check]):
    """The checks of a capture by name, each with `value`, `bound`, `unit`, `passed` and `kind`: conservation laws, and the
    feasibility for the robot."""

    def __init__(self, checks: Iterable[_grapnel.Check]) -> None:
        self._checks = {check.name: check for check in checks}

    def __getitem__(self, name: str) -> _grapnel.Check:
        try:
            return self._checks[name]
        except KeyError:
            raise KeyError(f"no check is named {name!r}{_meant(name, self._checks)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._checks)

    def __len__(self) -> int:
        return len(self._checks)

    @property
    def passed(self) -> bool:
        """Whether all checks of kind 'conservation' passed. If not, the result is not valid."""
        return all(check.passed for check in self._checks.values() if check.kind == "conservation")

    def __repr__(self) -> str:
        lines = [f"  {check.name:<32}{check.value:>12.3g} of {check.bound:<8.3g} {check.unit:<4} "
                 f"{'passed' if check.passed else 'FAILED'}" for check in self._checks.values()]
        return "\n".join(["Ledger", *lines])


class Result(Mapping[str, Array]):
    """A simulated capture: its time series by name, its summary, its ledger.

    `result["base/angular_velocity"]` is an array with one row per sample, at the times `result.time` [s]. Names, units and
    components are those of timeseries.h5 (docs/formats/timeseries.md). Arrays are read-only views of the result's memory, which
    stays valid as long as a view exists; `.copy()` makes a writable array.
    """

    def __init__(self, run: _grapnel.Run) -> None:
        self._run = run

    # ---- Time series ----

    @property
    def time(self) -> Array:
        """Times of the samples [s], shape (samples,). The impact has two samples at one time, before and after it."""
        return self._run.time

    @property
    def phase(self) -> Array:
        """The phase of each sample, shape (samples,): an index into `phases`."""
        return self._run.phase

    @property
    def phases(self) -> list[str]:
        """Names of the phases: 'approach', 'contact', 'post_impact' or 'motion', or names that the scenario specifies."""
        return self._run.phases

    @cached_property
    def _names(self) -> list[str]:
        return self._run.names

    def __getitem__(self, name: str) -> Array:
        """Samples of a quantity: shape (samples, width), or (samples,) for a scalar."""
        if not isinstance(name, str):
            raise TypeError(f"the name of a series is {name!r}; expected a string")
        try:
            return self._run.series(name)
        except KeyError:
            hint = f"; the samples' {name} is result.{name}" if name in ("time", "phase") else _meant(name, self._names)
            raise KeyError(f"no series is named {name!r}{hint}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    @cached_property
    def units(self) -> dict[str, str]:
        """Unit of every series, '1' if dimensionless; `units["time"]` is 's'."""
        return {"time": "s", **{name: self._run.unit(name) for name in self._names}}

    @cached_property
    def components(self) -> dict[str, list[str]]:
        """Names of the columns of every series: 'x', 'y', 'z', or names of joints; [''] for a scalar."""
        return {name: self._run.components(name) for name in self._names}

    @cached_property
    def descriptions(self) -> dict[str, str]:
        """Description of every series, with its frame."""
        return {name: self._run.description(name) for name in self._names}

    def to_pandas(self, names: str | Iterable[str] | None = None) -> Any:
        """Series, by default all, as a pandas.DataFrame with a row per sample and a column per component ('base/position/x'),
        indexed by time; units in `.attrs["units"]`. Requires pandas."""
        import pandas

        columns: dict[str, Array] = {}
        units: dict[str, str] = {}
        for name in self._names if names is None else [names] if isinstance(names, str) else names:
            array = self[name]
            rows = array.reshape(len(array), -1)
            for k, component in enumerate(self.components[name]):
                column = f"{name}/{component}" if component else name
                columns[column], units[column] = rows[:, k], self.units[name]
        frame = pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))
        frame.attrs["units"] = units
        return frame

    # ---- Outcome ----

    @property
    def status(self) -> str:
        """'completed' or 'failed'; `failure` then has the cause, place and time."""
        return self._run.status

    @property
    def failure(self) -> str:
        """Cause of a failed simulation: body, time and condition; '' if it completed."""
        return self._run.failure

    @property
    def captured(self) -> str:
        """'yes': every end-effector was within its capture envelope. 'no'. 'assumed': end-effectors have no capture envelope."""
        return self._run.captured

    @property
    def feasible(self) -> str:
        """'yes', 'no' (bodies overlap, joints beyond their limits), or 'not checked'."""
        return self._run.feasible

    @property
    def verdict(self) -> list[str]:
        """The verdicts on capture and feasibility, as the program prints them."""
        return self._run.verdict

    @cached_property
    def ledger(self) -> Ledger:
        """The conservation checks, by name."""
        return Ledger(self._run.ledger)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The content of summary.json as dictionaries and lists (docs/formats/summary.md): impulses, energies, final states."""
        summary: dict[str, Any] = json.loads(self._run.summary_json)
        return summary

    @property
    def control_loops(self) -> list[dict[str, Any]]:
        """Stability and margins of the controllers at the start and end of every phase, as `control_loops` of summary.json. Empty
        without `margins=True`, or if no law acts whose state is accessible; `warnings` then has the reason."""
        return list(self.summary.get("control_loops", []))

    @property
    def name(self) -> str:
        """The scenario's name."""
        return self._run.name

    @property
    def sha256(self) -> str:
        """SHA-256 of the scenario's input."""
        return self._run.sha256

    @property
    def warnings(self) -> list[str]:
        """Warnings about implausible input and from the simulation."""
        return self._run.warnings

    def raise_if_failed(self) -> Result:
        """Raises SimulationError if the simulation or its conservation checks failed; otherwise returns the result itself."""
        if self.status != "completed":
            raise SimulationError(f"the simulation failed: {self.failure}", self)
        failed = [check for check in self.ledger.values() if check.kind == "conservation" and not check.passed]
        if failed:
            advice = "".join(f"; {check.advice}" for check in failed if check.advice)
            raise SimulationError("conservation checks failed: " + "; ".join(map(repr, failed)) + advice, self)
        return self

    # ---- Pictures ----

    def plot(self, what: str | Iterable[str] = "joints", axes: Any = None) -> Any:
        """Draws series over time with matplotlib and returns their axes, one per series. `what`: a figure ('joints', 'base',
        'momentum', 'wheels', 'loads'), a series ('joints/effort'), a group of series ('targets/debris'), or several of these. Dotted
        lines separate the phases. `axes`: those to draw in, at least as many as series; None: a new figure."""
        return display.plot(self, what, axes)

    def replay(self, height: int = 640) -> display.Replay:
        """The report with its 3D replay, as an object that a notebook shows; `height` in pixels."""
        return display.Replay(self, height)

    def _repr_html_(self) -> str:
        return display.as_html(self)

    # ---- Files ----

    def save(self, folder: Path, report: bool | None = None) -> None:
        """Writes the files of `grapnel run -o FOLDER`: summary.json, timeseries.h5, scene.json, scenario.json and report.html.
        `report`: None writes the report if Grapnel was built with its viewer."""
        self._run.save(file_path("folder", folder), None if report is None else bool(report))

    def report(self, file: Path) -> None:
        """Writes the report, an HTML page with replay, plots and all numbers that opens from disk."""
        self._run.report(file_path("file", file))

    def __str__(self) -> str:
        """The table that `grapnel run` prints."""
        return self._run.table

    def __repr__(self) -> str:
        return f"<grapnel.Result of {self.name!r}: {self.status}, captured: {self.captured}, feasible: {self.feasible}>"

    def __reduce__(self) -> tuple[Any, ...]:
        raise TypeError("a grapnel.Result cannot be pickled; pickle parts of it, such as dict(result) or result.summary. "
                        "Threads and grapnel.simulate_many run in parallel without other processes")

    def __copy__(self) -> Result:
        return self  # immutable

    def __deepcopy__(self, _memo: object) -> Result:
        return self

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other
