#!/usr/bin/env python3
"""Whether the tables of docs/formats/scenario.md and robot.md say what `grapnel schema` says: every key is there, no other is,
and what stands beside it of choices, ranges, units and defaults is true. documented_keys.py PROGRAM; standard library only.
"""
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SUPERSCRIPTS = {"²": "^2", "³": "^3"}
# Keys described by a sentence, or by a separate kind of table; those of motion are those of post_impact.
ELSEWHERE = re.compile(r"^motion\.|(^|\.)(position|quaternion_wxyz|rpy|geometry\.\w+|robot\.\w.*)$|\.inertia\.\w+$|origin\.|\.momentum$"
                       r"|(^|\.)(tracking|noise|straight_in|state|limits|friction|rating|contact|grasp|time|base|joint|origin)$")


def resolved(root, node):
    """The schema with what it refers to; its own keywords win."""
    parts = [node["$ref"]] if "$ref" in node else [part["$ref"] for part in node.get("allOf", []) if "$ref" in part]
    for reference in parts:
        target = root
        for step in reference[2:].split("/"):
            target = target[step]
        node = {**resolved(root, target), **node}
    return node


def described(root, node, path, found):
    """All keys below a place, by their paths as the tables write them."""
    for key, value in node.get("properties", {}).items():
        below = f"{path}.{key}" if path else key
        value = resolved(root, value)
        for option in value.get("anyOf", []):
            if option.get("title") == "a mapping of one phase":
                value = {**resolved(root, option), **value}
        found[below] = (value, key in node.get("required", []))
        if below == "robot":
            continue
        described(root, value, below, found)
        for items, name in ((value.get("items"), "[]"), (value.get("additionalProperties"), ".NAME")):
            if isinstance(items, dict):
                described(root, resolved(root, items), below + name, found)
    return found


def rows(text):
    """(line, section, header, cells) of the tables' rows."""
    section, header = "", []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("#"):
            section = line.lstrip("# ")
        if not line.startswith("|"):
            header = []
        elif not header:
            header = [cell.strip() for cell in line.strip("|").split("|")]
        elif not line.startswith("|---"):
            yield number, section, header, [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]


def keys_of(cell):
    """The keys that the first cell names: `a.b`, `.c` are a.b and a.c."""
    keys = []
    for name in re.findall(r"`([^`]+)`", cell):
        keys.append(keys[-1].rsplit(".", 1)[0] + name if name.startswith(".") and keys else name)
    return keys


def number_in(text):
    text = text.strip("`").replace(",", "")
    text = text.replace("2⁵³ − 1", str(2**53 - 1)).replace("10¹²", "1e12")
    try:
        return float(text)
    except ValueError:
        return None


def faults_of(key, schema, required, row):
    """What a row about one key says wrong."""
    kind, unit, default = row.get("Type", ""), row.get("Unit"), row.get("Default", "")
    if "enum" in schema and kind.startswith("`"):
        if re.findall(r"`([^`]+)`", kind) != schema["enum"]:
            yield f"the choices are {', '.join(schema['enum'])}"
    if schema.get("type") in ("number", "integer", ["number", "string"]):
        low, high = schema.get("minimum"), schema.get("maximum")
        says = [number_in(part) for part in re.split(r" … | to ", kind)]
        if len(says) == 2 and None not in says and says != [low if low is not None else schema.get("exclusiveMinimum"), high]:
            yield f"the range is {low} to {high}"
        if len(says) == 1 and ("> 0" in kind) != (schema.get("exclusiveMinimum") == 0):
            yield f"it {'must' if 'exclusiveMinimum' in schema else 'need not'} be greater than 0"
        if len(says) == 1 and ("≥ 0" in kind) != (low == 0):
            yield "the limit 'at least 0' is documented incorrectly"
    if unit is not None and "1, rad" not in unit:
        for sign, power in SUPERSCRIPTS.items():
            unit = unit.replace(sign, power)
        told, true = re.split(r"[,;:`]| or | for | a ", unit)[0].strip(), re.split(r"[,;]| or | for ", schema.get("x-unit", ""))[0]
        if told != true and not {told, true} <= {"", "1"}:
            yield f"the unit is {schema.get('x-unit', 'none')}"
    if required and not default.startswith(("required", "one is")):
        yield "it is required"
    if not required and default == "required" and "default" in schema:
        yield "it is not required"
    if "default" in schema and default:
        value = schema["default"]
        if isinstance(value, (int, float)) and not isinstance(value, bool) and number_in(default) != value:
            yield f"the default is {value}"
        if isinstance(value, str) and not default.startswith(f"`{value}`"):
            yield f"the default is {value}"
        if isinstance(value, bool) and default != f"`{str(value).lower()}`":
            yield f"the default is {str(value).lower()}"


def check(program, name):
    schema = json.loads(subprocess.run([program, "schema"] + ([] if name == "scenario" else [name]), capture_output=True,
                                       check=True, text=True).stdout)
    found = described(schema, schema, "", {})
    page = ROOT / "docs" / "formats" / f"{name}.md"
    told, faults = set(), []
    for line, section, header, cells in rows(page.read_text(encoding="utf-8")):
        if header[0] != "Key" or "position and orientation" in cells[0] + cells[1]:
            continue
        prefixes = [prefix for prefix in re.findall(r"`([^`]+)`", section)] or [""]
        if section in ("`plan`", "`window`", "`waypoints[]`", "`pieces[]`"):
            prefixes = ["approach." + section.strip("`")]
        if section == "`base_control`":
            prefixes = ["approach.base_control", "post_impact.base_control"]
        for key in keys_of(cells[0]):
            places = [place for place in dict.fromkeys([key] + [f"{prefix}.{key}" for prefix in prefixes])
                      if place in found and (place != key or prefixes == [""] or len(prefixes) > 1)]
            if not places and not key.endswith(".match"):
                faults.append(f"{page.name}:{line}: there is no key {key}")
            for place in places:
                told.add(place)
                if len(keys_of(cells[0])) == 1:
                    faults += [f"{page.name}:{line}: {place}: {fault}"
                               for fault in faults_of(place, *found[place], dict(zip(header, cells)))]
    for key in found:
        by_its_parts = any(other.startswith((key + "[].", key + ".NAME.")) for other in told)
        if key not in told and not by_its_parts and not ELSEWHERE.search(key):
            faults.append(f"{page.name}: no table tells of {key}")
    return faults


def main():
    faults = check(sys.argv[1], "scenario") + check(sys.argv[1], "robot")
    print("\n".join(faults))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
