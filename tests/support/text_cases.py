"""Fixtures of texts that are wrong: each line of an input is one text, as a string of Python.

Entry point: `check_texts`. In the expected part stands below each text what its author is told.
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
"""From a text to what is made of it all the same, if anything, and what its author is told."""


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
