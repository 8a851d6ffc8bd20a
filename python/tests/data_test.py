"""The scenarios, robots, targets and studies that come with the package."""

import pytest
from conftest import SOURCE

import grapnel
import grapnel.data


def test_files_are_found_by_name():
    assert grapnel.data.folder() == SOURCE
    assert grapnel.data.scenario("thesis/closed-loop") == SOURCE / "scenarios/thesis/closed-loop.yaml"
    assert grapnel.data.scenario("first-plan.yaml") == SOURCE / "scenarios/first-plan.yaml"
    assert grapnel.data.study("thesis-monte-carlo").is_file()
    assert {"planar-dual-arm", "panda-arm"} <= set(grapnel.data.names("robots"))
    assert grapnel.load(grapnel.data.scenario("first-plan")).name
    assert grapnel.Robot(grapnel.data.robot("planar-dual-arm")).nv == 12


def test_unknown_names_are_errors():
    with pytest.raises(FileNotFoundError, match="expected one of .*first-plan"):
        grapnel.data.scenario("first")
    with pytest.raises(ValueError, match="kind is 'meshes'"):
        grapnel.data.names("meshes")
