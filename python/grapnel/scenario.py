"""Scenarios from files or dictionaries: read and change all values, simulate one or many."""

from __future__ import annotations

import inspect
import math
import operator
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from . import _grapnel
from ._arguments import Path, file_path, thread_count
from .controller import Controller, _given
from .linear import LinearModel
from .progress import ProgressChoice, reported
from .result import Result
from .sensitivities import Sensitivities, _names


def _changes(values: Mapping[str, Any] | None) -> list[tuple[str, Any]]:
    if values is None:
        return []
    if not isinstance(values, Mapping):
        raise TypeError(f"set is {type(values).__name__}; expected a mapping of paths to values, "
                        "such as {'approach.duration': 20}")
    for path in values:
        if not isinstance(path, str):
            raise TypeError(f"the path is {path!r}; expected a string such as 'targets[0].mass'")
    return list(values.items())


def _below(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key


def _is_structured(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and any(isinstance(item, (dict, list)) for item in value))


class Values:
    """A part of a scenario: a mapping, or a list of mappings. Read and assign values by attributes or items.

    `problem.targets[0].mass = 12` and `problem.targets["satellite"].mass = 12` are equivalent. Values include all changes and
    defaults, in SI units; `.value` is a copy of the whole part as dictionaries and lists. Lists of numbers are tuples: assign a
    whole list.
    """

    __slots__ = ("_problem", "_path")

    def __init__(self, problem: Problem, path: str) -> None:
        object.__setattr__(self, "_problem", problem)
        object.__setattr__(self, "_path", path)

    @property
    def value(self) -> Any:
        """A copy as dictionaries, lists, numbers and strings."""
        return self._problem._core.get(self._path)

    def _place(self, key: str | int) -> str:
        if isinstance(key, str):
            return _below(self._path, key)
        if isinstance(key, bool) or not hasattr(key, "__index__"):
            raise TypeError(f"{key!r} is neither a key nor an index")
        index, count = operator.index(key), len(self)
        if not -count <= index < count:
            raise IndexError(f"{self._path} has {count} items; index [{index}] is out of range")
        return f"{self._path}[{index % count}]"

    def __getattr__(self, key: str) -> Any:
        if key.startswith("_"):
            raise AttributeError(key)
        try:
            return self._problem[_below(self._path, key)]
        except KeyError as error:
            raise AttributeError(*error.args) from None

    def __setattr__(self, key: str, value: Any) -> None:
        self._problem[_below(self._path, key)] = value

    def __getitem__(self, key: str | int) -> Any:
        return self._problem[self._place(key)]

    def __setitem__(self, key: str | int, value: Any) -> None:
        self._problem[self._place(key)] = value

    def __len__(self) -> int:
        return len(self.value)

    def __iter__(self) -> Iterator[Any]:
        """Iterates over the keys of a mapping or the items of a list."""
        value = self.value
        return iter(value) if isinstance(value, dict) else (self[i] for i in range(len(value)))

    def __contains__(self, key: object) -> bool:
        return key in self.value

    def keys(self) -> list[str]:
        """Keys of a mapping."""
        return list(self.value)

    def items(self) -> list[tuple[str, Any]]:
        """Keys and values of a mapping."""
        return [(key, self[key]) for key in self.value]

    def __eq__(self, other: object) -> bool:
        return bool(self.value == (other.value if isinstance(other, Values) else other))

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return Values, (self._problem, self._path)

    def __repr__(self) -> str:
        return f"<{self._path}: {self.value!r}>"

    def __dir__(self) -> list[str]:
        value = self.value
        return sorted({*object.__dir__(self), *(value if isinstance(value, dict) else ())})


class Problem:
    """A capture problem, created by `load` or `Scenario`. Every change is validated immediately, as a whole scenario.

    Access values by their paths, as with `--set` of the program: `problem["targets[0].mass"]`, `problem["robot.base.mass"]`; or
    by attributes, `problem.targets[0].mass`. An invalid change raises `InputError` and leaves the problem unchanged.
    """

    _core: _grapnel.Problem

    def __init__(self, core: _grapnel.Problem) -> None:
        object.__setattr__(self, "_core", core)

    # ---- Values ----

    def __getitem__(self, path: str) -> Any:
        """The value at a path, with all changes and defaults: a number, a string, a tuple, or `Values` for a part."""
        if not isinstance(path, str):
            raise TypeError(f"the path is {path!r}; expected a string such as 'targets[0].mass'")
        value = self._core.get(path)
        if _is_structured(value):
            return Values(self, path)
        return tuple(value) if isinstance(value, list) else value

    def __setitem__(self, path: str, value: Any) -> None:
        self.set({path: value})

    def set(self, values: Mapping[str, Any]) -> Problem:
        """Changes several values together, by their paths: all of them, or none if the result is not a valid scenario. Raises
        InputError with all errors. Returns the problem itself."""
        self._core.set([(path, value.value if isinstance(value, Values) else value) for path, value in _changes(values)])
        return self

    def __iter__(self) -> Iterator[str]:
        """Iterates over the top-level keys: 'name', 'robot', 'targets', ..."""
        return iter(self._core.get(""))

    def __contains__(self, path: object) -> bool:
        """Whether a value exists at this path."""
        try:
            return isinstance(path, str) and self._core.get(path) is not None
        except KeyError:
            return False

    def __getattr__(self, key: str) -> Any:
        if key.startswith("_"):
            raise AttributeError(key)
        try:
            return self[key]
        except KeyError as error:
            raise AttributeError(*error.args) from None

    def __setattr__(self, key: str, value: Any) -> None:
        if isinstance(getattr(type(self), key, None), property) and key != "name":
            raise AttributeError(f"{key} cannot be set")
        self.set({key: value})

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *self._core.get("")})

    @property
    def name(self) -> str:
        """The scenario's name."""
        return self._core.name

    @property
    def file(self) -> str:
        """The file of the scenario; relative file names refer to its folder."""
        return self._core.file

    @property
    def sha256(self) -> str:
        """SHA-256 of all input, the same as that of the program for the same files and `--set`."""
        return self._core.sha256

    @property
    def settings(self) -> list[str]:
        """All changes in the form of `--set` of the program: "targets[0].mass=12"."""
        return self._core.settings

    @property
    def warnings(self) -> list[_grapnel.Fault]:
        """Warnings about valid but implausible input."""
        return self._core.warnings

    def copy(self) -> Problem:
        """An independent problem with the same values."""
        return Problem(self._core.copy())

    __copy__ = copy

    def __deepcopy__(self, _memo: object) -> Problem:
        return self.copy()

    def __reduce__(self) -> tuple[Any, ...]:
        # Another process reads the files again and checks that they are unchanged.
        return _again, (type(self), os.path.abspath(self.file), self._core.values, self._core.changes, self.sha256)

    def text(self) -> str:
        """The text of a YAML file with all changes, for the folder of the original file."""
        return self._core.text(self._core.file)

    def write(self, file: Path) -> None:
        """Writes a scenario file for the program, with all changes; names of other files are relative to its folder."""
        text = self._core.text(file_path("file", file))
        with open(file, "w", encoding="utf-8") as stream:
            stream.write(text)

    def __repr__(self) -> str:
        return f"<grapnel.Problem {self.name!r}, sha256 {self.sha256[:12]}>"

    # ---- Simulation ----

    def simulate(self, strict: bool = False, controller: Controller | type[Controller] | None = None, margins: bool = False) -> Result:
        """Simulates the capture, with the same bits as `grapnel run`. Ctrl-C ends it.

        `controller`: drives the joints of a scenario with `control.external: true`, see `grapnel.Controller`. `margins`: also
        computes `Result.control_loops`, as `grapnel run --margins`, which simulates a second time.

        A failed simulation returns its results up to the failure: see `Result.status`. With `strict`, failed simulations and
        failed conservation checks raise `SimulationError`.
        """
        return _simulate([self], 1, strict, [controller], margins=margins)[0]

    def linearize(self, time: float = 0, sample_time: float | None = None, delay: float = 0) -> LinearModel:
        """The linear model of the system at a time [s], and the stability of the scenario's controllers, as `grapnel linearize`.

        `sample_time` and `delay` [s] are those of the sampled model; None: those of the scenario's controllers, if they are
        sampled. Raises ValueError for impossible arguments, RuntimeError if no motion begins or continues at that time.
        """
        for name, value, is_valid in (("time", time, time >= 0), ("sample_time", sample_time, sample_time is None or sample_time > 0),
                                      ("delay", delay, delay >= 0)):
            if value is not None and not (is_valid and math.isfinite(value)):
                raise ValueError(f"{name} is {value!r}; expected a finite number of seconds, {'above' if name == 'sample_time' else 'at least'} 0")
        if delay > 0 and sample_time is None:
            raise ValueError(f"delay is {delay!r} without a sample_time; expected both")
        return LinearModel(_grapnel.linearize(self._core, float(time), None if sample_time is None else float(sample_time),
                                              float(delay)))

    def sensitivities(self, of: str | Iterable[str] | None = None, by: str | Iterable[str] | None = None, impact_only: bool = False,
                      plan_once: bool = False, threads: int = 0) -> Sensitivities:
        """Derivatives of outcomes of the capture by values of the scenario, as `grapnel sensitivities`. Ctrl-C ends it.

        `of`: columns of studies, such as "grasps/*/impulse_magnitude". `by`: paths of values, such as "targets[0].mass". None: the
        main outcomes, and the default values. `impact_only`: simulates the impact only. `plan_once`: every run follows the plan
        of this problem. `threads`: 0 is one per processor. Raises InputError for unknown names, RuntimeError if the capture fails.
        """
        return Sensitivities(_grapnel.sensitivities(self._core, _names("of", of), _names("by", by), bool(impact_only),
                                                    bool(plan_once), thread_count(threads)))


class Scenario(Problem):
    """A scenario from a dictionary with the keys of a scenario file (docs/formats/scenario.md).

    Numbers may be Python or NumPy numbers, lists may be arrays. Names of other files (robot, trajectory, meshes) are relative to
    `folder`. Errors name the value: `targets[0].mass`. `write` writes a scenario file.
    """

    def __init__(self, values: Mapping[str, Any], folder: Path = ".", set: Mapping[str, Any] | None = None) -> None:
        if not isinstance(values, Mapping):
            raise TypeError(f"the scenario is {type(values).__name__}; expected a mapping such as {{'schema': ...}}; "
                            "grapnel.load reads files")
        super().__init__(_grapnel.Problem(dict(values), file_path("folder", folder), _changes(set)))


def _again(kind: type[Problem], file: str, values: dict[str, Any] | None, changes: list[tuple[str, Any]],
           sha256: str) -> Problem:
    """Restores a pickled problem."""
    core = (_grapnel.Problem(file, changes) if values is None else
            _grapnel.Problem(values, os.path.dirname(file), changes))
    if core.sha256 != sha256:
        raise ValueError(f"{file}, or a file that it names, has changed since the problem was pickled")
    problem = kind.__new__(kind)
    Problem.__init__(problem, core)
    return problem


def load(file: Path, set: Mapping[str, Any] | None = None) -> Problem:
    """Reads a scenario file and the files it names. `set` changes values by their paths, as `--set` of the program:
    `load("a.yaml", set={"targets[0].mass": 12, "post_impact.joints": "free"})`. Raises InputError with all errors."""
    return Problem(_grapnel.Problem(file_path("file", file), _changes(set)))


def check(scenario: Path | Mapping[str, Any], set: Mapping[str, Any] | None = None, folder: Path = ".") -> list[_grapnel.Fault]:
    """All errors in a scenario file or dictionary, each with its location. Without errors: warnings about implausible input, or
    an empty list."""
    if isinstance(scenario, Mapping):
        return _grapnel.check_values(dict(scenario), file_path("folder", folder), _changes(set))
    return _grapnel.check_file(file_path("scenario", scenario), _changes(set))


def simulate_many(problems: Iterable[Problem], threads: int = 0, strict: bool = False,
                  controller: type[Controller] | None = None, progress: ProgressChoice = None,
                  margins: bool = False) -> list[Result]:
    """Simulates captures in parallel. Results have the order of the problems, with the same bits for any number of threads.

    `controller`: a class as for `Problem.simulate`; each run creates an object of it. Python runs their updates one at a time.
    `threads`: 0 for one per processor. Other Python threads continue to run. Ctrl-C ends all runs. `strict` and `margins` as for
    `Problem.simulate`, `progress` as for `grapnel.campaign`. For thousands of cases with drawn values, `grapnel.campaign` is
    faster and keeps less data per case.
    """
    if isinstance(problems, Problem):
        raise TypeError("problems is one grapnel.Problem; expected several, such as a list; use problem.simulate() for one")
    problems = list(problems)
    for problem in problems:
        if not isinstance(problem, Problem):
            raise TypeError(f"{problem!r} is not a grapnel.Problem")
    if controller is not None and not inspect.isclass(controller):
        raise TypeError("controller is one object for several runs; expected its class, of which each run creates an object")
    return _simulate(problems, threads, strict, [controller] * len(problems), progress, margins)


def _simulate(problems: list[Problem], threads: int, strict: bool, controllers: list[Any],
              progress: ProgressChoice = False, margins: bool = False) -> list[Result]:
    cores, count, given = [problem._core for problem in problems], thread_count(threads), [_given(controller) for controller in controllers]
    with reported(progress, "problems") as report:
        results = [Result(run) for run in _grapnel.simulate_many(cores, count, given, bool(margins), report)]
    if strict:
        for result in results:
            result.raise_if_failed()
    return results
