#!/usr/bin/python3
"""Prints the reference of the keys of a scene, geo/KEYS.md, from their JSON schema:

    make keys

The schema has two additional annotations: `values` describes the values and their unit; `absent` describes
the behaviour without the key if there is no single default. The introduction is scripts/keys.md; the program prints the
table of the figures."""

import functools
import json
import subprocess
import sys
from pathlib import Path

TABLES, FIGURES = "(the tables of keys)\n", "(the table of figures)\n"


def section(title, path, meaning, table):
    """A section with a row for each key of a table, and sections of the tables in it."""
    keys = table.get("properties", {})
    lines = [f"## {title}", "", *([meaning, ""] if meaning else []),
             "| key | values | default | meaning | example |", "|---|---|---|---|---|"]
    for name, key in keys.items():
        if not is_table(key):
            cells = [f"`{path}{name}`", values(key), default(table, name), text(key, "description"),
                     f"`{text(key, 'example')}`"]
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    for name, key in keys.items():
        if is_table(key):
            without = default(table, name)
            what = "Required." if without == "**required**" else f"Left out: {without}."
            brackets, below = ("[[{}]]", ".NAME.") if "items" in key else ("[{}]", ".")
            lines += ["", *section(f"`{brackets.format(path + name)}`", path + name + below,
                                   f"{text(key, 'description')} {what}", key.get("items", key))]
    other = table.get("additionalProperties")
    if other and is_table(other):
        lines += ["", *section(f"`[{path}NAME]`", f"{path}NAME.", text(other, "description"), other)]
    return lines


def resolved(schema, root):
    """The schema with the keys that it refers to: those of a surface are those of the whole body."""
    if not isinstance(schema, dict):
        return schema
    if "$ref" not in schema:
        return {name: resolved(value, root) for name, value in schema.items()}
    _, *path = schema["$ref"].split("/")
    meaning = f"`{path[1]}.{path[-1]}` in this surface."
    return {**functools.reduce(dict.__getitem__, path, root), "description": meaning, **schema}


def is_table(key):
    return "properties" in key or "properties" in key.get("items", {})


def values(key):
    """The values of a key, in words."""
    if "values" in key:
        return key["values"]
    if "enum" in key:
        return " or ".join(f'`"{name}"`' for name in key["enum"])
    kinds = {"object": "a table of numbers", "boolean": "`true` or `false`"}
    if key["type"] == "array":
        return f"two components, each: {values(key['items'])}"
    return kinds.get(key["type"], key["type"])


def default(table, name):
    """The default of a key of a table."""
    if name in table.get("required", []):
        return "**required**"
    key = table["properties"][name]
    return text(key, "absent") or f"`{json.dumps(key['default'], separators=(',', ':'))}`"


def text(key, name):
    return " ".join(key.get(name, "").split())


if __name__ == "__main__":
    schema = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    tables = "\n".join(section("At the top of the file", "", "", resolved(schema, schema))) + "\n"
    page = Path(__file__).with_suffix(".md").read_text(encoding="utf-8")
    figures = subprocess.run([sys.argv[2], "keys", "--figures"], check=True, capture_output=True, text=True).stdout
    print(page.replace(TABLES, tables).replace(FIGURES, figures), end="")
