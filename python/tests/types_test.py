"""Stubs and documentation are complete: every function of the compiled module is in the stub, every public name has words."""

import ast
import inspect
import pathlib

import grapnel
from grapnel import _grapnel

FOLDER = pathlib.Path(grapnel.__file__).parent


def test_the_stub_has_what_the_module_has():
    tree = ast.parse((FOLDER / "_grapnel.pyi").read_text(encoding="utf-8"))
    stub = {}
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            stub[node.name] = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
        elif isinstance(node, ast.FunctionDef):
            stub[node.name] = None
    for name, thing in vars(_grapnel).items():
        if name.startswith("_"):
            continue
        assert name in stub, f"{name} is not in _grapnel.pyi"
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            own = {key for key in vars(thing) if not key.startswith("_") or key == "__init__"}
            assert own - {"__init__"} == stub[name] - {"__init__"}, name
    assert set(stub) <= set(vars(_grapnel))
    assert (FOLDER / "py.typed").exists()


def test_everything_public_says_what_it_is():
    for name in grapnel.__all__:
        thing = getattr(grapnel, name)
        if name.startswith("__"):
            continue
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing) and thing.__module__.startswith("grapnel."):
            for key, part in vars(thing).items():
                obvious = {"name", "nq", "nv", "base", "close", "keys", "items", "warnings", "observe", "sha256"}
                if not key.startswith("_") and key not in obvious and (inspect.isfunction(part) or isinstance(part, property)):
                    assert inspect.getdoc(part), f"{name}.{key}"


def test_the_version_is_the_programs(program):
    import subprocess

    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    assert grapnel.__version__ in said
