"""The outputs of a course: what is recorded of each script, and what it printed in this run."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence

from coursebuild.core import model
from coursebuild.core.model.results import ScriptRun, Verdict
from coursebuild.core.scripts.printed_text import PrintedText
from coursebuild.core.scripts.tables import TableMatcher, updated_row


class PrintedOutputs:
    """The recorded outputs of a course and the runs of its scripts."""

    def __init__(
        self, verdicts: Iterable[Verdict], runs: Iterable[ScriptRun], scripts: Iterable[str] = ()
    ) -> None:
        """`scripts` are the paths of all scripts of the course, run or not."""
        self.runs = {run.path: run for run in runs}
        self._by_script: dict[str, list[Verdict]] = {}
        self._by_document: dict[str, list[Verdict]] = {}
        self._texts: dict[tuple[str, int], PrintedText] = {}
        self._run_texts: dict[tuple[str, tuple[model.Filter, ...], int | None], PrintedText] = {}
        for verdict in verdicts:
            recording = verdict.recording
            if recording.script is not None:
                self._by_script.setdefault(recording.script, []).append(verdict)
                self._by_document.setdefault(recording.span.path, []).append(verdict)
        for document_verdicts in self._by_document.values():
            document_verdicts.sort(key=end_of_body)
        self.scripts = frozenset({*scripts, *self.runs, *self._by_script})
        """The paths of all scripts."""

    def of_document(self, document: model.Document) -> Sequence[Verdict]:
        """The recorded outputs of a document, in order."""
        return self._by_document.get(document.source.path, ())

    def of_script(self, path: str) -> Sequence[Verdict]:
        """The recorded outputs of a script, in any document."""
        return self._by_script.get(path, ())

    def of_binding(self, binding: model.NumberBinding) -> list[Verdict]:
        """The recorded outputs that a binding depends on; in a caption, that of the caption."""
        if binding.script is not None:
            return self._by_script.get(binding.script, [])
        verdicts = self._by_document.get(binding.span.path, [])
        for verdict in verdicts:
            if verdict.recording.caption_span.contains(binding.span):
                return [verdict]
        after = bisect_left(verdicts, binding.span.start + 1, key=end_of_body)
        return verdicts[after - 1 : after] if after else []

    def script_of(self, binding: model.NumberBinding) -> str | None:
        """The path of the script that a binding depends on."""
        verdicts = self.of_binding(binding)
        return binding.script or (verdicts[0].recording.script if verdicts else None)

    def text(self, verdict: Verdict) -> PrintedText:
        """The lines of a recorded output."""
        key = recording_key(verdict.recording)
        if key not in self._texts:
            filters = verdict.comparison.own_filters
            self._texts[key] = PrintedText.of_recording(verdict.recording, filters)
        return self._texts[key]

    def updated_text(self, verdict: Verdict) -> PrintedText:
        """The lines of a recorded output as `update` writes it."""
        recording, comparison = verdict.recording, verdict.comparison
        if isinstance(body := recording.body, model.Table):
            printed = self.runs[recording.script or ""].output_of(recording.part)
            rows = TableMatcher(body, comparison, printed, verdict.row_addresses).match().rows
            return PrintedText.of_rows(body, [updated_row(row, comparison) for row in rows])
        return self.text_of_run(recording.script or "", comparison.own_filters, recording.part)

    def text_of_run(
        self, path: str, filters: Sequence[model.Filter], part: int | None = None
    ) -> PrintedText:
        """The lines that a script, or a part of it, printed in this run."""
        key = path, tuple(filters), part
        if key not in self._run_texts:
            run = self.runs[path]
            printed = run.stdout if part is None else run.output_of(part)
            self._run_texts[key] = PrintedText.of_run(printed, filters)
        return self._run_texts[key]


def end_of_body(verdict: Verdict) -> int:
    """Where a recorded output ends."""
    return verdict.recording.body_span.end


def recording_key(recording: model.Recording) -> tuple[str, int]:
    """A key that tells the recorded outputs of a course apart."""
    return recording.span.path, recording.body_span.start
