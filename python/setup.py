"""Builds a wheel of the package grapnel, with the compiled module from a CMake build.

The environment variable GRAPNEL_BUILD selects a configured build folder. The default is ../build/release, if that is configured
with the module; otherwise a build is configured below setuptools' build folder.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent


def version():
    text = (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"project\(grapnel VERSION ([0-9.]+)", text).group(1)


def settings(folder):
    """Entries of a build folder's CMake cache; empty without a cache."""
    try:
        text = (folder / "CMakeCache.txt").read_text(encoding="utf-8")
    except OSError:
        return {}
    return dict(re.findall(r"^(\w+):\w+=(.*)$", text, re.MULTILINE))


def is_for_this_python(folder):
    python = settings(folder).get("Python3_EXECUTABLE") or settings(folder).get("_Python3_EXECUTABLE", "")
    if not python or settings(folder).get("GRAPNEL_PYTHON", "OFF") == "OFF":
        return False
    tag = "import sysconfig; print(sysconfig.get_config_var('EXT_SUFFIX'))"
    reported = subprocess.run([python, "-c", tag], capture_output=True, text=True, check=False).stdout.strip()
    import sysconfig

    return reported == sysconfig.get_config_var("EXT_SUFFIX")


class Build(build_ext):
    """Builds _grapnel with CMake and copies it to the place that setuptools expects."""

    def build_extension(self, extension):
        named = os.environ.get("GRAPNEL_BUILD")
        folder = pathlib.Path(named).resolve() if named else SOURCE / "build" / "release"
        if named and not is_for_this_python(folder):
            raise SystemExit(f"GRAPNEL_BUILD is {named}, which is no build folder of Grapnel with a module for {sys.executable}")
        if not is_for_this_python(folder):
            folder = pathlib.Path(self.build_temp).resolve() / "cmake"
            # For any processor of the architecture, because wheels are distributed.
            subprocess.run(["cmake", "-S", SOURCE, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                            "-DCMAKE_CXX_FLAGS_RELEASE=-O3 -DNDEBUG", "-DGRAPNEL_NATIVE=OFF", "-DGRAPNEL_PYTHON=ON",
                            "-DGRAPNEL_BUILD_TESTS=OFF", f"-DPython3_EXECUTABLE={sys.executable}"], check=True)
        elif settings(folder).get("GRAPNEL_NATIVE") == "ON":
            print(f"note: the module of {folder} is tuned to this machine (GRAPNEL_NATIVE) and may not run on others")
        subprocess.run(["cmake", "--build", folder, "--target", "_grapnel"], check=True)
        made = next((folder / "python" / "grapnel").glob("_grapnel*" + pathlib.Path(self.get_ext_filename("x")).suffix))
        place = pathlib.Path(self.get_ext_fullpath(extension.name)).resolve()
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(made, place)
        shutil.copy2(made.parent / "_grapnel.pyi", place.parent)


setup(
    version=version(),
    packages=["grapnel"],
    package_data={"grapnel": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("grapnel._grapnel", sources=[])],
    cmdclass={"build_ext": Build},
    zip_safe=False,
)
