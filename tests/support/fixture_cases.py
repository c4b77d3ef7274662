"""Fixture files: cases of `title / . / input / . / expected / .`, with empty lines between them.

Entry points: `check_cases(path, render)`, `read_cases(path)` and `rewrite(path, cases)`. Lines
before a title that are empty or begin with `#` are for readers of the file. `check_lines(path,
convert)` is for inputs of a line each, which stand in the expected part alone, with what becomes of
them indented below; short cases, of a line each, may be rows of tables (`fixture_tables`).
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

FIXTURES = Path(__file__).parents[1] / "fixtures"
_LINE = re.compile(r"[^\n]*\n|[^\n]+")


class Case(Struct, frozen=True):
    """One case of a fixture file."""

    title: str
    input: str
    expected: str
    line: int
    """Of the title in the fixture file, from 1."""
    remarks: str = ""
    """The lines before the title, for readers."""

    @property
    def text(self) -> str:
        parts = (f"{self.title}\n", self.input, self.expected)
        return self.remarks + "".join(f"{part}.\n" for part in parts)


def check_cases(path: Path, render: Callable[[Case], str], *, rewriting: bool) -> None:
    """Compare the rendering of each case with the expected one, or rewrite the expected ones."""
    cases = read_cases(path)
    results = [replace(case, expected=render(case)) for case in cases]
    if rewriting:
        rewrite(path, results)
        return
    for case, now in zip(cases, results, strict=True):
        assert now.expected == case.expected, f"{path.name}:{case.line}: {case.title}"


def check_lines(path: Path, convert: Callable[[str], Iterable[str]], *, rewriting: bool) -> None:
    """Compare what becomes of each line of input; a quoted line is a literal of Python."""

    def render(case: Case) -> str:
        lines: list[str] = []
        for line, text in _input_lines(case):
            outputs = (r if r.isprintable() else repr(r) for r in convert(text))
            lines += [line, *(f"  {output}".rstrip() for output in outputs)]
        return "".join(f"{line}\n" for line in lines)

    check_cases(path, render, rewriting=rewriting)


def input_lines(path: Path) -> list[str]:
    """The inputs of a file for `check_lines`."""
    return [text for case in read_cases(path) for _, text in _input_lines(case)]


def _input_lines(case: Case) -> Iterator[tuple[str, str]]:
    """Each input as it stands in the file, and what it means."""
    for line in case.expected.splitlines():
        if line and not line.startswith(" "):
            yield line, ast.literal_eval(line) if line[0] in "'\"" else line


def read_cases(path: Path) -> list[Case]:
    """The cases of a fixture file; `ValueError` for a case without an end, or a title twice."""
    lines = text_lines(path.read_text(encoding="utf-8"))
    cases: list[Case] = []
    at = 0
    while at < len(lines):
        start = at
        while at < len(lines) and (lines[at].startswith("#") or not lines[at].strip()):
            at += 1
        if at == len(lines):
            break
        remarks, title_line, parts = "".join(lines[start:at]), at + 1, []
        for _ in range(3):
            end = next((i for i in range(at, len(lines)) if lines[i] == ".\n"), None)
            if end is None:
                raise ValueError(f"{path.name}:{title_line}: the case has no third `.`")
            parts.append("".join(lines[at:end]))
            at = end + 1
        cases.append(Case(parts[0].rstrip("\n"), parts[1], parts[2], title_line, remarks))
    titles = [case.title for case in cases]
    if len(set(titles)) != len(titles):
        raise ValueError(f"{path.name}: a title occurs twice")
    return cases


def rewrite(path: Path, cases: Iterable[Case]) -> None:
    text = "".join(case.text for case in cases)
    path.write_text(text, encoding="utf-8", newline="\n")


def check_text(path: Path, text: str, *, rewriting: bool) -> None:
    if rewriting:
        path.write_text(text, encoding="utf-8", newline="\n")
    assert text == path.read_text(encoding="utf-8"), path.name


def fixture_text(name: str) -> str:
    """The text of a file in `tests/fixtures`, with its line ends."""
    return (FIXTURES / name).read_bytes().decode()


def text_lines(text: str) -> list[str]:
    """Split at LF alone: a form feed in a lesson is no line end."""
    return _LINE.findall(text)


def fixture_tables(name: str) -> dict[str, Any]:
    """The tables of cases in a file of `tests/fixtures/tables`, by their names."""
    return tomllib.loads(fixture_text(f"tables/{name}.toml"))
