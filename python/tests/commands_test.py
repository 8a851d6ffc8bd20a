"""Campaigns, sweeps and optimizations: folders with the bytes of the program, and their tables."""

import filecmp
import subprocess
import warnings

import numpy as np
import pytest
from conftest import SOURCE

import grapnel


@pytest.fixture
def campaign_file(tmp_path):
    text = (SOURCE / "studies/thesis-monte-carlo.yaml").read_text(encoding="utf-8")
    assert "cases: 100000" in text.replace("_", "")
    lines = []
    for line in text.splitlines():
        if line.startswith("cases:"):
            line = "cases: 60"
        lines.append(line.replace("../scenarios", str(SOURCE / "scenarios")))
    file = tmp_path / "small.yaml"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def quietly(function, *arguments, **settings):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return function(*arguments, **settings)


def test_a_campaign_has_the_bytes_of_the_program(campaign_file, program, tmp_path):
    folder = quietly(grapnel.campaign, campaign_file, out=tmp_path / "python", threads=2, report=False)
    subprocess.run([program, "campaign", campaign_file, "-o", tmp_path / "program", "--quiet", "--no-report", "-j", "1"],
                   check=False, capture_output=True)
    for part in ("table.h5", "table.csv", "campaign.json"):
        assert filecmp.cmp(folder / part, tmp_path / "program" / part, shallow=False), part
    assert not (folder / "report.html").exists()


def test_tables(campaign_file, tmp_path):
    pandas = pytest.importorskip("pandas")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        folder = grapnel.campaign(campaign_file, out=tmp_path / "out", report=False)
    assert said and all(one.filename == __file__ for one in said)  # they point to the caller
    table = grapnel.read_table(folder)
    assert isinstance(table, pandas.DataFrame) and len(table) == 60 and list(table.index) == list(range(60))
    assert set(table["status"]) <= {"ok", "failed"} and table["success"].dtype == bool
    columns, units = grapnel.read_columns(folder)
    csv = pandas.read_csv(folder / "table.csv", comment="#", float_precision="round_trip")
    csv.columns = [column.split(" [")[0] for column in csv.columns]
    shared = [name for name in columns if name in csv and columns[name].dtype == np.float64]
    assert len(shared) > 3
    for name in shared:
        assert np.array_equal(columns[name], csv[name].to_numpy(float), equal_nan=True), name
    assert "kg" in units.values() and table.attrs["units"] == units


def test_a_campaign_is_extended(campaign_file, tmp_path):
    folder = quietly(grapnel.campaign, campaign_file, out=tmp_path / "out", report=False)
    before = grapnel.read_columns(folder)[0]
    quietly(grapnel.campaign, campaign_file, out=folder, report=False, extend=20)
    after = grapnel.read_columns(folder)[0]
    assert len(after["case"]) == 80
    for name, values in before.items():
        if values.dtype == np.float64:
            assert np.array_equal(values, after[name][:60], equal_nan=True)


def test_a_foreign_folder_is_refused(campaign_file, tmp_path):
    quietly(grapnel.campaign, campaign_file, out=tmp_path / "out", report=False)
    campaign_file.write_text(campaign_file.read_text(encoding="utf-8").replace("cases: 60", "cases: 61\n# other"),
                             encoding="utf-8")
    other = campaign_file.read_text(encoding="utf-8").replace("seed:", "seed: 9 #")
    campaign_file.write_text(other, encoding="utf-8")
    with pytest.raises(grapnel.CommandError) as raised:
        grapnel.campaign(campaign_file, out=tmp_path / "out", report=False)
    assert raised.value.code == 2 and "out" in str(raised.value)


def test_a_sweep_and_its_figure(tmp_path):
    file = tmp_path / "speed.yaml"
    file.write_text(f"""
schema: grapnel-study/1
name: impulse against speed
scenario: {SOURCE}/scenarios/thesis/open-loop-at-contact.yaml
simulate: impact
axes:
  - {{quantity: relative_speed, values: [0.05, 0.1, 0.2]}}
  - {{path: impact.joints, values: [free, braked]}}
""", encoding="utf-8")
    folder = quietly(grapnel.sweep, file, out=tmp_path / "sweep", report=False)
    columns, units = grapnel.read_columns(folder)
    assert list(columns["case"]) == list(range(6)) and units["relative_speed"] == "m/s"
    assert list(columns["status"]) == ["ok"] * 6 and set(columns["impact.joints"]) == {"free", "braked"}
    impulse = columns["grasps/tip-1/impulse_magnitude"][columns["impact.joints"] == "free"]
    assert np.all(np.diff(impulse) > 0) and units["grasps/tip-1/impulse_magnitude"] == "N s"
    grapnel.figure(folder, "impulse-map", tmp_path / "map.svg")
    assert (tmp_path / "map.svg").read_text(encoding="utf-8").startswith("<?xml")
    with pytest.raises(grapnel.CommandError):
        grapnel.figure(folder, "no such figure", tmp_path / "x.svg")


def test_reports_of_folders(tmp_path):
    if not grapnel._grapnel.has_reports():
        with pytest.raises(grapnel.CommandError):
            grapnel.report(tmp_path)
        return
    problem = grapnel.load(SOURCE / "scenarios/thesis/open-loop-case-1.yaml", set={"post_impact.duration": 2})
    problem.simulate().save(tmp_path / "a", report=False)
    problem.targets[0].mass = 20
    problem.simulate().save(tmp_path / "b", report=False)
    grapnel.report(tmp_path / "a", tmp_path / "b")
    assert (tmp_path / "a" / "report-vs-b.html").exists()
    with pytest.raises(grapnel.CommandError):
        grapnel.report(tmp_path)


@pytest.mark.parametrize("threads", [-1, 1.5, "2", 10**6, True])
def test_wrong_threads(campaign_file, threads):
    with pytest.raises((ValueError, TypeError)):
        grapnel.campaign(campaign_file, threads=threads)


def test_campaigns_and_studies_from_dictionaries(thesis, tmp_path):
    pandas = pytest.importorskip("pandas")
    thesis.post_impact.duration = 1
    what = {"name": "masses", "scenario": thesis, "simulate": "impact", "cases": 12, "seed": np.int64(3),
            "uncertain": [{"path": "targets.target-1.mass", "as": "factor", "uniform": {"from": 0.8, "to": 1.2}}]}
    folder = quietly(grapnel.campaign, what, out=tmp_path / "made", report=False)
    table = grapnel.read_table(folder)
    assert isinstance(table, pandas.DataFrame) and len(table) == 12 and (table["status"] == "ok").all()
    assert what["scenario"] is thesis  # unchanged
    # The folder is a campaign that the program can resume.
    assert grapnel.load(folder / "scenario.yaml")["post_impact.duration"] == 1
    quietly(grapnel.campaign, what, out=folder, report=False, extend=3)
    assert len(grapnel.read_table(folder)) == 15
    study = {"name": "a grid", "scenario": SOURCE / "scenarios/thesis/open-loop-at-contact.yaml", "simulate": "impact",
             "axes": [{"quantity": "relative_speed", "values": np.array([0.05, 0.1])}]}
    columns, units = grapnel.read_columns(quietly(grapnel.sweep, study, out=tmp_path / "grid", report=False))
    assert list(columns["relative_speed"]) == [0.05, 0.1] and units["relative_speed"] == "m/s"
    with pytest.raises(ValueError, match="out is missing"):
        grapnel.sweep(study)
    with pytest.raises(grapnel.InputError, match="did you mean 'cases'"):
        grapnel.campaign({**what, "case": 3}, out=tmp_path / "misspelt")


@pytest.mark.parametrize("call, error, message", [
    (lambda c, t: grapnel.campaign(c, out=t, extend=-1), ValueError, "extend is -1"),
    (lambda c, t: grapnel.campaign(c, out=t, extend=1.5), TypeError, "extend is 1.5"),
    (lambda c, t: grapnel.campaign(None, out=t), TypeError, "expected a path"),
    (lambda c, t: grapnel.campaign(c, out=3), TypeError, "expected a path"),
    (lambda c, t: grapnel.figure(t, None, t / "x.svg"), TypeError, "a figure's name"),
    (lambda c, t: grapnel.figure(t, "joints", t / "x.svg", width=float("nan")), ValueError, "width is nan"),
    (lambda c, t: grapnel.read_table(t), FileNotFoundError, "is not a folder of a campaign"),
    (lambda c, t: grapnel.read_columns(None), TypeError, "expected a path"),
])
def test_wrong_arguments_are_named(campaign_file, tmp_path, call, error, message):
    with pytest.raises(error, match=message):
        call(campaign_file, tmp_path)
