"""Sensitivities of captures: derivatives of outcomes by values of the scenario, and first-order uncertainty."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _grapnel
from ._arguments import Path, file_path, thread_count


def _names(name: str, given: str | Iterable[str] | None) -> list[str]:
    """Names as a list; a single name is allowed."""
    if given is None:
        return []
    names = [given] if isinstance(given, str) else list(given)
    for one in names:
        if not isinstance(one, str) or not one:
            raise TypeError(f"{name} has {one!r}; expected names such as 'targets[0].mass'")
    return names


class Sensitivities:
    """Derivatives of the outcomes of a capture by values of its scenario, from `Problem.sensitivities` or
    `campaign_sensitivities`. Rows are outcomes, columns are values; SI units. docs/formats/sensitivities.md describes all values.
    """

    of: list[str]  #: names of the outcomes
    by: list[str]  #: names of the values
    outcomes: NDArray[np.float64]  #: outcomes at the values
    at: NDArray[np.float64]  #: the values
    derivatives: NDArray[np.float64]  #: outcome by value; nan where the verdict is not 'yes'
    errors: NDArray[np.float64]  #: their estimated errors
    elasticities: NDArray[np.float64]  #: value / outcome times the derivative; nan for an outcome that is zero or negligible
    verdicts: list[list[str]]  #: 'yes', 'NO' or 'not decided'
    values: dict[str, Any]  #: all values, as in sensitivities.json

    def __init__(self, core: _grapnel.SensitivityReport) -> None:
        self._core = core
        self.values = json.loads(core.json())
        self.of = [one["name"] for one in self.values["outcomes"]]
        self.by = [one["name"] for one in self.values["values"]]
        self.outcomes = self._numbers([one["value"] for one in self.values["outcomes"]])
        self.at = self._numbers([one["value"] for one in self.values["values"]])
        self.verdicts = [[one["verdict"] for one in outcome["by"]] for outcome in self.values["outcomes"]]
        self.derivatives = self._matrix("derivative")
        self.errors = self._matrix("error")
        self.elasticities = self._matrix("elasticity")

    @staticmethod
    def _numbers(numbers: Sequence[float | None]) -> NDArray[np.float64]:
        return np.array([np.nan if one is None else one for one in numbers], dtype=float)

    def _matrix(self, key: str) -> NDArray[np.float64]:
        rows = [[one.get(key) if one["verdict"] == "yes" else None for one in outcome["by"]] for outcome in self.values["outcomes"]]
        return np.array([self._numbers(row) for row in rows], dtype=float).reshape(len(self.of), len(self.by))

    @property
    def units(self) -> dict[str, str]:
        """Units by the names of outcomes and values."""
        return {one["name"]: one["unit"] for kind in ("outcomes", "values") for one in self.values[kind]}

    @property
    def deviations(self) -> NDArray[np.float64]:
        """Standard deviations of the outcomes to first order, of a campaign; nan where a derivative is not determined."""
        return self._numbers([one.get("deviation") for one in self.values["outcomes"]])

    @property
    def shares(self) -> NDArray[np.float64]:
        """Shares of the values in the variance of each outcome, of a campaign."""
        return self._matrix("share")

    @property
    def limits(self) -> list[dict[str, Any]]:
        """Limits of the campaign's criteria with their first-order probabilities."""
        return list(self.values["limits"])

    def reason(self, of: str, by: str) -> str:
        """Why a derivative is not determined; empty if it is."""
        return str(self.values["outcomes"][self.of.index(of)]["by"][self.by.index(by)]["reason"])

    def text(self) -> str:
        """The tables of `grapnel sensitivities`."""
        return self._core.text()

    def write(self, file: Path) -> None:
        """Writes a file whose name ends in .json or .csv."""
        name = file_path("file", file)
        if not name.endswith((".json", ".csv")):
            raise ValueError(f"the name of the file must end in .json or .csv: {name}")
        with open(name, "w", encoding="utf-8") as stream:
            stream.write(self._core.json() if name.endswith(".json") else self._core.csv())

    def __getitem__(self, names: tuple[str, str]) -> float:
        """The derivative of an outcome by a value: `s["grasps/tip/impulse_magnitude", "targets[0].mass"]`."""
        of, by = names
        for name, known in ((of, self.of), (by, self.by)):
            if name not in known:
                raise KeyError(f"{name!r} is none of {', '.join(known)}")
        return float(self.derivatives[self.of.index(of), self.by.index(by)])

    def __repr__(self) -> str:
        return f"<grapnel.Sensitivities: {len(self.of)} outcomes by {len(self.by)} values>"


def campaign_sensitivities(file: Path, of: str | Iterable[str] | None = None, threads: int = 0) -> Sensitivities:
    """Derivatives by the uncertain values of a campaign file at their means, and the uncertainty of the outcomes to first order.

    `of`: columns, such as "grasps/*/impulse_magnitude"; None: the main ones and those of the criteria. `threads`: 0 is one per
    processor. Raises InputError for errors in the file, RuntimeError if the capture fails."""
    return Sensitivities(_grapnel.campaign_sensitivities(file_path("file", file), _names("of", of), thread_count(threads)))
