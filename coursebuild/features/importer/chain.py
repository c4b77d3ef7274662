"""The cells of a script that failed: which of them can run, and which are shown, with a reason."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from textwrap import shorten

from coursebuild.api import Edit, Options, Recording, ScriptRun, Span, marks, model, regex
from coursebuild.core.run.part_marks import FAILURE
from coursebuild.core.run.script_environment import InstalledPackages
from coursebuild.core.text.python_code import bound_name
from coursebuild.features.importer.cells import imported_names
from coursebuild.features.importer.commands.findings import Rank
from coursebuild.features.importer.context import script_path_of
from coursebuild.report.values import plural

_MISSING_MODULE = regex(r"^ModuleNotFoundError: No module named '([\w.]+)'", re.MULTILINE)


def missing_modules(text: str) -> list[str]:
    """Return the modules that a script did not find, as its error output names them."""
    return list(dict.fromkeys(_MISSING_MODULE.findall(text)))


_PACKAGES = {
    **{name: name for name in "control gymnasium jax networkx pandas scipy sympy torch".split()},
    "PIL": "pillow",
    "bs4": "beautifulsoup4",
    "cv2": "opencv-python",
    "dm_control": "dm-control",
    "skimage": "scikit-image",
    "sklearn": "scikit-learn",
    "yaml": "PyYAML",
}
"""Packages by the modules that they bring, as they say themselves in their manuals."""


def name_package(module: str, options: Options) -> str:
    """Return a sentence on what brings a module that is missing, as far as that is known."""
    top = module.partition(".")[0]
    installed = [name for _, name, _ in InstalledPackages(options.store).distributions([top])]
    package = installed[0] if installed else _PACKAGES.get(top)
    if package is None:
        return f"the module `{module}` is missing; which package brings it is not known here"
    return f"the module `{module}` is missing; the package `{package}` brings `{top}`"


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
        self.findings: list[tuple[Rank, str, Span | None]] = []
        self.failures: dict[int, list[str]] = {}
        """The errors of each cell that failed."""
        self.reasons: dict[int, str] = {}
        """Why cells are shown that cannot run, once the edits are made."""
        self.is_changed = False
        """Whether edits are made."""
        stderr = script_run.stderr
        notes = re.findall(rf"^{FAILURE} (\d+)\n(.*)$", stderr, re.MULTILINE)
        self._has_gone_on = bool(notes)
        if not notes and stderr.strip():  # it ended where it failed, with a traceback
            lines = re.findall(rf'File "[^"\n]*{re.escape(script.path)}", line (\d+)', stderr)
            notes = [(line, stderr.strip().splitlines()[-1]) for line in lines[:1]]
        starts = script.part_lines if script.parts else ()
        for line, error in notes:
            number = sum(start <= int(line) for start in starts)
            self.failures.setdefault(number, []).append(error.replace("`", "'"))
        self.modules = missing_modules("\n".join(error for _, error in notes))

    def edits(self, keys: Sequence[str] = ()) -> Iterator[Edit]:
        """Yield the edits that show, and no longer run, what cannot; the rest gets these keys.

        Of a run that did not go on after a failure, these are all cells from the failing one on.
        """
        if not self.failures or not self.is_of_cells or self.script.requires:
            return
        imports, names = self._without_modules()
        reasons = self.reasons
        for number, code in enumerate(self.codes):
            code = imports.get(number, code)
            errors = self.failures.get(number, [])
            if number in imports:
                errors = [e for e in errors if not missing_modules(e)]
            if reasons and not self._has_gone_on:
                reasons[number] = "a cell above fails"
            elif missing_names := _loaded_names(code) & names:
                words = " and ".join(f"`{name}`" for name in sorted(missing_names))
                reasons[number] = f"it needs {words}"
            elif errors:
                reasons[number] = f"`{shorten(errors[0], 200, placeholder='…')}`"
                message = f": {reasons[number]}, so the cell is not run"
                self.findings.append((Rank.FAILED, message, self.parts[number].span))
            else:
                names -= _bound_names(ast.parse(code))
                continue
            names |= _bound_names(ast.parse(code))
        rest = (imports.get(n, c) for n, c in enumerate(self.codes) if n not in reasons)
        if self.modules and not any(rest):
            return  # nothing would be left of it: a key says what it requires
        self.is_changed = True
        yield from self._edits(reasons, imports, keys)
        count = plural(len(reasons), "cell") if reasons else "an import"
        errors = [e for e in dict.fromkeys(chain(*self.failures.values())) if missing_modules(e)]
        reason = f": {shorten('; '.join(errors), 200, placeholder='…')}" if errors else ""
        message = f"{self.script.path}: {count} shown, not run{reason}"
        self.findings.append((Rank.MISSING if errors else Rank.CHANGED, message, None))

    def _without_modules(self) -> tuple[dict[int, str], set[str]]:
        """Return the cells that import a missing module without these imports, and their names."""
        cells: dict[int, str] = {}
        names = set[str]()
        for number, code in enumerate(self.codes) if self.modules else ():
            lines = code.split("\n")
            for statement in ast.parse(code).body:
                modules = imported_names(statement)
                if any(f"{name}.".startswith(f"{m}.") for name in modules for m in self.modules):
                    names |= _bound_names(statement)
                    first, last = statement.lineno - 1, statement.end_lineno or statement.lineno
                    lines[first:last] = [""] * (last - first)
            if (new := "\n".join(lines)) != code:
                cells[number] = re.sub(r"\n{3,}", "\n\n", new).strip("\n")
        return cells, names

    def _edits(
        self, reasons: Mapping[int, str], imports: Mapping[int, str], keys: Sequence[str]
    ) -> Iterator[Edit]:
        source, figures = self.script.span.source, [f.name for f in self.script.figures]
        figure_names = [
            name
            for number in reasons
            for name in figures
            if re.search(rf'\.(?:savefig|imsave)\(\s*"{re.escape(name)}"', self.codes[number])
        ]
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
                head, brace, label = head.partition(" {#")
                head = " ".join((head, *keys, *([word[0]] if word else []))) + brace + label
            if number in reasons:
                for name in figure_names:
                    lines = rf'^[\w.]+\.savefig\("{re.escape(name)}"\)\n[\w.]+\.close\("all"\)$'
                    code = re.sub(lines, "", code, flags=re.MULTILINE).strip("\n")
                note = f"*Not run here:* {reasons[number]}"
                new = f"{marks.fence('python', code)}\n\n{note}" if code else note
            elif number in imports:
                imports_alone = "\n".join(
                    line for line in code.split("\n") if line not in imports[number]
                )
                errors = (*self.failures.get(number, ()), *chain(*self.failures.values()))
                error = next(error for error in errors if missing_modules(error))
                note = f"*Not run here:* `{error}`"
                new = f"{marks.fence('python', imports_alone)}\n\n{note}"
                if imports[number]:
                    new += f"\n\n{marks.fence(head, imports[number])}"
            elif number == first:
                new = marks.fence(head, code)
            else:
                continue
            yield Edit(part.span, new.replace("\n", f"\n{part.prefix}"))
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
    """The names that a cell takes from those above it: no statement before has given them."""
    used_names, own_names = set[str](), set[str]()
    for statement in ast.parse(code).body:
        names = set[str]()
        for node in ast.walk(statement):
            match node:
                case ast.Name(id=name, ctx=ast.Load()) | ast.AugAssign(target=ast.Name(id=name)):
                    names.add(name)
                case (
                    ast.For(target=inner)
                    | ast.comprehension(target=inner)
                    | (ast.Import() as inner)
                    | (ast.ImportFrom() as inner)
                ):
                    own_names |= _bound_names(inner)
                case _:
                    continue
        used_names |= names - own_names
        own_names |= _bound_names(statement)
    return used_names


def _bound_names(tree: ast.AST) -> set[str]:
    """The names that code gives."""
    nodes = (n for n in ast.walk(tree) if not isinstance(n, ast.arg | ast.ExceptHandler))
    return {name for node in nodes if (name := bound_name(node))}
