"""A published planar capture: forces of the first touch against those of the published program and its refinement."""

import importlib.util

import numpy as np
import pytest
from conftest import HERE, SOURCE


def published_example():
    spec = importlib.util.spec_from_file_location("published", SOURCE / "examples/python/published_controller.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def reference(spin):
    """Rows of time, forces on the left and right gripper as published, and the same with refined laws and steps."""
    with open(HERE / f"data/planar-capture-{spin}-rad-per-s.csv", encoding="utf-8") as file:
        return np.array([[float(x) for x in line.split(",")] for line in file if line[0].isdigit()])


def first_touch(spin, closing, duration):
    """Rows of the reference, and Grapnel's forces on both grippers at their times."""
    rows = reference(spin)
    published = published_example()
    result = published.capture(float(spin), closing, duration)
    assert result.status == "completed" and result.ledger.passed
    samples, first = np.unique(result.time, return_index=True)
    return rows, np.column_stack([np.interp(rows[:, 0], samples, published.force_on(result, name)[first])
                                  for name in ("left", "right")])


@pytest.mark.parametrize("spin, peak", [(1, 1.12969), (3, 4.09178)])
def test_the_program_has_the_published_peaks(spin, peak):
    assert reference(spin)[:, 2].max() == pytest.approx(peak, abs=5e-6)  # of the right gripper


def test_forces_at_one_radian_per_second():
    rows, forces = first_touch(1, 0.5, 0.15)
    peaks = rows[:, 1:].max(axis=0)
    assert forces.max(axis=0) == pytest.approx(peaks[2:], rel=2e-4)  # measured 2.2e-5
    assert forces.max(axis=0) == pytest.approx(peaks[:2], rel=0.02)  # measured 0.0164 and 0.0095
    difference = np.abs(forces - rows[:, 3:]) / peaks[2:].max()
    sliding = rows[:, 0] < 2.535  # then the slip changes its direction, and friction sticks elastically in Grapnel
    assert difference[sliding].max() < 2e-4  # measured 5.3e-5
    assert difference.max() < 0.1  # measured 0.075


def test_forces_at_three_radians_per_second():
    rows, forces = first_touch(3, 0.6, 0.01)
    peaks = rows[:, 3:].max(axis=0)
    assert forces.max(axis=0) == pytest.approx(peaks, rel=2e-4)  # measured 2.3e-5
    assert (np.abs(forces - rows[:, 3:]) / peaks.max()).max() < 2e-4  # measured 3.3e-5
