"""Fixture files: cases of `title / . / input / . / expected / .`, with empty lines between them.

`read_cases` gives the cases of a file; `rewritten` is its text with other expected parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Case:
    title: str
    input: str
    expected: str
    line: int
    """Where it begins in its file, from 1."""


def read_cases(path: Path) -> list[Case]:
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    cases: list[Case] = []
    at = 0
    while at < len(lines):
        if not lines[at].strip():
            at += 1
            continue
        marks = [i for i in range(at, len(lines)) if lines[i] == ".\n"][:3]
        assert len(marks) == 3, f"{path}:{at + 1}: a case has three lines of a single dot"
        first, second, third = marks
        title = "".join(lines[at:first]).strip()
        given, expected = "".join(lines[first + 1 : second]), "".join(lines[second + 1 : third])
        cases.append(Case(title, given, expected, at + 1))
        at = third + 1
    titles = [case.title for case in cases]
    assert len(set(titles)) == len(titles), f"{path}: a title occurs twice"
    return cases


def rewritten(cases: Sequence[Case], expected: Sequence[str]) -> str:
    parts = (
        f"{case.title}\n.\n{case.input}.\n{text}.\n"
        for case, text in zip(cases, expected, strict=True)
    )
    return "\n".join(parts)
