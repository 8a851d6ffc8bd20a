"""Results in notebooks and in matplotlib."""

from __future__ import annotations

import html
import tempfile
from collections.abc import Iterable
from pathlib import Path as _Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arguments import Array, whole_number

if TYPE_CHECKING:
    from .result import Result

#: Standard figures: the series of each, of which a result has some.
FIGURES = {
    "joints": ("joints/position", "joints/velocity", "joints/effort"),
    "base": ("base/position", "base/velocity", "base/angular_velocity"),
    "momentum": ("robot/linear_momentum", "robot/angular_momentum", "system/linear_momentum", "system/angular_momentum"),
    "wheels": ("wheels/rate", "wheels/momentum", "wheels/torque"),
    "loads": ("joints/reaction_force", "joints/reaction_moment"),
}

_COLOURS = ("#2166ac", "#b2182b", "#1b7837", "#e08214", "#762a83", "#4d4d4d", "#35978f", "#c51b7d")
_SMALL = ("joints/velocity", "base/angular_velocity", "base/velocity")
_POINTS = 240  # of a line in a small plot


def series_of(result: Result, what: str | Iterable[str]) -> list[str]:
    """The series of a standard figure, of a group ('targets/debris'), or the named ones. Raises KeyError for unknown names."""
    if not isinstance(what, str):
        return [name for one in what for name in series_of(result, one)]
    if what in result:
        return [what]
    names = [name for name in FIGURES.get(what, ()) if name in result]
    names = names or [name for name in result if name.startswith(f"{what}/")]
    if not names:
        figures = [figure for figure, series in FIGURES.items() if any(name in result for name in series)]
        raise KeyError(f"{what!r} is neither a figure of this result ({', '.join(figures)}) nor a series, such as 'joints/position'")
    return names


def _boundaries(result: Result) -> list[float]:
    """Times at which a phase ends and another begins."""
    time, phase = result.time, result.phase
    return [float(time[k]) for k in np.flatnonzero(np.diff(phase)) + 1]


def plot(result: Result, what: str | Iterable[str] = "joints", axes: Any = None) -> Any:
    """Draws series over time with matplotlib, one below the other, and returns the array of their axes; see Result.plot."""
    import matplotlib.pyplot as pyplot

    names = series_of(result, what)
    if not names:
        raise ValueError("what is empty; expected a figure or series")
    if axes is None:
        _, axes = pyplot.subplots(len(names), 1, sharex=True, squeeze=False, figsize=(8, 2.4 * len(names) + 0.6), layout="constrained")
    axes = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(axes) < len(names):
        raise ValueError(f"axes has {len(axes)} axes; {len(names)} series need as many: {', '.join(names)}")
    for ax, name in zip(axes, names):
        values = result[name].reshape(len(result.time), -1)
        labels = result.components[name]
        for k in range(values.shape[1]):
            ax.plot(result.time, values[:, k], label=labels[k] or None, linewidth=1)
        for time in _boundaries(result):
            ax.axvline(time, color="0.6", linewidth=0.8, linestyle=":")
        ax.set_ylabel(f"{name.rpartition('/')[2].replace('_', ' ')} [{result.units[name]}]")
        ax.set_title(name, fontsize="medium", loc="left")
        if any(labels) and len(labels) <= 14:
            ax.legend(fontsize="small", loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
    axes[len(names) - 1].set_xlabel("time [s]")
    return axes[:len(names)]


def _parts(values: Array) -> list[Array]:
    """Indices of the finite values, in parts without a gap."""
    rows = np.flatnonzero(np.isfinite(values))
    return [part for part in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if len(part)]


def _extremes(values: Array, rows: Array) -> Array:
    """At most about _POINTS of the rows, with the smallest and the largest value of each interval."""
    if len(rows) <= _POINTS:
        return rows
    chosen = [rows[:1], rows[-1:]]
    for part in np.array_split(rows, _POINTS // 2):
        chosen += [part[[int(np.argmin(values[part]))]], part[[int(np.argmax(values[part]))]]]
    return np.asarray(np.unique(np.concatenate(chosen)))


def _small_plot(time: Array, values: Array, title: str, boundaries: list[float]) -> str:
    """An SVG image of the columns of `values`, (n, width)."""
    width, height, left, top = 300, 110, 6, 20
    values = values.reshape(len(time), -1)
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    if not high > low:
        low, high = low - 1, high + 1
    begin, end = float(time[0]), max(float(time[-1]), float(time[0]) + 1e-12)

    def across(t: Array) -> Array:
        return np.asarray(left + (t - begin) / (end - begin) * (width - 2 * left))

    def up(y: Array) -> Array:
        return np.asarray(top + (high - y) / (high - low) * (height - top - left))

    lines = []
    for k in range(values.shape[1]):
        for part in _parts(values[:, k]):
            rows = _extremes(values[:, k], part)
            points = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across(time[rows]), up(values[rows, k])))
            lines.append(f'<polyline points="{points}" fill="none" stroke="{_COLOURS[k % len(_COLOURS)]}" stroke-width="1"/>')
    for t in boundaries:
        x = float(across(np.asarray(t)))
        lines.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{top}" y2="{height - left}" stroke="#999" stroke-dasharray="2 2"/>')
    text = html.escape(f"{title}: {low:.3g} to {high:.3g}")
    return (f'<svg width="{width}" height="{height}" role="img" aria-label="{text}"><text x="{left}" y="13" font-size="11" fill="currentColor">'
            f'{text}</text>{"".join(lines)}</svg>')


def as_html(result: Result) -> str:
    """Verdicts, ledger and small plots of a result, for notebooks."""
    verdicts = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in result.verdict)
    rows = "".join(
        f"<tr><td style='text-align:left'>{html.escape(check.name)}</td><td>{check.value:.3g}</td><td>{check.bound:.3g}</td>"
        f"<td style='text-align:left'>{html.escape(check.unit)}</td><td style='text-align:left'>{html.escape(check.kind)}</td><td style='text-align:left'>{'passed' if check.passed else '<b>FAILED</b>'}</td></tr>"
        for check in result.ledger.values())
    plots = "".join(_small_plot(result.time, result[name], f"{name} [{result.units[name]}]", _boundaries(result))
                    for name in _SMALL if name in result and len(result.time) > 1)
    infeasible = sum(not check.passed for check in result.ledger.values() if check.kind != "conservation")
    label = f"Conservation checks: {'passed' if result.ledger.passed else 'FAILED'}"
    label += f"; {infeasible} other check{'s' if infeasible > 1 else ''} FAILED" if infeasible else ""
    failure = f"<p><b>{html.escape(result.failure)}</b></p>" if result.failure else ""
    return (f"<div><b>{html.escape(result.name)}</b>: {html.escape(result.status)}{failure}<ul>{verdicts}</ul><div>{plots}</div>"
            f"<details><summary>{label}</summary><table><thead><tr><th>check</th><th>value</th>"
            f"<th>bound</th><th>unit</th><th>kind</th><th></th></tr></thead><tbody>{rows}</tbody></table></details></div>")


class Replay:
    """The report of a result with its 3D replay, shown inside a notebook. It needs no network."""

    def __init__(self, result: Result, height: int = 640) -> None:
        height = whole_number("height", height, 1, 100_000)
        with tempfile.TemporaryDirectory() as folder:
            file = _Path(folder) / "report.html"
            result.report(file)
            self._page = file.read_text(encoding="utf-8")
        self._height = height

    def _repr_html_(self) -> str:
        return (f'<iframe sandbox="allow-scripts allow-downloads" style="width:100%;height:{self._height}px;border:0" '
                f'srcdoc="{html.escape(self._page, quote=True)}"></iframe>')

    def __repr__(self) -> str:
        return f"<grapnel replay, {len(self._page) / 2**20:.1f} MiB>"
