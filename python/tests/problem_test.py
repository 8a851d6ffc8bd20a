"""Scenarios: values by path and attribute, from files and dictionaries, consistent with the program."""

import concurrent.futures
import multiprocessing
import pathlib
import pickle
import subprocess

import numpy as np
import pytest
from conftest import SOURCE, THESIS

import grapnel


def test_values_are_read_with_defaults_and_the_robot(thesis):
    assert thesis.name == "open-loop case 1"
    assert thesis["targets[0].mass"] == 10
    assert thesis["targets.target-2.mass"] == 10
    assert thesis["robot.base.mass"] == 500
    assert thesis["approach.tracking.mode"] == "pd"
    assert thesis["targets[0].state.position"] == (2, -2, 0)
    assert thesis["output.as_published"] is True
    assert thesis["integration.relative_tolerance"] == 1e-12  # a default that the file does not state


def test_attributes_and_paths_are_the_same_values(thesis):
    thesis.targets[0].mass = 12.5
    assert thesis["targets[0].mass"] == 12.5
    thesis.targets["target-2"].inertia = np.array([1.0, 2.0, 2.5])
    assert thesis["targets[1].inertia"] == (1, 2, 2.5)
    thesis["impact"].duration = 2e-3
    assert thesis.impact.duration == 2e-3
    assert len(thesis.targets) == 2 and [target.name for target in thesis.targets] == ["target-1", "target-2"]
    assert thesis.targets[-1].name == "target-2"
    assert "mass" in thesis.targets[0] and "mass" in dir(thesis.targets[0]) and "approach" in dir(thesis)
    thesis.gravity = [0, 0, -1]
    assert thesis.gravity == (0, 0, -1)


def test_a_change_equals_set_of_the_program(thesis, program, tmp_path):
    problem = grapnel.load(THESIS, set={"targets[0].mass": 12.5, "post_impact.joints": "braked"})
    said = subprocess.run([program, "check", THESIS, "--set", "targets[0].mass=12.5", "--set", "post_impact.joints=braked"],
                          capture_output=True, text=True, check=True).stdout
    assert problem.sha256[:12] in said
    assert problem.settings == ["targets[0].mass=12.5", "post_impact.joints=braked"]
    # Only the last value of a path is effective.
    problem["targets[0].mass"] = 1
    problem["targets[0].mass"] = 12.5
    other = grapnel.load(THESIS, set={"post_impact.joints": "braked", "targets[0].mass": 12.5})
    assert problem.sha256 == other.sha256


def test_an_invalid_change_leaves_the_problem_unchanged(thesis):
    digest = thesis.sha256
    with pytest.raises(grapnel.InputError) as raised:
        thesis.targets[0].mass = -1
    assert "targets[0].mass" in str(raised.value)
    assert thesis["targets[0].mass"] == 10 and thesis.sha256 == digest
    # Changes that are valid only together are set together.
    with pytest.raises(grapnel.InputError):
        thesis["grasps"] = [{"end_effector": "tip-1", "target": "ball", "point": "grip"}]
    thesis.set({"targets[0].name": "ball", "grasps[0].target": "ball"})
    assert thesis.grasps[0].target == "ball"


def test_misspelt_paths_give_a_suggestion(thesis):
    with pytest.raises(grapnel.InputError, match="did you mean 'mass'"):
        thesis.targets[0].maas = 3
    with pytest.raises(KeyError, match="no item 'target-9'"):
        thesis["targets.target-9.mass"]
    for read in (lambda: thesis["targets[0].mas"], lambda: thesis.targets[0].mas):
        with pytest.raises((KeyError, AttributeError), match="no 'targets\\[0\\].mas'; did you mean 'mass'"):
            read()
    with pytest.raises(AttributeError, match="did you mean 'impact'"):
        thesis.impct
    with pytest.raises(KeyError, match="keys there are duration"):
        thesis["approach.nonexistent"]
    with pytest.raises(AttributeError):
        thesis.approach.nothing
    with pytest.raises(AttributeError):
        thesis.no_such_key
    with pytest.raises(IndexError):
        thesis.targets[2]
    with pytest.raises(AttributeError):
        thesis.sha256 = "0"


def test_copies_are_independent(thesis):
    other = thesis.copy()
    other.targets[0].mass = 20
    assert (thesis["targets[0].mass"], other["targets[0].mass"]) == (10, 20)


def test_a_dictionary_equals_the_file_that_it_writes(values, tmp_path, program):
    problem = grapnel.Scenario(values)
    file = tmp_path / "made.yaml"
    problem.write(file)
    again = grapnel.load(file)
    for name in ("base/position", "joints/position"):
        ours, theirs = problem.simulate(), again.simulate()
        assert np.array_equal(ours[name], theirs[name])
    subprocess.run([program, "check", file], check=True, capture_output=True)


def test_written_files_contain_the_changes(thesis, tmp_path):
    thesis.targets[0].mass = 12
    thesis["robot.base.mass"] = 600
    thesis.write(tmp_path / "changed.yaml")
    again = grapnel.load(tmp_path / "changed.yaml")
    assert again["targets[0].mass"] == 12 and again["robot.base.mass"] == 600
    assert np.array_equal(again.simulate()["base/position"], thesis.simulate()["base/position"])


def test_dictionaries_accept_numpy_and_paths(values):
    values["robot"] = SOURCE / "robots" / "planar-dual-arm.yaml"
    values["initial"]["joints"] = np.array(values["initial"]["joints"])
    values["targets"][0]["mass"] = np.float64(10)
    values["impact"] = {"law": "plastic"}
    problem = grapnel.Scenario(values, set={"approach.duration": np.int64(10)})
    assert problem.approach.duration == 10
    assert problem.targets[0] == {**problem.targets[0].value}


def test_file_names_are_relative_to_the_folder(values):
    values["robot"] = "planar-dual-arm.yaml"
    with pytest.raises(grapnel.InputError, match="planar-dual-arm.yaml"):
        grapnel.Scenario(values)
    assert grapnel.Scenario(values, folder=SOURCE / "robots")["robot.base.mass"] == 500


def test_text_that_looks_like_a_number_stays_text(values):
    values["name"] = "010"
    assert grapnel.Scenario(values).name == "010"
    values["targets"][0]["mass"] = "10"
    with pytest.raises(grapnel.InputError, match="targets\\[0\\].mass"):
        grapnel.Scenario(values)


def test_files_are_read_once(tmp_path):
    text = pathlib.Path(THESIS).read_text(encoding="utf-8").replace("../../robots", str(SOURCE / "robots"))
    file = tmp_path / "scenario.yaml"
    file.write_text(text, encoding="utf-8")
    problem = grapnel.load(file)
    file.write_text("not a scenario", encoding="utf-8")
    problem.targets[0].mass = 11
    assert problem["targets[0].mass"] == 11


def test_numbers_with_units_are_read_in_si(tmp_path, values):
    values["targets"][0]["mass"] = "12 kg"
    values["approach"]["duration"] = "0.5 min"
    values["robot"] = "ets-vii"
    values["initial"]["joints"] = ["30 deg", 0, 0, 0, 0, "-45 deg"]
    values["grasps"][0]["end_effector"] = "hand"
    values["approach"] = {"duration": "0.5 min", "final_joints": [0.1, 0, 0, 0, 0, 0]}
    problem = grapnel.Scenario(values)
    assert problem.targets[0].mass == 12 and problem.approach.duration == 30
    assert problem["initial.joints"] == (pytest.approx(np.pi / 6), 0, 0, 0, 0, pytest.approx(-np.pi / 4))
    assert problem["robot.links[0].joint.limits.rate"] == pytest.approx(np.radians(5))  # 5 deg/s in the file of the ready-made robot
    problem.targets[0].mass = 2 * problem.targets[0].mass
    assert problem["targets[0].mass"] == 24
    with pytest.raises(grapnel.InputError, match="a length"):
        problem.targets[0].mass = "3 m"


def test_keys_and_contains(thesis):
    assert {"name", "robot", "targets", "approach"} <= set(thesis) and "name" in dir(thesis)
    assert "targets[0].mass" in thesis and "targets[7].mass" not in thesis and 3 not in thesis
    assert dir(thesis).count("name") == 1
    assert thesis.targets[np.int64(-1)].name == "target-2"
    for index in (2, -3):
        with pytest.raises(IndexError):
            thesis.targets[index] = {}
    with pytest.raises(TypeError, match="neither a key nor an index"):
        thesis.targets[0:1]


def test_problems_can_be_sent_to_other_processes(thesis, values, tmp_path):
    thesis.targets[0].mass = 12.5
    thesis["approach.final_joints"] = np.linspace(-1, 1, 6)
    for problem in (thesis, grapnel.Scenario(values, set={"targets[0].name": "010", "grasps[0].target": "010"})):
        again = pickle.loads(pickle.dumps(problem))
        assert again.sha256 == problem.sha256 and type(again) is type(problem) and again.settings == problem.settings
        assert pickle.loads(pickle.dumps(problem.targets[0])).mass == problem.targets[0].mass
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = pool.submit(last_position, thesis).result(timeout=120)
        refused = pool.submit(set_mass, thesis, -1)
        with pytest.raises(grapnel.InputError) as raised:
            refused.result(timeout=120)
    assert np.array_equal(there, last_position(thesis))
    assert raised.value.faults[0].file == "targets[0].mass" and len(set(raised.value.faults)) == 1


def last_position(problem):
    return problem.simulate()["base/position"][-1].copy()


def set_mass(problem, mass):
    problem.targets[0].mass = mass


def test_a_pickled_problem_with_changed_files_is_rejected(tmp_path):
    text = pathlib.Path(THESIS).read_text(encoding="utf-8").replace("../../robots", str(SOURCE / "robots"))
    file = tmp_path / "scenario.yaml"
    file.write_text(text, encoding="utf-8")
    pickled = pickle.dumps(grapnel.load(file))
    file.write_text(text.replace("mass: 10", "mass: 11"), encoding="utf-8")
    with pytest.raises(ValueError, match="has changed since the problem was pickled"):
        pickle.loads(pickled)
