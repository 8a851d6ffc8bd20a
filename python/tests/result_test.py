"""Results: equality with the program, arrays as views, names and units, the ledger, files."""

import copy
import filecmp
import gc
import json
import pickle
import subprocess

import numpy as np
import pytest
from conftest import SOURCE, THESIS

import grapnel

h5py = pytest.importorskip("h5py")

SCENARIOS = {
    "thesis": (THESIS, {"post_impact.duration": 5}),
    "closed loop": (SOURCE / "scenarios/thesis/closed-loop.yaml", {"post_impact.duration": 2}),
    "planned": (SOURCE / "scenarios/thesis/open-loop-case-1-planned.yaml", {"post_impact.duration": 2}),
    "rebound": (SOURCE / "scenarios/contact-rebound.yaml", {}),
}


@pytest.mark.parametrize("name", SCENARIOS)
def test_results_have_the_bits_of_the_program(name, program, tmp_path):
    file, changes = SCENARIOS[name]
    arguments = [part for path, value in changes.items() for part in ("--set", f"{path}={value}")]
    subprocess.run([program, "run", file, "-o", tmp_path / "program", "--quiet", "--no-report", *arguments], check=False,
                   capture_output=True)
    result = grapnel.load(file, set=changes).simulate()
    result.save(tmp_path / "python", report=False)
    for part in ("summary.json", "scene.json", "scenario.json", "timeseries.h5"):
        assert filecmp.cmp(tmp_path / "program" / part, tmp_path / "python" / part, shallow=False), part
    assert result.summary == json.loads((tmp_path / "program" / "summary.json").read_text(encoding="utf-8"))
    with h5py.File(tmp_path / "program" / "timeseries.h5") as series:
        names = []
        series.visititems(lambda path, node: names.append(path) if isinstance(node, h5py.Dataset) else None)
        assert set(names) == {*result, "time", "phase"}
        assert np.array_equal(result.time, series["time"][:]) and np.array_equal(result.phase, series["phase"][:])
        for path in result:
            assert np.array_equal(result[path], series[path][:], equal_nan=True), path
            assert result.units[path] == series[path].attrs["unit"]
            assert result[path].shape == series[path].shape
            assert list(result.components[path]) == list(series[path].attrs["components"])


def test_parallel_runs_have_the_bits_of_single_runs(thesis):
    problems = []
    for mass in (5, 10, 20, 40):
        problem = thesis.copy()
        problem.targets[0].mass = mass
        problems.append(problem)
    alone = [problem.simulate() for problem in problems]
    for threads in (0, 1, 3):
        for one, other in zip(alone, grapnel.simulate_many(problems, threads=threads)):
            assert all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)
    impulses = [result.summary["impact"]["grasps"][0]["impulse_magnitude"] for result in alone]
    assert impulses == sorted(impulses) and impulses[0] < impulses[-1]


def test_arrays_are_views_that_outlive_the_result(thesis):
    result = thesis.simulate()
    position = result["base/position"]
    assert position.shape == (len(result.time), 3) and position.dtype == np.float64
    assert not position.flags.owndata and np.shares_memory(position, result["base/position"])
    with pytest.raises(ValueError):
        position[0, 0] = 1
    copy = position.copy()
    del result
    gc.collect()
    junk = [np.ones(10_000) for _ in range(100)]
    assert np.array_equal(position, copy) and len(junk) == 100


def test_names_units_and_summary(thesis):
    result = thesis.simulate()
    assert result.status == "completed" and result.captured == "assumed" and result.failure == ""
    assert result.units["time"] == "s" and result.units["base/angular_velocity"] == "rad/s"
    assert result.phases[0] == "approach" and result.phase[0] == 0
    assert result.components["base/position"] == ["x", "y", "z"]
    assert "base/position" in result and "nothing" not in result and len(list(result)) == len(result)
    with pytest.raises(KeyError, match="base/position"):
        result["position"]
    assert result.summary["scenario"]["sha256"] == thesis.sha256 == result.sha256
    assert "captured: assumed" in str(result) and "assumed" in repr(result)
    assert result.verdict[0].startswith("captured: assumed")


def test_the_ledger_has_the_values_of_the_summary(thesis):
    result = thesis.simulate()
    assert result.ledger.passed
    checks = result.summary["ledger"]
    for name, check in result.ledger.items():
        assert checks[name]["value"] == check.value and checks[name]["bound"] == check.bound
        assert checks[name]["pass"] == check.passed and checks[name]["kind"] == check.kind
    drift = result.ledger["linear_momentum_drift"]
    assert 0 < drift.value < drift.bound == 1e-11 and drift.kind == "conservation"
    assert "passed" in repr(drift) and "linear_momentum_drift" in repr(result.ledger)


def test_a_failed_ledger_is_an_error_in_strict_mode():
    problem = grapnel.load(THESIS, set={"integration.relative_tolerance": 1e-3, "integration.absolute_tolerance": 1e-3})
    result = problem.simulate()
    assert result.status == "completed" and not result.ledger.passed
    with pytest.raises(grapnel.SimulationError, match="conservation"):
        problem.simulate(strict=True)


def test_tables_of_series(thesis):
    pandas = pytest.importorskip("pandas")
    result = thesis.simulate()
    frame = result.to_pandas(["base/position", "joints/position"])
    assert isinstance(frame, pandas.DataFrame) and frame.index.name == "time"
    assert frame[["base/position/x"]].equals(result.to_pandas("base/position")[["base/position/x"]])
    assert np.array_equal(frame["base/position/x"].to_numpy(), result["base/position"][:, 0])
    assert frame.attrs["units"]["base/position/x"] == "m"


def test_reports(thesis, tmp_path):
    result = thesis.simulate()
    if not grapnel._grapnel.has_reports():
        with pytest.raises(RuntimeError, match="Node.js"):
            result.report(tmp_path / "x.html")
        return
    result.report(tmp_path / "x.html")
    result.save(tmp_path / "folder")
    assert (tmp_path / "x.html").read_bytes() == (tmp_path / "folder" / "report.html").read_bytes()
    with pytest.raises(OSError):
        result.report(tmp_path / "no folder" / "x.html")


def test_results_refuse_pickling_with_a_remedy(thesis):
    result = thesis.simulate()
    with pytest.raises(TypeError, match="pickle parts of it"):
        pickle.dumps(result)
    assert copy.copy(result) is result and copy.deepcopy(result) is result
    arrays = pickle.loads(pickle.dumps(dict(result)))
    assert np.array_equal(arrays["base/position"], result["base/position"])
    failed = grapnel.SimulationError("it failed", result)
    assert pickle.loads(pickle.dumps(failed)).args == ("it failed",)
    refused = pickle.loads(pickle.dumps(grapnel.CommandError("no", 2)))
    assert (str(refused), refused.code) == ("no", 2)


@pytest.mark.parametrize("name, message", [("base/angular_velocty", "did you mean 'base/angular_velocity'"), ("time", "result.time"),
                                           ("position", "base/position"), ("nothing of it", "available: base/position")])
def test_misspelt_series_give_a_suggestion(thesis, name, message):
    with pytest.raises(KeyError, match=message):
        thesis.simulate()[name]


def test_misspelt_checks_give_a_suggestion(thesis):
    with pytest.raises(KeyError, match="did you mean 'linear_momentum_drift'"):
        thesis.simulate().ledger["linear_momentum_drif"]


def test_folders_that_cannot_be_written(thesis, tmp_path):
    result = thesis.simulate()
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError):
        result.save(tmp_path / "file" / "folder")
    for wrong in (None, 3):
        with pytest.raises(TypeError, match="expected a path"):
            result.save(wrong)
        with pytest.raises(TypeError, match="expected a path"):
            result.report(wrong)


def test_views_cannot_be_made_writable(thesis):
    position = thesis.simulate()["base/position"]
    with pytest.raises(ValueError):
        position.flags.writeable = True
