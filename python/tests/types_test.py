"""Stubs and documentation are complete: the stub has all functions of the compiled module, and all public names have docstrings."""

import ast
import inspect
import os
import pathlib
import subprocess
import sys

import pytest
from conftest import SOURCE

import grapnel
from grapnel import _grapnel

FOLDER = pathlib.Path(grapnel.__file__).parent


def test_the_stub_matches_the_module():
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


def compiled_signature(function):
    """Names of the arguments of a compiled function, from the first line of the docstring of pybind11."""
    head = function.__doc__.splitlines()[0]
    inside = head[head.index("(") + 1:head.rindex(") ->")]
    # Types may contain commas and colons in brackets.
    depth, names, name = 0, [], ""
    for letter in inside + ",":
        depth += (letter in "[(") - (letter in "])")
        if letter == "," and depth == 0:
            names.append(name.split(":")[0].strip())
            name = ""
        else:
            name += letter
    return [name for name in names if name]


def test_the_arguments_of_the_stub_match_the_module():
    tree = ast.parse((FOLDER / "_grapnel.pyi").read_text(encoding="utf-8"))
    seen = 0
    for node in tree.body:
        functions, owner = ([node], _grapnel) if isinstance(node, ast.FunctionDef) else ([], None)
        if isinstance(node, ast.ClassDef) and not issubclass(getattr(_grapnel, node.name), Exception):
            functions, owner = node.body, getattr(_grapnel, node.name)
        for function in functions:
            if not isinstance(function, ast.FunctionDef) or function.decorator_list or function.name == "__init__":
                continue
            found = [argument.arg for argument in function.args.args]
            expected = compiled_signature(getattr(owner, function.name))
            assert found == expected or found == ["self", *expected[1:]], f"{node.name}.{function.name}"
            seen += 1
    assert seen > 40


def sources():
    return sorted(FOLDER.glob("*.py"))


def is_public(name):
    return not name.startswith("_") or name in ("__init__", "__call__", "__getitem__", "__setitem__")


def test_public_names_have_docstrings():
    """Modules, classes and all their functions and properties, except special methods."""
    for file in sources():
        tree = ast.parse(file.read_text(encoding="utf-8"))
        assert ast.get_docstring(tree), file.name
        for node in tree.body:
            if not isinstance(node, (ast.ClassDef, ast.FunctionDef)) or node.name.startswith("_"):
                continue
            assert ast.get_docstring(node), f"{file.name}: {node.name}"
            for part in node.body if isinstance(node, ast.ClassDef) else []:
                if isinstance(part, ast.FunctionDef) and not part.name.startswith("_"):
                    assert ast.get_docstring(part), f"{file.name}: {node.name}.{part.name}"
    for name in grapnel.__all__:
        assert name.startswith("__") or inspect.getdoc(getattr(grapnel, name)), name
    # pybind11 always writes the signature of compiled functions.
    assert "SIMD" in grapnel.instruction_set.__doc__
    for name in ("Fault", "Check"):
        for key, part in vars(getattr(grapnel, name)).items():
            assert key.startswith("_") or inspect.getdoc(part), f"{name}.{key}"


def test_public_functions_have_types():
    """All arguments and results of public functions have types, as py.typed requires."""
    for file in sources():
        tree = ast.parse(file.read_text(encoding="utf-8"))
        functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                functions += [part for part in node.body if isinstance(part, ast.FunctionDef)]
        for function in functions:
            if not is_public(function.name):
                continue
            place = f"{file.name}:{function.lineno} {function.name}"
            assert function.returns is not None, place
            arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
            assert all(argument.annotation is not None or argument.arg in ("self", "cls") for argument in arguments), place


def test_docstrings_of_array_functions_have_shapes():
    """Functions with arrays document their shapes."""
    for owner in (grapnel.Robot, grapnel.Loops):
        for name, function in inspect.getmembers(owner, inspect.isfunction):
            if name.startswith("_") or name in ("body_q", "body_v", "loops", "impact", "zero_state", "initial_state"):
                continue
            words = inspect.getdoc(function)
            has_shape = any(shape in words for shape in ("(4, 4)", "(6,", "(nv", "(3,)", "joints)", "closures, 4", "(nq,", "[J]", "grasps"))
            assert has_shape, f"{owner.__name__}.{name}: {words}"


def test_the_version_is_that_of_the_program(program):
    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    assert grapnel.__version__ in said


def test_types_pass_mypy(tmp_path):
    """The package in strict mode, and the examples as its users."""
    pytest.importorskip("mypy")
    for arguments in (["--config-file", SOURCE / "python/pyproject.toml"],
                      ["--ignore-missing-imports", *sorted((SOURCE / "examples/python").glob("*.py"))]):
        settings = {**os.environ, "MYPYPATH": str(FOLDER.parent)}
        done = subprocess.run([sys.executable, "-m", "mypy", "--cache-dir", tmp_path, *arguments], capture_output=True, text=True,
                              env=settings, cwd=FOLDER.parent, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
