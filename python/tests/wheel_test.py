"""The wheel: built without a network from the configured build, installed into a new environment and used there."""

import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys

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
