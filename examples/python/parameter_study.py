"""A parameter study: impulse against approach angle over a grid, as a table and a figure.

The grid is a dictionary with the keys of a study file (docs/formats/study.md). It is also written to a study file beside
the results, which `grapnel sweep` accepts.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/parameter_study.py [FOLDER]
"""

import pathlib
import sys

import numpy as np

import grapnel

source = pathlib.Path(__file__).parents[2]
out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/python/parameter-study")

study = {
    "name": "impulse against angle and speed",
    "scenario": source / "scenarios" / "thesis" / "open-loop-case-1-planned.yaml",
    "simulate": "impact",
    "set": {"approach.plan.starts": 4},  # initial guesses; those without a solution take most of the time
    "axes": [
        {"quantity": "relative_speed", "values": [0.05, 0.1]},  # [m/s]
        {"quantity": "approach_angle", "values": np.linspace(-20, 60, 7), "unit": "deg"},
    ],
}

folder = grapnel.sweep(study, out=out / "results")
columns, units = grapnel.read_columns(folder)
impulse = next(name for name in columns if name.endswith("impulse_magnitude"))
speed, angle = (next(name for name in columns if key in name) for key in ("speed", "angle"))
print(f"{len(columns['case'])} points; {impulse} [{units[impulse]}] over {speed} [{units[speed]}] and {angle} [{units[angle]}]")
for value in np.unique(columns[speed]):
    row = columns[impulse][columns[speed] == value]
    print(f"  {value:5.3g} {units[speed]}: {np.nanmin(row):.4f} to {np.nanmax(row):.4f} {units[impulse]}")

try:
    import matplotlib
except ImportError:
    grapnel.figure(folder, "impulse-map", out / "impulse.svg")  # drawn by gnuplot, for papers
else:
    matplotlib.use("agg")
    from matplotlib import pyplot

    for value in np.unique(columns[speed]):
        of = columns[speed] == value
        pyplot.plot(columns[angle][of], columns[impulse][of], label=f"{value:g} {units[speed]}")
    pyplot.xlabel(f"{angle} [{units[angle]}]")
    pyplot.ylabel(f"{impulse} [{units[impulse]}]")
    pyplot.legend()
    pyplot.savefig(out / "impulse.svg")
print(f"figure in {out}/impulse.svg, report in {folder}")
