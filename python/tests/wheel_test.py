"""Wheels, built without a network from the configured build, installed into a new environment and used there."""

import filecmp
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from conftest import SOURCE, THESIS

BUILD = os.environ.get("GRAPNEL_BUILD_DIR", "")


@pytest.mark.skipif(not BUILD, reason="no build folder is named")
def test_a_wheel_is_built_installed_and_used(tmp_path):
    for module in ("pip", "venv", "wheel", "setuptools"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    # setuptools creates folders beside setup.py, so it receives a copy of the files that it reads.
    tree = tmp_path / "tree"
    shutil.copytree(SOURCE / "python", tree / "python", ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    shutil.copy(SOURCE / "CMakeLists.txt", tree)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment.update(GRAPNEL_BUILD=BUILD, PIP_NO_INDEX="1", PIP_DISABLE_PIP_VERSION_CHECK="1", PIP_NO_CACHE_DIR="1")
    pip = [sys.executable, "-m", "pip"]
    subprocess.run([*pip, "wheel", "--no-build-isolation", "--no-deps", "-w", tmp_path / "wheels", "."], check=True,
                   cwd=tree / "python", env=environment, capture_output=True)
    wheel, = (tmp_path / "wheels").glob("grapnel-*.whl")
    assert "none-any" not in wheel.name
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", tmp_path / "venv"], check=True,
                   env=environment)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([*pip, "--python", python, "install", "--no-deps", wheel], check=True, env=environment, capture_output=True)
    code = f"""
import pathlib, grapnel
assert pathlib.Path(grapnel.__file__).is_relative_to({str(tmp_path)!r}), grapnel.__file__
result = grapnel.load({str(THESIS)!r}, set={{"post_impact.duration": 1}}).simulate()
print(result.status, (pathlib.Path(grapnel.__file__).parent / "py.typed").exists())
"""
    done = subprocess.run([python, "-c", code], check=True, env=environment, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == "completed True\n"
    assert pathlib.Path(BUILD).exists()


# What a process has loaded of the libraries of the wheel: only its own copies.
USE = """
import json, pathlib, sys
import grapnel, grapnel.data
problem = grapnel.load(grapnel.data.scenario("thesis/open-loop-case-1"), set={"post_impact.duration": 1})
result = problem.simulate()
result.save(sys.argv[1])
own = pathlib.Path(grapnel.__file__).parents[1] / "grapnel.libs"
stems = {file.name.rpartition("-")[0] for file in own.iterdir()} - {"libz", "libbz2", "liblzma", "libcrypto", "libssl", "libffi"}  # Python has these
maps = {line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}
foreign = [file for file in maps for stem in stems if pathlib.Path(file).name.startswith(stem + ".so")]
print(json.dumps({"package": grapnel.__file__, "status": result.status, "own": sum(str(own) in file for file in maps), "foreign": foreign,
                  "names": [len(grapnel.data.names(kind)) for kind in ("scenarios", "robots", "targets", "studies")]}))
"""


@pytest.mark.skipif(not BUILD, reason="no build folder is named")
def test_a_self_contained_wheel_needs_python_and_numpy_alone(tmp_path):
    if shutil.which("patchelf") is None:
        pytest.skip("patchelf is not installed")
    if pathlib.Path(BUILD).resolve() != (SOURCE / "build/release").resolve():
        pytest.skip("scripts/wheel --trial takes build/release")
    subprocess.run([SOURCE / "scripts/wheel", "--trial", "--out", tmp_path / "wheels"], check=True, capture_output=True)
    wheel, = (tmp_path / "wheels").glob("grapnel-*+trial-*-linux_*.whl")
    clean = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True, env=clean)
    python, home = tmp_path / "venv/bin/python", tmp_path / "elsewhere"
    subprocess.run([sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", wheel], check=True, env=clean,
                   capture_output=True)
    packages = next((tmp_path / "venv/lib").glob("python3*/site-packages"))
    (packages / "numpy").symlink_to(pathlib.Path(np.__file__).parent)
    home.mkdir()
    done = subprocess.run([python, "-c", USE, "saved"], check=True, env=clean, cwd=home, capture_output=True, text=True)
    used = json.loads(done.stdout)
    assert pathlib.Path(used["package"]).is_relative_to(tmp_path) and used["status"] == "completed"
    assert used["own"] > 5 and used["foreign"] == []
    assert used["names"] == [len(list((SOURCE / kind).rglob("*.yaml"))) for kind in ("scenarios", "robots", "targets", "studies")]
    assert (home / "saved/report.html").stat().st_size > 1e6
    # The program, as a module and as a command, gives the same bits; it exports FMUs with the libraries that they need.
    scenario = packages / "grapnel/share/scenarios/thesis/open-loop-case-1.yaml"
    for command in ([python, "-m", "grapnel"], [tmp_path / "venv/bin/grapnel"]):
        shutil.rmtree(home / "run", ignore_errors=True)
        subprocess.run([*command, "run", scenario, "--set", "post_impact.duration=1", "-o", "run", "--quiet"], check=True, env=clean, cwd=home,
                       capture_output=True)
        for part in ("summary.json", "timeseries.h5"):
            assert filecmp.cmp(home / "run" / part, home / "saved" / part, shallow=False), part
    subprocess.run([python, "-m", "grapnel", "export-fmu", packages / "grapnel/share/scenarios/first-plan.yaml", "--set", "control.period=10 ms",
                    "-o", "plant.fmu"], check=True, env=clean, cwd=home, capture_output=True)
    with zipfile.ZipFile(home / "plant.fmu") as archive:
        binaries = [name for name in archive.namelist() if name.startswith("binaries/") and ".so" in name]
    assert any("yaml-cpp" in name for name in binaries)
    failed = subprocess.run([python, "-m", "grapnel", "run", "none.yaml"], env=clean, cwd=home, capture_output=True, text=True, check=False)
    assert failed.returncode == 2 and "none.yaml" in failed.stderr
