"""Runs the studies of the thesis's section 4.3 and computes tables of impulses from their results. Standard library only.

Used by scripts/validation (tables) and scripts/impulse_charts.py (curves).
"""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(os.environ.get("GRAPNEL_PROGRAM", ROOT / "build" / "release" / "bin" / "grapnel"))

CASES = ("case 1", "case 2", "case 3", "case 4")
GRIPS = ("tip-1", "tip-2")
MOTION = "motion of the target"
ANGLE = "approach_angle [deg]"
SPEED = "relative_speed [m/s]"


def sweep(study):
    """The points of studies/STUDY.yaml as dictionaries by column; numbers are floats. Points may be unreachable."""
    with tempfile.TemporaryDirectory() as folder:
        command = [PROGRAM, "sweep", ROOT / "studies" / f"{study}.yaml", "-o", folder, "--quiet", "-j", str(os.cpu_count())]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if done.returncode not in (0, 3):
            sys.exit(done.stderr)
        with open(pathlib.Path(folder) / "table.csv", newline="") as file:
            return [{name: value_of(text) for name, text in row.items()} for row in csv.DictReader(file)]


def impact_of(scenario):
    """`impact` of the summary of a run of scenarios/SCENARIO.yaml."""
    with tempfile.TemporaryDirectory() as folder:
        command = [PROGRAM, "run", ROOT / "scenarios" / f"{scenario}.yaml", "-o", folder, "--quiet"]
        done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
        return json.loads((pathlib.Path(folder) / "summary.json").read_text())["impact"]


def value_of(text):
    try:
        return float(text)
    except ValueError:
        return text


def magnitude(row, grasp):
    """|P| on the robot at a grasp [N s]."""
    return row[f"grasps/{grasp}/impulse_magnitude [N s]"]


def impulse(row, grasp):
    """On the robot at a grasp, in W [N s]."""
    return [row[f"grasps/{grasp}/impulse/{c} [N s]"] for c in "xyz"]


def angular_impulse(row, grasp):
    """On the robot about the contact point of a grasp, in W [N m s]."""
    return [row[f"grasps/{grasp}/angular_impulse/{c} [N m s]"] for c in "xyz"]


def joints(row):
    """Joint angles at the capture [rad]."""
    return [row[f"joints/arm-{arm}-joint-{i}/position [rad]"] for arm in (1, 2) for i in (1, 2, 3)]


def distance(a, b):
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)))


def bend(speeds, curve):
    """Largest distance of a curve of vectors from the straight line between its ends, over its largest length."""
    largest = max(math.hypot(*p) for p in curve)
    if largest == 0:
        return 0.0
    first, last = curve[0], curve[-1]
    worst = 0.0
    for v, p in zip(speeds, curve):
        share = (v - speeds[0]) / (speeds[-1] - speeds[0])
        worst = max(worst, distance(p, [a + share * (b - a) for a, b in zip(first, last)]))
    return worst / largest


def angles_of(rows):
    """The angles of approach of a table [deg], in order."""
    return sorted({r[ANGLE] for r in rows})


def along_speed(rows, case, angle):
    """The points of one case and angle, by increasing speed."""
    return sorted((r for r in rows if r[MOTION] == case and r[ANGLE] == angle), key=lambda r: r[SPEED])


def affine_residual(rows, twist, outputs):
    """Deviation of outputs from the affine map of the twist's components, over the largest output.

    `rows` is a full grid over the columns `twist`; the map is taken from one corner and its neighbours along each column.
    """
    values = {c: sorted({r[c] for r in rows}) for c in twist}
    at = {tuple(r[c] for c in twist): outputs(r) for r in rows}
    corner = tuple(values[c][0] for c in twist)
    slopes = []
    for i, c in enumerate(twist):
        next_to = (*corner[:i], values[c][-1], *corner[i + 1:])
        step = values[c][-1] - values[c][0]
        slopes.append([(b - a) / step for a, b in zip(at[corner], at[next_to])])
    largest = max(math.hypot(*p) for p in at.values())
    worst = 0.0
    for where, p in at.items():
        expected = list(at[corner])
        for i, slope in enumerate(slopes):
            expected = [e + (where[i] - corner[i]) * s for e, s in zip(expected, slope)]
        worst = max(worst, distance(p, expected))
    return worst / largest


# Largest joint motion between neighbours of a fine grid for the same configuration [rad].
JUMP = 0.6


def families(rows):
    """Points in the order of the angle, cut where a point is unreachable or the configuration jumps."""
    parts, last = [], None
    for row in sorted(rows, key=lambda r: r[ANGLE]):
        if row["status"] != "ok":
            last = None
            continue
        if last is None or max(abs(a - b) for a, b in zip(joints(last), joints(row))) > JUMP:
            parts.append([])
        parts[-1].append(row)
        last = row
    return parts
