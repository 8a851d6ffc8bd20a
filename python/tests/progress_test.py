"""Progress of campaigns, sweeps, optimizations and batches: functions of the caller, terminals and notebooks."""

import os
import pty
import subprocess
import sys
import threading
import types
import warnings

import pytest
from conftest import THESIS

import grapnel
from grapnel import progress


def campaign_of(problem, cases=300):
    return {"name": "made", "scenario": problem, "simulate": "impact", "cases": cases, "seed": 4,
            "uncertain": [{"path": "targets[0].mass", "as": "factor", "uniform": {"from": 0.8, "to": 1.2}}],
            "success": [{"name": "small", "holds": "grasps/tip-1/impulse_magnitude < 0.12"}]}


def quietly(function, *arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return function(*arguments, **options)


def test_a_function_gets_the_numbers(thesis, tmp_path):
    seen = []
    folder = quietly(grapnel.campaign, campaign_of(thesis), out=tmp_path / "with", report=False, progress=seen.append)
    assert seen and all(isinstance(at, grapnel.Progress) and at.total == 300 for at in seen)
    done = [at.done for at in seen]
    assert done == sorted(done) and done[-1] == 300
    columns, _ = grapnel.read_columns(folder)
    assert seen[-1].successes == sum(columns["success"]) and 0 < seen[-1].successes < 300 and seen[-1].not_ok == 0

    plain = quietly(grapnel.campaign, campaign_of(thesis), out=tmp_path / "without", report=False)
    for file in ("table.csv", "table.h5", "campaign.json"):
        assert (folder / file).read_bytes() == (plain / file).read_bytes(), file

    seen.clear()
    quietly(grapnel.campaign, campaign_of(thesis), out=folder, report=False, extend=50, progress=seen.append)
    assert seen[0].begun_with == 300 and seen[0].done >= 300 and seen[-1][:2] == (350, 350)


def test_an_exception_ends_the_campaign_and_keeps_its_cases(thesis, tmp_path):
    def end(at):
        raise LookupError(f"enough: {at.done}")

    with pytest.raises(LookupError, match="enough"):
        quietly(grapnel.campaign, campaign_of(thesis, 20000), out=tmp_path, report=False, progress=end)
    assert not (tmp_path / "table.h5").exists()
    seen = []
    with pytest.raises(KeyError):
        quietly(grapnel.campaign, campaign_of(thesis, 20000), out=tmp_path, report=False,
                progress=lambda at: (seen.append(at), {}["none"]))
    assert seen[0].total == 20000


def test_sweeps_searches_and_batches(thesis, tmp_path):
    seen = []
    study = {"name": "grid", "scenario": thesis, "simulate": "impact", "axes": [{"path": "targets[0].mass", "values": [8, 9, 10]}]}
    quietly(grapnel.sweep, study, out=tmp_path / "grid", report=False, progress=seen.append)
    assert seen[-1][:2] == (3, 3)
    seen.clear()
    thesis.post_impact.duration = 1
    results = grapnel.simulate_many([thesis.copy() for _ in range(3)], progress=seen.append)
    assert len(results) == 3 and seen[-1] == (3, 3, 0, 0, 0)


@pytest.mark.parametrize("choice", [3, "yes"])
def test_other_values_are_refused(thesis, tmp_path, choice):
    with pytest.raises(TypeError, match="progress is .*; expected None, True, False or a function"):
        grapnel.campaign(campaign_of(thesis), out=tmp_path, progress=choice)


CODE = """
import sys, warnings
import grapnel
from grapnel import progress
progress._BEGIN = progress._INTERVAL = 0
warnings.simplefilter("ignore")
problem = grapnel.load(THESIS, set={"post_impact.duration": 1})
values = {"name": "made", "scenario": problem, "simulate": "impact", "cases": 3000,
          "uncertain": [{"path": "targets[0].mass", "as": "factor", "uniform": {"from": 0.8, "to": 1.2}}],
          "success": [{"name": "any", "holds": "grasps/tip-1/impulse_magnitude > 0"}]}
grapnel.campaign(values, out=sys.argv[1], report=False, progress=CHOICE)
"""


def command(folder, choice):
    return [sys.executable, "-c", f"THESIS, CHOICE = {str(THESIS)!r}, {choice!r}\n" + CODE, str(folder)]


@pytest.mark.parametrize(("choice", "is_shown"), [(None, True), (False, False)])
def test_a_terminal_shows_one_line_that_disappears(tmp_path, choice, is_shown):
    ours, theirs = pty.openpty()
    with subprocess.Popen(command(tmp_path, choice), stderr=theirs, env=os.environ) as child:
        os.close(theirs)
        text = b""
        timer = threading.Timer(300, child.kill)
        timer.start()
        try:
            while part := os.read(ours, 4096):
                text += part
        except OSError:  # the other end is closed
            pass
        child.wait()
        timer.cancel()
    os.close(ours)
    assert child.returncode == 0
    text = text.decode()
    if not is_shown:
        assert text == ""
        return
    assert "\n" not in text
    assert text.endswith("\r\x1b[K") and text.startswith("\r")
    assert " of 3000 cases" in text or "3000 cases in" in text


@pytest.mark.parametrize(("choice", "lines"), [(None, 0), (True, 1)])
def test_a_file_gets_the_last_line_on_request_only(tmp_path, choice, lines):
    done = subprocess.run(command(tmp_path, choice), capture_output=True, text=True, env=os.environ, check=True, timeout=300)
    assert done.stderr.count("\n") == lines and ("3000 cases in" in done.stderr) == (lines == 1)
    assert done.stdout == ""


class Display:
    """The function `display` of IPython, which records the outputs of a cell."""

    def __init__(self):
        self.outputs = []

    def __call__(self, data, raw, display_id):
        assert raw and display_id
        self.outputs.append(data)
        return types.SimpleNamespace(update=self.update)

    def update(self, data, raw):
        assert raw
        self.outputs[-1] = data


def test_a_notebook_shows_one_bar_that_is_updated(thesis, tmp_path, monkeypatch):
    display = Display()
    module = types.ModuleType("IPython")
    module.get_ipython = lambda: types.SimpleNamespace(kernel=object())
    module.display = types.ModuleType("IPython.display")
    module.display.display = display
    monkeypatch.setitem(sys.modules, "IPython", module)
    monkeypatch.setitem(sys.modules, "IPython.display", module.display)
    monkeypatch.setattr(progress, "_BEGIN", 0)
    monkeypatch.setattr(progress, "_INTERVAL", 0)
    quietly(grapnel.campaign, campaign_of(thesis), out=tmp_path, report=False)
    (data,) = display.outputs
    assert data["text/plain"].startswith("300 cases in ") and "success" in data["text/plain"]
    assert '<progress value="1.0000" max="1">' in data["text/html"] and data["text/plain"] in data["text/html"]

    display.outputs.clear()
    quietly(grapnel.campaign, campaign_of(thesis), out=tmp_path / "silent", report=False, progress=False)
    module.get_ipython = lambda: types.SimpleNamespace()  # IPython on a terminal has no kernel
    quietly(grapnel.campaign, campaign_of(thesis), out=tmp_path / "terminal", report=False)
    assert display.outputs == []


def test_the_text_of_a_line():
    at = grapnel.Progress(done=400, total=1000, successes=390, not_ok=2, begun_with=100)
    assert at.text("cases", 10.0) == "400 of 1000 cases, 30 per s, 20 s left, success 97.5 %, 2 not ok"
    assert grapnel.Progress(0, 5).text("points", 0.0) == "0 of 5 points"
    assert grapnel.Progress(5, 5).text("points", 2.0) == "5 points in 2.0 s"
