#!/usr/bin/env python3
"""The tables of the keys of input files in docs/formats, generated from `grapnel schema KIND`.
key_tables.py PROGRAM [--check]; standard library only.

`<!-- keys NAME -->` ... `<!-- end of keys -->` on a page is the place of a structure: a definition of the schema, or the kind
itself. A table has a row per key. Keys of nested mappings follow in the same table (`until.base_rate`), unless their
structure has its own place: then the key is a link to it. So each key is in a table as soon as the schema has it.
"Absent: ..." in a description is what the column Default shows. --check only compares.
"""
import json
import os
import pathlib
import re
import subprocess
import sys

import markdown_table

ROOT = pathlib.Path(__file__).resolve().parent.parent
FORMATS = ROOT / "docs" / "formats"
KINDS = ("scenario", "robot", "target", "study", "campaign", "optimization", "mapping", "identification")
PLACE = re.compile(r"(<!-- keys (\w+) -->\n).*?(<!-- end of keys -->)", re.DOTALL)
JOINT_VALUES = "mapping {joint name: value}, or list in joint order"
INERTIA = ("[Ixx, Iyy, Izz], or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz], or symmetric 3 x 3 matrix, "
           "or mapping {xx, yy, zz, xy, xz, yz}")
SERIES = "mapping {joint name: list of numbers}, or list of lists in joint order"
FORMS = {  # forms of values that a page describes: (words, page, anchor)
    JOINT_VALUES: ("joint values", "scenario/initial-state.md", "initial"),
    JOINT_VALUES.replace("value}", "rate}"): ("joint values", "scenario/initial-state.md", "initial"),
    INERTIA: ("inertia", "robot.md", "inertia"),
    SERIES: ("lists of 1 to 100 numbers as joint values", "scenario/initial-state.md", "initial"),
}
ORIENTATION = "Unit quaternion w, x, y, z;"  # begins the description of an orientation in the usual two forms
# In descriptions: {match: twist}, [1, 0, 0], approach.final_rates.match
CODE = re.compile(r"\{[^}]*\}|\[[-0-9., ]+\]"
                  r"|(?<![\w./-])[a-z][a-z0-9]*(?:\[\])?(?:[._][a-z][a-z0-9]*(?:\[\])?)+(?![\w/(])")


# ---- Words of a schema ----

def resolved(root, node):
    """The schema with what it refers to; its own keywords win."""
    references = [part["$ref"] for part in [node, *node.get("allOf", [])] if "$ref" in part]
    for reference in references:
        node = {**resolved(root, root["definitions"][reference.rsplit("/", 1)[1]]), **node}
    return node


def structure_below(node):
    """(name, suffix of the key) of the structure that a value holds: directly, in a list, by name."""
    if not isinstance(node, dict):
        return None
    for part in [node, *node.get("allOf", [])]:
        if "$ref" in part:
            return part["$ref"].rsplit("/", 1)[1], ""
    for inner, suffix in ((node.get("items"), "[]"), (node.get("additionalProperties"), ".NAME")):
        if found := structure_below(inner):
            return found[0], suffix + found[1]
    return next((found for option in node.get("anyOf", []) if (found := structure_below(option))), None)


def number(x):
    if isinstance(x, bool) or not isinstance(x, (int, float)):
        return f"`{json.dumps(x).strip(chr(34))}`"
    if isinstance(x, float) and x.is_integer() and abs(x) < 1e5:
        return str(int(x))
    if x == 2**53 - 1:
        return "2⁵³ − 1"
    if abs(x) >= 1e5 and (isinstance(x, float) or abs(x) >= 1e8) and float(f"{x:.0e}") == x:
        return f"{x:.0e}".replace("e+0", "e").replace("e+", "e")
    return f"{x:,}" if isinstance(x, int) and abs(x) >= 10000 else repr(x)


def with_range(word, node):
    low, above, high = node.get("minimum"), node.get("exclusiveMinimum"), node.get("maximum", node.get("x-largest"))
    if low is not None and high is not None:
        text = f"{'whole number, ' if word == 'whole number' else ''}{number(low)} to {number(high)}"
    else:
        limit = f" > {number(above)}" if above is not None else f" ≥ {number(low)}" if low is not None else ""
        text = word + limit + (f", at most {number(high)}" if high is not None else "")
    return text + (", or `.inf`" if node.get("x-infinity") else "")


def counted(word, node):
    least, most = node.get("minItems", node.get("minProperties")), node.get("maxItems")
    if least is not None and least == most:
        return f"{least} {word.removeprefix('list of ')}"
    if least is not None and most is not None:
        return f"{word}, {least} to {number(most)}"
    return word + (f", at least {least}" if least else "") + (f", at most {number(most)}" if most is not None else "")


def scalar_type(node):
    kind = node.get("type")
    return kind[0] if isinstance(kind, list) else kind


def one_alternative(node):
    if "enum" in node or scalar_type(node) in ("number", "integer"):
        return type_of(node)
    return re.sub("^list of 3 numbers", "3", node["title"].removeprefix("a ")) if "title" in node else type_of(node)


def type_of(node):
    if "const" in node:
        return f"`{node['const']}`"
    if "enum" in node:
        return ", ".join(f"`{name}`" for name in node["enum"])
    if "anyOf" in node:
        return ", or ".join(one_alternative(option) for option in node["anyOf"])
    kind = scalar_type(node)
    if kind in ("number", "integer"):
        return with_range("number" if kind == "number" else "whole number", node)
    if kind == "array":
        items = node.get("items", {})
        fixed = re.fullmatch(r"a list of (\d+ \w+)", node.get("title", ""))
        if fixed:
            return fixed[1] + (" > 0" if items.get("exclusiveMinimum") == 0 else "")
        inner = items.get("title", "").removeprefix("a list of ")
        return counted(node.get("title", "a list of rows of " + inner if inner else "a list").removeprefix("a "), node)
    if kind == "object":
        return counted("mapping", node) + " key" * ("minProperties" in node)
    return {"boolean": "`true`, `false`", "string": "text"}.get(kind, "any")


def enumerated(words, last="or"):
    return f" {last} ".join([*([", ".join(words[:-1])] if words[1:] else []), *words[-1:]])


def conditions(parts):
    """Keys, or keys with certain values, on which something depends: `a`, `mode: x` or `y`."""
    values = {}
    for part in parts:
        key = next(iter(part.get("properties", {})), None)
        names = part["properties"][key].get("enum", [part["properties"][key].get("const")]) if key else []
        values.setdefault(key or part["required"][0], []).extend(names)
    return [f"`{key}: {names[0]}`" + "".join(f", `{name}`" for name in names[1:]) if names else f"`{key}`"
            for key, names in values.items()]


def parts_of(structure):
    return [structure, *structure.get("allOf", [])]


def default_of(key, node, structure, text):
    """When the key is required, or its default, and the text without it."""
    if key in structure.get("required", []):
        return "required", text
    absent = re.search(r"(?:^| |; )[Aa]bsent: (.*?)(?=\.(?: [A-Z`]|$))", text)
    default = []
    if absent:
        end = absent.end() + (1 if absent[0][0] != ";" else 0)
        text = (text[:absent.start()] + text[end:]).strip()
        default.append(f"`{absent[1]}`" if absent[1] in node.get("enum", []) else absent[1])
    elif node.get("default", {}) != {}:
        value = node["default"]
        default.append(f"`[{', '.join(json.dumps(x) for x in value)}]`" if isinstance(value, list) else number(value))
    for part in parts_of(structure):
        for choice, condition in ((part, ""), (part.get("then", {}), " with {}")):
            alternatives = [option["required"][0] for option in choice.get("oneOf", [])]
            if key not in alternatives:
                continue
            others = [f"`{other}`" for other in alternatives if other != key]
            words = enumerated(["this", *(others if len(others) < 5 else ["another one"])])
            default.append(words + (condition and condition.format(conditions([part["if"]])[0])))
    needed = conditions([part["if"] for part in parts_of(structure) if key in part.get("then", {}).get("required", [])])
    default += [f"required with {enumerated(needed)}"] if needed else []
    if any(key in option.get("required", []) for option in structure.get("anyOf", [])[:1]):
        default.append(f"required without `{structure['anyOf'][1]['required'][0]}`")
    return "; ".join(default) or ("" if "default" in node else "none"), text


def has_no_meaning(schema):
    return schema is False or (isinstance(schema, dict) and "not" in schema)


def relations(key, structure):
    """Sentences: what the key needs, and with what it has no meaning."""
    needed = [f"`{other}`" for other in structure.get("dependencies", {}).get(key, [])]
    pairs = [part.get("not", {}).get("required", []) for part in parts_of(structure)]
    refused = [f"`{other}`" for pair in pairs for other in pair if key in pair and other != key]
    refused += conditions([part["if"] for part in parts_of(structure)
                           if "if" in part and has_no_meaning(part["then"].get("properties", {}).get(key))])
    return [f"Needs {enumerated(needed, 'and')}."] * bool(needed) + [f"Not with {enumerated(refused)}."] * bool(refused)


def plain(text):
    return text.replace("^2", "²").replace("^3", "³")


def meaning(text, node):
    """Markdown: names of values and keys as code."""
    for name in node.get("enum", []):
        text = re.sub(rf"(?<![\w`.])({re.escape(str(name))})(?=: )", r"`\1`", text)
    parts = re.split(r"(`[^`]*`)", text)  # not inside code
    for i in range(0, len(parts), 2):
        part = plain(parts[i]).replace("<", "\\<").replace("|", "\\|")
        parts[i] = CODE.sub(r"`\g<0>`", part)
    return "".join(parts)


# ---- Tables ----

class Tables:
    def __init__(self, schemas, pages):
        self.schemas = schemas
        self.places = {}  # name of a structure: (page, anchor)
        self.texts = pages
        for page, text in pages.items():
            anchor, fenced = "", False
            for line in text.splitlines():
                fenced ^= line.startswith("```")
                if line.startswith("#") and not fenced:
                    anchor = re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-")
                if place := re.fullmatch(r"<!-- keys (\w+) -->", line):
                    if place[1] in self.places:
                        raise SystemExit(f"{page}: {place[1]} has a table in {self.places[place[1]][0]} too")
                    self.places[place[1]] = page, anchor
            if text.count("<!-- keys ") != len(PLACE.findall(text)):
                raise SystemExit(f"{page}: a table does not end")

    def root_of(self, name):
        for kind, schema in self.schemas.items():
            if name == kind or name in schema.get("definitions", {}):
                return schema, schema if name == kind else schema["definitions"][name]
        raise SystemExit(f"no schema has the structure {name}")

    def link(self, page, target, anchor):
        path = "" if target == page else pathlib.Path(os.path.relpath(target, page.parent)).as_posix()
        return f"({path}#{anchor})"

    def form_of(self, page, node):
        words = type_of(node)
        for form, (name, target, anchor) in FORMS.items():
            words = words.replace(form, f"[{name}]{self.link(page, FORMATS / target, anchor)}")
        return words

    def rows(self, page, root, structure, prefix):
        for key, node in structure.get("properties", {}).items():
            whole = resolved(root, node)
            default, text = default_of(key, whole, structure, whole.get("description", ""))
            if ORIENTATION in text:
                continue
            if key == "rpy" and ORIENTATION in structure["properties"]["quaternion_wxyz"]["description"]:
                forms = self.link(page, FORMATS / "robot.md", "position-and-orientation")
                yield (f"`{prefix}quaternion_wxyz` or `{prefix}rpy`", "4 or 3 numbers", "1, rad", "no rotation",
                       f"Orientation, in one of [two forms]{forms}.")
                continue
            text = " ".join([*([text] if text else []), *relations(key, structure)])
            name, below = f"`{prefix}{key}`", structure_below(node)
            if below and below[0] in self.places:
                name = f"[{name}]" + self.link(page, *self.places[below[0]])
            unit = plain(whole.get("x-unit", ""))
            yield name, self.form_of(page, whole), unit, meaning(default, {}), meaning(text, whole)
            if below and below[0] not in self.places:
                yield from self.rows(page, root, root["definitions"][below[0]], f"{prefix}{key}{below[1]}.")
            for option in whole.get("anyOf", []):  # {match: ...}
                described = {k: v for k, v in option.get("properties", {}).items() if "description" in v}
                if "$ref" not in json.dumps(option):
                    yield from self.rows(page, root, {"properties": described}, f"{prefix}{key}.")

    def table(self, page, name):
        root, structure = self.root_of(name)
        rows = list(self.rows(page, root, structure, ""))
        header = ["Key", "Type", "Unit", "Default", "Meaning"]
        if not any(row[2] for row in rows):
            header.remove("Unit")
            rows = [row[:2] + row[3:] for row in rows]
        return markdown_table.table(header, rows) + "\n"

    def remade(self, page):
        return PLACE.sub(lambda place: place[1] + self.table(page, place[2]) + place[3], self.texts[page])


def main():
    program, check = sys.argv[1], "--check" in sys.argv[2:]
    schemas = {kind: json.loads(subprocess.check_output([program, "schema", kind])) for kind in KINDS}
    pages = {page: page.read_text(encoding="utf-8") for page in sorted(FORMATS.rglob("*.md"))}
    tables = Tables(schemas, pages)
    faults = [f"no page has the keys of {kind}" for kind in KINDS if kind != "target" and kind not in tables.places]
    for page, text in pages.items():
        remade = tables.remade(page)
        if remade != text and check:
            faults.append(f"{page.relative_to(ROOT)} is not current: run scripts/tables")
        elif remade != text:
            page.write_text(remade, encoding="utf-8")
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
