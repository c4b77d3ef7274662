"""The parts of a site's library, remembered document by document.

Entry point: `Parts`. `library(course)` puts together what is known of a course: nothing is worked
out again for a document that is the very same as before, and a result counts only for what it was
made from.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.checks.formulas import document_formulas, formula_findings
from coursebuild.diagnostics import Diagnostic
from coursebuild.effects.v8 import MathEngine
from coursebuild.effects.versions import engine_version, python_version
from coursebuild.model import (
    Bench,
    Course,
    Document,
    FeatureBlock,
    Lab,
    Lesson,
    Lexicon,
    Mjcf,
    Page,
    Recording,
    Script,
    document_blocks,
)
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.preview.memo import PerDocument
from coursebuild.render.asked import asked
from coursebuild.render.assets import Assets
from coursebuild.render.lab_files import LabFiles, PublishedLabs, lab_files
from coursebuild.render.library import (
    Library,
    NamedModels,
    Owner,
    course_scripts,
    document_scripts,
    lexicon_of,
    named_models,
    owners,
    place,
    references_of,
    uses_of,
)
from coursebuild.render.lookup.lexicon import misdeclared
from coursebuild.render.lookup.references import Mentions, mentions
from coursebuild.results import (
    CompileResult,
    Formula,
    LabResult,
    MathError,
    Results,
    ScriptJob,
    ScriptRun,
    Verdict,
)
from coursebuild.scripts.compare import verify
from coursebuild.scripts.extract import Extraction, jobs


class Ran(Struct, frozen=True):
    """A run, and what was run."""

    job: ScriptJob
    text: str
    run: ScriptRun
    again: str | None = None
    """What it printed when it was run once more, if it was."""


def extraction(script: Script, owner: Owner) -> Extraction:
    """A script of a course as the file that it becomes."""
    return Extraction(script.path, script.code.text.rstrip("\n") + "\n", script, owner.id)


class Parts:
    """What is known of a course and its documents."""

    def __init__(self, assets: Assets) -> None:
        self.runs: dict[str, Ran] = {}
        """By path; one counts as long as the script is what was run."""
        self.models: tuple[tuple[str, CompileResult], ...] = ()
        self.labs: tuple[LabResult, ...] = ()
        self.reports = Reports()
        self._assets = assets
        self._engine = MathEngine()
        self._formulas: dict[Formula, str | MathError] = {}
        self._wrong: set[Formula] = set()
        """Those that do not parse."""
        self._published = PublishedLabs({}, ())
        self._by_name: dict[str, LabFiles] = {}
        self._verdicts: dict[str, _Verdicts] = {}
        self._scripts_of = PerDocument(document_scripts)
        self._labs_of = PerDocument(_labs)
        self.has_models = PerDocument(_has_models)
        """Whether MJCF stands in a document, or what is held against compiled models."""
        self._formulas_of = PerDocument(document_formulas)
        self._lexicon_of = PerDocument(self._lexicon)
        self._asked_of = PerDocument(asked)
        self.models_of = PerDocument(named_models)
        """The models that a document names."""
        self.leans_on = PerDocument(_leans_on)
        """The scripts of which a document's page shows what they printed, or how they did."""

    def close(self) -> None:
        """Free the typesetter's memory."""
        self._engine.close()

    def library(self, course: Course) -> Library:
        """The library of a course with what is known of it."""
        runs = self.current(course)
        versions = python_version(), engine_version()
        return Library.made(
            course,
            Results(tuple(runs.values()), (), (), self.models, *versions),
            self._assets,
            scripts_of=self._scripts_of,
            models_of=self.models_of,
            mentions_of=lambda document: self.mentions(document, course),
            asked_of=self._asked_of,
            labs=self._labs(course),
            formulas=self._formulas,
            verdicts={place(v.recording): v for v in self.verdicts(course, runs)},
            reports=self.reports,
        )

    def verdicts(self, course: Course, runs: Mapping[str, ScriptRun]) -> tuple[Verdict, ...]:
        """How the recorded outputs compare with the runs, in order."""
        return tuple(
            verdict
            for document in course.documents
            for verdict in self._verdicts_of(course, document, runs)
        )

    def renewed(self, library: Library, course: Course, fresh: Sequence[Owner]) -> Library:
        """The library of a course of which only the documents of some owners are others.

        It costs no more for a large course than for a small one.
        """
        old = tuple(library.lessons.get(o.id) or library.pages[o.id] for o in fresh)
        before, after = (
            [script.path for o in owners for script in self._scripts(o)] for owners in (old, fresh)
        )
        scripts: Mapping[str, tuple[Script, Owner]]
        if before == after:
            scripts = {**library.scripts}
            for owner in fresh:
                for script in self._scripts(owner):
                    if library.scripts[script.path][1].id == owner.id:
                        scripts[script.path] = script, owner
        else:
            scripts = course_scripts(course, self._scripts_of)
        runs = {path: run for path, run in library.runs.items() if path in scripts}
        for path in {*before, *after} & scripts.keys():
            run = self._run_of(*scripts[path])
            runs.pop(path, None)
            if run is not None:
                runs[path] = run
        changed = {p for p in {*before, *after} if library.runs.get(p) is not runs.get(p)}
        documents = [o.document for o in fresh if o.document is not None]
        if changed:
            known = {document.source.path for document in documents}
            others = (d for d in course.documents if d.source.path not in known)
            documents += [d for d in others if not changed.isdisjoint(self.leans_on(d))]
        verdicts = self._renewed_verdicts(library, course, documents, runs)
        uses = library.uses
        if any(self._named(one) != self._named(two) for one, two in zip(old, fresh, strict=True)):
            uses = uses_of(course, self.models_of)
        references = library.references
        pairs = zip(old, fresh, strict=True)
        if any(self._said(a, course) != self._said(b, course) for a, b in pairs):
            references = references_of(course, lambda document: self.mentions(document, course))
            _ = references.symbols  # looked up now, where formulas can be typeset
        questions = library.asked
        if any(self._asks(one) != self._asks(two) for one, two in zip(old, fresh, strict=True)):
            now = {owner.path: self._asks(owner) for owner in fresh}
            questions = {path: text for path, text in {**questions, **now}.items() if text}
        lessons = {o.id: o for o in fresh if isinstance(o, Lesson)}
        levels = {o.level for o in lessons.values()}
        return replace(
            library,
            course=course,
            results=replace(library.results, runs=tuple(runs.values())),
            lessons={**library.lessons, **lessons},
            levels={**library.levels, **{v.id: v for v in course.levels if v.id in levels}},
            pages={**library.pages, **{o.id: o for o in fresh if isinstance(o, Page)}},
            order=course.lessons,
            scripts=scripts,
            runs=runs,
            uses=uses,
            references=references,
            asked=questions,
            labs=self._labs(course) if any(map(self._has_labs, (*old, *fresh))) else library.labs,
            verdicts=verdicts,
        )

    def _scripts(self, owner: Owner) -> tuple[Script, ...]:
        return () if owner.document is None else self._scripts_of(owner.document)

    def mentions(self, document: Document, course: Course) -> Mentions:
        """What a document says of others."""
        return mentions(document, course, self._lexicon_of(document))

    def _lexicon(self, document: Document) -> Lexicon:
        if document.lexicon is None:
            self.typeset([document])
        return lexicon_of(document, self._formulas)

    def _said(self, owner: Owner, course: Course) -> Mentions | None:
        return None if owner.document is None else self.mentions(owner.document, course)

    def _asks(self, owner: Owner) -> str:
        return "" if owner.document is None else self._asked_of(owner.document)

    def _named(self, owner: Owner) -> NamedModels | None:
        return None if owner.document is None else self.models_of(owner.document)

    def _has_labs(self, owner: Owner) -> bool:
        return owner.document is not None and self.has_labs(owner.document)

    def _renewed_verdicts(
        self,
        library: Library,
        course: Course,
        documents: Iterable[Document],
        runs: Mapping[str, ScriptRun],
    ) -> dict[tuple[str, int], Verdict]:
        """All verdicts, those of some documents anew."""
        paths = {document.source.path for document in documents}
        verdicts = {key: v for key, v in library.verdicts.items() if key[0] not in paths}
        for document in documents:
            found = self._verdicts_of(course, document, runs)
            verdicts |= {place(verdict.recording): verdict for verdict in found}
        return verdicts

    def current(self, course: Course) -> dict[str, ScriptRun]:
        """The runs of scripts that are still what was run."""
        scripts = course_scripts(course, self._scripts_of).items()
        found = ((path, self._run_of(script, owner)) for path, (script, owner) in scripts)
        return {path: run for path, run in found if run is not None}

    def _run_of(self, script: Script, owner: Owner) -> ScriptRun | None:
        ran = self.runs.get(script.path)
        if ran is None:
            return None
        now = extraction(script, owner)
        return ran.run if ran.text == now.text and (ran.job,) == jobs([now]) else None

    def _verdicts_of(
        self, course: Course, document: Document, runs: Mapping[str, ScriptRun]
    ) -> tuple[Verdict, ...]:
        wanted = tuple(runs[path] for path in self.leans_on(document) if path in runs)
        made_from = _MadeFrom(document, course, wanted)
        kept = self._verdicts.get(document.source.path)
        if kept is None or not kept.made_from.same(made_from):
            kept = _Verdicts(made_from, verify(_only(document, course), wanted))
            self._verdicts[document.source.path] = kept
        return kept.verdicts

    # --- labs

    def has_labs(self, document: Document) -> bool:
        """Whether there is a lab in a document."""
        return bool(self._labs_of(document))

    def take_labs(self, labs: tuple[LabResult, ...], published: PublishedLabs) -> None:
        """Take what trying the labs gave, and its files."""
        self.labs, self._published = labs, published
        self._by_name = {files.result.name: files for files in published.labs.values()}

    def publish(self, labs: tuple[LabResult, ...]) -> PublishedLabs:
        """The files of tried labs; their hashes take some milliseconds."""
        return lab_files(labs, self._assets)

    def _labs(self, course: Course) -> PublishedLabs:
        """The files of the labs where these stand now: a lab that moved stays the same."""
        if not self._by_name:
            return self._published
        found: dict[tuple[str, int], LabFiles] = {}
        for owner in owners(course):
            if owner.document is not None:
                for number, lab in enumerate(self._labs_of(owner.document), 1):
                    files = self._by_name.get(f"{owner.id}-lab-{number}")
                    if files is not None:
                        found[lab.span.path, lab.span.start] = files
        return PublishedLabs(found, self._published.files)

    # --- formulas

    def typeset(self, documents: Iterable[Document]) -> None:
        """Typeset what is new in these documents."""
        wanted = {formula for document in documents for formula in self._formulas_of(document)}
        new = sorted(wanted - self._formulas.keys(), key=lambda f: (f.tex, f.display))
        if new:
            made = dict(zip(new, self._engine.typeset(new), strict=True))
            self._formulas |= made
            self._wrong |= {f for f, result in made.items() if isinstance(result, MathError)}

    def untypeset(self, course: Course) -> tuple[Document, ...]:
        """The documents with formulas that no page has asked for yet."""
        known = self._formulas.keys()
        return tuple(d for d in course.documents if not known >= {*self._formulas_of(d)})

    def formula_mistakes(self, document: Document) -> tuple[Diagnostic, ...]:
        """The formulas of a document that do not parse, of those that were typeset."""
        told = misdeclared(document, self._formulas)
        if not self._wrong or self._wrong.isdisjoint(self._formulas_of(document)):
            return told
        made = {f: self._formulas[f] for f in self._formulas_of(document) if f in self._formulas}
        missing = {f: "" for f in self._formulas_of(document) if f not in made}
        return (*formula_findings(document, made | missing), *told)

    def forget_formulas(self, course: Course) -> None:
        """Let go of formulas that were written and taken back."""
        wanted = {f for document in course.documents for f in self._formulas_of(document)}
        if len(self._formulas) > 2 * len(wanted) + 1000:
            for formula in self._formulas.keys() - wanted:
                del self._formulas[formula]
            self._wrong &= wanted


class _MadeFrom(Struct, frozen=True):
    document: Document
    course: Course
    runs: tuple[ScriptRun, ...]

    def same(self, other: _MadeFrom) -> bool:
        one, two = self.course, other.course
        return (
            self.document is other.document
            and len(self.runs) == len(other.runs)
            and all(a is b for a, b in zip(self.runs, other.runs, strict=True))
            and (one.comparison, one.filters) == (two.comparison, two.filters)
        )


class _Verdicts(Struct, frozen=True):
    made_from: _MadeFrom
    verdicts: tuple[Verdict, ...]


def _only(document: Document, course: Course) -> Course:
    """The course, with nothing in it but one document."""
    page = Page(document.source.span(0, 0), "only", "", document.source.path, document)
    return replace(course, levels=(), pages=(page,))


def _labs(document: Document) -> tuple[Lab, ...]:
    return tuple(block for block in document_blocks(document) if isinstance(block, Lab))


def _has_models(document: Document) -> bool:
    blocks = document_blocks(document)
    return any(
        isinstance(b, Mjcf | Bench) or (isinstance(b, Lab) and b.xml is not None) for b in blocks
    )


def _leans_on(document: Document) -> tuple[str, ...]:
    found: set[str] = set()
    for block in document_blocks(document):
        if isinstance(block, Script):
            found.add(block.path)
        elif isinstance(block, Recording) and block.script is not None:
            found.add(block.script)
        elif isinstance(block, FeatureBlock):
            found |= {script for script, _ in block.quoted_lines()}
    return tuple(sorted(found))
