"""Campaigns, sweeps and searches: the program's folders, byte for byte, and their tables."""

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


def test_a_campaign_is_the_programs(campaign_file, program, tmp_path):
    folder = quietly(grapnel.campaign, campaign_file, out=tmp_path / "python", threads=2, report=False)
    subprocess.run([program, "campaign", campaign_file, "-o", tmp_path / "program", "--quiet", "--no-report", "-j", "1"],
                   check=False, capture_output=True)
    for part in ("table.h5", "table.csv", "campaign.json"):
        assert filecmp.cmp(folder / part, tmp_path / "program" / part, shallow=False), part
    assert not (folder / "report.html").exists()


def test_tables(campaign_file, tmp_path):
    pandas = pytest.importorskip("pandas")
    folder = quietly(grapnel.campaign, campaign_file, out=tmp_path / "out", report=False)
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


def test_a_campaign_goes_on(campaign_file, tmp_path):
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
    with pytest.raises(grapnel.CommandError) as caught:
        grapnel.campaign(campaign_file, out=tmp_path / "out", report=False)
    assert caught.value.code == 2 and "out" in str(caught.value)


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
