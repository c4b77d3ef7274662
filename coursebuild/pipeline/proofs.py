"""What a check without errors proved of each lesson, and what of it is proved no longer.

A slip may leave a text that is right, but says less: without its caption an output is a block of
text, without its brace a bound number is code. Nobody can see that in the text. But what was proved
at the last check without errors, still stands in the text, and is proved no longer, is a fact. So
is that a bound number gave way to another one, which is printed elsewhere or with fewer digits.

Entry points: `proved_texts`, `find_losses`; `remarks_on_proofs`, which `check` ends with.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from textwrap import shorten
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.engine.store import Store, value_reader
from coursebuild.core.model import (
    Course,
    Document,
    FeatureBlock,
    Heading,
    Link,
    Mjcf,
    Recording,
    Table,
    UrlTarget,
    find_blocks,
    find_inlines,
)
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.lesson_record import known_addresses
from coursebuild.core.registry import feature_trials, features
from coursebuild.core.scripts.bound_places import document_bindings, moved_values
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Source, Span
from coursebuild.core.values import fingerprint
from coursebuild.pipeline.verify import Verification
from coursebuild.report.values import Report, plural

Kind: TypeAlias = Literal[
    "output", "table", "value", "figure", "lab", "block", "section", "link", "formula"
]
KIND = "proofs"
"""That of entries of the store: what was proved of a document, by the hash of its path."""
_OPAQUE = regex(r"[A-Za-z][\w+.-]*:(?!//)")
"""An address that nothing looks up, as `mailto:` and a misspelt `lesson:`."""
_FENCE = regex(r"(?:`{3,}|~{3,})[ ]*(?P<word>[\w-]+)")
_TRIED = frozenset(("lab", "exercise"))
"""Blocks that are proved by a trial."""


class Proof(Struct, frozen=True):
    """Something that was proved of a document."""

    kind: Kind
    name: str
    """What it is called in a report."""
    text: str
    """What of it stands in the document, on one line."""
    script: str = ""
    """The path of the script that proves it, if that is one."""
    count: int = 1
    """How often the text stood in the document."""
    line: int = 0
    """The line where it stood."""
    label: str = ""
    """What stays where its text is misspelt: a link's words in their brackets, the number of a
    value, the first side of a formula."""
    labels: int = 0
    """How often the label stood in the document."""


def remarks_on_proofs(
    course: Course,
    store: Store,
    verification: Verification,
    documents: Collection[str] | None,
    report: Report,
) -> tuple[str, ...]:
    """Say what is proved no longer or elsewhere; without errors, keep what is proved now.

    `documents` are the paths of those that were checked; `None`: all. A formula in whose line
    the report tells a mistake is not named as well.
    """
    remarks = []
    spans = [diagnostic.span for diagnostic in report.diagnostics]
    lines = {(span.path, n) for span in spans for n in range(span.line, span.end_line + 1)}
    results = verification.results
    addresses = known_addresses(course.records)
    outputs = PrintedOutputs(results.verdicts, results.runs)
    scripts = {run.path for run in results.runs if run.did_run}
    owned_documents = [
        (owner, document)
        for owner, document in course.owned_documents
        if documents is None or document.source.path in documents
    ]
    all_texts = proved_texts(course, (document for _, document in owned_documents))
    for owner, document in owned_documents:
        path, texts = document.source.path, all_texts[document.source.path]
        proofs = tuple(proof for proof, _, script in texts if script is None or script in scripts)
        for move in moved_values(document, outputs, addresses, verification.addresses):
            remarks.append(f"{owner.id}: {move}")
        key = fingerprint(path)
        before = store.peek(KIND, key, value_reader(tuple[Proof, ...])) or ()
        losses = [
            f"{proof.name} in line {line}"
            for proof, line in find_losses(document.source, texts, before)
            if proof.kind != "formula" or (path, line) not in lines
        ]
        if losses:
            verb = "was proved before and is not now"
            if losses[1:]:
                verb = "were proved before and are not now"
            counts = Counter(proof.kind for proof in proofs).items()
            rest = ", ".join(plural(count, kind) for kind, count in counts) or "nothing"
            remarks.append(f"{owner.id}: {' and '.join(losses)} {verb} (proved: {rest})")
        if report.summary.ok and proofs != before:
            store.put_value(KIND, key, proofs)
    return tuple(remarks)


ProvedText: TypeAlias = tuple[Proof, Span, str | None]
"""A proof, its place, and the script that has to run for it, if one has."""


def proved_texts(course: Course, documents: Iterable[Document]) -> dict[str, list[ProvedText]]:
    """What is proved of documents where all scripts run, by their paths."""
    texts = {d.source.path: [*_of_document(d)] for d in documents}
    for _, trial in feature_trials(course).values():
        span = trial.block.span
        if span.path in texts:  # not in a model's file
            texts[span.path].append(_proved("lab", "the lab", _fenced_line(span), span))
    return texts


def find_losses(
    source: Source, texts: Sequence[ProvedText], before: Iterable[Proof]
) -> Iterator[tuple[Proof, int]]:
    """What was proved before, still stands in the text, and is proved no longer; with its line."""
    now = Counter(_identity(proof) for proof, _, _ in texts)
    for proof in before:
        if now[_identity(proof)]:
            now[_identity(proof)] -= 1
            continue
        # What a title of a section holds is proved for itself.
        spans = [s for p, s, _ in texts if p.kind != "section" or proof.kind == "section"]
        for text, count in ((proof.text, proof.count), (proof.label, proof.labels)):
            places = [*_places(source, text)] if text else []
            free = [p for p in places if not any(span.contains(p) for span in spans)]
            if free and len(places) >= count:
                yield proof, min((p.line for p in free), key=lambda line: abs(line - proof.line))
                break


def _identity(proof: Proof) -> tuple[Kind, str, str, str]:
    return proof.kind, proof.text, proof.script, proof.label


def _of_document(document: Document) -> Iterator[ProvedText]:
    recordings = [r for r in find_blocks(document, Recording) if r.readable and r.script]
    for recording in recordings:
        kind: Kind = "table" if isinstance(recording.body, Table) else "output"
        text, script = _longest_line(recording.body_span.text), recording.script or ""
        if text:
            yield _proved(kind, f"the {kind} of `{script}`", text, recording.span, script)
    for binding in document_bindings(document):
        above = [r.script for r in recordings if r.body_span.end <= binding.span.start]
        if binding_script := binding.script or (above[-1] if above else None):
            text, label = binding.text, binding.text.partition(" ")[0]
            yield _proved("value", f"`{text}`", text, binding.span, binding_script, label)
    for figure in recorded_figures(document):
        name = f"the figure `{figure.name}`"
        yield _proved("figure", name, figure.name, figure.span, figure.script)
    for block in (*find_blocks(document, FeatureBlock), *find_blocks(document, Mjcf)):
        fence = _FENCE.match(block.span.text)
        if fence is not None and fence["word"] not in _TRIED:
            name = f"the block `{fence['word']}`"
            yield _proved("block", name, _fenced_line(block.span), block.span)
    for heading in find_blocks(document, Heading):
        title = _longest_line(heading.span.text.rpartition("{")[0].lstrip("# \t"))
        if heading.goes_further and title:
            yield _proved("section", f"the optional section `{title}`", title, heading.span)
    for sides in (p for f in features() if f.proofs is not None for p in f.proofs(document)):
        label, text = (side.text.strip() for side in sides)
        whole = document.source.span(sides[0].start, sides[1].end)
        first = document.source.span(sides[0].start, sides[1].start).text.strip()
        if not first.isalnum():  # else it may stand in any sentence: only with its sign
            label = first
        name = f"the formula `{shorten(whole.text, 80, placeholder='…')}`"
        yield _proved("formula", name, text, whole, label=label)
    for link in find_inlines(document, Link):
        text = link.target_span.text
        is_opaque = isinstance(link.target, UrlTarget) and _OPAQUE.match(text)
        if not link.mention and text and not is_opaque:
            label = link.span.text.partition("](")[0] + "]"
            yield _proved("link", f"the link to `{text}`", text, link.span, label=label)


def _proved(
    kind: Kind, name: str, text: str, span: Span, script: str | None = None, label: str = ""
) -> ProvedText:
    places = [*_places(span.source, text)]
    place = next(filter(span.contains, places), span)
    labels = [*_places(span.source, label)] if label else []
    proof = Proof(kind, name, text, script or "", len(places), place.line, label, len(labels))
    return proof, span, script


def _fenced_line(span: Span) -> str:
    """The longest line of a fenced block, of the first one what stands behind its word."""
    return _longest_line(_FENCE.sub("", span.text))


def _longest_line(text: str) -> str:
    return max((line.strip() for line in text.splitlines()), key=len, default="")


def _places(source: Source, text: str) -> Iterator[Span]:
    """Where a text stands in a source, not as a part of a longer word or number."""
    at = source.text.find(text)
    while at >= 0:
        end = at + len(text)
        edges = source.text[max(at - 1, 0) : at + 1], source.text[end - 1 : end + 1]
        if not any(edge.isalnum() and len(edge) > 1 for edge in edges):
            yield source.span(at, end)
        at = source.text.find(text, end)
