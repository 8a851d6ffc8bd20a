#!/usr/bin/env python3
"""Writes the pages of the documentation's site for Sphinx. Standard library only.

usage: scripts/site_pages.py PROGRAM OUT [--python FOLDER] [--katex FOLDER] [--stills FOLDER] [--sample] [--notebooks FOLDER]
       (scripts/docs calls it)

OUT/source receives the pages of the repository, with links rewritten to their place on the site and equations typeset where
--katex names the folder that has the package KaTeX in node_modules. Generated pages follow: the gallery, which runs every shipped
scenario; a page for each scenario; a page for each notebook, with the outputs of the executed copies in --notebooks; the commands; the references of the stable C++ headers and of the Python module, if it is
built. --stills names the folder of the packages that a browser needs to draw pictures of scenarios. With --sample most scenarios
run without report and pictures.

docs/README.md is the home page. Its sections and links determine the order of the site. Lines within a comment
`<!-- on the site:` appear on the site only.
"""
import concurrent.futures
import hashlib
import html
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent
MAIN = "docs/README.md"
GALLERY = "docs/gallery.md"  # where it exists
NOTEBOOKS = "examples/notebooks"
# The folders of scenarios and their titles, in the order of the gallery.
FOLDERS = [("scenarios", "Scenarios"), ("scenarios/thesis", "Cases of the thesis")]
REPORT = "dual-arm-satellite-handles"  # the scenario whose report pages show
SAMPLE = 8  # with --sample, one scenario of so many is drawn

sys.path.insert(0, str(ROOT / "docs" / "site"))
import equations  # noqa: E402
from site_notebooks import NotebookPage, with_download  # noqa: E402


def pages_of_repository():
    """The place of every page of the repository on the site. README.md of a folder is its index."""
    pages = {"README.md": "readme.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md", MAIN: "index.md"}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        name = page.relative_to(ROOT).as_posix()
        place = page.relative_to(ROOT / "docs")
        pages.setdefault(name, (place.with_name("index.md") if place.name == "README.md" else place).as_posix())
    for notebook in sorted((ROOT / NOTEBOOKS).glob("*.ipynb")):
        pages[notebook.relative_to(ROOT).as_posix()] = f"notebooks/{notebook.stem}.md"
    return pages


def outside_code(text):
    """Yields the lines of a text, each with whether it is outside code blocks."""
    code = False
    for line in text.split("\n"):
        fence = line.lstrip().startswith("```")
        yield line, not (code or fence)
        if fence:
            code = not code


class Site:
    def __init__(self, out):
        self.source = out / "source"
        self.extra = out / "extra"
        self.pages = pages_of_repository()
        self.faults = []
        for folder in (self.source, self.extra):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)

    def write(self, name, text):
        path = self.source / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def led(self, page, line):
        """Rewrites the links of a line to places on the site."""
        here = pathlib.PurePosixPath(self.pages[page]).parent

        def lead(match):
            before, link = match[1], match[2]
            target, _, anchor = link.partition("#")
            if re.match(r"[a-z]+:", link) or not target:
                return match[0]
            repository = os.path.normpath((pathlib.PurePosixPath(page).parent / target).as_posix())
            if repository in self.pages:
                place = self.pages[repository]
            elif repository.removeprefix("docs/") in self.made:
                place = repository.removeprefix("docs/")
            elif (ROOT / repository).is_file():
                place = repository.removeprefix("docs/") if repository.startswith("docs/images/") else f"files/{repository}"
                copy = self.source / place
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(ROOT / repository, copy)
            else:
                self.faults.append(f"{page}: error: broken link '{link}'")
                return match[0]
            relative = os.path.relpath(place, here.as_posix() or ".")
            return f"{before}{relative}{'#' + anchor if anchor else ''})"

        parts = re.split(r"(`[^`]*`)", line)  # inline code remains unchanged
        if len(parts) > 1 and re.search(r"\[[^\]]*`[^`]*`[^\]]*\]\(", line):
            return re.sub(r"(\]\()([^) ]+)\)", lead, line)  # except in the text of a link
        return "".join(part if part.startswith("`") else re.sub(r"(\]\()([^) ]+)\)", lead, part) for part in parts)

    def take_pages(self, made, gallery, katex, executed):
        """`executed`: the folder of executed notebooks."""
        self.made = made
        texts, seconds = {}, {}
        for page, place in self.pages.items():
            if page.endswith(".ipynb"):
                notebook = NotebookPage(ROOT / page, executed / pathlib.Path(page).name, (self.source / place).parent, self.source.parent / "reports")
                texts[page] = notebook.text()
                seconds[page] = notebook.seconds
                continue
            text = (ROOT / page).read_text()
            if page == MAIN:
                text = re.sub(r"<!-- on the site:\n(.*?)\n?-->", r"\1", text, flags=re.DOTALL)
            texts[page] = text
        typesetting = Typesetting(texts, self.pages, katex)
        for page, place in self.pages.items():
            lines = [self.led(page, line) if prose else line for line, prose in outside_code(texts[page])]
            text = typesetting.apply(page, "\n".join(lines))
            if page == MAIN:
                text = home(text) + contents(text)
            elif page == GALLERY:
                text = gallery.with_cards(text)
            elif page.endswith(".ipynb"):
                copy = self.source / "files" / page
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(ROOT / page, copy)
                text = with_download(text, f"../files/{page}", seconds[page])
            elif page.startswith("docs/"):
                text += children(text, place, self.pages.values())
            self.write(place, text)
        return typesetting


class Typesetting:
    """Equations of pages, typeset by KaTeX. Without KaTeX they remain plain text."""

    BLOCK = re.compile(r"^```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
    # A letter with a subscript or superscript, in prose: X_WB, J_b, h_Cᵀ, M⁻¹; no units such as m².
    SCRIPTS = "[⁰¹²³⁴-⁹⁺⁻ᵀ₀-₉]"
    SYMBOL = re.compile(rf"(?<![\w/.\\^#-])([Δδ∂]?(?![ms](?:[²³]|⁻[¹²])(?!_))[A-Za-zΑ-Ωα-ωÀ-ÿĀ-ſẋẏẍż][\u0300-\u036f]?"
                        rf"(?:(?:\^[a-z])?{SCRIPTS}*_[A-Za-zα-ω0-9]{{1,12}}(?:,[a-z])?{SCRIPTS}*|{SCRIPTS}+))(?![_.]\w|\w|[²³⁺⁻ᵀ])")
    NUMBER = re.compile(r"(?<![\w\]`])\((\d+\.\d+[a-z]?)\)")

    def __init__(self, texts, pages, katex):
        self.pages, self.places, self.items, self.html, self.plain = pages, {}, {}, {}, 0
        if not katex:
            return
        for page, text in texts.items():
            for block in self.BLOCK.findall(text):
                if rows := self.rows(block):
                    for left, right, number in rows:
                        self.items |= {(tex, True): None for tex in (left, *right.split(equations.GAP)) if tex}
                        if number:
                            self.places[number] = pages[page]
        self.theory = {page for page in texts if any(page == folder or page.startswith(folder + "/") for folder in ("docs/theory", "docs/theory.md"))}
        for page in self.theory:
            for line, prose in outside_code(texts[page]):
                if prose and not line.startswith("#"):
                    for symbol in self.SYMBOL.findall(line):
                        try:
                            self.items[(equations.Line(symbol).all(), False)] = None
                        except equations.NotAnEquation:
                            pass
        keys = list(self.items)
        done = subprocess.run(["node", str(ROOT / "docs" / "site" / "typeset.mjs")], text=True, stdout=subprocess.PIPE, check=True,
                              input=json.dumps([{"tex": tex, "display": display} for tex, display in keys]),
                              env={**os.environ, "SITE_PACKAGES": katex})
        self.html = {key: result.get("html", "").replace("\n", " ") for key, result in zip(keys, json.loads(done.stdout))}

    @staticmethod
    def rows(block):
        if not equations.NUMBER.search(block.split("\n")[0]) and not any(equations.NUMBER.search(line) for line in block.split("\n")):
            return None
        try:
            return equations.rows_of(block)
        except equations.NotAnEquation:
            return None

    def apply(self, page, text):
        if not self.html:
            return text
        text = self.BLOCK.sub(self.block, text)
        if page not in self.theory:
            return text
        lines = []
        for line, prose in outside_code(text):
            if prose and not line.startswith(("#", "<")):
                parts = re.split(r"(`[^`]*`|\]\([^)]*\))", line)
                line = "".join(part if part.startswith(("`", "](")) else self.prose(page, part) for part in parts)
            lines.append(line)
        return "\n".join(lines)

    def block(self, match):
        rows = self.rows(match[1])
        if not rows or not all(self.html.get((tex, True)) for left, right, _ in rows for tex in (left, *right.split(equations.GAP)) if tex):
            self.plain += bool(re.search(equations.NUMBER.pattern, match[1], re.MULTILINE))
            return match[0]
        aligned = any(left for left, _, _ in rows)
        cells = []
        for left, right, number in rows:
            place = f' id="eq-{number.replace(".", "-")}"' if number else ""
            cells += [f'<div class="left">{self.html[left, True]}</div>' if left else ""] if aligned else []
            statements = " ".join(f'<span class="statement">{self.html[tex, True]}</span>' for tex in right.split(equations.GAP) if tex)
            cells.append(f'<div class="right">{statements}</div><div class="number"{place}>{f"({number})" if number else ""}</div>')
        source = html.escape(match[1].strip(), quote=True).replace("\n", "&#10;")
        return f'<div class="equations{" aligned" if aligned else ""}" role="math" aria-label="{source}">{"".join(cells)}</div>'

    def prose(self, page, text):
        def symbol(match):
            try:
                return self.html.get((equations.Line(match[1]).all(), False)) or match[0]
            except equations.NotAnEquation:
                return match[0]

        def reference(match):
            place = self.places.get(match[1])
            if not place:
                return match[0]
            relative = os.path.relpath(place, pathlib.PurePosixPath(self.pages[page]).parent.as_posix()).removesuffix(".md") + ".html"
            return f'<a class="equation-reference" href="{relative}#eq-{match[1].replace(".", "-")}">({match[1]})</a>'

        return self.NUMBER.sub(reference, self.SYMBOL.sub(symbol, text))


def home(text):
    """The home page: the commands of README.md after the picture, and the entry points as cards."""
    commands = re.search(r"```bash\n.*?\n```\n", (ROOT / "README.md").read_text(), re.DOTALL)
    if commands:
        text = re.sub(r"(?=^## )", commands[0] + "\n", text, count=1, flags=re.MULTILINE)

    def cards(match):
        rows = re.findall(r"^\| \*\*(.+?)\*\* \| (.+?) \|$", match[0], re.MULTILINE)
        made = "\n".join(f":::{{container}} card\n**{title[0].upper() + title[1:]}**\n\n{text}\n:::\n" for title, text in rows)
        return f"::::{{container}} cards\n{made}::::\n"

    return re.sub(r"^\|[^\n]*\|\n\|[-|: ]+\|\n(?:\| \*\*[^\n]*\|\n)+(?!\|)", cards, text, flags=re.MULTILINE)


def children(text, place, places):
    """A hidden table of contents: the pages in the folder of a page, in the order in which the page links to them."""
    here = pathlib.PurePosixPath(place)
    folder = here.parent if here.name == "index.md" else here.with_suffix("")
    inner = [os.path.relpath(p, here.parent) for p in sorted(places) if pathlib.PurePosixPath(p).parent == folder and p != place]
    rows = {link: i for i, link in enumerate(re.findall(r"^\| \[[^\]]*\]\(([^)#]+)", text, re.MULTILINE))}
    inner.sort(key=lambda name: (rows.get(name, len(rows)), text.find(f"({name}") if f"({name}" in text else len(text)))
    return "\n```{toctree}\n:hidden:\n\n" + "\n".join(inner) + "\n```\n" if inner else ""


def contents(text):
    """Hidden tables of contents: a section of the home page is a part of the site, with the pages to which it links."""
    parts, section, seen = [], None, set()
    for line in text.split("\n"):
        if line.startswith("## "):
            section = (line[3:], [])
            parts.append(section)
        for words, link in re.findall(r"\[([^\]]+)\]\(([^)#:]+)\.md\)", line):
            if section and link not in seen:
                seen.add(link)
                section[1].append(f"{words} <{link}>")
    blocks = ["```{toctree}\n:hidden:\n:caption: " + title + "\n\n" + "\n".join(links) + "\n```\n" for title, links in parts if links]
    return "\n" + "\n".join(blocks)


def run(program, *words, **options):
    return subprocess.run([program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL, **options)


def first_words(text):
    """The first paragraph of the comment at the beginning of a scenario."""
    words = []
    for line in text.split("\n"):
        if line.startswith("# yaml-language-server:"):
            continue
        if not line.startswith("#") or not line.strip("# "):
            break
        words.append(line[1:].strip())
    return " ".join(words)


class Scenario:
    """A shipped scenario: its results, pictures and page."""

    def __init__(self, path, kept):
        self.path, self.name, self.drawn = path, path.relative_to(ROOT / "scenarios").with_suffix("").as_posix(), True
        self.key, self.kept = self.name.replace("/", "-"), kept
        self.text = path.read_text()
        self.title = re.search(r"^name: *(.*)$", self.text, re.MULTILINE)[1].strip("'\"")
        self.summary = first_words(self.text)

    def file(self, ending):
        return self.kept / f"{self.key}{ending}"

    def run(self, program):
        """Runs the scenario and draws it. Returns an error message, or None."""
        if self.file(".txt").exists() and (self.file(".svg").exists() or not self.drawn):
            return None
        folder = self.file("")
        done = run(program, "run", self.path, "-o", folder, *([] if self.drawn else ["--no-report"]))
        if done.returncode > 1:
            return f"{self.path}: error: {done.stderr.strip()}"
        if self.drawn:
            drawn = run(program, "figure", folder, "--what", "strobe", "-o", folder / "strobe.svg")
            if drawn.returncode:
                return f"{self.path}: error: {drawn.stderr.strip()}"
            os.replace(folder / "strobe.svg", self.file(".svg"))
        if (folder / "report.html").exists():
            os.replace(folder / "report.html", self.file(".html"))
        shutil.rmtree(folder)
        printed = done.stdout.split("\n")
        verdicts = printed[next((i for i, line in enumerate(printed) if line.startswith("captured:")), len(printed)):]
        verdicts = verdicts[: next((i for i, line in enumerate(verdicts) if not line.strip()), len(verdicts))]
        self.file(".txt").write_text("\n".join(verdicts))
        return None

    def page(self):
        up = "../" * (self.name.count("/") + 1)
        parts = ["---\norphan: true\n---", f"# {self.title}", self.summary]
        if self.file(".jpg").exists():
            parts.append(f"![3D replay of {self.title}]({up}gallery/{self.key}.jpg)")
        links = [f"[Gallery]({up}gallery.md)"]
        if self.file(".html").exists():
            links.insert(0, f'<a href="{up}reports/{self.key}.html">Report: 3D replay, plots, every number</a>')
        parts.append(" · ".join(links))
        parts.append(f"```console\n$ grapnel run scenarios/{self.name}.yaml\n...\n{self.file('.txt').read_text()}\n```")
        if self.file(".svg").exists():
            parts.append(f"![Superposed configurations of {self.title}]({up}gallery/{self.key}.svg)")
        parts.append(f"## Input\n\n[{self.path.name}]({up}files/scenarios/{self.name}.yaml)\n\n```yaml\n{self.text.rstrip()}\n```\n")
        return "\n\n".join(parts)

    def card(self, description=None):
        picture = next((e for e in (".jpg", ".svg") if self.file(e).exists()), None)
        shown = f"[![Picture of {self.title}](gallery/{self.key}{picture})](scenarios/{self.name}.md)\n\n" if picture else ""
        return f":::{{container}} card\n{shown}**[{self.title}](scenarios/{self.name}.md)**\n\n{description or self.summary}\n:::\n"


class Gallery:
    """All shipped scenarios. Results are kept as long as program and inputs are the same."""

    COMMAND = re.compile(r"^\| `grapnel run scenarios/([\w/-]+)\.yaml` \| (.*?) \|$")

    def __init__(self, program, out, stills, sample):
        self.out, self.faults, self.report = out, [], None
        state = hashlib.sha256(program.read_bytes())
        for folder in ("scenarios", "robots", "targets", "meshes"):
            for file in sorted((ROOT / folder).rglob("*.*")):
                state.update(file.relative_to(ROOT).as_posix().encode() + file.read_bytes())
        kept = out / "gallery" / state.hexdigest()[:16]
        if not kept.exists():
            shutil.rmtree(kept.parent, ignore_errors=True)
            kept.mkdir(parents=True)
        self.folders = [(title, [Scenario(path, kept) for path in sorted((ROOT / folder).glob("*.yaml"))]) for folder, title in FOLDERS]
        self.scenarios = {scenario.name: scenario for _, scenarios in self.folders for scenario in scenarios}
        for number, scenario in enumerate(self.scenarios.values()):
            scenario.drawn = not sample or number % SAMPLE == 0 or scenario.name == REPORT
        processors = len(os.sched_getaffinity(0))
        with concurrent.futures.ThreadPoolExecutor(processors) as pool:
            self.faults += filter(None, pool.map(lambda scenario: scenario.run(program), self.scenarios.values()))
            if stills:
                wanted = [s for s in self.scenarios.values() if s.file(".html").exists() and not s.file(".jpg").exists()]
                list(pool.map(lambda k: self.draw_stills(kept / f"stills-{k}.json", wanted[k::processors], stills), range(processors)))
                if wanted and not any(s.file(".jpg").exists() for s in wanted):
                    self.faults.append(f"error: the browser drew none of {len(wanted)} pictures")
        (out / "source" / "gallery").mkdir(parents=True)
        for scenario in self.scenarios.values():
            copy = out / "source" / "files" / scenario.path.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(scenario.path, copy)
            for ending in (".svg", ".jpg"):
                if scenario.file(ending).exists():
                    shutil.copyfile(scenario.file(ending), out / "source" / "gallery" / scenario.file(ending).name)
        self.link_reports()
        if stills:
            self.draw_report(kept / "report.jpg", stills)

    @staticmethod
    def draw_stills(list_file, scenarios, packages):
        """Draws pictures in a browser; a picture that fails is missing, since a site without it is complete. It is an error if all fail."""
        if scenarios:
            list_file.write_text(json.dumps([{"report": str(s.file(".html")), "out": str(s.file(".jpg"))} for s in scenarios]))
            subprocess.run(["node", str(ROOT / "docs" / "site" / "stills.mjs"), list_file], env={**os.environ, "GRAPNEL_WEB_MODULES": packages},
                           timeout=600, check=False)

    def draw_report(self, picture, packages):
        """Draws the picture of a report that pages show, from the present report. docs/images/ has one for those without a browser."""
        report = self.scenarios.get(REPORT)
        if report and report.file(".html").exists() and not picture.exists():
            subprocess.run(["node", str(ROOT / "web" / "picture.mjs"), report.file(".html"), picture, "45"],
                           env={**os.environ, "GRAPNEL_WEB_MODULES": packages}, timeout=300, check=False)
            if not picture.exists():
                self.faults.append(f"error: the browser drew no picture of {report.file('.html')}")
        self.report = picture if picture.exists() else None

    def link_reports(self):
        """OUT/reports has the reports under the names of their links. scripts/docs adds it to the site."""
        reports = self.out / "reports"
        shutil.rmtree(reports, ignore_errors=True)
        reports.mkdir()
        for scenario in self.scenarios.values():
            if scenario.file(".html").exists():
                os.link(scenario.file(".html"), reports / f"{scenario.key}.html")

    def pages(self):
        return {f"scenarios/{s.name}.md": s.page() for s in self.scenarios.values() if s.file(".txt").exists()}

    def page(self):
        text = "# Gallery\n\nThis page shows every scenario that comes with Grapnel, at the instant of capture. Each picture leads to the scenario's page.\n"
        for title, scenarios in self.folders:
            text += f"\n## {title}\n\n" + grid(s.card() for s in scenarios if s.file(".txt").exists())
        return text

    def with_cards(self, text):
        """docs/gallery.md, with cards in place of the rows of tables that run a scenario."""

        def table(match):
            cards, rows = [], []
            for row in match[2].splitlines(keepends=True):
                command = self.COMMAND.match(row.rstrip("\n"))
                scenario = command and self.scenarios.get(command[1])
                if scenario and scenario.file(".txt").exists():
                    cards.append(scenario.card(command[2]))
                else:
                    rows.append(row)
            shown = grid(cards) if cards else ""
            return shown + ("\n" if cards and rows else "") + (match[1] + "".join(rows) if rows else "")

        beginning, heading, rest = text.partition("\n## ")
        beginning = re.sub(r"\n!\[[^\n]*\n\n\*[^\n]*\*\n", "", beginning)  # cards come first
        text = beginning + heading + rest
        return re.sub(r"^(\|[^\n]*\|\n\|[-|: ]+\|\n)((?:\|[^\n]*\|\n)+)", table, text, flags=re.MULTILINE)


def grid(cards):
    return "::::{container} cards\n" + "\n".join(cards) + "::::\n"


def cpp_reference():
    """A page for every module with headers that are kept stable."""
    modules = {}
    for header in sorted((ROOT / "grapnel").rglob("*.hpp")):
        text = header.read_text()
        if re.search(r"Public( \w+)?, kept stable", re.sub(r"\s*\n\s*(/// ?)?", " ", text[:2000])):
            modules.setdefault(header.parent.name, []).append(header)
    order = re.findall(r"[a-z_]+", re.search(r"set\(GRAPNEL_MODULES ([^)]*)\)", (ROOT / "cmake" / "GrapnelModule.cmake").read_text())[1])
    pages = {}
    names = sorted(modules, key=order.index, reverse=True)
    for module in names:
        text = f"# {module}\n"
        for header in modules[module]:
            name = header.relative_to(ROOT).as_posix()
            text += f"\n## {name}\n\n```{{doxygenfile}} {name}\n```\n"
        pages[f"cpp/{module}.md"] = text
    links = "\n".join(names)
    pages["cpp/index.md"] = (
        "# C++ reference\n\nThe headers that are [kept stable](../stability.md), module by module, those in the order in which programs use them.\n"
        "`find_package(Grapnel)` and `Grapnel::grapnel` or `Grapnel::<module>` bring them; "
        "[Assumptions and limits](../modules.md) lists the assumptions of each module.\n\n"
        "<p>All other headers, which may change with any commit, with graphs of dependencies: "
        '<a href="../doxygen/index.html">the whole library</a>.</p>\n\n```{toctree}\n' + links + "\n```\n")
    return pages


def main():
    words = sys.argv[1:]
    options = {name: words[words.index(name) + 1] if name in words else None for name in ("--python", "--katex", "--stills", "--notebooks")}
    module = options["--python"]
    program, out = pathlib.Path(words[0]).resolve(), pathlib.Path(words[1]).resolve()
    site = Site(out)
    gallery = Gallery(program, out, options["--stills"], "--sample" in words)
    pages = cpp_reference() | gallery.pages()
    if GALLERY not in site.pages:
        pages["gallery.md"] = gallery.page()
    made = {"commands.md", "python-reference.md", *pages}
    faults = gallery.faults
    for name, text in pages.items():
        site.write(name, text)
    manual = run(program, "manual", "--markdown")
    if manual.returncode:
        faults.append(manual.stderr)
    site.write("commands.md", manual.stdout)
    reference = "The Python module was not built when this site was made: `scripts/setup build`, then build `build/release` again.\n"
    if module:
        modules = ["grapnel"] + [f"grapnel.{name}" for name in ("env", "optimal_control") if (pathlib.Path(module) / "grapnel" / f"{name}.py").exists()]
        reference = "\n".join("```{eval-rst}\n.. automodule:: " + name + "\n   :members:\n   :imported-members:\n```\n" if name == "grapnel" else
                              "## " + name + "\n\n```{eval-rst}\n.. automodule:: " + name + "\n   :members:\n```\n" for name in modules)
    site.write("python-reference.md", "# Python reference\n\n" + reference)
    typesetting = site.take_pages(made, gallery, options["--katex"], pathlib.Path(options["--notebooks"] or out / "notebooks"))
    if gallery.report:
        shutil.copyfile(gallery.report, out / "source" / "images" / "report.jpg")
    print(f"{len(gallery.scenarios)} scenarios, {sum(s.file('.jpg').exists() for s in gallery.scenarios.values())} pictures, "
          f"{len(typesetting.places)} equations typeset, {typesetting.plain} numbered blocks in plain text")
    for fault in faults + site.faults:
        print(fault, file=sys.stderr)
    sys.exit(1 if faults or site.faults else 0)


main()
