"""Documents whose outputs and bound numbers held are not compared again until something changes.

After an edit of one lesson of many, comparing the others would take longer than all else.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import TypeAlias

from coursebuild.core.engine.store import Store
from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import (
    Course,
    Document,
    NumberBinding,
    Recording,
    document_scripts,
    find_blocks,
    find_inlines,
)
from coursebuild.core.model.lesson_record import Address, Addresses, ShownValue
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.values import fingerprint

_KIND = "held"
OwnedDocument: TypeAlias = tuple[str, Document]
"""A document with the id of its lesson or page."""


_Printed: TypeAlias = tuple[tuple[ShownValue, tuple[Address, ...]], ...]
"""Where the values of a document were printed, in which all held."""


class HeldDocuments:
    """What is known of documents that held, given what scripts print now."""

    def __init__(
        self,
        course: Course,
        store: Store,
        outputs: PrintedOutputs,
        other_runs: Mapping[str, ScriptRun],
        addresses: Addresses,
    ) -> None:
        """See `verify`; to `addresses` those are added that are found now."""
        self._store, self._addresses = store, addresses
        self._outputs, self._other_runs = outputs, other_runs
        self._course_key = fingerprint(
            (
                (course.comparison, course.filters, course.callouts),
                (course.words, course.language, course.words_of(None).macros),
            )
        )
        self._known_addresses = self._by_document()
        self._keys: dict[str, str] = {}
        self._script_state = functools.cache(self._find_script_state)

    def leave_out(self, documents: Iterable[OwnedDocument]) -> list[OwnedDocument]:
        """The documents that are to be compared; the addresses of the others are taken over."""
        changed_documents = []
        for id, document in documents:
            scripts = {script.path for script in document_scripts(document)}
            scripts |= {recording.script or "" for recording in find_blocks(document, Recording)}
            scripts |= {binding.script or "" for binding in find_inlines(document, NumberBinding)}
            source = document.source
            key = self._keys[document.source.path] = step_key(
                "held outputs",
                self._course_key,
                id,
                (source.path, source.digest),
                self._known_addresses.get(source.path),
                [(path, self._script_state(path)) for path in sorted(scripts)],
            )
            entry = self._store.get_value(_KIND, key, _Printed)
            if entry is None:
                changed_documents.append((id, document))
            else:
                self._addresses |= dict(entry)
        return changed_documents

    def keep(self, documents: Iterable[OwnedDocument], findings: Iterable[Diagnostic]) -> None:
        """Note that these documents held, except where something was found."""
        found_paths = {finding.span.path for finding in findings}
        addresses = self._by_document()
        for path in (document.source.path for _, document in documents):
            if path not in found_paths:
                self._store.put_value(_KIND, self._keys[path], tuple(addresses.get(path, ())))

    def _by_document(self) -> dict[str, list[tuple[ShownValue, tuple[Address, ...]]]]:
        by_document: dict[str, list[tuple[ShownValue, tuple[Address, ...]]]] = {}
        for item in self._addresses.items():
            by_document.setdefault(item[0].path, []).append(item)
        return by_document

    def _find_script_state(self, path: str) -> str:
        """A hash of what a script printed, and of all outputs that are recorded of it."""
        runs = self._outputs.runs.get(path), self._other_runs.get(path)
        printed = [run and (run.outcome, run.stdout, run.part_starts) for run in runs]
        recorded = [
            (v.recording.span.path, v.recording.span.source.digest, v.comparison, v.row_addresses)
            for v in self._outputs.of_script(path)
        ]
        return fingerprint((path in self._outputs.scripts, printed, recorded))
