"""Tables of campaigns and sweeps."""

from __future__ import annotations

import os
from typing import Any, Union

import numpy as np

from . import _grapnel

Path = Union[str, "os.PathLike[str]"]


def read_columns(folder: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """The columns of a campaign's or sweep's table.h5 and their units, by name: `case`, `status` ('ok', ...), `success`,
    `reason`, then design values, drawn values and outcomes. Numbers are the table's doubles; what a case lacks is nan."""
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for name, values, unit in _grapnel.read_table(folder):
        columns[name] = np.asarray(values)
        units[name] = unit
    return columns, units


def read_table(folder: Path) -> Any:
    """The table of a campaign or sweep as a pandas.DataFrame, a row per case, indexed by the case's number; units in
    `.attrs["units"]`. Needs pandas; `read_columns` does without."""
    import pandas

    columns, units = read_columns(folder)
    frame = pandas.DataFrame(columns).set_index("case")
    frame.attrs["units"] = units
    return frame
