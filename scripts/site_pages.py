#!/usr/bin/env python3
"""Lays out the pages of the documentation's site for Sphinx. Standard library only.

usage: scripts/site_pages.py PROGRAM OUT [--python FOLDER]     (scripts/docs calls it)

OUT/source gets the pages of the repository, which stay the only source of their text, with their links led to where pages are on
the site; and the generated pages: pictures of every shipped scenario; the program's commands; the
reference of the stable C++ headers; and of the Python module, where it is built. The site's first page and its order are
docs/README.md: its sections, and the links in them. Lines within a comment `<!-- on the site:` there are shown on the site only.
"""
import concurrent.futures
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent
MAIN = "docs/README.md"
# Order of the folders in the gallery, and their descriptions.
GALLERY = [("scenarios", "Captures in three dimensions and first steps"), ("scenarios/thesis", "The thesis's cases")]


def pages_of_repository():
    """Locations on the site of all pages of the repository."""
    pages = {"README.md": "readme.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md", MAIN: "index.md"}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        name = page.relative_to(ROOT).as_posix()
        pages.setdefault(name, page.relative_to(ROOT / "docs").as_posix())
    return pages


def outside_code(text):
    """The text's lines, each with whether it is prose."""
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
        """A line of a page of the repository, its links led to places of the site."""
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

        parts = re.split(r"(`[^`]*`)", line)  # ... except in the text of a link
        return "".join(part if part.startswith("`") else re.sub(r"(\]\()([^) ]+)\)", lead, part) for part in parts)

    def take_pages(self, made):
        self.made = made
        for page, place in self.pages.items():
            text = (ROOT / page).read_text()
            if page == MAIN:
                text = re.sub(r"<!-- on the site:\n(.*?)\n?-->", r"\1", text, flags=re.DOTALL)
            lines = [self.led(page, line) if prose else line for line, prose in outside_code(text)]
            text = "\n".join(lines)
            # A folder's README.md lists the pages of the folder.
            has_contents = page.startswith("docs/") and page.endswith("/README.md")
            self.write(place, text + (contents(text) if has_contents else details(place, text, self.pages.values())))


def contents(text):
    """Hidden tables of contents: a section of the first page is a part of the site, with the pages that it links."""
    parts, section, seen = [], None, set()
    for line in text.split("\n"):
        if line.startswith("## "):
            section = (line[3:], [])
            parts.append(section)
        for words, link in re.findall(r"\[([^\]]+)\]\(([^)#]+)\.md\)", line):
            if section and link not in seen:
                seen.add(link)
                section[1].append(f"{words} <{link}>")
    blocks = ["```{toctree}\n:hidden:\n:caption: " + title + "\n\n" + "\n".join(links) + "\n```\n" for title, links in parts if links]
    return "\n" + "\n".join(blocks)


def details(place, text, places):
    """Hidden table of contents of a page with details behind it: the pages in the folder of its name, as it links them."""
    folder = place.removesuffix(".md") + "/"
    inner = sorted(p for p in places if p.startswith(folder))
    if not inner:
        return ""
    names = [os.path.relpath(p, pathlib.PurePosixPath(place).parent) for p in inner]
    names.sort(key=lambda name: text.find(f"({name}") if f"({name}" in text else len(text))
    return "\n```{toctree}\n:hidden:\n\n" + "\n".join(names) + "\n```\n"


def run(program, *words, **options):
    return subprocess.run([program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL, **options)


def first_words(text):
    """Description of a scenario: the first paragraph of its leading comment."""
    words = []
    for line in text.split("\n"):
        if line.startswith("# yaml-language-server:"):
            continue
        if not line.startswith("#") or not line.strip("# "):
            break
        words.append(line[1:].strip())
    return " ".join(words)


def draw(program, scenario, cache):
    """Runs a scenario and draws it into the folder `kept`. Returns its entry in the gallery, or the error."""
    name = scenario.relative_to(ROOT / "scenarios").with_suffix("").as_posix()
    picture, entry, folder = (cache / f"{name.replace('/', '-')}{ending}" for ending in (".svg", ".md", ""))
    if entry.exists():
        return entry.read_text(), None
    done = run(program, "run", scenario, "-o", folder, "--no-report")
    if done.returncode > 1:
        return None, f"{scenario}: error: {done.stderr.strip()}"
    drawn = run(program, "figure", folder, "--what", "strobe", "-o", folder / picture.name)
    if drawn.returncode:
        return None, f"{scenario}: error: {drawn.stderr.strip()}"
    os.replace(folder / picture.name, picture)
    shutil.rmtree(folder)
    title = re.search(r"^name: *(.*)$", scenario.read_text(), re.MULTILINE)[1].strip("'\"")
    printed = done.stdout.split("\n")
    verdicts = printed[next((i for i, line in enumerate(printed) if line.startswith("captured:")), len(printed)):]
    verdicts = verdicts[: next((i for i, line in enumerate(verdicts) if not line.strip()), len(verdicts))]
    text = (f"## {title}\n\n{first_words(scenario.read_text())}\n\n"
            f"![Superposed configurations of {title}](gallery/{picture.name})\n\n"
            f"```console\n$ grapnel run scenarios/{name}.yaml\n...\n" + "\n".join(verdicts) + "\n```\n\n"
            f"[scenarios/{name}.yaml](files/scenarios/{name}.yaml)\n")
    entry.write_text(text)
    return text, None


def gallery(program, out):
    """The page, and the scenarios that could not be drawn. Runs are cached while program and inputs are unchanged."""
    state = hashlib.sha256(program.read_bytes() )
    for folder in ("scenarios", "robots", "targets", "meshes"):
        for file in sorted((ROOT / folder).rglob("*.*")):
            state.update(file.as_posix().encode() + file.read_bytes())
    cache = out / "gallery" / state.hexdigest()[:16]
    if not cache.exists():
        shutil.rmtree(cache.parent, ignore_errors=True)
        cache.mkdir(parents=True)
    text = ("# Pictures of all scenarios\n\nThe build of this page ran every scenario that comes with Grapnel and drew it by `grapnel figure DIR --what strobe`.\n"
            "Early configurations are light, late ones dark. One panel shows the approach, the other the motion after the impact.\n"
            "Each picture is followed by its command and the verdicts that the command prints.\n")
    faults = []
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for folder, title in GALLERY:
            scenarios = sorted((ROOT / folder).glob("*.yaml"))
            text += f"\n## {title}\n\n"
            for scenario, (entry, fault) in zip(scenarios, pool.map(lambda s: draw(program, s, cache), scenarios)):
                faults += [fault] if fault else []
                text += "#" + (entry or "# " + scenario.name) + "\n"
                copy = out / "source" / "files" / scenario.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(scenario, copy)
    (out / "source" / "gallery").mkdir(parents=True)
    for picture in cache.glob("*.svg"):
        shutil.copyfile(picture, out / "source" / "gallery" / picture.name)
    return text, faults


def cpp_reference():
    """A page for every module with stable headers."""
    modules = {}
    for header in sorted((ROOT / "grapnel").rglob("*.hpp")):
        text = header.read_text()
        if "Public, kept stable" in text[:2000]:
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
        "# C++ reference\n\nThe headers that are [kept stable](../stability.md), module by module, those that programs begin with first.\n"
        "`find_package(Grapnel)` and `Grapnel::grapnel` or `Grapnel::<module>` bring them; "
        "[Assumptions and limits](../modules.md) lists the assumptions of each module.\n\n"
        "<p>All other headers, which may change with any commit, with graphs of what uses what: "
        '<a href="../doxygen/index.html">the whole library</a>.</p>\n\n```{toctree}\n' + links + "\n```\n")
    return pages


def main():
    words = sys.argv[1:]
    python = words.index("--python") if "--python" in words else None
    module = words[python + 1] if python is not None else None
    program, out = pathlib.Path(words[0]).resolve(), pathlib.Path(words[1]).resolve()
    site = Site(out)
    made = {"pictures.md", "commands.md", "python-reference.md", *(pages := cpp_reference())}
    for name, text in pages.items():
        site.write(name, text)
    text, faults = gallery(program, out)
    site.write("pictures.md", text)
    manual = run(program, "manual", "--markdown")
    if manual.returncode:
        faults.append(manual.stderr)
    site.write("commands.md", manual.stdout)
    reference = "The Python module was not built when this site was made: `scripts/setup build`, then build `build/release` again.\n"
    if module:
        modules = ["grapnel"] + [f"grapnel.{name}" for name in ("env",) if (pathlib.Path(module) / "grapnel" / f"{name}.py").exists()]
        reference = "\n".join("```{eval-rst}\n.. automodule:: " + name + "\n   :members:\n   :imported-members:\n```\n" if name == "grapnel" else
                              "## " + name + "\n\n```{eval-rst}\n.. automodule:: " + name + "\n   :members:\n```\n" for name in modules)
    site.write("python-reference.md", "# Python reference\n\n" + reference)
    site.take_pages(made)
    for fault in faults + site.faults:
        print(fault, file=sys.stderr)
    sys.exit(1 if faults or site.faults else 0)


main()
