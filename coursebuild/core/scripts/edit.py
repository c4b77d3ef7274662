"""A new output, put into the lesson by span.

Entry points: `updated_body` (what to write into one recorded output), `adopted` (an extracted file
that was edited), `apply_edits`.

1. A recording that matches is left alone; it must match both of two runs. A volatile one takes the
   text of the first run, where that differs in more than its numbers.
2. The new lines of a fence are those of the first run. Lines with `...`, and lines that match only
   after a filter, stay as the author wrote them. Line ends and what stands before each line (`> `,
   indentation) are those of the lesson.
3. What was made is compared with both runs before it is offered: an output that differs from run to
   run, or that the lesson's text cannot hold, is refused with the reason.

Tables are brought up to date number by number: see `tableedit`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from coursebuild.core.model import Comparison, Filter, Mode, Recording, Script, Table
from coursebuild.core.scripts.align import Step, StepKind, align, same_lines
from coursebuild.core.scripts.lines import ELLIPSIS, LineMatcher
from coursebuild.core.scripts.mapped_text import Side, replaced
from coursebuild.core.scripts.repeat import unstable
from coursebuild.core.scripts.tableedit import updated_table
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.core.text.source import Excerpt, Span

_FENCE = re.compile(r"`{3,}|~{3,}")


def apply_edits(text: str, edits: Iterable[Edit]) -> str:
    """The text with edits applied by offset.

    Raises `ValueError` for edits that overlap, stand at the same place, or belong to another text:
    each is a bug of whoever made them.
    """
    places: list[tuple[int, int, str]] = []
    for edit in sorted(edits, key=lambda edit: (edit.span.start, edit.span.end)):
        start, end = edit.span.start, edit.span.end
        if edit.span.source.text != text:
            raise ValueError(f"an edit of another text than {edit.span.path} is now")
        if places and (start < places[-1][1] or (start, end) == places[-1][:2]):
            raise ValueError(f"edits overlap at offset {start} of {edit.span.path}")
        places.append((start, end, edit.text))
    return replaced(text, places)


def updated_body(
    recording: Recording,
    comparison: Comparison,
    filters: tuple[Filter, ...],
    first: str,
    second: str,
) -> Edit | Diagnostic | None:
    """What to write into a recording whose script printed `first` and then, run again, `second`.

    `None` where it matches already; a diagnostic where it cannot be brought up to date.
    """
    if not first.strip():
        return refusal(recording.caption_span, "the script printed nothing to record", "")
    if isinstance(recording.body, Table):
        return updated_table(recording, recording.body, comparison, filters, first, second)
    body, filters = recording.body, (*filters, *comparison.filters)
    if comparison.mode is Mode.VOLATILE:
        before, now = Side.of(body.text).lines, Side.of(first).lines
        alike = LineMatcher(comparison).alike
        if len(before) == len(now) and all(map(alike, before, now)):
            return None
        return _fence_edit(recording, now)
    recorded, ran, again = (Side.of(text, filters) for text in (body.text, first, second))
    lines: list[str] | Diagnostic
    if same_lines(recorded, ran, comparison):
        if same_lines(recorded, again, comparison):
            return None
        return unstable(recording, recorded, again, comparison)
    lines = _new_lines(body, recorded, ran, comparison, filters)
    if isinstance(lines, Diagnostic):
        return lines
    new = Side.of("\n".join(lines), filters)
    if not same_lines(new, again, comparison):
        return unstable(recording, new, again, comparison)
    return _fence_edit(recording, lines)


def refusal(span: Span, message: str, help_text: str, label: str = "") -> Diagnostic:
    """An output that cannot be brought up to date."""
    return diagnose("output-not-updatable", span, message, label=label, help=help_text)


# ------------------------------------------------------------------------------------ new lines


def _new_lines(
    body: Excerpt,
    recorded: Side,
    ran: Side,
    comparison: Comparison,
    filters: tuple[Filter, ...],
) -> list[str] | Diagnostic:
    """The lines to record; they match the run."""
    printed = list(Side.of(ran.raw).lines)
    tries: list[list[str]] = []
    if filters or comparison.ellipsis:
        kept = _Kept(body, recorded, ran, LineMatcher(comparison)).lines()
        if isinstance(kept, Diagnostic):
            return kept
        tries.append(kept)
    if not comparison.ellipsis:
        tries.append(printed)
    for lines in tries:
        if same_lines(Side.of("\n".join(lines), filters), ran, comparison):
            return lines
    return refusal(
        body.span().first_line(),
        "no text was found that matches what the script prints",
        "bring it up to date by hand: a `...` or a filter stands in the way",
    )


class _Kept:
    """Builds new lines around what the author wrote on purpose."""

    def __init__(self, body: Excerpt, recorded: Side, ran: Side, matcher: LineMatcher) -> None:
        self.body, self.recorded, self.ran, self.matcher = body, recorded, ran, matcher

    def lines(self) -> list[str] | Diagnostic:
        steps = align(self.recorded, self.ran, self.matcher)
        lines: list[str] = []
        for index, step in enumerate(steps):
            made = self._of_step(step, steps, index)
            if isinstance(made, Diagnostic):
                return made
            lines += made
        return lines

    def _of_step(self, step: Step, steps: Sequence[Step], index: int) -> Iterable[str] | Diagnostic:
        match step.kind:
            case StepKind.SAME:
                if self._on_purpose(step):
                    return self.recorded.raw_lines(step.recorded)
                return self.ran.raw_lines(step.ran)
            case StepKind.DIFFERS:
                if self.matcher.elides(self.recorded.lines[step.recorded]):
                    return self._with_numbers(step)
                return self.ran.raw_lines(step.ran)
            case StepKind.MISSING:
                if _beside_elided(steps, index):
                    return self._refusal(step.recorded, "this line was not printed where `...` is")
                return ()
            case StepKind.EXTRA:
                return self.ran.raw_lines(step.ran)
            case StepKind.ELLIPSIS:
                return self.recorded.raw_lines(step.recorded)
            case StepKind.ELIDED:
                return ()

    def _on_purpose(self, step: Step) -> bool:
        """Whether a line that matches does so by an ellipsis or a filter."""
        text = self.recorded.lines[step.recorded]
        return (
            self.matcher.elides(text)
            or self.recorded.raw_lines(step.recorded) != (text,)
            or self.ran.raw_lines(step.ran) != (self.ran.lines[step.ran],)
        )

    def _with_numbers(self, step: Step) -> Iterable[str] | Diagnostic:
        """A line with `...` that fits but for its numbers, with the numbers of the run."""
        text = self.recorded.lines[step.recorded]
        pairs = self.matcher.pairs(text, self.ran.lines[step.ran])
        if pairs is None or self.recorded.raw_lines(step.recorded) != (text,):
            return self._refusal(step.recorded, "this line no longer fits what the script prints")
        others = ((a.start, a.end, b.text) for a, b in pairs if not self.matcher.same(a, b))
        return (replaced(text, others),)

    def _refusal(self, line: int, label: str) -> Diagnostic:
        start, end = self.recorded.origin(line, 0, len(self.recorded.lines[line]))
        return refusal(
            self.body.span(start, end),
            f"an output with `{ELLIPSIS}` cannot be brought up to date here",
            f"write the line anew by hand, or take the `{ELLIPSIS}` away and update again",
            label,
        )


def _beside_elided(steps: Sequence[Step], index: int) -> bool:
    """Whether lines are elided between the pairs of lines around a step."""
    for places in (range(index - 1, -1, -1), range(index + 1, len(steps))):
        for kind in (steps[at].kind for at in places):
            if kind is StepKind.ELIDED:
                return True
            if kind in (StepKind.SAME, StepKind.DIFFERS):
                break
    return False


# ---------------------------------------------------------------------------------------- fences


def _fence_edit(recording: Recording, lines: Sequence[str]) -> Edit | Diagnostic:
    """Replace the lines between the fences; refused where a fence cannot hold them."""
    fence = _opening_fence(recording.body_span)
    for number, line in enumerate(lines, start=1):
        if "\x00" in line:
            return refusal(
                fence,
                f"line {number} of the output has a NUL character, which Markdown cannot hold",
                "print text only",
            )
    longest = _longest_marks(lines, fence.text)
    if longest:
        marks = "backticks" if fence.text[0] == "`" else "tildes"
        return refusal(
            fence,
            "the output has a line that would close this fence, or begin another",
            f"open and close it with {longest + 1} {marks}, then update again",
        )
    return whole_lines(recording.body_span, recording.prefix, lines)


def adopted(script: Script, data: bytes) -> Edit | Diagnostic:
    """What to write into the block so that it extracts to `data`; a diagnostic where it cannot be.

    The lesson's line ends and what stands before each line of the block are kept.
    """

    def impossible(why: str) -> Diagnostic:
        message = f"{script.path} cannot be brought into the lesson: {why}"
        return diagnose("example-edited", script.path_span, message, help="bring it over by hand")

    text = block_text(data)
    if text is None:
        return impossible("it is not UTF-8")
    if text == "\n":
        return impossible("it is empty")
    lines = text.removesuffix("\n").split("\n")
    if _longest_marks(lines, _opening_fence(script.body_span).text):
        return impossible("one of its lines would close the fence, or begin another")
    if "\0" in text:
        return impossible("it holds a NUL")
    return whole_lines(script.body_span, script.prefix, lines)


def block_text(data: bytes) -> str | None:
    """A file as a block can hold it; `None` where it is not UTF-8.

    Without a byte order mark, with LF line ends, and one at the end.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\n") + "\n"


def _opening_fence(body: Span) -> Span:
    """The marks that open the fence whose lines these are."""
    line = body.source.position(body.start - 1)[0]
    found = _FENCE.search(body.source.text, body.source.line_starts[line - 1], body.start)
    assert found is not None
    return Span(body.source, *found.span())


def _longest_marks(lines: Sequence[str], fence: str) -> int:
    """The number of marks of the longest line that would close a fence, or begin another in it."""
    marks = re.compile(rf" {{0,3}}({re.escape(fence[0])}{{{len(fence)},}})(?:[ \t]*| *\w[^`]*)")
    found = (marks.fullmatch(line) for line in lines)
    return max((len(one[1]) for one in found if one), default=0)


def whole_lines(body: Span, prefix: str, lines: Sequence[str]) -> Edit:
    """New lines in a fence, with the line ends of the lesson and what stands before each line."""
    before = body.source.text[: body.start]
    line_end = "\r\n" if before.endswith("\r\n") else "\r" if before.endswith("\r") else "\n"
    written = (prefix + line if line else prefix.rstrip() for line in lines)
    return Edit(body, "".join(line + line_end for line in written))
