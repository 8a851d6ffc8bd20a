"""The scenarios, robots, targets and studies that come with the package."""

import pathlib
import shutil
import subprocess
import sys

import pytest
from conftest import PROGRAM, SOURCE

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


def test_the_module_is_the_program_and_never_calls_itself(tmp_path):
    script = tmp_path / "bin/grapnel"
    script.parent.mkdir()
    script.write_text("#!/bin/sh\necho the script of a wheel\n", encoding="utf-8")
    script.chmod(0o755)
    package = pathlib.Path(grapnel.__file__).parent
    lonely = tmp_path / "lonely"  # a package without a program
    lonely.mkdir()
    shutil.copytree(package, lonely / "grapnel", ignore=shutil.ignore_patterns("*.pyi"))
    environment = {"PATH": str(script.parent), "PYTHONPATH": str(lonely)}
    done = subprocess.run([sys.executable, "-m", "grapnel", "--version"], env=environment, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1 and "this package has no program" in done.stderr
    if PROGRAM:
        done = subprocess.run([sys.executable, "-m", "grapnel", "--version"], capture_output=True, text=True, check=True)
        assert done.stdout == subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout
