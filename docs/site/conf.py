"""Configuration of Sphinx for the documentation's site. scripts/docs calls it on the pages that scripts/site_pages.py writes."""
import json
import os
import pathlib
import re
import sys

from breathe.renderer import sphinxrenderer
from docutils import nodes

ROOT = pathlib.Path(os.environ["GRAPNEL_SOURCE"])
BUILT = pathlib.Path(os.environ["GRAPNEL_DOCS_BUILD"])

project = "Grapnel"
author = "the authors of Grapnel"
project_copyright = "Apache License 2.0"
version = release = os.environ["GRAPNEL_VERSION"]

extensions = ["myst_parser", "breathe", "sphinx_copybutton"]
python_package = os.environ.get("GRAPNEL_PYTHON")  # the folder that holds the built module, where there is one
if python_package:
    sys.path.insert(0, python_package)
    extensions += ["sphinx.ext.autodoc", "sphinx.ext.napoleon"]
    autodoc_member_order = "bysource"

# Anchors of headings are those of GitHub.
myst_heading_anchors = 5
myst_enable_extensions = ["colon_fence"]
suppress_warnings = [
    "myst.header",  # a page of the repository may begin below its title
]
highlight_language = "none"
pygments_style = "friendly"
pygments_dark_style = "native"
nitpicky = False  # C++ names types of the standard library, which have no page here
smartquotes = False  # options begin with --

breathe_projects = {"grapnel": str(BUILT / "doxygen" / "xml")}
breathe_default_project = "grapnel"
breathe_default_members = ("members", "undoc-members")
breathe_show_include = True
breathe_order_parameters_first = True
cpp_index_common_prefix = ["grapnel::"]

copybutton_prompt_text = "$ "
copybutton_only_copy_prompt_lines = True

html_theme = "furo"
html_title = f"Grapnel {version}"
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_static_path = [str(ROOT / "docs" / "site" / "static"), str(BUILT / "static")]
html_css_files = ["site.css"]
if (BUILT / "static" / "katex").exists():
    html_css_files.append("katex/katex.min.css")
html_extra_path = [str(BUILT / "extra")]
# A browser does not let a page from disk fetch other pages, from which Sphinx takes excerpts: excerpts.js shows them from texts.js.
html_show_search_summary = False
html_search_scorer = str(ROOT / "docs" / "site" / "scorer.js")
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#2a5f8f", "color-brand-content": "#2a5f8f"},
    "dark_css_variables": {"color-brand-primary": "#8fbfe8", "color-brand-content": "#8fbfe8"},
}


def mend_furo(app, failed):
    """Debian's furo loads a style from the web server's /javascript and a script as a module, which do not work from disk. Both are
    inserted into the files that request them. It is dark only on request; the colours of a dark system are added."""
    static = pathlib.Path(app.outdir) / "_static"
    style, script = static / "styles" / "furo.css", static / "scripts" / "furo.js"
    request, name = "@import url(/javascript/normalize.css/normalize.css);", "import Gumshoe from \"./gumshoe-patched.js\";"
    if not failed and style.exists() and request in style.read_text():
        normalize = pathlib.Path("/usr/share/javascript/normalize.css/normalize.css").read_text()
        text = style.read_text().replace(request, normalize)
        # Its compiler omitted the dark colours of readers whose system is dark.
        dark = re.search(r'body\[data-theme="dark"\] \{(.*?)\}', text, re.DOTALL)[1]
        style.write_text(f'{text}\n@media screen and (prefers-color-scheme: dark) {{ body[data-theme="auto"] {{{dark}}} }}\n')
    if not failed and script.exists() and name in script.read_text():
        script.write_text((static / "scripts" / "gumshoe-patched.js").read_text() + script.read_text().replace(name, ""))


def members_of_namespace(renderer, node):
    """Renders the declarations of a header in a namespace, without the namespace, which Breathe would declare again in every header."""
    data = renderer.compound_parser.parse(node.refid)
    context = renderer.context.create_child_context(data)
    with sphinxrenderer.WithContext(renderer, context.create_child_context(data.compounddef)):
        return renderer.render(data, context)


def plain_docstring(app, what, name, item, options, lines):
    """Escapes | and * outside backquotes: in docstrings, |x| is a magnitude and * a product."""
    for i, line in enumerate(lines):
        parts = re.split(r"(`+[^`]*`+)", line)
        lines[i] = "".join(part if part.startswith("`") else re.sub(r"([|*])", r"\\\1", part) for part in parts)


def texts_of_pages(app, failed):
    """Writes _static/texts.js: the text of each page, for the excerpts of search results. References are too long and have none."""
    if failed:
        return
    texts = {}
    for name in sorted(app.env.found_docs):
        if name.startswith("cpp/") or name == "python-reference":
            continue
        page = app.env.get_doctree(name)
        for node in [*page.findall(nodes.raw), *page.findall(nodes.comment), *page.findall(nodes.title)]:
            node.parent.remove(node)
        texts[name] = re.sub(r"\s+", " ", page.astext())
    (pathlib.Path(app.outdir) / "_static" / "texts.js").write_text("const kTexts = " + json.dumps(texts, ensure_ascii=False) + ";\n")


def scripts_of_search(app, page, template, context, doctree):
    if page == "search":
        app.add_js_file("texts.js")
        app.add_js_file("excerpts.js")


def setup(app):
    if python_package:
        app.connect("autodoc-process-docstring", plain_docstring)
    sphinxrenderer.SphinxRenderer.visit_namespace = members_of_namespace
    app.connect("build-finished", mend_furo)
    app.connect("build-finished", texts_of_pages)
    app.connect("html-page-context", scripts_of_search)
