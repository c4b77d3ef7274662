"""What a check without errors proved of each lesson, and what of it is proved no longer.

A slip may leave a text that is right, but says less: without its caption an output is a block of
text, without its brace a bound number is code. Nobody can see that in the text. But what was proved
at the last check without errors, still stands in the text, and is proved no longer, is a fact.

Entry points: `find_proofs`, `find_losses`; `remarks_on_proofs`, which `check` ends with.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.engine.store import Store, value_reader
from coursebuild.core.model import (
    Course,
    Document,
    Link,
    Recording,
    Table,
    UrlTarget,
    find_blocks,
    find_inlines,
)
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.registry import feature_trials
from coursebuild.core.scripts.bound_places import document_bindings
from coursebuild.core.text.source import Source, Span
from coursebuild.core.values import fingerprint
from coursebuild.report.values import plural

Kind: TypeAlias = Literal["output", "table", "value", "figure", "lab", "link"]
KIND = "proofs"
"""That of entries of the store: what was proved of a document, by the hash of its path."""


_OPAQUE = re.compile(r"[A-Za-z][\w+.-]*:(?!//)")
"""An address that nothing looks up, as `mailto:` and a misspelt `lesson:`."""


class Proof(Struct, frozen=True):
    """Something that was proved of a document."""

    kind: Kind
    text: str
    """What of it stands in the document, on one line."""
    script: str = ""
    """The path of the script that proves it, if that is one."""
    count: int = 1
    """How often the text stood in the document."""
    line: int = 0
    """The line where it stood."""
    label: str = ""
    """What readers see of a link, in its brackets: it stays where its address is misspelt."""
    labels: int = 0
    """How often the label stood in the document."""

    def describe(self) -> str:
        """What it is called in a report."""
        match self.kind:
            case "value":
                return f"`{self.text}`"
            case "figure":
                return f"the figure `{self.text}`"
            case "lab":
                return "the lab"
            case "link":
                return f"the link to `{self.text}`"
            case "output" | "table":
                return f"the {self.kind} of `{self.script}`"


class Loss(Struct, frozen=True):
    """Something that was proved, and is proved no longer."""

    proof: Proof
    span: Span
    """Where it stands."""


class _ProvedText(Struct, frozen=True):
    """A proof with its place."""

    proof: Proof
    span: Span


def find_proofs(
    course: Course, scripts: Collection[str] | None = None
) -> dict[str, tuple[Proof, ...]]:
    """What a check without errors has proved, by document.

    `scripts` are those that were run; of others nothing is proved. `None`: all.
    """
    return {
        path: tuple(proved.proof for proved in texts)
        for path, texts in _proved_texts(course, scripts).items()
    }


def find_losses(course: Course, path: str, before: Sequence[Proof]) -> Iterator[Loss]:
    """What was proved of a document before, still stands in it, and is proved no longer."""
    texts = _proved_texts(course, None).get(path)
    document = next((d for d in course.documents if d.source.path == path), None)
    if texts is None or document is None:
        return
    now = Counter(_identity(proved.proof) for proved in texts)
    spans = [proved.span for proved in texts]
    for proof in before:
        if now[_identity(proof)]:
            now[_identity(proof)] -= 1
            continue
        for text, count in ((proof.text, proof.count), (proof.label, proof.labels)):
            places = [*_places(document.source, text)] if text else []
            free = [p for p in places if not any(span.contains(p) for span in spans)]
            if free and len(places) >= count:
                yield Loss(proof, min(free, key=lambda place: abs(place.line - proof.line)))
                break


def remarks_on_proofs(
    course: Course,
    store: Store,
    scripts: Collection[str],
    documents: Collection[str] | None,
    *,
    is_green: bool,
) -> tuple[str, ...]:
    """Say what is proved no longer; without errors, keep what is proved now.

    `documents` are the paths of those that were checked; `None`: all.
    """
    remarks = []
    proofs = find_proofs(course, scripts)
    for owner, document in course.owned_documents:
        path = document.source.path
        if documents is not None and path not in documents:
            continue
        key = fingerprint(path)
        before = store.peek(KIND, key, value_reader(tuple[Proof, ...])) or ()
        losses = [
            f"{loss.proof.describe()} in line {loss.span.line}"
            for loss in find_losses(course, path, before)
        ]
        if losses:
            verb = "was proved before and is not now"
            if losses[1:]:
                verb = "were proved before and are not now"
            counts = Counter(proof.kind for proof in proofs[path]).items()
            rest = ", ".join(plural(count, kind) for kind, count in counts) or "nothing"
            remarks.append(f"{owner.id}: {' and '.join(losses)} {verb} (proved: {rest})")
        if is_green and proofs[path] != before:
            store.put_value(KIND, key, proofs[path])
    return tuple(remarks)


def _identity(proof: Proof) -> tuple[Kind, str, str]:
    return proof.kind, proof.text, proof.script


def _proved_texts(
    course: Course, scripts: Collection[str] | None
) -> dict[str, tuple[_ProvedText, ...]]:
    texts = {d.source.path: [*_of_document(d, scripts)] for d in course.documents}
    for _, trial in feature_trials(course).values():
        span = trial.block.span
        if span.path in texts:  # not in a model's file
            texts[span.path].append(_proved("lab", _longest_line(span.text), span))
    return {path: tuple(texts_of_path) for path, texts_of_path in texts.items()}


def _of_document(document: Document, scripts: Collection[str] | None) -> Iterator[_ProvedText]:
    def is_run(script: str | None) -> bool:
        return script is not None and (scripts is None or script in scripts)

    recordings = [r for r in find_blocks(document, Recording) if r.readable and is_run(r.script)]
    for recording in recordings:
        kind: Kind = "table" if isinstance(recording.body, Table) else "output"
        text = _longest_line(recording.body_span.text)
        if text:
            yield _proved(kind, text, recording.span, recording.script or "")
    for binding in document_bindings(document):
        above = [r.script for r in recordings if r.body_span.end <= binding.span.start]
        if is_run(binding.script or (above[-1] if above else None)):
            yield _proved("value", binding.text, binding.span)
    for figure in recorded_figures(document):
        if is_run(figure.script):
            yield _proved("figure", figure.name, figure.span, figure.script)
    for link in find_inlines(document, Link):
        text = link.target_span.text
        is_opaque = isinstance(link.target, UrlTarget) and _OPAQUE.match(text)
        if not link.mention and text and not is_opaque:
            yield _proved("link", text, link.span)


def _proved(kind: Kind, text: str, span: Span, script: str = "") -> _ProvedText:
    label = span.text.partition("](")[0] + "]" if kind == "link" and span.text[:1] == "[" else ""
    places = [*_places(span.source, text)]
    place = next(filter(span.contains, places), span)
    labels = [*_places(span.source, label)] if label else []
    proof = Proof(kind, text, script, len(places), place.line, label, len(labels))
    return _ProvedText(proof, span)


def _longest_line(text: str) -> str:
    return max((line.strip() for line in text.splitlines()), key=len, default="")


def _places(source: Source, text: str) -> Iterator[Span]:
    """Where a text stands in a source, not as a part of a longer word or number."""
    at = source.text.find(text)
    while at >= 0:
        end = at + len(text)
        signs = source.text[at - 1 : at], source.text[end : end + 1]
        if text[0] == "[" or not any(sign.isalnum() for sign in signs):
            yield source.span(at, end)
        at = source.text.find(text, end)
