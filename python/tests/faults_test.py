"""Errors as objects, and damaged input: always an exception, never a crash of the interpreter."""

import math

import numpy as np
import pytest
from conftest import SOURCE, THESIS

import grapnel


def test_errors_have_locations(tmp_path):
    text = THESIS.read_text(encoding="utf-8").replace("../../robots", str(SOURCE / "robots"))
    file = tmp_path / "faulty.yaml"
    file.write_text(text.replace("mass: 10", "maas: 10", 1).replace("duration: 20", "duration: -20"), encoding="utf-8")
    faults = grapnel.check(file)
    assert len(faults) >= 2 and all(not fault.is_warning for fault in faults)
    line = 1 + file.read_text(encoding="utf-8").splitlines().index("    maas: 10")
    misspelt = next(fault for fault in faults if "maas" in fault.message)
    assert (misspelt.file, misspelt.line, misspelt.column) == (str(file), line, 5)
    assert "did you mean 'mass'" in misspelt.message
    assert str(misspelt) == f"{file}:{line}:5: error: {misspelt.message}"
    with pytest.raises(grapnel.InputError) as raised:
        grapnel.load(file)
    assert raised.value.faults == faults and isinstance(raised.value, ValueError)
    assert str(raised.value) == "\n".join(map(str, faults))


def test_implausible_values_of_a_valid_scenario_are_warnings(values):
    assert grapnel.check(THESIS) == [fault for fault in grapnel.check(THESIS) if fault.is_warning]
    values["targets"][0]["state"]["angular_velocity"] = [0, 0, 90]
    warnings = grapnel.check(values)
    assert warnings and all(fault.is_warning for fault in warnings)
    assert grapnel.Scenario(values).warnings == warnings


def test_errors_in_dictionaries_name_the_value(values):
    values["targets"][0]["mass"] = -3
    values["approach"]["profil"] = "quintic"
    faults = grapnel.check(values)
    assert {fault.file for fault in faults} == {"targets[0].mass", "approach.profil"}
    assert all(fault.line == 0 for fault in faults)


def test_errors_in_settings_name_the_path():
    faults = grapnel.check(THESIS, set={"targets[0].mass": -3})
    assert len(faults) == 1 and faults[0].file == "targets[0].mass"


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize("path", ["targets[0].mass", "targets[0].inertia", "initial.joints", "approach.duration",
                                  "integration.relative_tolerance", "output.interval", "impact.duration", "robot.base.mass",
                                  "targets[0].state.position", "grasps[0].point", "grasps", "targets", "robot", "name"])
@pytest.mark.parametrize("value", [NAN, INF, -INF, -1.5, 0, 1e300, 1e-300, None, True, "", "text", [], {}, [NAN], [[1]],
                                   {"a": NAN}, b"bytes", object(), 1j, np.array([1 + 2j]), np.zeros((2, 2, 2)), {1: 2},
                                   lambda: 0, "\x00", "\ud800", "a\nb: c", 10**400],
                         ids=lambda value: f"{type(value).__name__}-{value!r}"[:40].replace("\x00", "0"))
def test_any_value_is_accepted_or_rejected(thesis, path, value):
    before = thesis.sha256
    try:
        thesis[path] = value
    except (grapnel.InputError, TypeError, ValueError):
        assert thesis.sha256 == before
    else:
        assert thesis.sha256 != before


@pytest.mark.parametrize("damage", range(40))
def test_damaged_dictionaries_are_rejected(values, damage):
    generator = np.random.default_rng(damage)
    wrong = [NAN, INF, -1, None, "x", [], {}, [1, 2], {"x": 1}, True, object()]

    def spoil(part):
        keys = list(part) if isinstance(part, dict) else list(range(len(part)))
        key = keys[generator.integers(len(keys))]
        below = part[key]
        if isinstance(below, (dict, list)) and below and generator.random() < 0.8:
            spoil(below)
        elif isinstance(part, dict) and generator.random() < 0.3:
            del part[key]
        else:
            part[key] = wrong[generator.integers(len(wrong))]

    for _ in range(3):
        spoil(values)
    try:
        problem = grapnel.Scenario(values)
    except (grapnel.InputError, TypeError, ValueError):
        return
    assert math.isfinite(problem["robot.base.mass"])


def test_deep_and_recursive_values_are_rejected(values):
    values["targets"][0]["self"] = values["targets"]
    with pytest.raises((grapnel.InputError, ValueError)):
        grapnel.Scenario(values)
    deep = 1.0
    for _ in range(100_000):
        deep = [deep]
    values["loads"] = deep
    with pytest.raises((grapnel.InputError, ValueError)):
        grapnel.Scenario(values)
    del values
    while isinstance(deep, list):
        deep = deep[0]


@pytest.mark.parametrize("file", ["", "nothing.yaml", ".", "/dev/null", THESIS.parent, "a\x00b"])
def test_files_that_cannot_be_read(file):
    with pytest.raises((grapnel.InputError, ValueError, TypeError, OSError)):
        grapnel.load(file)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"a: [", b"schema: grapnel-robot/1", b"\x00" * 100, b"- " * 5000,
                                     b"&a [*a]", b"x: &a 1\ny: *b"])
def test_damaged_files(tmp_path, content):
    file = tmp_path / "x.yaml"
    file.write_bytes(content)
    assert grapnel.check(file)
    with pytest.raises(grapnel.InputError):
        grapnel.Robot(file)
    for load in (grapnel.campaign, grapnel.sweep, grapnel.optimize):
        with pytest.raises(grapnel.InputError):
            load(file, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("argument", [None, 3, [], object()])
def test_wrong_arguments(argument):
    with pytest.raises(TypeError):
        grapnel.load(argument)
    with pytest.raises(TypeError):
        grapnel.Robot(argument)
    with pytest.raises(TypeError):
        grapnel.simulate_many([argument])
    with pytest.raises((TypeError, ValueError)):
        grapnel.rollout(argument, np.zeros((1, 3)), step=0.1, steps=1)


def test_a_failed_simulation_keeps_its_results(values):
    values["approach"] = {"duration": 20, "plan": {}}
    values["targets"][0]["state"]["position"] = [30, 0, 0]  # out of reach
    result = grapnel.Scenario(values).simulate()
    assert result.status == "failed" and "planning" in result.failure and result.captured == "no"
    assert result.summary["status"] == "failed"
    assert len(result.time) == len(result["base/position"]) if len(result) else True
    with pytest.raises(grapnel.SimulationError, match="planning") as raised:
        result.raise_if_failed()
    assert raised.value.result is result
    with pytest.raises(grapnel.SimulationError):
        grapnel.Scenario(values).simulate(strict=True)


def test_one_problem_instead_of_a_list_is_rejected(thesis):
    with pytest.raises(TypeError, match="one grapnel.Problem"):
        grapnel.simulate_many(thesis)
    for threads in (-1, 4097, True):
        with pytest.raises(ValueError, match="threads is"):
            grapnel.simulate_many([thesis], threads=threads)
    assert len(grapnel.simulate_many([thesis], threads=np.int64(1))) == 1 and grapnel.simulate_many([]) == []


def test_messages_for_arguments_of_a_wrong_type():
    for wrong in (None, 3, []):
        for call in (grapnel.load, grapnel.check, grapnel.Robot):
            with pytest.raises(TypeError, match="expected a path"):
                call(wrong)
