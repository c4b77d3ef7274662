"""Cells of R or Julia, which are lines of one script: it ends before the first that cannot run.

The first run prints a mark before each cell but the first, so that it tells which one failed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from textwrap import shorten

from msgspec.structs import replace

from coursebuild.api import Edit, ScriptRun, Span, marks, model
from coursebuild.core.scripts.extract import Extraction
from coursebuild.features.importer.context import PRINTS, script_path_of

_MARK = "the next cell of this text"


def find_cells(script: model.Script) -> Sequence[re.Match[str]]:
    """Return the blocks that show the cells of an imported script where they stood."""
    block = (
        rf"^(?P<lead>[> \t]*)(?P<mark>`{{3,}})(?P<language>\w+) show={re.escape(script.path)}"
        r"#L(?P<first>\d+)-L\d+\n(?P<code>(?:.*\n)*?)(?P=lead)(?P=mark)[ \t]*$"
    )
    own_path = script_path_of(script.span.path).removesuffix(".py")
    is_of_cells = script.path.startswith(own_path) and not script.is_python
    blocks = re.finditer(block, script.span.source.text, re.MULTILINE)
    return [*blocks] if is_of_cells and script.language in PRINTS else []


def mark_cells(extraction: Extraction) -> Extraction:
    """Return a script that prints a mark before each of its cells but the first."""
    script = extraction.script
    lines = script.code.text.split("\n")
    for cell in reversed(find_cells(script)[1:]):
        lines.insert(int(cell["first"]) - 1, PRINTS[script.language].format(_MARK, 0))
    code = replace(script.code, text="\n".join(lines))
    return replace(extraction, script=replace(script, code=code))


def end_before_failure(script: model.Script, script_run: ScriptRun) -> Iterator[Edit]:
    """Yield the edits that show, and no longer run, the cell that failed and those below it."""
    source, cells = script.span.source, find_cells(script)
    lines = script_run.stderr.strip().split("\n")
    error = next((line for line in lines if "rror" in line), lines[-1])
    reason = f"`{shorten(error.replace('`', chr(39)), 200, placeholder='…')}`"
    first = script_run.stdout.count(f"{_MARK}:")
    for cell in cells[first:]:
        code = marks.fence(cell["language"], cell["code"].rstrip("\n"))
        new = f"{code}\n\n*Not run here:* {reason}"
        yield Edit(Span(source, *cell.span()), new.replace("\n", f"\n{cell['lead']}"))
        reason = "a cell above fails"
    head = script.span.first_line().text
    kept_lines = script.code.text.split("\n")[: int(cells[first]["first"]) - 1]
    if kept_lines:
        yield Edit(script.span, marks.fence(head.lstrip("`~ "), "\n".join(kept_lines)))
    else:
        end = script.span.start + len(head)
        yield Edit(Span(source, end, end), " norun")
