"""Sensitivities: closed forms, the same values as the program's file, campaigns and errors."""

import json
import subprocess

import numpy as np
import pytest

import grapnel

STRIKE = {
    "schema": "grapnel-scenario/1",
    "name": "strike",
    "robot": {
        "name": "striker",
        "base": {"name": "bus", "mass": 8, "inertia": [1, 1, 1]},
        "links": [{"name": "panel", "parent": "bus", "joint": {"name": "hinge", "type": "fixed"}, "mass": 1e-9,
                   "inertia": [1e-12, 1e-12, 1e-12]}],
        "end_effectors": [{"name": "tip", "link": "bus", "position": [0.5, 0, 0], "approach_axis": [1, 0, 0]}],
    },
    "initial": {"joints": []},
    "targets": [{
        "name": "ball", "mass": 4, "inertia": [0.3, 0.3, 0.3], "geometry": {"shape": "sphere", "radius": 0.3},
        "state": {"position": [0.8, 0, 0], "velocity": [-0.2, 0, 0]},
        "grasp_points": [{"name": "front", "position": [-0.3, 0, 0], "approach_direction": [1, 0, 0], "normal": [-1, 0, 0]}],
    }],
    "grasps": [{"end_effector": "tip", "target": "ball", "point": "front", "model": "contact"}],
    "contact": {"gap": "weld_as_found"},
    "impact": {"law": "friction", "restitution": 0.5, "friction": 0},
}
IMPULSE = "grasps/tip/impulse_magnitude"


def test_a_central_impact_has_its_closed_form():
    s = grapnel.Scenario(STRIKE).sensitivities(of=[IMPULSE, "grasps/tip/impulse/y"], by=["targets.ball.mass", "impact.restitution"], impact_only=True)
    m = 8 * 4 / 12
    assert s.of == [IMPULSE, "grasps/tip/impulse/y"] and s.by == ["targets.ball.mass", "impact.restitution"]
    np.testing.assert_allclose(s.outcomes, [1.5 * m * 0.2, 0], atol=1e-8)
    np.testing.assert_allclose(s.derivatives, [[1.5 * 0.2 * (m / 4)**2, m * 0.2], [0, 0]], atol=1e-7)
    np.testing.assert_allclose(s.elasticities[0], [m / 4, 0.5 / 1.5], rtol=1e-6)
    assert np.isnan(s.elasticities[1]).all()  # of an outcome that is zero
    assert s.verdicts == [["yes", "yes"], ["yes", "yes"]] and s.reason(IMPULSE, "targets.ball.mass") == ""
    assert s[IMPULSE, "impact.restitution"] == s.derivatives[0, 1]
    assert s.units[IMPULSE] == "N s" and s.units["targets.ball.mass"] == "kg"
    assert "impact.restitution" in s.text()


def test_changes_count_and_files_are_those_of_the_program(program, tmp_path):
    problem = grapnel.Scenario(STRIKE, set={"targets.ball.mass": 2})
    by = ["targets.ball.mass", "targets.ball.state.velocity"]
    s = problem.sensitivities(of=IMPULSE, by=by, impact_only=True, threads=1)
    assert s.by[1:] == [f"targets.ball.state.velocity/{axis}" for axis in "xyz"]
    assert s.at[0] == 2 and s.values["settings"]["sha256"] == problem.sha256
    problem.write(tmp_path / "strike.yaml")
    subprocess.run([program, "sensitivities", tmp_path / "strike.yaml", "--of", IMPULSE, "--by", ",".join(by), "--impact", "-o", tmp_path / "out",
                    "--quiet"], check=True)
    s.write(tmp_path / "s.json")
    s.write(tmp_path / "s.csv")
    a, b = (json.loads(path.read_text()) for path in (tmp_path / "out" / "sensitivities.json", tmp_path / "s.json"))
    assert a["outcomes"] == b["outcomes"] and a["values"] == b["values"]
    assert (tmp_path / "out" / "sensitivities.csv").read_text() == (tmp_path / "s.csv").read_text()


def test_a_campaign_has_deviations(tmp_path):
    grapnel.Scenario(STRIKE).write(tmp_path / "strike.yaml")
    (tmp_path / "campaign.yaml").write_text(
        "schema: grapnel-campaign/1\nname: c\nscenario: strike.yaml\nsimulate: impact\ncases: 10\nseed: 1\nuncertain:\n"
        "  - {path: targets.ball.mass, as: offset, normal: {deviation: 0.1}}\n"
        "  - {path: impact.restitution, as: offset, normal: {deviation: 0.02}}\n"
        f"success:\n  - {IMPULSE} < 0.81\n", encoding="utf-8")
    s = grapnel.campaign_sensitivities(tmp_path / "campaign.yaml", of=IMPULSE)
    m = 8 * 4 / 12
    variances = np.array([1.5 * 0.2 * (m / 4)**2 * 0.1, m * 0.2 * 0.02])**2
    np.testing.assert_allclose(s.deviations, [np.sqrt(variances.sum())], rtol=1e-6)
    np.testing.assert_allclose(s.shares[0], variances / variances.sum(), rtol=1e-5)
    assert 0.5 < s.limits[0]["probability"] < 1 and s.limits[0]["holds"]


def test_errors():
    problem = grapnel.Scenario(STRIKE)
    with pytest.raises(grapnel.InputError) as caught:
        problem.sensitivities(of="grasps/tip/impuls", by="targets.ball.mas")
    assert len(caught.value.faults) == 2
    with pytest.raises(TypeError, match="by has 3"):
        problem.sensitivities(by=[3])
    with pytest.raises(KeyError, match="none of"):
        problem.sensitivities(of=IMPULSE, by="impact.restitution", impact_only=True)[IMPULSE, "x"]
    with pytest.raises(ValueError, match="json or .csv"):
        problem.sensitivities(of=IMPULSE, by="impact.restitution", impact_only=True).write("s.txt")
