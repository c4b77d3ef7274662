"""Cells in languages other than Python: scripts of their own, which a runner of the map runs.

A cell of a shell is a process of its own in every tool, and becomes a script. The cells of other
languages share what they define, and scripts have parts in Python alone: so one that is alone in
its text becomes a script, and several become one, which ends the text. Each of these stands where
it was, as lines of that script.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from msgspec.structs import replace

from coursebuild.api import marks, regex
from coursebuild.features.importer.cell_texts import code_for_readers, read_options
from coursebuild.features.importer.cells import (
    caption_of_code,
    how_shown,
    show_cell,
    write_outputs,
    write_recorded,
)
from coursebuild.features.importer.context import JoinedCells, LessonContext
from coursebuild.features.importer.prose import rewrite_prose
from coursebuild.features.importer.source_files import Segment, find_group

_EXTENSIONS = {
    **dict.fromkeys(("bash", "sh", "zsh"), "sh"),
    **{"c": "c", "cpp": "cpp", "javascript": "js", "julia": "jl", "r": "R"},
}
"""The extensions of scripts by their languages, which are the first words of their fences."""
_SHELLS = ("bash", "sh", "zsh")
_PRINTING = ("r", *_SHELLS)
"""Languages of which a script prints the values that a cell shows."""
_HEAD = regex(
    r"\{code-cell\}[ \t]+(?P<myst>\w+).*|\{(?P<name>\w+)(?:[\s,]+(?P<options>[^{}]*))?\}", re.DOTALL
)
_OWN_LABEL = regex(r"\A\{r[ \t]+([\w.-]+)[ \t]*(?:,.*)?\}\Z", re.DOTALL)
"""The label of a cell as knitr has it, the word behind the language."""
_MAGIC = regex(r"\A\s*%%(\w+)[^\n]*\n")
_NESTED = regex(r"^[ \t>]*(?:`{3,}|~{3,})\{(?:code-cell\}[ ]+)?(\w+)", re.MULTILINE)
"""The language of a cell in the text of a block."""
_SETTINGS = regex(r"(?:library\(knitr\)\s*)?(?:knitr::)?opts_chunk\$set\([^()]*\)\s*")
_PICTURE = regex(r"\s*(?:knitr::)?include_graphics\(\s*([\"'])(?P<path>[^\"'\n]+)\1[^()]*\)\s*")
_KNITR = regex(r"([\w.]+)\s*=\s*(\"(?:[^\"\\]|\\.)*\"|'(?:[^'\\]|\\.)*'|[^,\s]+)")
"""An option of a cell as knitr has it, in the head."""


def language_of(segment: Segment) -> str:
    """Return the language of a cell that is not Python; empty for anything else."""
    language = ""
    if segment.kind == "cell":
        language = find_group(_MAGIC, segment.text)
        language = "" if language.startswith("j") else language  # it changes the page
    elif segment.mark[0] in "`~" and (head := _HEAD.fullmatch(segment.head)):
        language = head["myst"] or head["name"]
    language = {"shell": "sh", "script": ""}.get(language.lower(), language.lower())
    return language if language in _EXTENSIONS else ""


def languages_of_single_cells(segments: Iterable[Segment]) -> frozenset[str]:
    """Return the languages of which a text has one cell that is run, also within blocks."""
    languages = []
    for segment in segments:
        if segment.mark[0] not in "`~":
            languages += _NESTED.findall(segment.text)
        elif not (_is_shown_only(segment) or _PICTURE.fullmatch(code_for_readers(segment.text))):
            languages.append(language_of(segment))
    return frozenset(language for language in languages if languages.count(language) == 1)


def _is_shown_only(segment: Segment) -> bool:
    return _options_of(segment).get("eval", "").lower() == "false"


def _options_of(segment: Segment) -> dict[str, str]:
    head = _HEAD.fullmatch(segment.head)
    words = _KNITR.findall(head["options"] or "") if head is not None else ()
    options = {
        name.replace(".", "-"): value.strip("\"'").replace("\\\\", "\\") for name, value in words
    }
    booleans = {"T": "true", "TRUE": "true", "F": "false", "FALSE": "false"}
    return {**{n: booleans.get(v, v) for n, v in options.items()}, **read_options(segment.text)[0]}


def write_other_cell(cell: Segment, language: str, context: LessonContext) -> str:
    """Return a cell of this language as a script, or as code that is shown, with its output."""
    options, kind = _options_of(cell), f"cell of `{language}`"
    code = code_for_readers(_MAGIC.sub("", cell.text, count=1))
    label = options.get("label", "")
    if own_label := find_group(
        _OWN_LABEL, cell.head
    ):  # of which only figures and tables are referred to
        label = f"fig-{own_label}" if "fig-cap" in options else ""
        label = label or (f"tbl-{own_label}" if "caption" in code else "")
    if picture := _PICTURE.fullmatch(code):
        words = options.get("fig-cap", "")
        mark = f"{{#{label}}}" if words and label.startswith("fig-") else ""
        return rewrite_prose(f"![{words}]({picture['path']}){mark}", context)
    head = caption_of_code(options, context, ("fig-cap", "lst-cap"), label)
    if _SETTINGS.fullmatch(code):
        context.leave(kind, f"a {kind} that sets how its tool shows others")
        code = ""
    if not code:
        return "\n\n".join(head)
    if _is_shown_only(cell):
        context.leave(kind, f"a {kind}, which its tool does not run")
        return "\n\n".join((*head, show_cell(cell, options, language, code, context)))
    is_script = language in _SHELLS or language in context.single_languages
    word = how_shown(options, cell.head)
    if not is_script:
        context.change(kind, "lines of one script, which ends the text")
        cells = context.joined.setdefault(language, JoinedCells(_new_path(language, context)))
        lines = cells.add(code, cell.printed + (cell.value if language in _PRINTING else ""))
        block = marks.fence(f"{language} show={cells.path}#{lines}", code)
        head += [block] if word != " hidden" else []
        return "\n\n".join((*head, *write_outputs(cell, context)))
    message = f"a {kind} is a script, which runs when `[runners]` of the map says how"
    context.leave(kind, message)
    context.scripts.append(path := _new_path(language, context))
    head.append(marks.fence(f"{language} file={path}{word}", code))
    if language in _PRINTING:
        cell = replace(cell, printed=cell.printed + cell.value, value="")
    head += write_recorded(cell.printed, path, context)
    return "\n\n".join((*head, *write_outputs(replace(cell, printed=""), context)))


def write_joined_cells(context: LessonContext) -> Iterator[str]:
    """Yield the scripts that the cells of a text make together, with what they print."""
    for language, script in context.joined.items():
        message = f"the cells of `{language}` are one script, which runs when `[runners]` says how"
        context.leave(f"script of `{language}`", message)
        yield marks.fence(f"{language} file={script.path} folded", "\n".join(script.lines))
        yield from write_recorded(script.printed, script.path, context)


def _new_path(language: str, context: LessonContext) -> str:
    stem = context.script_path.removesuffix(".py")
    number = f"_{len(context.scripts) + 1}" if context.scripts else ""
    return f"{stem}{number}.{_EXTENSIONS[language]}"
