"""Parts of the pages in docs/ that are generated from the code are up to date and complete.

`pytest tests/docs/test_generated_parts.py --rewrite-fixtures` updates them.
"""

from __future__ import annotations

import json
import re

import pytest

from coursebuild.cli.commands import known_commands
from coursebuild.core.syntax.schemas import json_schema
from support.generated_parts import headings, regenerate
from support.markdown_files import PAGES

LONG = 6
"""With so many sections or more, a page begins with its contents."""
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
    for schema in ("course", "model", "lab", "quiz"):
        names = set(json.loads(json_schema(schema))["$defs"]) - TOLD_OTHERWISE
        missing = {name for name in names if not {f"{schema} {name}", f"lab {name}"} & headings}
        assert missing == set(), schema


def test_every_command_has_its_section() -> None:
    assert generated("command ") == set(known_commands())


def test_long_pages_begin_with_their_contents() -> None:
    long = {path for path, text in TEXTS.items() if len(headings(text, 2)) >= LONG}
    contents = re.compile("<!-- generated: (contents|commands) -->")
    without_contents = {path for path in long if not contents.search(TEXTS[path])}
    assert without_contents == set()


def test_every_page_begins_with_its_title() -> None:
    assert [path for path, text in TEXTS.items() if not re.match(r"# \w", text)] == []
