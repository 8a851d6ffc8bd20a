"""Logs of measurements: the files of the program, arrays of their contents, and errors."""

import csv
import filecmp
import json
import math
import subprocess

import numpy as np
import pytest
from conftest import SOURCE, THESIS

import grapnel

RATES = {"base/angular_velocity": ("z", 2e-5), "base/velocity": ("xy", 2e-5), "targets/target-1/angular_velocity": ("z", 2e-4),
         "targets/target-2/angular_velocity": ("z", 2e-4), "joints/velocity": (range(6), 2e-4), "joints/position": (range(6), 1e-4)}


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    """A run's folder, a log with noise from it, and a mapping as a dictionary."""
    folder = tmp_path_factory.mktemp("logs")
    result = grapnel.load(THESIS, set={"post_impact.duration": 5, "output.interval": 0.01}).simulate()
    result.save(folder / "run", report=False)
    time, random = np.arange(16.003, 24, 0.01), np.random.default_rng(3)
    columns, quantities = {"time": time}, []
    for series, (components, deviation) in RATES.items():
        for k in components:
            column = "xyz".index(k) if isinstance(k, str) else k
            name = f"{series}/{k if isinstance(k, str) else result.components[series][column]}"
            after = result.time >= 20  # a jump at the impact, of which each side is interpolated
            values = np.where(time < 20, np.interp(time, result.time[~after], result[series][~after, column]),
                              np.interp(time, result.time[result.time > 20], result[series][result.time > 20, column]))
            columns[name] = values + random.normal(0, deviation, len(time))
            quantities.append({"run": name, "log": name, "uncertainty": deviation})
    with open(folder / "log.csv", "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*(map(repr, map(float, column)) for column in columns.values())))
    return folder / "run", folder / "log.csv", {"time": {"column": "time", "unit": "s"}, "quantities": quantities}


def test_a_comparison_has_the_bytes_of_the_program(experiment, program, tmp_path):
    run, log, mapping = experiment
    comparison = grapnel.compare(run, log, mapping, out=tmp_path / "python", report=False)
    subprocess.run([program, "compare", run, log, "--map", tmp_path / "python/mapping.yaml", "-o", tmp_path / "program", "--quiet"],
                   check=True, capture_output=True)
    for part in ("comparison.json", "comparison.csv"):
        assert filecmp.cmp(comparison.folder / part, tmp_path / "program" / part, shallow=False), part
    assert comparison.verdict == "yes" and comparison.offset == 0
    entry = comparison["base/angular_velocity/z"]
    residuals = comparison.residuals("base/angular_velocity/z")
    assert residuals.unit == "rad/s" and residuals.compared.sum() == entry["compared"]
    assert np.sqrt(np.mean(residuals.residual[residuals.compared] ** 2)) == pytest.approx(entry["rms"], rel=1e-9)
    assert not (comparison.folder / "comparison.html").exists()
    # Momentum of the measured motion is that of the estimate of impulses, apart from times near the contact.
    impulses = grapnel.impulses(run, log, mapping, out=tmp_path / "impulses", report=False)
    for ours, theirs in zip(comparison.summary["momentum"], impulses.summary["momentum"], strict=True):
        assert all(ours[key] == theirs[key] for key in ("body", "missing", "first", "last"))
    assert comparison.summary["momentum_reason"] == "" and len(comparison.summary["momentum"]) == 3
    name = "angular z [N m s]"
    assert np.array_equal(comparison.momentum("target-1")[name][:300], impulses.momentum("target-1")[name][:300])
    bare = {**mapping, "quantities": [{k: v for k, v in one.items() if k != "uncertainty"} for one in mapping["quantities"]]}
    bare = grapnel.compare(run, log, bare, out=tmp_path / "bare", report=False)
    assert bare.summary["momentum"] == [] and bare.summary["momentum_reason"] == "no rate with an uncertainty is measured"
    with pytest.raises(ValueError, match="has a momentum of no body"):
        bare.momentum()


def test_a_disagreement_is_a_result(experiment, tmp_path):
    run, log, mapping = experiment
    small = {**mapping, "quantities": [{**one, "uncertainty": one["uncertainty"] / 10} for one in mapping["quantities"]]}
    assert grapnel.compare(run, log, small, out=tmp_path, report=False).verdict == "no"


def test_impulses_have_the_bytes_of_the_program(experiment, program, tmp_path):
    run, log, mapping = experiment
    impulses = grapnel.impulses(run, log, mapping, out=tmp_path / "python", report=False)
    subprocess.run([program, "impulses", run, log, "--map", tmp_path / "python/mapping.yaml", "-o", tmp_path / "program", "--quiet"],
                   check=True, capture_output=True)
    for part in ("impulses.json", "impulses.csv", "momentum.csv"):
        assert filecmp.cmp(impulses.folder / part, tmp_path / "program" / part, shallow=False), part
    (contact,) = impulses.contacts
    assert impulses.verdict == contact.verdict == "yes" and contact.time == pytest.approx(20, abs=0.02)
    for end_effector in ("tip-1", "tip-2"):
        grasp = contact[end_effector]
        seen = ~np.isnan(grasp.value)
        assert list(seen) == [False, False, True, True, True, False]  # nothing measures motion out of the plane
        assert np.all(np.abs(grasp.value - grasp.simulated)[seen] < 5 * grasp.uncertainty[seen])
        assert np.sqrt(np.diag(grasp.covariance)[seen]) == pytest.approx(grasp.uncertainty[seen], rel=1e-2)
        assert np.array_equal(grasp.covariance[np.ix_(seen, seen)], grasp.covariance[np.ix_(seen, seen)].T)
    entry = next(one for one in contact.summary["grasps"][0]["components"] if one["name"] == "angular z")
    assert contact["tip-1"].value[2] == entry["value"]
    momentum = impulses.momentum("target-1")
    assert momentum["angular z [N m s]"][0] == pytest.approx(0.2, abs=1e-3) and np.isnan(momentum["linear x [N s]"]).all()


def test_a_wrong_model_violates_the_balance(experiment, tmp_path):
    run, log, mapping = experiment
    wrong = grapnel.impulses(run, log, mapping, out=tmp_path, at=20, set={"targets[0].inertia": np.full(3, 1.3)}, report=False)
    assert wrong.verdict == "no" and wrong.contacts[0].chi_square > 5


def test_parameters_from_a_log(tmp_path):
    scenario = SOURCE / "scenarios/air-bearing-friction.yaml"
    true = grapnel.load(scenario, set={"targets.block.mass": 4.35, "output.interval": 0.05}).simulate()
    random, time = np.random.default_rng(1), np.arange(0.2, 19.8, 0.1)
    x = np.interp(time, true.time, true["links/platform/position"][:, 0]) + random.normal(0, 2e-4, len(time))
    (tmp_path / "log.csv").write_text("t [s],x [m]\n" + "".join(f"{a},{b}\n" for a, b in zip(time, x)), encoding="utf-8")
    (tmp_path / "map.yaml").write_text("schema: grapnel-mapping/1\ntime: {column: t}\nquantities:\n"
                                       "  - {run: links/platform/position/x, log: x, uncertainty: 2e-4}\n", encoding="utf-8")
    (tmp_path / "study.yaml").write_text(
        f"schema: grapnel-identification/1\nname: one mass\nscenario: {json.dumps(str(scenario))}\nset: {{output.interval: 0.05}}\n"
        "parameters:\n  - {path: targets.block.mass, name: mass, from: 2, to: 8}\nlogs:\n  - {log: log.csv, map: map.yaml}\n",
        encoding="utf-8")
    fitted = grapnel.identify_from_logs(tmp_path / "study.yaml", out=tmp_path / "out", threads=2, report=False)
    assert fitted.verdict == "yes" and fitted.names == ["mass"] and fitted.covariance.shape == (1, 1)
    deviation = fitted.parameter("mass")["uncertainty"]
    assert abs(fitted["mass"] - 4.35) < 5 * deviation and math.sqrt(fitted.covariance[0, 0]) == pytest.approx(deviation)
    assert grapnel.load(fitted.scenario).targets["block"].mass == pytest.approx(fitted["mass"])
    (log,) = fitted.summary["logs"]
    assert fitted.comparison(log["name"]).verdict == "yes"


def test_errors_name_their_place(experiment, tmp_path):
    run, log, mapping = experiment
    with pytest.raises(grapnel.InputError, match="no such file"):
        grapnel.compare(run, tmp_path / "none.csv", mapping, out=tmp_path)
    with pytest.raises(grapnel.InputError, match=r"mapping\.yaml:\d+:\d+: .*no column 'gyro'"):
        grapnel.compare(run, log, {"quantities": [{"run": "base/velocity/x", "log": "gyro"}]}, out=tmp_path)
    for at in ([(20, -1)], [(20, 1, 2)]):
        with pytest.raises(ValueError, match="at has"):
            grapnel.impulses(run, log, mapping, out=tmp_path, at=at)
    with pytest.raises(TypeError, match="at is 'x'"):
        grapnel.impulses(run, log, mapping, out=tmp_path, at=["x"])
    with pytest.raises(ValueError, match=r"set has nan for 'targets\[0\].mass'"):
        grapnel.impulses(run, log, mapping, out=tmp_path, set={"targets[0].mass": math.nan})
    with pytest.raises(ValueError, match="window is 0"):
        grapnel.impulses(run, log, mapping, out=tmp_path, window=0)
    with pytest.raises(grapnel.InputError, match=r"targets\[5\]"):
        grapnel.impulses(run, log, mapping, out=tmp_path, set={"targets[5].mass": 1})
    with pytest.raises(grapnel.InputError):
        grapnel.identify_from_logs(tmp_path / "none.yaml", out=tmp_path / "out")
    comparison = grapnel.compare(run, log, mapping, out=tmp_path / "errors", report=False)
    with pytest.raises(KeyError, match="expected one of base/angular_velocity/z"):
        comparison["gyro"]
    with pytest.raises(ValueError, match="component is 'y'"):
        comparison.residuals("base/angular_velocity/z", "y")


def test_other_files_are_not_replaced(experiment, tmp_path):
    run, log, mapping = experiment
    (tmp_path / "mapping.yaml").write_text("# mine\n", encoding="utf-8")
    with pytest.raises(grapnel.CommandError, match="not of an earlier call"):
        grapnel.compare(run, log, mapping, out=tmp_path)
    assert (tmp_path / "mapping.yaml").read_text(encoding="utf-8") == "# mine\n"
    for folder in (tmp_path / "own", tmp_path / "own"):  # repeated
        assert grapnel.compare(run, log, mapping, out=folder, report=False).verdict == "yes"
    with pytest.raises(grapnel.InputError):
        grapnel.compare(tmp_path / "typo", log, mapping)
    assert not (tmp_path / "typo").exists()
    (tmp_path / "file").write_text("", encoding="utf-8")
    for given in (mapping, tmp_path / "own/mapping.yaml"):
        with pytest.raises(grapnel.CommandError, match="cannot write results"):
            grapnel.compare(run, log, given, out=tmp_path / "file/folder", report=False)


def test_a_log_outside_the_run_has_no_statistics(experiment, tmp_path):
    run, _, _ = experiment
    (tmp_path / "late.csv").write_text("time [s],v [m/s]\n" + "".join(f"{900 + i},0\n" for i in range(9)), encoding="utf-8")
    mapping = {"quantities": [{"name": "late", "run": "base/velocity/x", "log": "v"}]}
    late = grapnel.compare(run, tmp_path / "late.csv", mapping, out=tmp_path / "late", report=False)["late"]
    assert late["compared"] == 0 and not {"rms", "peak", "peak_time", "interpolation_error"} & set(late)
