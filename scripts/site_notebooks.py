"""Pages of the documentation's site from notebooks. Standard library only; scripts/site_pages.py calls it.

A page has the cells of a notebook in their order: text, code, and the outputs of an executed copy. Replays become files, which the
page loads when the reader scrolls to them.
"""

import base64
import html
import json
import os
import re

FRAME = re.compile(r'<iframe([^>]*?)\ssrcdoc="([^"]*)"([^>]*)></iframe>')
ESCAPES = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")  # colours of terminals


def joined(text):
    """The text of a cell or an output, which files store as a string or as a list of lines."""
    return text if isinstance(text, str) else "".join(text)


class NotebookPage:
    """A notebook as a page in Markdown, for Sphinx with MyST."""

    def __init__(self, source, executed, pictures, replays):
        """`source`: the notebook; `executed`: a copy with outputs, which is used if it has the same cells; `pictures` and `replays`:
        folders for files."""
        self.name, self.pictures, self.replays = source.stem, pictures, replays
        self.notebook = json.loads(source.read_text(encoding="utf-8"))
        if executed.exists():
            copy = json.loads(executed.read_text(encoding="utf-8"))
            if self.sources(copy) == self.sources(self.notebook):
                self.notebook = copy
        #: Duration of the execution [s]; None without outputs.
        self.seconds = self.notebook["metadata"].get("grapnel", {}).get("seconds")
        self.heading, self.files = source.stem, 0

    @staticmethod
    def sources(notebook):
        return [(cell["cell_type"], joined(cell["source"])) for cell in notebook["cells"]]

    def text(self):
        """The page. Links remain those of the notebook."""
        parts = []
        for cell in self.notebook["cells"]:
            source = joined(cell["source"])
            if cell["cell_type"] == "markdown":
                self.heading = next(iter(re.findall(r"^#+ (.*)$", source, re.MULTILINE)), self.heading)
                parts.append(source)
            elif cell["cell_type"] == "code":
                parts.append(f"```python\n{source}\n```")
                shown = self.outputs(cell["outputs"])
                if shown:
                    parts.append("::::{container} notebook-output\n" + "\n\n".join(shown) + "\n::::")
        return "\n\n".join(parts) + "\n"

    def outputs(self, outputs):
        """The outputs of a cell. Consecutive texts of one stream are one block."""
        shown, stream = [], None
        for output in outputs:
            kind = output["output_type"]
            if kind == "stream":
                if stream is None:
                    stream = []
                    shown.append(stream)
                stream.append(joined(output["text"]))
                continue
            stream = None
            if kind in ("execute_result", "display_data"):
                shown.append(self.data(output["data"]))
            elif kind == "error":
                shown.append(self.block("\n".join(output["traceback"])))
        return [self.block("".join(one)) if isinstance(one, list) else one for one in shown]

    def data(self, data):
        """The richest form of an output."""
        if "text/html" in data:
            page = FRAME.sub(self.frame, joined(data["text/html"]))
            return "```{raw} html\n" + re.sub(r"\n\s*\n", "\n", page) + "\n```"
        for kind, ending in (("image/svg+xml", "svg"), ("image/png", "png")):
            if kind in data:
                content = joined(data[kind])
                file = self.file(self.pictures, ending)
                file.write_bytes(content.encode() if ending == "svg" else base64.b64decode(content))
                return f"```{{image}} {file.name}\n:alt: {json.dumps('Figure: ' + self.heading)}\n```"
        return self.block(joined(data.get("text/plain", "")))

    def frame(self, match):
        """Writes the page of a frame to a file, which the frame loads on demand."""
        file = self.file(self.replays, "html")
        file.write_text(html.unescape(match[2]), encoding="utf-8")
        place = "../reports/" + file.name
        title = html.escape(f"{self.heading}: report with 3D replay", quote=True)
        return (f'<iframe{match[1]}{match[3]} src="{place}#replay" loading="lazy" title="{title}"></iframe>'
                f'<p><a href="{place}">Open the report in full size</a></p>')

    def file(self, folder, ending):
        self.files += 1
        folder.mkdir(parents=True, exist_ok=True)
        return folder / f"notebook-{self.name}-{self.files}.{ending}"

    @staticmethod
    def block(text):
        return "```{code-block} none\n" + ESCAPES.sub("", text).rstrip("\n").replace("```", "'''") + "\n```"


def with_download(text, place, seconds):
    """A page with the link to its notebook below the title. `place`: of the notebook in the site's source, relative to the page."""
    when = f"executed in {seconds:.0f} s for this page" if seconds else "without outputs: nbclient or the Python module was missing"
    title, _, rest = text.partition("\n")
    return f"{title}\n\nNotebook: [{os.path.basename(place)}]({place}), {when}.\n{rest}"
