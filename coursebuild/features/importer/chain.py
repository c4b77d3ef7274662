"""The cells of a script that failed: which of them can run, and which are shown, with a reason."""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence, Set
from textwrap import shorten

from coursebuild.api import Edit, Recording, ScriptRun, Span, marks, model
from coursebuild.features.importer.context import script_path_of
from coursebuild.report.values import plural

_MISSING_MODULE = re.compile(r"^ModuleNotFoundError: No module named '([\w.]+)'", re.MULTILINE)


def missing_module(script_run: ScriptRun) -> str:
    """Return the name of the module that a script could not import; empty for other failures."""
    missing = _MISSING_MODULE.search(script_run.stderr)
    return missing[1] if missing is not None else ""


class Chain:
    """The cells of a script that failed, as parts of it."""

    def __init__(
        self, script: model.Script, script_run: ScriptRun, recordings: Sequence[Recording]
    ) -> None:
        self.script, self.recordings = script, recordings
        self.parts: tuple[model.Script | model.ScriptPart, ...] = self.script.parts or (
            self.script,
        )
        self.codes = [part.code.text.strip("\n") for part in self.parts]
        self.is_of_cells = script.path == script_path_of(script.span.path)
        self.remarks: list[str] = []
        name = re.escape(self.script.path)
        lines = re.findall(rf'File "[^"\n]*{name}", line (\d+)', script_run.stderr)
        starts = self.script.part_lines if self.script.parts else ()
        self.failing = sum(start <= int(lines[0]) for start in starts) if lines else None
        last_line = (script_run.stderr.strip().splitlines() or ["it failed"])[-1]
        self.reason = shorten(last_line.replace("`", "'"), 200, placeholder="…")
        self.module = missing_module(script_run)

    def edits(self, *, is_prefix: bool) -> Iterator[Edit]:
        """Yield the edits that show, and no longer run, what cannot.

        `is_prefix`: all from the cell on that failed.
        """
        if self.failing is None or not self.is_of_cells or self.script.requires:
            return
        imports, names = self._without_module()
        reasons: dict[int, str] = {}
        if is_prefix:
            reasons = dict.fromkeys(range(self.failing + 1, len(self.parts)), "a cell above fails")
            reasons[self.failing] = f"`{self.reason}`"
        else:
            if not imports:
                reasons[self.failing] = f"`{self.reason}`"
                names = _bound_names(self.codes[self.failing])
            for number in range(0 if imports else self.failing + 1, len(self.parts)):
                code = imports.get(number, self.codes[number])
                if missing_names := _loaded_names(code) & names:
                    words = " and ".join(f"`{name}`" for name in sorted(missing_names))
                    reasons[number] = f"it needs {words}"
                    names |= _bound_names(code)
                else:
                    names -= _bound_names(code)
        rest = (imports.get(n, c) for n, c in enumerate(self.codes) if n not in reasons)
        if self.module and not any(rest):
            return  # nothing would be left of it: a key says what to install
        yield from self._edits(reasons, imports)
        count = plural(len(reasons), "cell") if reasons else "an import"
        self.remarks.append(f"{self.script.path}: {count} shown, not run: {self.reason}")

    def _without_module(self) -> tuple[dict[int, str], Set[str]]:
        """Return the cells that import a missing module without these imports, and their names."""
        cells: dict[int, str] = {}
        names = set[str]()
        for number, code in enumerate(self.codes) if self.module else ():
            lines = code.split("\n")
            for statement in ast.parse(code).body:
                match statement:
                    case ast.Import():
                        modules = [alias.name for alias in statement.names]
                    case ast.ImportFrom(module=str(module)):
                        modules = [module]
                    case _:
                        continue
                if any(f"{name}.".startswith(f"{self.module}.") for name in modules):
                    names |= {a.asname or a.name.split(".")[0] for a in statement.names}
                    first, last = statement.lineno - 1, statement.end_lineno or statement.lineno
                    lines[first:last] = [""] * (last - first)
            if (new := "\n".join(lines)) != code:
                cells[number] = re.sub(r"\n{3,}", "\n\n", new).strip("\n")
        return cells, names

    def _edits(self, reasons: Mapping[int, str], imports: Mapping[int, str]) -> Iterator[Edit]:
        source, figures = self.script.span.source, [f.name for f in self.script.figures]
        figure_names = [
            name
            for number in reasons
            for name in figures
            if f'plt.savefig("{name}")' in self.codes[number]
        ]
        cells = [number for number in reasons if number not in imports or reasons[number]]
        numbers = (n for n in range(len(self.parts)) if n not in reasons)
        first = next((n for n in numbers if imports.get(n, self.codes[n])), None)
        for number, part in enumerate(self.parts):
            code = self.codes[number]
            head = part.span.first_line().text.lstrip("`~ ")
            if number == first:  # it has the keys of the script
                word = re.search(r"\b(?:open|folded|hidden)\b", head)
                head = self.script.span.first_line().text.lstrip("`~ ")
                head = re.sub(r"\s+(?:open|folded|hidden)\b", "", head)
                names = ",".join(name for name in figures if name not in figure_names)
                head = re.sub(r"\s+figure=\S+", f" figure={names}" if names else "", head)
                head = f"{head} {word[0]}" if word else head
            if number in cells:
                for name in figure_names:
                    lines = f'\nplt.savefig("{name}")\nplt.close("all")'
                    code = f"\n{code}".replace(lines, "").strip("\n")
                note = f"*Not run here:* {reasons[number]}"
                new = f"{marks.fence('python', code)}\n\n{note}" if code else note
            elif number in imports:
                imports_alone = "\n".join(
                    line for line in code.split("\n") if line not in imports[number]
                )
                note = f"*Not run here:* `{self.reason}`"
                new = f"{marks.fence('python', imports_alone)}\n\n{note}"
                if imports[number]:
                    new += f"\n\n{marks.fence(head, imports[number])}"
            elif number == first:
                new = marks.fence(head, code)
            else:
                continue
            indented = textwrap.indent(new, part.prefix, lambda line: True)
            yield Edit(part.span, indented.removeprefix(part.prefix))
        for recording in self.recordings:
            if recording.script == self.script.path and recording.part in reasons:
                line = recording.span.first_line()
                if "output" in line.text:
                    yield Edit(line, line.text.replace("output", "text", 1))
        for name in figure_names:
            pattern = rf"^[> ]*Figure: !\[[^\]\n]*\]\({re.escape(name)}\)[^\n]*\n?"
            if paragraph := re.search(pattern, source.text, re.MULTILINE):
                yield Edit(Span(source, paragraph.start(), paragraph.end()), "")


def _loaded_names(code: str) -> set[str]:
    """The names that a cell takes from those above it, without those that it imports itself."""
    nodes = [*ast.walk(ast.parse(code))]
    imports = {alias.asname or alias.name for node in nodes for alias in _aliases(node)}
    names = (n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load))
    return {*names} - imports


def _bound_names(code: str) -> set[str]:
    """The names that a cell gives."""
    names = set[str]()
    for node in ast.walk(ast.parse(code)):
        match node:
            case ast.Name(id=name, ctx=ast.Store()):
                names.add(name)
            case ast.FunctionDef() | ast.ClassDef() | ast.AsyncFunctionDef():
                names.add(node.name)
            case ast.Import() | ast.ImportFrom():
                names |= {a.asname or a.name.partition(".")[0] for a in node.names}
            case _:
                continue
    return names


def _aliases(node: ast.AST) -> Sequence[ast.alias]:
    return node.names if isinstance(node, ast.Import | ast.ImportFrom) else ()
