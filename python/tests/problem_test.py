"""Scenarios: values by path and attribute, from files and dictionaries, as the program reads them."""

import pathlib
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


def test_a_change_is_what_the_program_sets(thesis, program, tmp_path):
    problem = grapnel.load(THESIS, set={"targets[0].mass": 12.5, "post_impact.joints": "braked"})
    said = subprocess.run([program, "check", THESIS, "--set", "targets[0].mass=12.5", "--set", "post_impact.joints=braked"],
                          capture_output=True, text=True, check=True).stdout
    assert problem.sha256[:12] in said
    assert problem.settings == ["targets[0].mass=12.5", "post_impact.joints=braked"]
    # The last value of a path counts, as if the others had not been.
    problem["targets[0].mass"] = 1
    problem["targets[0].mass"] = 12.5
    other = grapnel.load(THESIS, set={"post_impact.joints": "braked", "targets[0].mass": 12.5})
    assert problem.sha256 == other.sha256


def test_a_faulty_change_leaves_the_problem_as_it_was(thesis):
    digest = thesis.sha256
    with pytest.raises(grapnel.InputError) as caught:
        thesis.targets[0].mass = -1
    assert "targets[0].mass" in str(caught.value)
    assert thesis["targets[0].mass"] == 10 and thesis.sha256 == digest
    # What is possible only together is set together.
    with pytest.raises(grapnel.InputError):
        thesis["grasps"] = [{"end_effector": "tip-1", "target": "ball", "point": "grip"}]
    thesis.set({"targets[0].name": "ball", "grasps[0].target": "ball"})
    assert thesis.grasps[0].target == "ball"


def test_misspelt_values_name_what_was_meant(thesis):
    with pytest.raises(grapnel.InputError, match="did you mean 'mass'"):
        thesis.targets[0].maas = 3
    with pytest.raises(KeyError, match="no item 'target-9'"):
        thesis["targets.target-9.mass"]
    with pytest.raises(KeyError):
        thesis["approach.nothing"]
    with pytest.raises(AttributeError):
        thesis.approach.nothing
    with pytest.raises(AttributeError):
        thesis.nothing_of_the_kind
    with pytest.raises(IndexError):
        thesis.targets[2]
    with pytest.raises(AttributeError):
        thesis.sha256 = "0"


def test_copies_are_apart(thesis):
    other = thesis.copy()
    other.targets[0].mass = 20
    assert (thesis["targets[0].mass"], other["targets[0].mass"]) == (10, 20)


def test_a_dictionary_is_the_file_it_is_written_to(values, tmp_path, program):
    problem = grapnel.Scenario(values)
    file = tmp_path / "made.yaml"
    problem.write(file)
    again = grapnel.load(file)
    for name in ("base/position", "joints/position"):
        ours, theirs = problem.simulate(), again.simulate()
        assert np.array_equal(ours[name], theirs[name])
    subprocess.run([program, "check", file], check=True, capture_output=True)


def test_changes_are_in_what_is_written(thesis, tmp_path):
    thesis.targets[0].mass = 12
    thesis["robot.base.mass"] = 600
    thesis.write(tmp_path / "changed.yaml")
    again = grapnel.load(tmp_path / "changed.yaml")
    assert again["targets[0].mass"] == 12 and again["robot.base.mass"] == 600
    assert np.array_equal(again.simulate()["base/position"], thesis.simulate()["base/position"])


def test_dictionaries_take_numpy_and_paths(values):
    values["robot"] = SOURCE / "robots" / "planar-dual-arm.yaml"
    values["initial"]["joints"] = np.array(values["initial"]["joints"])
    values["targets"][0]["mass"] = np.float64(10)
    values["impact"] = {"law": "plastic"}
    problem = grapnel.Scenario(values, set={"approach.duration": np.int64(10)})
    assert problem.approach.duration == 10
    assert problem.targets[0] == {**problem.targets[0].value}


def test_files_are_found_from_the_folder(values):
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
    file.write_text("no scenario any more", encoding="utf-8")
    problem.targets[0].mass = 11
    assert problem["targets[0].mass"] == 11
