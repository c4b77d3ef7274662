"""What to say about a script that did not run to its end, or in which a simulation was lost.

Entry points: `failure` (a run), `silence` (an output is recorded and nothing was printed),
`divergence` (simulations), `is_lost`, `effects` (what it does to what is around it).

1. A traceback's frames are read out of the standard error: each line of an extracted file is the
   line of a lesson, and the innermost such line is what the diagnostic points at. Of a script that
   does not parse nothing is said: the reader of its lesson has told it.
2. A warning of MuJoCo's and a state that is not finite are errors, unless the fence says
   `diverges`; bodies deep in each other are a warning, unless it says `deep`. A script that says
   either and does not is wrong about itself.
"""

from __future__ import annotations

import posixpath
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import assert_never

from coursebuild.core.model import Recording
from coursebuild.core.model.results import Divergence, Effect, EffectKind, Outcome, ScriptRun, Sign
from coursebuild.core.scripts.diff import shortened
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Span

_FRAME = re.compile(r'File "(?P<path>[^"\n]+)", line (?P<line>\d{1,9})')
_WARNING = re.compile(r"^(?P<path>[^\n]*?\.py):(?P<line>\d{1,9})(?=: )", re.MULTILINE)
_NOISE = re.compile(
    r"(?<=\b[Tt]hread )0x[0-9a-f]+ (?:\[[^\]\n]*\] )?|\n+Extension modules: [^\n]*\Z"
)
"""What a crash tells that is of no use, or another each time."""
_COLOURS = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
_CRASH = "Current thread "
_ABORTED = "Fatal Python error: Aborted\n\n"
"""What Python says when it is asked, at the end of its time, where it is."""
_LIBRARIES = ("site-packages", "dist-packages")

_FIRST_SIGNALS = "HUP INT QUIT ILL TRAP ABRT BUS FPE KILL USR1 SEGV USR2 PIPE ALRM TERM"
_SIGNALS = {**dict(enumerate(_FIRST_SIGNALS.split(), 1)), 24: "XCPU", 25: "XFSZ", 31: "SYS"}
"""As Linux numbers them (signal(7))."""

_HELPS = (
    (
        re.compile(r"ModuleNotFoundError: No module named '(\w+)"),
        r"install `\1`, or say `requires=\1` on its fence, to skip it where `\1` is missing",
    ),
    (
        re.compile(r"FileNotFoundError: |.*Error opening file"),
        "a script runs in the project's folder: name files from there, as `models/box.xml`",
    ),
    (
        re.compile(r"EOFError: EOF when reading a line"),
        "nobody types while a course is checked: write into the script what it asks for",
    ),
    (
        re.compile(r".*(?:GLFW|gladLoadGL|OpenGL platform library|X11|\bDISPLAY\b)"),
        "no window opens while a course is checked: leave it out, or say `norun` on its fence",
    ),
)
"""The exception's line, and what mends it."""

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
        frames = list(_FRAME.finditer(stderr, max(0, dump)))
        for found in frames if dump >= 0 else reversed(frames):
            extraction, span = self._find(found)
            if extraction is not None and span is not None:
                return extraction, without_indentation(span)
        return None

    def translated(self, text: str) -> str:
        """The text with the paths and lines of extracted files made those of lessons."""

        def frame(found: re.Match[str]) -> str:
            _, span = self._find(found)
            return found.group() if span is None else f'File "{span.path}", line {span.line}'

        def warning(found: re.Match[str]) -> str:
            _, span = self._find(found)
            return found.group() if span is None else f"{span.path}:{span.line}"

        return _WARNING.sub(warning, _FRAME.sub(frame, text))

    def _find(self, found: re.Match[str]) -> tuple[Extraction | None, Span | None]:
        parts = found["path"].replace("\\", "/").split("/")
        if any(library in parts for library in _LIBRARIES):
            return None, None
        for first in range(len(parts)):
            extraction = self._by_path.get("/".join(parts[first:]))
            if extraction is not None:
                return extraction, extraction.line_span(int(found["line"]))
        return None, None


def without_indentation(span: Span) -> Span:
    """A line from its first letter on."""
    lead = len(span.text) - len(span.text.lstrip())
    return Span(span.source, span.start + lead, span.end)


def failure(
    extraction: Extraction, run: ScriptRun, extractions: Iterable[Extraction]
) -> Diagnostic | None:
    """What is wrong with a run; `None` for one that ended well or was not to be made."""
    path, help = f"`{extraction.path}`", ""
    match run.outcome:
        case Outcome.OK | Outcome.SKIPPED | Outcome.NORUN:
            return None
        case Outcome.FAILED:
            rule, message = "script-failed", f"{path} exited with status {run.status}"
        case Outcome.KILLED:
            known = _SIGNALS.get(run.status)
            name = f"SIG{known}" if known else f"signal {run.status}"
            rule, message = "script-killed", f"{path} was ended by {name}"
            if name == "SIGKILL":
                help = "the system ends a process that takes too much memory"
        case Outcome.TIMEOUT:
            limit = f"{extraction.script.timeout:g}"
            rule, message = "script-timeout", f"{path} was stopped after {limit} s, its time limit"
            help = "make it do less, or set `timeout=SECONDS` on its fence to a higher limit"
        case Outcome.OUTPUT_LIMIT:
            rule, message = "script-output-limit", f"{path} printed more than 1 MiB"
            help = "print less: a recorded output is to be read"
        case Outcome.ENCODING:
            rule, message = "script-encoding", f"{path} printed bytes that are not UTF-8"
            help = "print text; `sys.stdout.buffer` takes bytes as they are"
        case _:
            assert_never(run.outcome)
    lessons, stderr = _Lessons(extractions), _COLOURS.sub("", run.stderr)
    fence = extraction.script.span.first_line()
    where, span, label = extraction, fence, ""
    if run.outcome in (Outcome.FAILED, Outcome.KILLED, Outcome.TIMEOUT):
        where, span = lessons.innermost(stderr) or (extraction, fence)
        label = "" if span is fence else "it was here"
    if run.outcome is Outcome.FAILED:
        if not (_parses(where) and _parses(extraction)):
            return None
        words = _last_words(stderr)
        label = shortened(words, _LABEL)
        found = ((pattern.match(words), advice) for pattern, advice in _HELPS)
        help = next((match.expand(advice) for match, advice in found if match), "")
    notes = _stderr_notes(run.outcome, lessons.translated(stderr))
    if where.path != extraction.path:
        notes.insert(0, Note(f"`{extraction.path}` was running", fence))
    return diagnose(rule, span, message, label=label, help=help, notes=notes)


def silence(recording: Recording, path: str) -> Diagnostic:
    """An output is recorded, and the script printed no line."""
    return diagnose(
        "script-silent",
        recording.caption_span,
        f"an output is recorded here and `{path}` printed nothing",
        help="print what is recorded, or take the recorded output away",
    )


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
    frames = list(_FRAME.finditer(stderr))
    if frames:
        after = stderr[frames[-1].end() :].split("\n")[1:]
        lines = [line for line in after if line and not line[0].isspace()]
        if lines:
            return lines[0].strip()
    # Exception groups are drawn with lines and corners.
    written = [line.strip(" \t\r|+-") for line in stderr.split("\n")]
    written = [line for line in written if line]
    return written[-1] if written else ""


def _stderr_notes(outcome: Outcome, text: str) -> list[Note]:
    """The end of the standard error."""
    text = text.rstrip()
    text = _NOISE.sub("", text.removeprefix(_ABORTED) if outcome is Outcome.TIMEOUT else text)
    if not text.strip():
        return []
    lines = text.replace("\r\n", "\n").split("\n")
    tail = "\n".join(lines[-_TAIL_LINES:])
    cut = len(lines) > _TAIL_LINES or len(tail) > _TAIL_CHARACTERS
    lead = "its standard error ended with" if cut else "its standard error"
    return [Note(f"{lead}:\n{tail[-_TAIL_CHARACTERS:]}")]


# --- simulations

_SHOWN = 4
"""Further simulations that are named."""
_DIVERGES = (
    "try a smaller timestep or another integrator; if it is to diverge, say so by `diverges` on "
    "its fence"
)
_DEEP = (
    "MuJoCo does not warn of this: try a smaller timestep, stiffer contacts (`solref`), or look at "
    "where they start; if they are to, say so by `deep` on its fence"
)

_EFFECTS = {
    EffectKind.WRITE: (
        "script-writes",
        "writes outside its temporary folder",
        "write into `tempfile.mkdtemp()`, or name a folder of the course by `writes=` on its fence",
    ),
    EffectKind.CONNECTION: (
        "script-connects",
        "uses the network",
        "keep what it asks for in the course, where it stays the same",
    ),
}
"""The rule, what is said, and what mends it."""


def is_lost(extraction: Extraction, run: ScriptRun) -> bool:
    """Whether a simulation was lost, without the script's saying so."""
    return not extraction.script.diverges and bool(_lost_simulations(run))


def divergence(
    extraction: Extraction, run: ScriptRun, extractions: Iterable[Extraction]
) -> Iterator[Diagnostic]:
    """What is wrong with the simulations of a script that was run."""
    found = () if run.trace is None else run.trace.divergences
    script = extraction.script
    deep = [each for each in found if each.sign is Sign.CONTACT]
    if run.outcome is Outcome.OK and run.trace is not None:
        if script.diverges and not found:
            yield _unlike(extraction, "script-stable", "diverges", "none of its simulations did")
        if script.deep and not deep:
            what = "no bodies lay deep in each other"
            yield _unlike(extraction, "script-shallow", "deep", what)
    if script.diverges or not found:
        return
    lost = _lost_simulations(run)
    if lost:
        said = f"a simulation of `{script.path}` diverged"
        yield _found("script-diverged", extraction, lost, extractions, said, _DIVERGES)
    elif deep and not script.deep:  # what is lost may as well lie anywhere
        said = f"bodies of `{script.path}` lie deep in each other"
        yield _found("script-penetration", extraction, deep, extractions, said, _DEEP)


def effects(
    extraction: Extraction, run: ScriptRun, extractions: Iterable[Extraction]
) -> Iterator[Diagnostic]:
    """That a script wrote outside its temporary folder, or used the network."""
    found = () if run.trace is None else run.trace.effects
    for kind, (rule, said, help) in _EFFECTS.items():
        if these := [each for each in found if each.kind is kind]:
            what = these[0].what
            if kind is EffectKind.WRITE and what.endswith((".svg", ".png")):
                name = posixpath.basename(what)
                help = f"to show it, save it as `{name}`, and say `figure={name}` on the fence"
            yield _found(rule, extraction, these, extractions, f"`{run.path}` {said}", help)


def _lost_simulations(run: ScriptRun) -> tuple[Divergence, ...]:
    found = () if run.trace is None else run.trace.divergences
    return tuple(each for each in found if each.sign is not Sign.CONTACT)


def _unlike(extraction: Extraction, rule: str, key: str, what: str) -> Diagnostic:
    fence = extraction.script.span.first_line()
    message = f"`{extraction.path}` says `{key}`, and {what}"
    return diagnose(rule, fence, message, help=f"take `{key}` away")


def _found(
    rule: str,
    extraction: Extraction,
    found: Sequence[Divergence | Effect],
    extractions: Iterable[Extraction],
    said: str,
    help: str,
) -> Diagnostic:
    """The first of what was found, where it was found, and some more in notes."""
    by_path = {each.path: each for each in extractions}
    fence = extraction.script.span.first_line()
    further, left = found[1 : _SHOWN + 1], len(found) - 1 - _SHOWN
    notes = [Note(_noticed(each), _place(each, by_path)) for each in further]
    if found[0].path not in ("", extraction.path):
        notes.insert(0, Note(f"`{extraction.path}` was running", fence))
    if left > 0:
        notes.append(Note(f"and {left} more like these"))
    place = _place(found[0], by_path) or fence
    return diagnose(rule, place, f"{said}: {_noticed(found[0])}", help=help, notes=notes)


def _place(found: Divergence | Effect, by_path: Mapping[str, Extraction]) -> Span | None:
    """The lesson's line where it was noticed."""
    where = by_path.get(found.path)
    span = None if where is None else where.line_span(found.line)
    return None if span is None else without_indentation(span)


def _noticed(found: Divergence | Effect) -> str:
    """What was noticed, in words."""
    if isinstance(found, Effect):
        return f"`{found.what}`"
    of = f" of model `{found.model}`" if found.model else ""
    at = f" at t = {found.time} s" if found.time else ""
    match found.sign:
        case Sign.POSITIONS | Sign.VELOCITIES | Sign.ACCELERATIONS:
            return f"MuJoCo warned of bad {found.sign.value}{of}{at}"
        case Sign.STATE:
            return f"the state{of} is not finite{at}"
        case Sign.CONTACT:
            one, other = (*found.geoms, "", "")[:2]
            return f"{one} and {other}{of} by {found.depth} m{at}"
        case _:
            assert_never(found.sign)
