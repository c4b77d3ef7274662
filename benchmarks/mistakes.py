"""Change a course in small ways as hands do, check each change, and count what nobody is told of.

Run: python benchmarks/mistakes.py [--seed 37 …] [--count 1200] [--kinds KIND …] [--jobs 2]
         [--course DIR] [--list END …] [--minutes N] [--lessons N]

The course is verified once, in its folder, where results are known. Then each change of a
lesson, a page, the map or what is declared of a model is checked in memory, in a copy of the
course; of scripts and labs those run whose text has changed. A change ends in one of these ways:

- at its place: a message names a changed line, or the one before or after it;
- in its result: what runs was changed, and a message names what came of it, such as the output;
- elsewhere: a message names another line;
- hinted: only a hint says what is likely;
- unproved: `check` says what was proved of the course as it was, and is proved no longer;
- same: the pages say the same;
- prose: only words have changed, which nothing can know to be wrong;
- silent: all others. They are listed.

With `--lessons` only so many lessons and pages, drawn by the first seed, are verified, changed and
compared, besides the map and models; what a change of these breaks elsewhere is then not noticed.

Nothing excuses a silence: which slips could not be known either, a reader of the list decides.
A claim is a part of the course that is run, computed, compiled, looked up or read by a schema: the
kinds in `CLAIMS`. Of formulas it is one with numbers on both sides of a relation, or with a letter
that has a value in its text. Relations between letters alone, as `$F = ma$`, and those of a letter
and a number, as `$p = 1$`, state something too, but another one may be meant as well: they have a
row of their own, and are counted once without and once with the claims. Neither are what says
nothing that could be tried: a formula without a relation, as `$m$`; commands, and what they
printed, in blocks that are only shown; docstrings, comments and sources in words
(`{given="ISO 80000-3"}`); and addresses of others, where nothing is looked up.
Beside the silence stand the false alarms that it was bought with: those of `corpus.py --record`.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]

from benchmarks.slips.changes import KINDS, Change, make_change  # noqa: E402
from benchmarks.slips.pages import compare_pages  # noqa: E402
from coursebuild.core.files.trust import FOLDER  # noqa: E402
from coursebuild.core.model import Course  # noqa: E402
from coursebuild.core.model.lesson_record import known_addresses  # noqa: E402
from coursebuild.core.model.results import ScriptJob, ScriptRun  # noqa: E402
from coursebuild.core.pages import urls  # noqa: E402
from coursebuild.core.pages.page_list import page_list  # noqa: E402
from coursebuild.core.run.script_server import ScriptServer  # noqa: E402
from coursebuild.core.scripts.bound_places import moved_values  # noqa: E402
from coursebuild.core.text.diagnostics import Diagnostic  # noqa: E402
from coursebuild.pipeline.check import judge  # noqa: E402
from coursebuild.pipeline.options import Options, open_store  # noqa: E402
from coursebuild.pipeline.proofs import find_losses, proved_texts  # noqa: E402
from coursebuild.pipeline.verify import Verification, verify  # noqa: E402
from coursebuild.preview.messages import printed_outputs  # noqa: E402
from coursebuild.preview.run_history import script_keys  # noqa: E402
from coursebuild.preview.session import Session  # noqa: E402

ENDS = "at its place|in its result|elsewhere|hinted|unproved|same|prose|silent".split("|")
CLAIMS = frozenset(
    (
        *("bound and given numbers", "attributes", "links", "formulas", "captions", "fences"),
        *("scripts", "recorded outputs", "quizzes", "labs", "other blocks", "course map"),
        *("declarations of models", "fence not closed", "key renamed", "merge conflict"),
    )
)
"""Kinds of changes of what the course claims."""
RELATIONS = "relations without values"
"""A kind of its own; all others are of prose and its marks."""
RESULT = Path(__file__).parent / "corpus_result.json"
"""What `corpus.py --record` writes."""
WIDTH = 300
"""Characters of a change that are listed."""
SECONDS = 20.0
"""How long a changed script may run."""
_RUN_PLACES = {"script", "output", "lab", "declarations", "map"}


class Outcome(Struct, frozen=True):
    """What became of a change."""

    change: Change
    end: str
    note: str = ""
    """The message."""


class Checker:
    """A course in memory in which changes are checked, one after the other."""

    def __init__(self, root: Path, verification: Verification, paths: frozenset[str]) -> None:
        self.server = ScriptServer()
        self.options = Options(root, 1, open_store(root, None, None), run_all=self._run)
        self.session = Session(self.options)
        self.session.read()
        course = self._course
        self.verification = verification
        self.session.take_results(course, verification, self.session.runs.addresses)
        report = judge(course, self.session.diagnostics())
        findings = report.diagnostics
        self.hints = Counter(map(_identity, report.hints))
        if any(diagnostic.is_error for diagnostic in findings):
            raise SystemExit(f"the course has mistakes of its own: {_describe(findings[0])}")
        self.findings = Counter(map(_identity, findings))
        self.texts = {source.path: source.text for source in (course.map, *course.sources)}
        self.paths = paths
        self.texts = {
            path: text
            for path, text in self.texts.items()
            if path in paths or path == course.map.path
        }
        self.texts |= {
            path.relative_to(root).as_posix(): path.read_text("utf-8")
            for path in sorted(root.glob("models/*.toml"))
        }
        texts = proved_texts(course, course.documents)
        self.proofs = {p: [proof for proof, _, _ in texts[p]] for p in texts}
        self.runs = {run.path: run for run in self.verification.results.runs}
        self.keys = script_keys(course)
        self.pages: dict[str, bytes] = {}
        self._owner_pages = {owner.path: urls.owner_path(owner) for owner in course.owners}
        self._other_pages = {page for path, page in self._owner_pages.items() if path not in paths}

    def close(self) -> None:
        self.session.close()
        self.server.close()
        self.options.store.close()

    @property
    def _course(self) -> Course:
        assert self.session.course is not None
        return self.session.course

    def _run(self, root: Path, jobs: Sequence[ScriptJob], **keywords: Any) -> tuple[ScriptRun, ...]:
        jobs = [replace(job, timeout=SECONDS) for job in jobs]
        return self.server.run(root, jobs, **keywords)

    def check(self, change: Change) -> Outcome:
        """Check a change, and undo it."""
        old = self.texts[change.path]
        new = change.apply(old)
        try:
            diagnostics = self._diagnose(change.path, new)
            if diagnostics:
                return _judge_place(change, old, new, diagnostics)
            verdict = self._compare(change)
            verdict_of_remarks = self._tell(change) if verdict == "other" else None
        finally:
            self.session.open_texts = {}
            if self.session.edit([change.path], is_saved=False) is None:
                self.session.read(is_saved=False)
            self.session.take_results(self._course, self.verification, self.session.runs.addresses)
        return verdict_of_remarks or Outcome(change, "silent" if verdict == "other" else verdict)

    def _tell(self, change: Change) -> Outcome | None:
        """What is said of a change that is no mistake, if anything is."""
        course = self._course
        for document in course.documents:
            if (path := document.source.path) == change.path:
                texts = proved_texts(course, [document])[path]
                for proof, _ in find_losses(document.source, texts, self.proofs.get(path, ())):
                    return Outcome(change, "unproved", proof.name)
                library, addresses = self.session.library, self.session.runs.addresses
                before = known_addresses(course.records)
                for move in moved_values(document, printed_outputs(library), before, addresses):
                    return Outcome(change, "unproved", move)
        for hint in judge(course, self.session.diagnostics()).hints:
            if _identity(hint) not in self.hints:
                return Outcome(change, "hinted", _describe(hint))
        return None

    def _diagnose(self, path: str, new: str) -> list[Diagnostic]:
        """What is reported of a course with this text, and not of the course as it was."""
        session = self.session
        session.open_texts = {path: new}
        if session.edit([path], is_saved=False) is not None:
            findings = self._new(session.course, session.reading_diagnostics)
            if any(d.is_error for d in findings):
                return findings
        session.read(is_saved=False)
        course = session.course
        findings = self._new(course, session.reading_diagnostics)
        if course is None or any(d.is_error for d in findings):
            return findings
        keys = script_keys(course)
        known_runs_by_path = {
            p: run for p, run in self.runs.items() if keys.get(p) == self.keys.get(p)
        }
        is_alone = keys == self.keys and path in self._owner_pages  # no other page can change
        documents = frozenset([path]) if is_alone else self.paths
        verification = verify(course, self.options, documents, known_runs=known_runs_by_path)
        if is_alone:
            results = replace(self.verification.results, trials=verification.results.trials)
            verification = replace(verification, results=results)
        session.take_results(course, verification, session.runs.addresses)
        return self._new(course, session.diagnostics())

    def _new(self, course: Course | None, diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
        reported = judge(course, diagnostics).diagnostics
        return [d for d in reported if _identity(d) not in self.findings]

    def _compare(self, change: Change) -> str:
        """Whether the pages of the changed course say what they said."""
        paths = [self._owner_pages[change.path]] if change.path in self._owner_pages else None
        if paths is None:  # of the map and of declarations, all
            paths = self._all_pages()
        whole = change.slip in ("line lost", "line repeated", "paragraph moved")
        whole &= change.place not in ("script", "output", "lab", "declarations")
        worst = "same"
        changed = {path: self.session.find(path) or b"" for path in paths}
        for path, page in changed.items():
            verdict = compare_pages(self.pages.get(path, b""), page, whole_lines=whole)
            worst = max(worst, verdict, key=("same", "prose", "other").index)
        return worst

    def draw(self) -> None:
        """Draw all pages of the course as it is."""
        self.pages = {path: self.session.find(path) or b"" for path in self._all_pages()}

    def _all_pages(self) -> list[str]:
        assert self.session.library is not None
        paths = [entry.path for entry in page_list(self.session.library)]
        return [path for path in paths if path not in self._other_pages]


def _identity(diagnostic: Diagnostic) -> tuple[str, str, str]:
    return diagnostic.rule, diagnostic.span.path, diagnostic.message


def _judge_place(change: Change, old: str, new: str, diagnostics: Sequence[Diagnostic]) -> Outcome:
    """Where a change was reported."""
    first = new.count("\n", 0, change.start) + 1
    last = first + change.text.rstrip("\n").count("\n")
    spans = [(d, d.span) for d in diagnostics]
    spans += [(d, n.span) for d in diagnostics for n in d.notes if n.span is not None]
    for diagnostic, span in spans:
        if span.path == change.path and span.line <= last + 1 and first - 1 <= span.end_line:
            return Outcome(change, "at its place", _describe(diagnostic))
        if span.path == change.path and diagnostic.rule == "fence-unclosed" and span.line <= last:
            return Outcome(change, "at its place", _describe(diagnostic))  # where the fence opens
    end = "in its result" if change.place in _RUN_PLACES else "elsewhere"
    return Outcome(change, end, _describe(diagnostics[0]))


def _describe(diagnostic: Diagnostic) -> str:
    span = diagnostic.span
    return f"{span.path}:{span.line}: {diagnostic.rule}: {diagnostic.message}"


# --- the run

_checker: Checker | None = None
"""That of this process."""


def _prepare(course: Path, top: Path, count: int | None, seed: int) -> None:
    global _checker
    folder = Path(tempfile.mkdtemp(dir=top)) / "course"
    copy_course(course, folder)
    has_results = (course / FOLDER).is_dir()
    verification, paths = verify_course(course if has_results else folder, count, seed)
    _checker = Checker(folder, verification, paths)
    _checker.draw()


def verify_course(root: Path, count: int | None, seed: int) -> tuple[Verification, frozenset[str]]:
    """Verify so many documents of a course as it is; with their paths.

    In a copy, scripts that import the modules of the course would run again.
    """
    server = ScriptServer()
    options = Options(root, 1, open_store(root, None, None), run_all=server.run)
    session = Session(options)
    session.read()
    assert session.course is not None
    paths = sorted(document.source.path for document in session.course.documents)
    paths = paths if count is None else random.Random(seed).sample(paths, min(count, len(paths)))
    verification = verify(session.course, options, frozenset(paths))
    session.close()
    server.close()
    options.store.close()
    return verification, frozenset(paths)


def copy_course(course: Path, folder: Path) -> None:
    """Copy what belongs to a course, with what is known of its texts and labs."""
    names = (*"content models lib runs docs plugins mjcourse examples".split(), FOLDER)
    of_site = shutil.ignore_patterns("pages", "published", "pictures", "exports", "compressed")
    for name in names:
        if (course / name).is_dir():
            ignore = of_site if name == FOLDER else None
            shutil.copytree(course / name, folder / name, symlinks=True, ignore=ignore)
    for file in course.iterdir():
        if file.is_file():
            shutil.copy(file, folder / file.name)


def _check(kind: str, seed: int, number: int) -> Outcome | None:
    assert _checker is not None
    chance = random.Random(f"{seed} {kind} {number}")
    change = make_change(kind, _checker.texts, chance)
    return None if change is None else _checker.check(change)


def run(
    course: Path,
    seeds: Sequence[int],
    count: int,
    kinds: Sequence[str],
    jobs: int,
    lesson_count: int | None = None,
) -> Iterator[Outcome]:
    """Check so many changes for each seed, as many of each kind."""
    share_of_kind = max(1, round(count / len(kinds)))
    tasks = [
        (kind, seed, number) for number in range(share_of_kind) for seed in seeds for kind in kinds
    ]
    with tempfile.TemporaryDirectory(prefix="mistakes-", ignore_cleanup_errors=True) as top:
        context = multiprocessing.get_context("fork")  # no V8 runs in this process
        setting = (course, Path(top), lesson_count, seeds[0])
        pool = ProcessPoolExecutor(jobs, context, _prepare, setting)
        try:
            for outcome in pool.map(_check, *zip(*tasks, strict=True), chunksize=1):
                if outcome is not None:
                    yield outcome
        finally:
            pool.shutdown(cancel_futures=True)


def table(outcomes: Sequence[Outcome]) -> list[str]:
    """The counts by kind, and what they come to."""
    head = f"| kind of change | tried | {' | '.join(ENDS)} | silent, % |"
    lines = [head, "| --- |" + " ---: |" * (len(ENDS) + 2)]
    claims = [outcome for outcome in outcomes if outcome.change.kind in CLAIMS]
    prose = [o for o in outcomes if o.change.kind not in {*CLAIMS, RELATIONS}]
    groups = [(k, [o for o in outcomes if o.change.kind == k]) for k in KINDS]
    statements = [o for o in outcomes if o.change.kind in {*CLAIMS, RELATIONS}]
    groups += [("**claims**", claims), ("**claims and relations**", statements)]
    groups += [("**prose**", prose), ("**all**", list(outcomes))]
    for name, group in groups:
        if group:
            ends = Counter(outcome.end for outcome in group)
            cells = " | ".join(str(ends[end] or "") for end in ENDS)
            share = 100 * ends["silent"] / len(group)
            lines.append(f"| {name} | {len(group)} | {cells} | {share:.1f} |")
    return lines


def alarms() -> str:
    """The false alarms of the last recorded run of `corpus.py`, in a sentence."""
    if not RESULT.is_file():
        return "No run of `corpus.py` is recorded, so nobody knows the false alarms."
    result = json.loads(RESULT.read_text("utf-8"))
    return (
        f"Of 10,000 words of public texts, {result['error']:.2f} false errors, "
        f"{result['warning']:.2f} false warnings and {result['hint']:.1f} hints "
        f"({result['words']:,} words, as `corpus.py` has recorded)."
    )


def describe(outcome: Outcome, old: str) -> Iterator[str]:
    """A change with the text before and after."""
    change = outcome.change
    line = old.count("\n", 0, change.start) + 1
    start = max(old.rfind("\n", 0, change.start) + 1, change.start - 60)
    end = min(old.find("\n", change.end) % (len(old) + 1), change.end + 30)
    before, after = old[start:end], old[start : change.start] + change.text + old[change.end : end]
    yield f"{outcome.end}: {change.kind} ({change.slip}, {change.place}) {change.path}:{line}"
    yield f"  - {before[:WIDTH]!r}"
    yield f"  + {after[:WIDTH]!r}"
    if outcome.note:
        yield f"  {outcome.note}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])  # type: ignore[union-attr]
    parser.add_argument("--seed", type=int, nargs="+", default=[37])
    parser.add_argument("--count", type=int, default=1200, help="changes for each seed")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, metavar="KIND")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--lessons", type=int, help="verify and change so many documents")
    parser.add_argument("--course", type=Path, default=ROOT)
    parser.add_argument("--list", nargs="*", choices=ENDS, default=["silent", "elsewhere"])
    arguments = parser.parse_args()
    course: Path = arguments.course.resolve()
    outcomes: list[Outcome] = []
    began = time.monotonic()
    shares = arguments.kinds, arguments.jobs, arguments.lessons
    for outcome in run(course, arguments.seed, arguments.count, *shares):
        outcomes.append(outcome)
        if outcome.end in arguments.list:
            old = (course / outcome.change.path).read_text("utf-8")
            print(*describe(outcome, old), sep="\n", flush=True)
        if time.monotonic() - began > arguments.minutes * 60:
            break
    print("", *table(outcomes), "", alarms(), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
