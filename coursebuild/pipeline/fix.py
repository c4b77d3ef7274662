"""`coursebuild check --fix` and `--propose`: make the edits that diagnostics carry.

1. `--fix` makes those that change form and no word, in memory, and reads the course again: a fix
   stays if its mistake is gone and the course has no more errors than before; else each half of the
   fixes is tried. Where reading finds nothing more to fix, scripts and labs run, and what they show
   is fixed likewise.
2. `--propose` shows the others one by one; a human accepts or declines each. With `--truth` it
   proposes to bind numbers as well.
3. The files, texts in `content/` and `models/` behind no link, are written at the end, all or none,
   with a journal for `coursebuild undo`.
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.write import FileChange, change_files, check_writable
from coursebuild.core.scripts.edit import edited_texts, select_harmless
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from coursebuild.pipeline.check import judge, list_unproven, read_and_verify
from coursebuild.pipeline.load import Code, load
from coursebuild.pipeline.options import Options, select
from coursebuild.pipeline.outputs import DOUBTFUL, changed_text
from coursebuild.pipeline.reader import Reader
from coursebuild.report import Report
from coursebuild.report.text import location
from coursebuild.report.values import plural

_ROUNDS = 20
"""How often fixes may lead to further ones."""
_HIDING = frozenset(
    """
    map-syntax json-syntax toml-syntax fence-unclosed fence-info fence-key-unknown
    callout-unknown markup-foreign binding-attribute
    """.split()
)
"""Rules of mistakes that keep what they stand in from being checked: without one, more errors may
be found."""


Ask: TypeAlias = Callable[[Diagnostic, str], str]
"""Shows a diagnostic and a proposed change, as a diff; returns `y`, `n`, or `q` to end."""


def choose_fixes(
    diagnostics: Iterable[Diagnostic], *, proposals: bool = False
) -> tuple[Diagnostic, ...]:
    """The diagnostics whose edits can be made together: none touches another, safe ones first.

    With `proposals`, also those that a human has to decide.
    """
    fixes: list[Diagnostic] = []
    taken_places: dict[str, list[tuple[int, int]]] = {}
    for diagnostic in sorted(diagnostics, key=lambda d: (not d.safe, d.order)):
        if not diagnostic.edits or not (diagnostic.safe or proposals):
            continue
        places = [(e.span.path, e.span.start, e.span.end) for e in diagnostic.edits]
        if any(
            a <= end and start <= b for p, start, end in places for a, b in taken_places.get(p, ())
        ):
            continue
        for path, start, end in places:
            taken_places.setdefault(path, []).append((start, end))
        fixes.append(diagnostic)
    return tuple(sorted(fixes, key=lambda d: d.order))


def ways(diagnostic: Diagnostic) -> Iterator[Diagnostic]:
    """The same diagnostic with the edits and the help of each way in which it can be mended."""
    if diagnostic.edits:
        yield diagnostic
    for note in diagnostic.notes:
        if note.edits:
            yield replace(diagnostic, help=note.message, edits=note.edits)


def proposals(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """What a human has to decide, one way after the other."""
    return tuple(way for d in diagnostics if not d.safe for way in ways(d))


def may_edit(root: Path, path: str) -> bool:
    """Whether fixes may change a file: one of the course's texts, itself and not behind a link."""
    try:
        target = check_writable(root, path)
    except EffectError:
        return False
    folders = (root.resolve() / name for name in ("content", "models"))
    return path.startswith(("content/", "models/")) and any(map(target.is_relative_to, folders))


def fix(options: Options, names: tuple[str, ...] = ()) -> Report:
    """Mend the form of the lessons that the names mean, or of everything; report what is left."""
    with project_lock(options.root, options.progress.say), Reader(options) as reader:
        fixer = _Fixer(options, reader, names)
        report = fixer.run()
    return replace(report, remarks=(*report.remarks, *fixer.write("fixed", report)))


def propose(
    options: Options, names: tuple[str, ...] = (), ask: Ask | None = None, *, truth: bool = False
) -> Report:
    """Propose one by one what a human should decide; without `ask`, only say what that is.

    `truth`: also to bind numbers that a text states to the outputs that have them.
    """
    with project_lock(options.root, options.progress.say), Reader(options) as reader:
        fixer = _Fixer(options, reader, names, truth=truth)
        report, proposals = fixer.propose(ask)
    if ask is not None:
        return replace(report, remarks=(*report.remarks, *fixer.write("changed", report)))
    changes = [
        f"{location(diagnostic.span)}: {diagnostic.message}\n{diff}"
        for diagnostic, diff in proposals
    ]
    summary = f"{plural(len(changes), 'proposal')}; in a terminal, each can be accepted"
    summary = summary if changes else "there is nothing to propose"
    return replace(report, remarks=(*report.remarks, *changes, summary))


class _Fixer:
    """Mends the texts of a course in memory."""

    def __init__(
        self, options: Options, reader: Reader, names: tuple[str, ...], *, truth: bool = False
    ) -> None:
        self.options, self.reader, self.names, self.truth = options, reader, names, truth
        self.code: Code = "run" if options.sandbox is None else "refuse"
        self.texts: dict[str, str] = {}
        """The mended texts, by path."""
        self.originals: dict[str, Source] = {}
        self.fixed: list[Diagnostic] = []
        self.paths: set[str] = set()
        """The map and the texts that are named, where some are."""
        self.tried: set[tuple[object, ...]] = set()
        """Fixes that were made, or are not to be made."""

    def run(self) -> Report:
        """Mend the form of all texts; return what is left."""
        for _ in range(_ROUNDS):
            diagnostics = self._read(self.texts)
            if self._mend(diagnostics, diagnostics):
                continue
            report = self._verify()
            if not self._mend(report.diagnostics, diagnostics):
                break
        return report

    def propose(self, ask: Ask | None) -> tuple[Report, list[tuple[Diagnostic, str]]]:
        """Ask about each proposal until there is no new one; return what is left, and all."""
        questions: list[tuple[Diagnostic, str]] = []
        while True:
            self._read(self.texts)  # which lessons the names mean
            report = self._verify()
            accepted: list[Diagnostic] = []
            answer = "n"
            for diagnostic in self._candidates(proposals(report.diagnostics)):
                if answer == "q":
                    continue
                if len(choose_fixes([*accepted, diagnostic], proposals=True)) <= len(accepted):
                    continue  # it touches an accepted one, and is proposed again if need be
                self.tried.add(_key(diagnostic))
                questions.append((diagnostic, "\n".join(self._diff(diagnostic))))
                answer = "n" if ask is None else ask(*questions[-1])
                accepted += [diagnostic] if answer == "y" else []
            self._make(accepted)
            if not accepted:
                return report, questions
            if answer == "q":
                return self._verify(), questions

    def write(self, verb: str, report: Report) -> tuple[str, ...]:
        """Write the files; what was done, as remarks."""
        texts = [(self.originals[path], text) for path, text in sorted(self.texts.items())]
        changed = [(source, text) for source, text in texts if text != source.text]
        changes = [FileChange.of(*change) for change in changed]
        can_undo = bool(changes) and change_files(
            self.options.root, changes, self.options.progress.say, keep=True
        )
        remarks = [changed_text(verb, *change) for change in changed]
        rules = Counter(diagnostic.rule for diagnostic in self.fixed)
        names = ", ".join(f"{rule} {n}" if n > 1 else rule for rule, n in sorted(rules.items()))
        left = len(report.diagnostics)
        parts = [f"nothing {verb}; {left} left"]
        if self.fixed:
            mistakes, files = plural(len(self.fixed), "mistake"), plural(len(changes), "file")
            parts = [f"fixed {mistakes} in {files} ({names})"]
            parts.append(f"{left} left" if left else "nothing is left")
        if count := len(proposals(report.diagnostics)):
            parts.append(f"`coursebuild check --propose` has {plural(count, 'proposal')}")
        if self.fixed:
            parts.append("`coursebuild undo` takes it back" if can_undo else "it cannot be undone")
        return (*remarks, "; ".join(parts))

    def _verify(self) -> Report:
        outcome = read_and_verify(self.options, self.reader, self.names, texts=self.texts)
        if isinstance(outcome, Report):
            return outcome
        return outcome.report(inventory=[*list_unproven(outcome)] if self.truth else [])

    def _read(self, texts: Mapping[str, str]) -> tuple[Diagnostic, ...]:
        """What is wrong with the course with these texts, as far as reading it shows."""
        parsed_course = load(self.options.root, self.reader, texts, code=self.code)
        if parsed_course.value is not None and self.names:
            paths = select(parsed_course.value, self.names, self.options.root) or frozenset()
            self.paths = {*paths, parsed_course.value.map.path}
        return judge(
            parsed_course.value, parsed_course.diagnostics, strict=self.options.strict
        ).diagnostics

    def _mend(self, diagnostics: Collection[Diagnostic], before: Collection[Diagnostic]) -> bool:
        """Make the fixes of these diagnostics that do no harm; return whether there were any.

        `before` are the diagnostics of reading the course.
        """
        fixes = choose_fixes(self._candidates(diagnostics))
        self.tried |= {_key(diagnostic) for diagnostic in fixes}
        harmless = select_harmless(fixes, lambda some: self._is_harmless(some, before))
        self._make(harmless)
        return bool(harmless)

    def _candidates(self, diagnostics: Collection[Diagnostic]) -> list[Diagnostic]:
        """The diagnostics with edits that may be made and were not tried."""
        doubtful = {d.span.path for d in diagnostics if d.rule in DOUBTFUL}

        def may_change(path: str) -> bool:
            is_asked = path in self.paths or not self.names
            return is_asked and path not in doubtful and may_edit(self.options.root, path)

        return [
            d
            for d in diagnostics
            if d.edits
            and _key(d) not in self.tried
            and all(may_change(edit.span.path) for edit in d.edits)
        ]

    def _make(self, fixes: Sequence[Diagnostic]) -> None:
        """Make the edits of diagnostics in memory."""
        for edit in (edit for diagnostic in fixes for edit in diagnostic.edits):
            self.originals.setdefault(edit.span.path, edit.span.source)
        self.texts = self._texts_with(fixes)
        self.fixed += fixes

    def _diff(self, diagnostic: Diagnostic) -> Iterator[str]:
        """The lines that the edits of a diagnostic change."""
        for path, new in self._texts_with([diagnostic]).items():
            sources = (edit.span.source for edit in diagnostic.edits)
            if (source := next((s for s in sources if s.path == path), None)) is not None:
                old_lines, new_lines = source.text.splitlines(), new.splitlines()
                diff = difflib.unified_diff(old_lines, new_lines, n=0, lineterm="")
                yield from (line for line in list(diff)[2:] if not line.startswith("@@"))

    def _texts_with(self, fixes: Iterable[Diagnostic]) -> dict[str, str]:
        edits = (edit for diagnostic in fixes for edit in diagnostic.edits)
        return self.texts | {s.path: text for s, text in edited_texts(edits).items()}

    def _is_harmless(self, fixes: Sequence[Diagnostic], before: Collection[Diagnostic]) -> bool:
        """Whether the mistakes are gone with these fixes, and there are no more errors."""
        after = self._read(self._texts_with(fixes))
        counts_before, counts_after = (
            Counter(map(_mistake, diagnostics)) for diagnostics in (before, after)
        )
        expected = counts_before - Counter(map(_mistake, fixes))
        are_gone = all(counts_after[_mistake(f)] <= expected[_mistake(f)] for f in fixes)
        return are_gone and _count_errors(after) <= _count_errors(before)


def _mistake(diagnostic: Diagnostic) -> tuple[str, str, str]:
    return diagnostic.span.path, diagnostic.rule, diagnostic.message


def _count_errors(diagnostics: Collection[Diagnostic]) -> tuple[int, int]:
    """How many errors there are: first of those that hide others."""
    errors = [d for d in diagnostics if d.is_error]
    return sum(d.rule in _HIDING for d in errors), len(errors)


def _key(diagnostic: Diagnostic) -> tuple[object, ...]:
    """What tells a mistake with its fix from others, wherever it has moved to."""
    span, texts = diagnostic.span, tuple(edit.text for edit in diagnostic.edits)
    return (*_mistake(diagnostic), span.source.line_text(span.line), texts)
