"""Parts of the pages in docs/ that are made from the code are up to date and complete.

`pytest tests/docs/test_generated_parts.py --rewrite-fixtures` updates them. Such a part stands
between `<!-- generated: WORDS -->` and `<!-- end -->`. The words are those of `_MAKERS`:

- `fields lab SimLab`: the fields of a structure in the schema `lab`; `beyond` or `within` and the
  name of another one, of this schema or of `lab`, leave out those that it has, or has not;
- `units`: those that there are;
- `commands`, and `command check`: all of them, and what one takes; `options`: those of several.
"""

from __future__ import annotations

import argparse
import json
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any

import pytest

from coursebuild.cli.commands import known_commands, parser_of
from coursebuild.core.syntax.course_schema import json_schema
from coursebuild.core.text.units import UNITS
from support.markdown_files import PAGES

_PART = re.compile(r"(<!-- generated: ([^>\n]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def regenerate(text: str) -> str:
    def part(match: re.Match[str]) -> str:
        name, *words = match[2].split()
        body = _MAKERS[name](text, *words)
        return f"{match[1]}\n{body}\n\n{match[3]}" if body else match[1] + match[3]

    return _PART.sub(part, text)


def _table(head: str, rows: Iterable[tuple[str, ...]]) -> str:
    cells = ([cell.replace("|", r"\|") for cell in row] for row in rows)
    lines = (f"| {' | '.join(row)} |" for row in cells)
    rule = "|" + " --- |" * (head.count("|") + 1)
    return "\n".join((f"| {head} |", rule, *lines))


# --------------------------------------------------------------------------------------- fields


def _fields(
    text: str, schema: str, name: str, relation: str = "beyond", other_name: str = ""
) -> str:
    definitions = json.loads(json_schema(schema))["$defs"]
    structure = definitions[name]
    other_fields = {}
    if other_name:
        is_here = other_name in definitions
        base = definitions if is_here else json.loads(json_schema("lab"))["$defs"]
        other_fields = base[other_name]["properties"]
    rows: list[tuple[str, str]] = []
    long_lists: dict[str, str] = {}
    for field, field_schema in structure["properties"].items():
        if (field in other_fields) != (relation == "within") or (other_fields and field == "kind"):
            continue
        meaning = field_schema.get("description") or _describe(field_schema, definitions)
        required = ", required" * (field in structure.get("required", ()))
        value = _value(field_schema)
        for words, first_field in long_lists.items():
            value = value.replace(words, f"list as in `{first_field}`")
        if value.count('"') > 10:
            long_lists[value] = field
        if value == "text" or value in meaning:  # pages say once that a value is a text
            value = ""
        meaning = f"{meaning} ({value})" if meaning and value else meaning or value
        rows.append((f"`{field}`{required}", meaning))
    return _table("field | meaning", rows)


def _describe(schema: dict[str, Any], definitions: dict[str, Any]) -> str:
    match = re.search(r'"\$ref": "#/\$defs/(\w+)"', json.dumps(schema))
    meaning = definitions[match[1]]["description"].partition("\n")[0] if match else ""
    return meaning[:1].lower() + meaning[1:].rstrip(".")


def _value(schema: dict[str, Any]) -> str:
    value = _kind(schema)
    default = schema.get("default")
    if default not in (None, "", [], {}, False):
        value += f"; default `{json.dumps(default)}`"
    return value


def _kind(schema: dict[str, Any]) -> str:
    if "anyOf" in schema:
        kinds = [_kind(choice) for choice in schema["anyOf"] if choice.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if "enum" in schema:
        return ", ".join(f"`{json.dumps(choice)}`" for choice in schema["enum"])
    match schema.get("type"):
        case "array":
            inner = _kind(schema["items"]) if schema.get("items") else ""
            inner = re.sub(r"^(table|text|number|integer|list)\b", r"\1s", inner)
            return f"list of {inner}" if inner else "list"
        case "string":
            return "Markdown" if "contentMediaType" in schema else "text"
        case "boolean":
            return "boolean"
        case "integer" | "number" as kind:
            return kind + _bounds(schema)
    return "table"


def _bounds(schema: dict[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    if "exclusiveMinimum" in schema:
        return f" > {schema['exclusiveMinimum']:g}"
    if low is not None and high is not None:
        return f", {low} to {high}"
    return f" ≥ {low}" if low is not None else ""


# ------------------------------------------------------------------------------------- commands


def _commands(text: str) -> str:
    rows = (
        (f"[`{command.name}`](#{command.name})", command.summary)
        for command in known_commands().values()
    )
    return _table("command | what it does", rows)


def _actions(name: str) -> Iterator[argparse.Action]:
    parser = parser_of(known_commands()[name])
    return (action for action in parser._actions if action.dest not in ("help", "root"))


def _shared() -> dict[tuple[str, str], list[str]]:
    """Arguments that at least three commands take, with the commands."""
    commands_by_row: dict[tuple[str, str], list[str]] = {}
    for name in known_commands():
        for action in _actions(name):
            commands_by_row.setdefault(_row(action), []).append(name)
    return {row: names for row, names in commands_by_row.items() if len(names) > 2}


def _row(action: argparse.Action) -> tuple[str, str]:
    value = action.metavar or "|".join(map(str, action.choices or ()))
    if not action.option_strings:
        names = [f"`{action.metavar or action.dest}`"]
    else:
        names = [f"`{name}{' ' * bool(value)}{value}`" for name in action.option_strings]
    return ", ".join(names), (action.help or "") % {"default": action.default}


def _options(text: str) -> str:
    rows: list[tuple[str, ...]] = []
    last_names: list[str] = []
    for (argument, meaning), names in _shared().items():
        commands = ", ".join(f"`{command}`" for command in names)
        rows.append((argument, "the same" if names == last_names else commands, meaning))
        last_names = names
    return _table("argument | of | meaning", rows)


def _command(text: str, name: str) -> str:
    command = known_commands()[name]
    parser = parser_of(command)
    rows = [row for action in _actions(name) if (row := _row(action)) not in _shared()]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            rows = [*chain.from_iterable(_kinds(action))]
    parts = []
    if rows:
        parts.append(_table("argument | meaning", rows))
    examples = (parser.epilog or "").partition("\n")[2].rstrip("\n")
    if re.search(r"[|>]", examples):  # what a table of arguments cannot say; `help` shows all
        lines = "\n".join(line[2:] for line in examples.splitlines())
        parts.append(f"```console\n{lines}\n```")
    if not [*_actions(name)]:
        parts.append("It takes no arguments.")
    return "\n\n".join(parts)


def _kinds(action: Any) -> Iterator[list[tuple[str, str]]]:
    helps = {choice.dest: choice.help for choice in action._choices_actions}
    for name, parser in action.choices.items():
        yield [(f"`{name}`", helps[name])]
        rows = [_row(option) for option in parser._actions if option.dest not in ("help", "root")]
        yield [(f"`{name}` {argument}", meaning) for argument, meaning in rows]


def _units(text: str) -> str:
    parts = []
    for marks, lead in (("*", "With prefixes, as in `mm` and `MPa`"), ("", "Without")):
        symbols = [f"`{name}`" for name, row in UNITS.items() if ("*" in row.marks) is bool(marks)]
        parts.append(f"{lead}: {', '.join(symbols)}.")
    return "\n\n".join("\n".join(textwrap.wrap(part, 120)) for part in parts)


_MAKERS: dict[str, Callable[..., str]] = {
    "fields": _fields,
    "commands": _commands,
    "command": _command,
    "options": _options,
    "units": _units,
}


TOLD_OTHERWISE = {"CourseFile", "ModelFile", "Overlays"}
"""Structs whose fields are the sections of a page, or the values of a field."""
TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES}


def generated(kind: str) -> set[str]:
    """The subjects of the generated parts of a kind."""
    part = re.compile(rf"<!-- generated: {kind}(.*) -->")
    return {part_text.strip() for text in TEXTS.values() for part_text in part.findall(text)}


def test_generated_parts_are_in_step(request: pytest.FixtureRequest) -> None:
    stale = {path: now for path, text in TEXTS.items() if (now := regenerate(text)) != text}
    if request.config.getoption("--rewrite-fixtures"):
        for path, now in stale.items():
            path.write_text(now, encoding="utf-8")
    else:
        assert sorted(stale) == [], "run pytest tests/docs --rewrite-fixtures"


def test_every_field_has_its_table() -> None:
    headings = {" ".join(words.split()[:2]) for words in generated("fields")}
    for schema in ("course", "model", "lab", "quiz", "exercise"):
        names = set(json.loads(json_schema(schema))["$defs"]) - TOLD_OTHERWISE
        missing = {name for name in names if not {f"{schema} {name}", f"lab {name}"} & headings}
        assert missing == set(), schema


def test_every_command_has_its_section() -> None:
    assert generated("command ") == set(known_commands())


def test_every_page_begins_with_its_title() -> None:
    assert [path for path, text in TEXTS.items() if not re.match(r"# \w", text)] == []
