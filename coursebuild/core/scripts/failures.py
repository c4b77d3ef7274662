"""What to say about a script that did not run to its end.

Entry points: `failure` (a run), `silence` (an output is recorded and nothing was printed),
`in_lessons` (a text with the paths of extracted files made places of lessons).

A traceback's frames are read out of the standard error: each line of an extracted file is the line
of a lesson, and the innermost such line is what the diagnostic points at. Of a script that does not
parse nothing is said: the reader of its lesson has told it.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from typing import assert_never

from coursebuild.core.model import Recording
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.diff import shortened
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.source import Span

_FRAME = pattern(r'File "(?P<path>[^"\n]+)", line (?P<line>\d{1,9})')
_WARNING = pattern(r"^(?P<path>[^\n]*?\.py):(?P<line>\d{1,9})(?=: )", re.MULTILINE)
_THREAD = pattern(r"(?<=\b[Tt]hread )0x[0-9a-f]+ (?:\[[^\]\n]*\] )?")
_COLOURS = pattern(r"\x1b\[[0-9;]*[A-Za-z]")
_CRASH = "Current thread "
_ABORTED = "Fatal Python error: Aborted\n\n"
"""What Python says when it is asked, at the end of its time, where it is."""
_LIBRARIES = ("site-packages", "dist-packages")

_SIGNALS = {
    1: "SIGHUP",
    2: "SIGINT",
    3: "SIGQUIT",
    4: "SIGILL",
    5: "SIGTRAP",
    6: "SIGABRT",
    7: "SIGBUS",
    8: "SIGFPE",
    9: "SIGKILL",
    11: "SIGSEGV",
    13: "SIGPIPE",
    14: "SIGALRM",
    15: "SIGTERM",
    24: "SIGXCPU",
    25: "SIGXFSZ",
    31: "SIGSYS",
}
"""As Linux numbers them (signal(7))."""

_TAIL_LINES = 30
_TAIL_CHARACTERS = 4000
_LABEL = 120


class _Lessons:
    """Finds the lesson's line for a line of an extracted file, wherever that file lies."""

    def __init__(self, extractions: Iterable[Extraction]) -> None:
        self._by_path = {extraction.path: extraction for extraction in extractions}

    def innermost(self, stderr: str) -> tuple[Extraction, Span] | None:
        """The script and the lesson's line where a traceback or a crash dump ends."""
        dump = stderr.rfind(_CRASH)
        for found in _FRAME.finditer(stderr, dump) if dump >= 0 else reversed(_frames(stderr)):
            extraction, span = self._find(found)
            if extraction is not None and span is not None:
                lead = len(span.text) - len(span.text.lstrip())
                return extraction, Span(span.source, span.start + lead, span.end)
        return None

    def place(self, found: re.Match[str]) -> Span | None:
        """The lesson's line of a frame."""
        return self._find(found)[1]

    def _find(self, found: re.Match[str]) -> tuple[Extraction | None, Span | None]:
        parts = found["path"].replace("\\", "/").split("/")
        if any(library in parts for library in _LIBRARIES):
            return None, None
        for first in range(len(parts)):
            extraction = self._by_path.get("/".join(parts[first:]))
            if extraction is not None:
                return extraction, extraction.line_span(int(found["line"]))
        return None, None


def _frames(stderr: str) -> list[re.Match[str]]:
    return list(_FRAME.finditer(stderr))


def in_lessons(text: str, extractions: Iterable[Extraction]) -> str:
    """The text with `File "…/examples/x.py", line 12` made the lesson's path and line."""
    return _in_lessons(text, _Lessons(extractions))


def _in_lessons(text: str, lessons: _Lessons) -> str:
    def frame(found: re.Match[str]) -> str:
        span = lessons.place(found)
        return found.group() if span is None else f'File "{span.path}", line {span.line}'

    def warning(found: re.Match[str]) -> str:
        span = lessons.place(found)
        return found.group() if span is None else f"{span.path}:{span.line}"

    return _WARNING.sub(warning, _FRAME.sub(frame, text))


def failure(
    extraction: Extraction, run: ScriptRun, extractions: Iterable[Extraction]
) -> Diagnostic | None:
    """What is wrong with a run; `None` for one that ended well or was not to be made."""
    path = f"`{extraction.path}`"
    fence = extraction.script.span.first_line()
    match run.outcome:
        case Outcome.OK | Outcome.SKIPPED | Outcome.NORUN:
            return None
        case Outcome.FAILED:
            message = f"{path} exited with status {run.status}"
            return _crash("script-failed", extraction, run, extractions, message)
        case Outcome.KILLED:
            message = f"{path} was ended by {_signal_name(run.status)}"
            return _crash("script-killed", extraction, run, extractions, message)
        case Outcome.TIMEOUT:
            limit = f"{extraction.script.timeout:g}"
            message = f"{path} was stopped after {limit} s, its time limit"
            return _crash("script-timeout", extraction, run, extractions, message)
        case Outcome.OUTPUT_LIMIT:
            return diagnose(
                "script-output-limit",
                fence,
                f"{path} printed more than 1 MiB",
                help="print less: a recorded output is to be read",
                notes=_stderr_notes(run, _Lessons(extractions)),
            )
        case Outcome.ENCODING:
            return diagnose(
                "script-encoding",
                fence,
                f"{path} printed bytes that are not UTF-8",
                help="print text; `sys.stdout.buffer` takes bytes as they are",
                notes=_stderr_notes(run, _Lessons(extractions)),
            )
        case _:
            assert_never(run.outcome)


def silence(recording: Recording, path: str) -> Diagnostic:
    """An output is recorded, and the script printed no line."""
    return diagnose(
        "script-silent",
        recording.caption_span,
        f"an output is recorded here and `{path}` printed nothing",
        help="print what is recorded, or take the recorded output away",
    )


def _signal_name(number: int) -> str:
    return _SIGNALS.get(number, f"signal {number}")


def _crash(
    rule: str,
    extraction: Extraction,
    run: ScriptRun,
    extractions: Iterable[Extraction],
    message: str,
) -> Diagnostic | None:
    """A diagnostic at the innermost line of the traceback that lies in a lesson."""
    lessons = _Lessons(extractions)
    stderr = _COLOURS.sub("", run.stderr)
    fence = extraction.script.span.first_line()
    notes: list[Note] = []
    where, span = lessons.innermost(stderr) or (extraction, fence)
    if rule == "script-failed" and not (_parses(where) and _parses(extraction)):
        return None
    if where.path != extraction.path:
        notes.append(Note(f"`{extraction.path}` was running", fence))
    return diagnose(
        rule,
        span,
        message,
        label=_beside(rule, stderr, span is not fence),
        help=_help(rule, run),
        notes=[*notes, *_stderr_notes(run, lessons)],
    )


def _beside(rule: str, stderr: str, found: bool) -> str:
    """What stands beside the marked line."""
    if rule == "script-failed":
        return _last_words(stderr)
    return "it was here" if found else ""


def _help(rule: str, run: ScriptRun) -> str:
    if rule == "script-timeout":
        return "make it do less, or set `timeout=SECONDS` on its fence to a higher limit"
    if rule == "script-killed" and _signal_name(run.status) == "SIGKILL":
        return "the system ends a process that takes too much memory"
    return ""


def _parses(extraction: Extraction) -> bool:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            compile(extraction.text, extraction.path, "exec", dont_inherit=True)
    except (SyntaxError, ValueError, MemoryError, RecursionError, OverflowError):
        return False
    return True


def _last_words(stderr: str) -> str:
    """The exception's line of the last traceback, else the last line that was written."""
    frames = _frames(stderr)
    if frames:
        after = stderr[frames[-1].end() :].split("\n")[1:]
        lines = [line for line in after if line and not line[0].isspace()]
        if lines:
            return shortened(lines[0].strip(), _LABEL)
    # Exception groups are drawn with lines and corners.
    written = [line.strip(" \t\r|+-") for line in stderr.split("\n")]
    written = [line for line in written if line]
    return shortened(written[-1], _LABEL) if written else ""


def _stderr_notes(run: ScriptRun, lessons: _Lessons) -> list[Note]:
    """The end of the standard error, its paths made places of lessons."""
    text = _in_lessons(_COLOURS.sub("", run.stderr), lessons).rstrip()
    text = _THREAD.sub("", text.removeprefix(_ABORTED) if run.outcome is Outcome.TIMEOUT else text)
    if not text.strip():
        return []
    lines = text.replace("\r\n", "\n").split("\n")
    tail = "\n".join(lines[-_TAIL_LINES:])
    cut = len(lines) > _TAIL_LINES or len(tail) > _TAIL_CHARACTERS
    lead = "its standard error ended with" if cut else "its standard error"
    return [Note(f"{lead}:\n{tail[-_TAIL_CHARACTERS:]}")]
