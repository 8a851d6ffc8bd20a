"""Every script of examples/python runs unchanged, with and without optional packages."""

import os
import re
import subprocess
import sys

import pytest
from conftest import SOURCE, environment

EXAMPLES = sorted((SOURCE / "examples" / "python").glob("*.py"))
FILES = {
    "earth_twin.py": ["accuracy.csv"],
    "first_capture.py": ["summary.json", "timeseries.h5"],
    "impulse_against_mass_ratio.py": ["impulse.csv"],
    "own_controller.py": ["summary.json", "timeseries.h5"],
    "published_controller.py": ["summary.json", "timeseries.h5"],
    "parameter_study.py": ["impulse.svg", "results/table.csv"],
    "your_urdf.py": ["summary.json"],
}
# What the scripts print on controllers: rows of tables whose better controller is certain, and verdicts.
PRINTED = {
    "lqr_after_capture.py": ["Riccati equation satisfied: True", r"settling time .* LQR$", r"peak attitude error .* LQR$",
                             r"joint effort\^2 .* own$", "own: captured yes, ledger passed: True", "LQR: captured yes, ledger passed: True"],
    "mpc_with_wheel_limits.py": ["all solved: True", r"settling time .* MPC$", r"time of wheels at the limit .* 0  MPC$",
                                 r"wheel torque\^2 .* own$", "own: captured yes, ledger passed: True", "MPC: captured yes, ledger passed: True"],
    "minimum_time_detumbling.py": [r"^lower bound .* 12\.4", r"minimum time of the rigid stack 2[01]\.", r"below 0.05 deg/s .* planned$",
                                   r"angular impulse .* own$", "own: captured yes, ledger passed: True",
                                   "planned: captured yes, ledger passed: True"],
}
PLOTS = [script for script in EXAMPLES if "matplotlib" in script.read_text(encoding="utf-8")]


def run(script, tmp_path, settings):
    done = subprocess.run([sys.executable, script, tmp_path / "out"], capture_output=True, text=True, cwd=tmp_path,
                          env={**settings, "OPENBLAS_NUM_THREADS": "1"}, timeout=500, check=False)
    assert done.returncode == 0, done.stderr + done.stdout
    for file in FILES.get(script.name, []):
        assert (tmp_path / "out" / file).exists(), file
    for line in PRINTED.get(script.name, []):
        assert re.search(line, done.stdout, re.MULTILINE), f"{line} is not in\n{done.stdout}"
    return done.stdout


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda script: script.name)
def test_it_runs_with_numpy_alone(script, tmp_path):
    run(script, tmp_path, environment("without"))


@pytest.mark.parametrize("script", PLOTS, ids=lambda script: script.name)
def test_it_plots(script, tmp_path):
    pytest.importorskip("matplotlib")
    output = run(script, tmp_path, {**os.environ, "MPLCONFIGDIR": str(tmp_path)})
    assert "impulse.svg" in output
    plot = (tmp_path / "out" / "impulse.svg").read_text(encoding="utf-8")
    assert "Matplotlib" in plot and plot.count("<path") > 10


def test_there_are_examples():
    assert len(EXAMPLES) >= 6 and len(PLOTS) >= 2 and set(FILES) | set(PRINTED) <= {script.name for script in EXAMPLES}


def test_the_code_of_the_readme_runs(tmp_path):
    """The Python code of the README is a program."""
    text = (SOURCE / "README.md").read_text(encoding="utf-8")
    begin = text.index("import grapnel\n")
    code = text[begin:text.index("```", begin)]
    for folder in ("scenarios", "robots"):
        (tmp_path / folder).symlink_to(SOURCE / folder)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, env=os.environ,
                          timeout=300, check=False)
    assert done.returncode == 0, done.stderr
