#!/usr/bin/env python3
"""Checks every link and picture of a site on disk: the file must exist, and the anchor within it. Standard library only.

usage: scripts/site_links.py FOLDER     (scripts/docs calls it)

Doxygen checks its own pages, and reports have no links. Links to both are checked.
"""
import html.parser
import pathlib
import sys
import urllib.parse

FOREIGN = {"doxygen", "reports", "_static"}  # folders whose pages other programs write


class Page(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.links, self.places = [], set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id" or (tag == "a" and name == "name"):
                self.places.add(value)
            elif name in ("href", "src") and value:
                self.links.append(value)


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    pages = {p: Page(p) for p in sorted(site.rglob("*.html")) if p.relative_to(site).parts[0] not in FOREIGN}
    faults = checked = 0
    for path, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                if parts.scheme == "http" or (not parts.scheme and parts.netloc):
                    print(f"{path.relative_to(site)}: error: '{link}' is not https", file=sys.stderr)
                    faults += 1
                continue
            checked += 1
            target = path if not parts.path else pathlib.Path(path.parent, urllib.parse.unquote(parts.path)).resolve()
            place = urllib.parse.unquote(parts.fragment)
            where = None
            if not target.exists() or target.is_dir():
                where = "the file does not exist"
            elif place and target in pages and place not in pages[target].places and place != "top":
                where = f"the anchor '#{place}' does not exist"
            if where:
                print(f"{path.relative_to(site)}: error: broken link '{link}': {where}", file=sys.stderr)
                faults += 1
    if not pages or not checked:
        print(f"{site}: error: {len(pages)} pages with {checked} links: nothing to check", file=sys.stderr)
        faults += 1
    print(f"{len(pages)} pages, {checked} links, {faults} of them broken")
    sys.exit(1 if faults else 0)


main()
