"""Tables of campaigns and sweeps."""

from __future__ import annotations

import csv
import os
from typing import Any

import numpy as np

from . import _grapnel
from ._arguments import Array, Path, file_path


def _read_csv(file: str) -> tuple[dict[str, Array], dict[str, str]]:
    """A sweep's table.csv, with "name [unit]" at the head of every column; numbers are read to the same doubles."""
    with open(file, newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    columns: dict[str, Array] = {}
    units: dict[str, str] = {}
    for k, head in enumerate(rows[0]):
        name, _, unit = head.partition(" [")
        texts = [row[k] for row in rows[1:]]
        try:
            values = np.array([float(text) if text else np.nan for text in texts])
        except ValueError:
            values = np.array(texts, dtype=object)
        if name in ("status", "reason"):
            values = np.array(texts, dtype=object)
        if name == "point":
            name, values = "case", np.array([int(text) for text in texts], dtype=np.uint64)
        columns[name], units[name] = values, unit.rstrip("]") or "1"
    return columns, units


def read_columns(folder: Path) -> tuple[dict[str, Array], dict[str, str]]:
    """The columns of a campaign's or sweep's table and their units, by name: `case`, `status` ('ok', ...), `success` (campaigns
    only), `reason`, then design values, drawn values and outcomes. Numbers are the table's doubles; missing values are nan."""
    columns: dict[str, Array] = {}
    units: dict[str, str] = {}
    folder = file_path("folder", folder)
    if os.path.exists(os.path.join(folder, "study.json")):  # a sweep
        return _read_csv(os.path.join(folder, "table.csv"))
    if not os.path.exists(os.path.join(folder, "table.h5")):
        raise FileNotFoundError(f"{folder} is not a folder of a campaign or sweep: it has neither table.h5 nor study.json")
    for name, values, unit in _grapnel.read_table(folder):
        columns[name] = np.asarray(values)
        units[name] = unit
    return columns, units


def read_table(folder: Path) -> Any:
    """The table of a campaign or sweep as a pandas.DataFrame, with a row per case, indexed by the case number; units in
    `.attrs["units"]`. Requires pandas; `read_columns` does not."""
    import pandas

    columns, units = read_columns(folder)
    frame = pandas.DataFrame(columns).set_index("case")
    frame.attrs["units"] = units
    return frame
