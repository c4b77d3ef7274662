"""`coursebuild check --fix`: make the edits that diagnostics carry, and check what comes of them.

Edits are made in memory, and the course is read again: a fix stays if its mistake is gone and the
course has no more errors than before; else each half of the fixes is tried. Where reading finds
nothing more to fix, scripts and labs run, and what they show is fixed likewise. The files, texts in
`content/` and `models/` behind no link, are written at the end, all or none, with a journal for
`coursebuild undo`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.write import FileChange, change_files, check_writable
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Source
from coursebuild.pipeline.check import judge, read_and_verify
from coursebuild.pipeline.load import Code, load
from coursebuild.pipeline.options import Options, select
from coursebuild.pipeline.outputs import changed_text
from coursebuild.pipeline.reader import Reader
from coursebuild.report import Report
from coursebuild.report.values import plural

_ROUNDS = 20
"""How often fixes may lead to further ones."""
_DOUBTFUL = ("file-encoding", "merge-conflict")
"""Rules of files whose text is not what they hold, or not one text."""
_HIDING = frozenset(
    """
    map-syntax json-syntax toml-syntax fence-unclosed fence-info fence-kind-near fence-key-unknown
    callout-unknown recording-misspelt markup-foreign markup-unread binding-attribute
    """.split()
)
"""Rules of mistakes that keep what they stand in from being checked: without one, more errors may
be found."""


def choose_fixes(
    diagnostics: Iterable[Diagnostic], *, unsafe: bool = False
) -> tuple[Diagnostic, ...]:
    """The diagnostics whose edits can be made together: none touches another, safe ones first."""
    fixes: list[Diagnostic] = []
    taken_places: dict[str, list[tuple[int, int]]] = {}
    for diagnostic in sorted(diagnostics, key=lambda d: (not d.safe, d.order)):
        if not diagnostic.edits or not (diagnostic.safe or unsafe):
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


def may_edit(root: Path, path: str) -> bool:
    """Whether fixes may change a file: one of the course's texts, itself and not behind a link."""
    try:
        target = check_writable(root, path)
    except EffectError:
        return False
    folders = (root.resolve() / name for name in ("content", "models"))
    return path.startswith(("content/", "models/")) and any(map(target.is_relative_to, folders))


def fix(options: Options, names: tuple[str, ...] = (), *, unsafe: bool = False) -> Report:
    """Mend the lessons that the names mean, or everything; report what was done and what is left.

    Without `unsafe`, only what can be mended in one way.
    """
    with project_lock(options.root, options.progress.say), Reader(options) as reader:
        fixer = _Fixer(options, reader, names, unsafe=unsafe)
        report = fixer.run()
    originals = fixer.originals
    changed = {p: text for p, text in fixer.texts.items() if text != originals[p].text}
    changes = [
        FileChange(path, originals[path].text.encode(), text.encode())
        for path, text in sorted(changed.items())
    ]
    can_undo = bool(changes) and change_files(
        options.root, changes, options.progress.say, keep=True
    )
    remarks = [changed_text("fixed", originals[c.path], changed[c.path]) for c in changes]
    # How much was fixed, by rule, and what is left
    fixed, files = fixer.fixed, len(changes)
    rules = Counter(diagnostic.rule for diagnostic in fixed)
    rule_names = ", ".join(f"{rule} {n}" if n > 1 else rule for rule, n in sorted(rules.items()))
    left = len(report.diagnostics)
    parts = [f"nothing fixed; {left} left"]
    if fixed:
        parts = [f"fixed {plural(len(fixed), 'mistake')} in {plural(files, 'file')} ({rule_names})"]
        parts.append(f"{left} left" if left else "nothing is left")
    if likely := sum(bool(d.edits) and not d.safe for d in report.diagnostics):
        parts.append(f"{likely} more with `--unsafe`, if they are what you meant")
    if fixed:
        parts.append("`coursebuild undo` takes it back" if can_undo else "it cannot be undone")
    return replace(report, remarks=(*report.remarks, *remarks, "; ".join(parts)))


class _Fixer:
    """Mends the texts of a course in memory."""

    def __init__(
        self, options: Options, reader: Reader, names: tuple[str, ...], *, unsafe: bool
    ) -> None:
        self.options, self.reader, self.names, self.unsafe = options, reader, names, unsafe
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
        for _ in range(_ROUNDS):
            diagnostics = self._read(self.texts)
            if self._mend(diagnostics, diagnostics):
                continue
            outcome = read_and_verify(self.options, self.reader, self.names, texts=self.texts)
            report = outcome if isinstance(outcome, Report) else outcome.report()
            if not self._mend(report.diagnostics, diagnostics):
                break
        return report

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
        doubtful = {d.span.path for d in diagnostics if d.rule in _DOUBTFUL}
        candidates = [
            d
            for d in diagnostics
            if _key(d) not in self.tried
            and all(e.span.path not in doubtful and self._may_edit(e) for e in d.edits)
        ]
        fixes = choose_fixes(candidates, unsafe=self.unsafe)
        self.tried |= {_key(diagnostic) for diagnostic in fixes}
        if not fixes:
            return False
        harmless = self._select_harmless(list(fixes), [], before)
        for edit in (edit for diagnostic in harmless for edit in diagnostic.edits):
            self.originals.setdefault(edit.span.path, edit.span.source)
        self.texts = self._texts_with(harmless)
        self.fixed += harmless
        return bool(harmless)

    def _may_edit(self, edit: Edit) -> bool:
        path = edit.span.path
        return (not self.names or path in self.paths) and may_edit(self.options.root, path)

    def _texts_with(self, fixes: Iterable[Diagnostic]) -> dict[str, str]:
        edits: dict[Source, list[Edit]] = {}
        for edit in (edit for diagnostic in fixes for edit in diagnostic.edits):
            edits.setdefault(edit.span.source, []).append(edit)
        return self.texts | {s.path: apply_edits(s.text, changes) for s, changes in edits.items()}

    def _select_harmless(
        self, fixes: list[Diagnostic], selection: list[Diagnostic], before: Collection[Diagnostic]
    ) -> list[Diagnostic]:
        """The selection with as many further fixes as do no harm together."""
        if not fixes or self._is_harmless(selection + fixes, before):
            return selection + fixes
        if len(fixes) == 1:
            return selection
        half = len(fixes) // 2
        selection = self._select_harmless(fixes[:half], selection, before)
        return self._select_harmless(fixes[half:], selection, before)

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
