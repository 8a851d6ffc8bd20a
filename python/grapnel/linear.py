"""Linear models of scenarios, for the design of controllers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _grapnel
from ._arguments import Path, file_path


class LinearModel:
    """The linear model of a scenario at a time, from `Problem.linearize`: x' = A x + B u, y = C x + D u, in SI units.

    x, u and y are deviations. `python-control` takes the matrices: `control.ss(m.A, m.B, m.C, m.D)`.
    docs/formats/linear-model.md describes all values.
    """

    A: NDArray[np.float64]  #: x' by x
    B: NDArray[np.float64]  #: x' by u
    C: NDArray[np.float64]  #: y by x
    D: NDArray[np.float64]  #: y by u
    states: list[str]  #: names of x
    inputs: list[str]  #: names of u
    outputs: list[str]  #: names of y
    values: dict[str, Any]  #: all values, as in the JSON file

    def __init__(self, core: _grapnel.LinearModel) -> None:
        self._core = core
        self.values = json.loads(core.json())
        self.states = [one["name"] for one in self.values["states"]]
        self.inputs = [one["name"] for one in self.values["inputs"]]
        self.outputs = [one["name"] for one in self.values["outputs"]]
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        self.A = self._matrix(self.values["A"], n, n)
        self.B = self._matrix(self.values["B"], n, m)
        self.C = self._matrix(self.values["C"], p, n)
        self.D = self._matrix(self.values["D"], p, m)

    @staticmethod
    def _matrix(rows: list[list[float]], height: int, width: int) -> NDArray[np.float64]:
        return np.array(rows, dtype=float).reshape(height, width)

    @property
    def units(self) -> dict[str, str]:
        """Units by the names of states, inputs and outputs."""
        return {one["name"]: one["unit"] for kind in ("states", "inputs", "outputs") for one in self.values[kind]}

    @property
    def sampled(self) -> dict[str, Any] | None:
        """The model from sample to sample, with Ad, Bd and Bd_previous as arrays; None without a sample time."""
        given = self.values.get("sampled")
        if given is None:
            return None
        n, m = len(self.states), len(self.inputs)
        return {**given, "Ad": self._matrix(given["Ad"], n, n), "Bd": self._matrix(given["Bd"], n, m),
                "Bd_previous": self._matrix(given["Bd_previous"], n, m)}

    @property
    def K(self) -> NDArray[np.float64] | None:
        """Inputs by states, u = K x, of the scenario's own laws; None without a closed loop. Joints that move as prescribed have
        zero columns."""
        loop = self.values.get("closed_loop")
        if loop is None:
            return None
        K = np.zeros((len(self.inputs), len(self.states)))
        own = [self.states.index(name) for name in loop["states"]]
        K[:, own] = self._matrix(loop["K"], len(self.inputs), len(own))
        return K

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of the controlled system [1/s], the least stable first; without a closed loop those of A."""
        modes = self.values["closed_loop"]["stability"] if "closed_loop" in self.values else self.values["open_loop"]
        return np.array([complex(one["real"] if one["real"] is not None else -np.inf, one["imaginary"]) for one in modes["eigenvalues"]])

    @property
    def verdict(self) -> str | None:
        """Of the controlled system: 'stable', 'marginal', 'unstable' or 'not decided'; None without a closed loop."""
        loop = self.values.get("closed_loop")
        return None if loop is None else str(loop["stability"]["verdict"])

    @property
    def margins(self) -> list[dict[str, Any]]:
        """Gain, phase and delay margins of each channel, with the others closed."""
        loop = self.values.get("closed_loop")
        return [] if loop is None else list(loop["margins"])

    @property
    def warnings(self) -> list[str]:
        """Doubts, and instability."""
        return list(self.values["warnings"])

    def text(self) -> str:
        """The tables of `grapnel linearize`."""
        return self._core.text()

    def write(self, file: Path) -> None:
        """Writes a file whose name ends in .json or .mat."""
        self._core.write(file_path("file", file))

    def __repr__(self) -> str:
        return f"<grapnel.LinearModel: {len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs>"
