"""How Sphinx makes the documentation's site; scripts/docs calls it on the pages that scripts/site_pages.py has laid out."""
import os
import pathlib
import re
import sys

from breathe.renderer import sphinxrenderer

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

# Links into pages are those of the headings, as forges make them.
myst_heading_anchors = 5
myst_enable_extensions = ["colon_fence"]
suppress_warnings = [
    "myst.header",  # a page of the repository may begin below its title
]
highlight_language = "none"
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
html_static_path = [str(ROOT / "docs" / "site" / "static")]
html_css_files = ["site.css"]
html_extra_path = [str(BUILT / "extra")]
# Excerpts of the results are fetched by the page, which a browser does not allow from disk; titles and places need none of that.
html_show_search_summary = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#2a5f8f", "color-brand-content": "#2a5f8f"},
    "dark_css_variables": {"color-brand-primary": "#8fbfe8", "color-brand-content": "#8fbfe8"},
}


def mend_furo(app, failed):
    """Debian's furo takes a style from the web server's /javascript and a script as a module, neither of which there is from disk: both go
    into the files that ask for them."""
    static = pathlib.Path(app.outdir) / "_static"
    style, script = static / "styles" / "furo.css", static / "scripts" / "furo.js"
    request, name = "@import url(/javascript/normalize.css/normalize.css);", "import Gumshoe from \"./gumshoe-patched.js\";"
    if not failed and style.exists() and request in style.read_text():
        normalize = pathlib.Path("/usr/share/javascript/normalize.css/normalize.css").read_text()
        style.write_text(style.read_text().replace(request, normalize))
    if not failed and script.exists() and name in script.read_text():
        script.write_text((static / "scripts" / "gumshoe-patched.js").read_text() + script.read_text().replace(name, ""))


def members_of_namespace(renderer, node):
    """What a header declares in a namespace. Breathe would declare the namespace itself, again in every header."""
    data = renderer.compound_parser.parse(node.refid)
    context = renderer.context.create_child_context(data)
    with sphinxrenderer.WithContext(renderer, context.create_child_context(data.compounddef)):
        return renderer.render(data, context)


def plain_docstring(app, what, name, item, options, lines):
    """Docstrings are text: |x| is a magnitude and no substitution, * a product and no emphasis. Code in backquotes stays unchanged."""
    for i, line in enumerate(lines):
        parts = re.split(r"(`+[^`]*`+)", line)
        lines[i] = "".join(part if part.startswith("`") else re.sub(r"([|*])", r"\\\1", part) for part in parts)


def setup(app):
    if python_package:
        app.connect("autodoc-process-docstring", plain_docstring)
    sphinxrenderer.SphinxRenderer.visit_namespace = members_of_namespace
    app.connect("build-finished", mend_furo)
