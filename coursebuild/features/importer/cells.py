"""Cells of Python, which share their names, as one script of a lesson.

Entry points: `script_of`, `shown_text`.

Scripts of coursebuild are complete. So all cells of a lesson become one script, which stands where
the last of them stood; the ones before are shown where they stood, as parts of it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence

from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.values import Segment

_OPTION = re.compile(r"^(?:#\|[ \t]*([\w-]+):|:([\w-]+):)[ \t]*(.*)\n?", re.MULTILINE)
"""Of Quarto, and of MyST."""
_DEFINES = re.compile(r"(?:@|(?:async )?def |class )")
_TIMED = re.compile(r"%%(?:time|timeit|capture|prun)\b.*")
_SHOWS = re.compile(r"\b(?:plt|ax|axs|axes)\.(?!close|switch_backend)[a-z]\w*\(")
_MAGIC = re.compile(r"^[ \t]*(?:[%!?]|\w+\?{1,2}[ \t]*$).*$", re.MULTILINE)


def script_of(
    cells: Sequence[Segment], title: str, context: LessonContext
) -> tuple[str, list[int]]:
    """The script, and the numbers of the cells that it runs."""
    codes = {number: _code(cell, context).strip() for number, cell in enumerate(cells)}
    run = [number for number, code in codes.items() if code]
    summary = re.sub(r'[\\"]', "", title).strip().rstrip(".") or "The cells of this lesson"
    script = f'"""{summary}."""\n'
    before = ""
    for number in run:
        apart = before.split("\n")[-1].startswith((" ", "\t")) or _DEFINES.match(codes[number])
        script += ("\n\n" if before and apart else "\n") + codes[number] + "\n"
        before = codes[number]
    return script, run


def shown_text(cell: Segment) -> str:
    """The code of a cell as readers are shown it."""
    return _MAGIC.sub("", _OPTION.sub("", cell.text)).strip("\n")


def _code(cell: Segment, context: LessonContext) -> str:
    """What a cell runs; empty where that is nothing for a script."""
    options = {quarto or myst: value.strip() for quarto, myst, value in _OPTION.findall(cell.text)}
    text = _OPTION.sub("", cell.text)
    if "raises-exception" in cell.head + options.get("tags", ""):
        context.leave(cell.place, "a cell that is to fail is shown and not run")
        return ""
    if options.get("eval") == "false":
        return ""
    first, _, rest = text.lstrip("\n").partition("\n")
    if _TIMED.fullmatch(first):
        text = rest
        context.leave(cell.place, f"`{first}`, which is for Jupyter alone")
    elif first.startswith("%%"):
        context.leave(cell.place, f"a cell of `{first.split()[0]}` is shown and not run")
        return ""
    for magic in _MAGIC.findall(text):
        context.leave(cell.place, f"`{magic.strip()}`, which is for Jupyter alone")
    text = _MAGIC.sub("", text)
    if _SHOWS.search(text):
        context.leave(cell.place, "a figure: save it by `plt.savefig`, and name it by `figure=`")
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError) as error:
        context.leave(cell.place, f"a cell that is no Python is shown and not run: {error}")
        return ""
    return _printed(cell, text, tree, context) if cell.value is not False else text


def _printed(cell: Segment, text: str, tree: ast.Module, context: LessonContext) -> str:
    """The code with the value of its last expression printed, as Jupyter shows it."""
    last = tree.body[-1] if tree.body else None
    if not isinstance(last, ast.Expr) or text.rstrip().endswith(";"):
        return text
    if isinstance(last.value, ast.Call):
        if _draws(last.value):
            return text
        if not cell.value:
            what = ast.unparse(last.value.func)
            context.leave(cell.place, f"the value of `{what}(…)` is shown there if it has one")
            return text
    lines = text.split("\n")
    before = "\n".join(lines[: last.lineno - 1])
    lead = lines[last.lineno - 1].encode()[: last.col_offset].decode()
    return f"{before}\n{lead}print({ast.get_source_segment(text, last.value)})"


def _draws(call: ast.Call) -> bool:
    """Whether a call draws, so that its value says nothing."""
    root: ast.expr = call.func
    while isinstance(root, ast.Attribute | ast.Call):
        root = root.func if isinstance(root, ast.Call) else root.value
    name = root.id if isinstance(root, ast.Name) else ""
    return name in ("print", "plt", "ax", "axs", "axes", "fig", "display")
