"""Linear models: the same values as the program's file, and their use for design."""

import json
import subprocess

import numpy as np
import pytest

import grapnel

HINGE = {
    "schema": "grapnel-scenario/1",
    "name": "hinge",
    "robot": {
        "name": "hinge",
        "base": {"name": "bench", "mode": "fixed", "mass": 100, "inertia": [10, 10, 10]},
        "links": [{"name": "arm", "parent": "bench", "joint": {"name": "elbow", "type": "revolute", "axis": [0, 0, 1]},
                   "mass": 2, "inertia": [0.1, 0.4, 0.5]}],
    },
    "initial": {"joints": [0.3]},
    "motion": [{"name": "hold", "duration": 10, "joints": "pd", "kp": 20, "kd": 1.6}],
}


def test_a_hinge_has_its_closed_form():
    model = grapnel.Scenario(HINGE).linearize(2)
    assert model.states == ["joints/position/elbow", "joints/velocity/elbow"]
    assert model.units["joints/effort/elbow"] == "N m"
    np.testing.assert_allclose(model.B, [[0], [2]], atol=1e-12)
    np.testing.assert_allclose(model.K, [[-20, -1.6]], rtol=1e-9)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(model.A + model.B @ model.K)), np.sort(model.eigenvalues), atol=1e-7)
    assert model.verdict == "stable" and not model.warnings
    # |L| = 1 for I^2 w^4 = k^2 + d^2 w^2.
    k, d, inertia = 20, 1.6, 0.5
    w = np.sqrt((d**2 + np.sqrt(d**4 + 4 * (k * inertia)**2)) / (2 * inertia**2))
    assert model.margins[0]["channel"] == "joints/effort/elbow"
    np.testing.assert_allclose(model.margins[0]["phase"], np.arctan2(d * w, k), rtol=1e-6)
    assert model.sampled is None
    sampled = grapnel.Scenario(HINGE).linearize(2, sample_time=0.1, delay=0.03).sampled
    np.testing.assert_allclose(sampled["Ad"], [[1, 0.1], [0, 1]], atol=1e-9)
    np.testing.assert_allclose(sampled["Bd_previous"][1], [0.06], atol=1e-9)


def test_the_file_of_the_program_is_the_same(program, tmp_path):
    problem = grapnel.Scenario(HINGE)
    problem.write(tmp_path / "hinge.yaml")
    subprocess.run([program, "linearize", tmp_path / "hinge.yaml", "--at", "2", "-o", tmp_path / "a.json", "--quiet"], check=True)
    model = problem.linearize(2)
    model.write(tmp_path / "b.json")
    a, b = (json.loads((tmp_path / name).read_text()) for name in ("a.json", "b.json"))
    assert a.keys() == b.keys() and a["A"] == b["A"] and a["closed_loop"] == b["closed_loop"]


def test_results_have_the_margins_of_the_program(program, tmp_path):
    problem = grapnel.Scenario({**HINGE, "motion": [{**HINGE["motion"][0], "duration": 1}]})
    result = problem.simulate(margins=True)
    assert [(loop["phase"], loop["verdict"]) for loop in result.control_loops] == [("hold", "stable")] * 2
    at_start = problem.linearize(0)
    assert result.control_loops[0]["margins"] == at_start.margins and at_start.margins
    problem.write(tmp_path / "hinge.yaml")
    subprocess.run([program, "run", tmp_path / "hinge.yaml", "-o", tmp_path / "out", "--margins", "--quiet", "--no-report"], check=True)
    assert json.loads((tmp_path / "out/summary.json").read_text())["control_loops"] == result.control_loops
    # The rest of a result is the same without them.
    without = grapnel.simulate_many([problem])[0]
    assert without.control_loops == [] and "control_loops" not in without.summary
    assert {key: value for key, value in result.summary.items() if key != "control_loops"} == without.summary


def test_a_result_states_why_it_has_no_margins():
    free = {**HINGE, "motion": [{"name": "drift", "duration": 1}]}
    (result,) = grapnel.simulate_many([grapnel.Scenario(free)], margins=True)
    assert result.control_loops == [] and any("no margins" in warning for warning in result.warnings)


def test_the_mat_file_has_the_matrices(tmp_path):
    io = pytest.importorskip("scipy.io")
    model = grapnel.Scenario(HINGE).linearize(2, sample_time=0.1)
    model.write(tmp_path / "hinge.mat")
    read = io.loadmat(tmp_path / "hinge.mat", simplify_cells=True)
    np.testing.assert_array_equal(read["A"], model.A)
    np.testing.assert_array_equal(np.reshape(read["B"], (2, 1)), model.B)
    assert list(read["state_names"]) == model.states
    assert read["period"] == 0.1


def test_errors():
    problem = grapnel.Scenario(HINGE)
    with pytest.raises(RuntimeError, match="no motion follows t = 11 s"):
        problem.linearize(11)
    with pytest.raises(ValueError, match="json or .mat"):
        problem.linearize(2).write("hinge.txt")
