"""The notebooks of examples/notebooks: they have no stored outputs, and a kernel executes them."""

import importlib.machinery
import importlib.util
import json
import os
import pathlib
import re

import pytest
from conftest import SOURCE

FOLDER = SOURCE / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
BUILD = pathlib.Path(os.environ.get("GRAPNEL_BUILD_DIR", SOURCE / "build/release"))


def load_script():
    """scripts/notebooks as a module."""
    loader = importlib.machinery.SourceFileLoader("notebooks_script", str(SOURCE / "scripts/notebooks"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


script = load_script()


def cells(notebook, kind):
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == kind]


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_no_outputs_are_stored(file):
    text = file.read_text(encoding="utf-8")
    assert script.faults_of(text, file.name) == []

    executed = json.loads(text)
    code = next(cell for cell in executed["cells"] if cell["cell_type"] == "code")
    code["outputs"] = [{"output_type": "stream", "name": "stdout", "text": ["1\n"]}]
    assert "cell 2 has outputs" in script.faults_of(json.dumps(executed), file.name)[0]
    code["outputs"], code["execution_count"] = [], 1
    assert "cell 2 has an execution count" in script.faults_of(json.dumps(executed), file.name)[0]
    code["execution_count"] = None
    executed["metadata"]["widgets"] = {}
    assert "widgets" in script.faults_of(json.dumps(executed), file.name)[0]


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_the_contents_of_a_notebook(file):
    notebook = json.loads(file.read_text(encoding="utf-8"))
    text, code = "\n".join(cells(notebook, "markdown")), "\n".join(cells(notebook, "code"))
    assert text.startswith("# ") and "After this notebook you can" in text and "## Exercises" in text
    assert ".plot(" in code and ".replay(" in code and re.search("ledger", code)
    assert max(len(line) for line in code.splitlines()) <= 100  # the site's code blocks
    for link in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (FOLDER / link).exists(), link


def test_the_page_lists_all_notebooks():
    page = (SOURCE / "docs/notebooks.md").read_text(encoding="utf-8")
    assert len(NOTEBOOKS) >= 5 and all(f"(../examples/notebooks/{file.name})" in page for file in NOTEBOOKS)
    order = [file.stem for file in script.notebooks()]
    assert order[0] == "first-capture" and len(order) == len(NOTEBOOKS)


def test_they_run(capsys):
    """Executes all notebooks into build/notebooks, where scripts/docs finds the outputs for the site."""
    for module in ("nbclient", "ipykernel", "matplotlib"):
        pytest.importorskip(module, reason=f"{module} is missing: scripts/setup test installs python3-{module}")
    out = BUILD.parent / "notebooks"
    module = script.package()
    assert module.samefile(BUILD / "python")
    for file in script.notebooks():
        made, seconds = script.execute(file, out, module)
        with capsys.disabled():
            print(f"\n{file.stem}: " + (f"{seconds[0]:.1f} s" if seconds else "is up to date"), end="")
        notebook = json.loads(made.read_text(encoding="utf-8"))
        outputs = [output for cell in notebook["cells"] for output in cell.get("outputs", [])]
        assert not [output for output in outputs if output["output_type"] == "error" or output.get("name") == "stderr"], file.stem
        kinds = [kind for output in outputs for kind in output.get("data", {})]
        assert kinds.count("image/png") >= 1 and kinds.count("text/html") >= 2, file.stem
        pages = ["".join(output["data"]["text/html"]) for output in outputs if "text/html" in output.get("data", {})]
        assert any("srcdoc=" in page for page in pages) and any("Conservation checks: passed" in page for page in pages), file.stem
        assert script.execute(file, out, module) == (made, None)  # not again
