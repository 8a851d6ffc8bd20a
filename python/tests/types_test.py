"""Stubs and documentation are complete: the stub has all functions of the compiled module, and all public names have docstrings."""

import ast
import functools
import inspect
import os
import pathlib
import re
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


def public_functions():
    """Name and function, class or property of everything that users of the package call or read."""
    things = {f"grapnel.{name}": getattr(grapnel, name) for name in grapnel.__all__}
    for module in (grapnel.env, grapnel.data):
        things |= {f"{module.__name__}.{name}": thing for name, thing in vars(module).items()
                   if not name.startswith("_") and callable(thing) and getattr(thing, "__module__", None) == module.__name__}
    for name, thing in things.items():
        if inspect.ismodule(thing) or isinstance(thing, str):
            continue
        yield name, thing
        for key, member in vars(thing).items() if inspect.isclass(thing) else ():
            is_documented = callable(member) or isinstance(member, (property, functools.cached_property, classmethod, staticmethod))
            if not key.startswith("_") and (is_documented or inspect.isdatadescriptor(member)):
                yield f"{name}.{key}", member


def sentences(text):
    """Sentences and items of lists of a docstring, without code and parentheses."""
    text = re.sub(r"\([^()]*\)", "", re.sub(r"`[^`]*`", "code", text))
    for paragraph in re.split(r"\n\s*\n|\n\s*(?=code|\w+:)", text):
        yield from filter(None, re.split(r"(?<=[.!?:;])\s+", " ".join(paragraph.split())))


def faults_of_docstring(text):
    """What the rules of CONTRIBUTING.md do not permit in a docstring."""
    faults = [f"a sentence has {len(one.split())} words: {one}" for one in sentences(text) if len(one.split()) > 25]
    if not re.search(r"[.:\]`]$", text.rstrip()) and "->" not in text:
        faults.append(f"it ends without a full stop: {text[-40:]}")
    return faults


def test_docstrings_follow_the_rules_of_language():
    """help() gives text for every public name, in sentences of at most 25 words. scripts/prose checks the terms."""
    names, missing, faults = [], [], []
    for name, thing in public_functions():
        names.append(name)
        text = inspect.getdoc(thing)
        if not text or text.startswith(("Alias for field", "partial(")):
            missing.append(name)
        else:
            faults += [f"{name}: {fault}" for fault in faults_of_docstring(text)]
    assert not missing and not faults, "\n".join(missing + faults)
    assert len(names) > 200 and {"grapnel.Problem.simulate", "grapnel.data.scenario", "grapnel.env.CaptureEnv.step"} <= set(names)
    assert faults_of_docstring("Word " * 26 + "end.") and faults_of_docstring("No full stop") and not faults_of_docstring("Good.")


def test_help_shows_types():
    """help() of a function shows the types of its arguments and result."""
    seen = 0
    for name, thing in public_functions():
        function = getattr(thing, "__func__", thing)
        if inspect.isfunction(function):
            signature = inspect.signature(function)
            untyped = [key for key, argument in signature.parameters.items()
                       if key not in ("self", "cls") and argument.annotation is inspect.Parameter.empty]
            assert not untyped and signature.return_annotation is not inspect.Signature.empty, f"{name}: {untyped}"
            seen += 1
        elif inspect.isbuiltin(function) or type(function).__name__ == "instancemethod":
            assert "->" in (function.__doc__ or ""), name
            seen += 1
    assert seen > 60


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
    output = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    assert grapnel.__version__ in output


def test_types_pass_mypy(tmp_path):
    """The package in strict mode, and the examples as its users."""
    pytest.importorskip("mypy")
    for arguments in (["--config-file", SOURCE / "python/pyproject.toml"],
                      ["--ignore-missing-imports", *sorted((SOURCE / "examples/python").glob("*.py"))]):
        settings = {**os.environ, "MYPYPATH": str(FOLDER.parent)}
        done = subprocess.run([sys.executable, "-m", "mypy", "--cache-dir", tmp_path, *arguments], capture_output=True, text=True,
                              env=settings, cwd=FOLDER.parent, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
