"""Shared by the tests: locations of files, and a problem that simulates quickly."""

import copy
import os
import pathlib

import pytest

import grapnel

SOURCE = pathlib.Path(os.environ.get("GRAPNEL_SOURCE_DIR", pathlib.Path(__file__).parents[2]))
PROGRAM = os.environ.get("GRAPNEL_PROGRAM", "")
THESIS = SOURCE / "scenarios" / "thesis" / "open-loop-case-1.yaml"
SPATIAL = SOURCE / "robots" / "seven-joint-dual-arm.yaml"

HERE = pathlib.Path(__file__).parent


def environment(folder):
    """The environment of a process in which the packages of a folder beside this file take precedence."""
    path = os.pathsep.join(part for part in (str(HERE / folder), os.environ.get("PYTHONPATH", "")) if part)
    return {**os.environ, "PYTHONPATH": path}


# The thesis's first case as a dictionary, with a shorter motion after the impact.
VALUES = {
    "schema": "grapnel-scenario/1",
    "name": "made in Python",
    "robot": str(SOURCE / "robots" / "planar-dual-arm.yaml"),
    "initial": {"joints": [0.698, -1.571, 1.047, 2.444, 1.571, -1.047]},
    "targets": [{"name": "debris", "mass": 10, "inertia": [1, 1, 1], "geometry": {"shape": "sphere", "radius": 0.5},
                 "state": {"at": "capture", "position": [2, -2, 0], "angular_velocity": [0, 0, 0.2]},
                 "grasp_points": [{"name": "grip", "position": [0, 0.5, 0]}]}],
    "grasps": [{"end_effector": "tip-1", "target": "debris", "point": "grip"}],
    "approach": {"duration": 20, "final_joints": [-0.524, -1.393, -0.035, 2.618, -1.393, -0.035],
                 "final_rates": {"match": "velocity"}},
    "contact": {"gap": "translate_target"},
    "impact": {},
    "post_impact": {"duration": 5},
}


@pytest.fixture
def values():
    return copy.deepcopy(VALUES)


@pytest.fixture
def thesis():
    return grapnel.load(THESIS, set={"post_impact.duration": 5})


@pytest.fixture
def program():
    if not PROGRAM:
        pytest.skip("the program is not built")
    return PROGRAM
