"""Fixtures of invalid texts: each line of an input is one text, as a Python string literal.

Entry point: `check_texts`. The expected part has the diagnostics of each text below it.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path

from coursebuild.core.text.diagnostics import Diagnostic
from support.fixture_cases import check_cases
from support.positioned_nodes import format_diagnostics

FOLDER = Path(__file__).parents[1] / "fixtures" / "texts"

Reader = Callable[[str], tuple[object, tuple[Diagnostic, ...]]]
"""Reads a text: returns its value, or None if it has none, and its diagnostics."""


def check_texts(name: str, read: Reader, *, rewriting: bool) -> None:
    check_cases(
        FOLDER / f"{name}.md", lambda case: _format_case(case.input, read), rewriting=rewriting
    )


def _format_case(texts: str, read: Reader) -> str:
    lines = []
    for line in texts.splitlines():
        value, diagnostics = read(ast.literal_eval(line))
        lines += [line, *(f"  {message}" for message in format_diagnostics(diagnostics))]
        if value is not None:
            lines.append("  and it is read")
    return "".join(f"{line}\n" for line in lines)
