"""Diagnostics of a script that did not run to its end, lost a simulation, or reached too far.

1. A traceback's frames are read out of the standard error. Each line of an extracted file is the
   line of a lesson; the diagnostic points at the innermost such line. A script that does not parse
   gets none: the check of its lesson has reported it.
2. A warning of MuJoCo's and a state that is not finite are errors, unless the fence says
   `diverges`; bodies deep in each other are a warning, unless it says `deep`. A fence that says
   either of a script that does not is a mistake as well.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TypeAlias, assert_never

import msgspec

from coursebuild.core.model.results import Divergence, Effect, EffectKind, Outcome, ScriptRun, Sign
from coursebuild.core.scripts.diff import limit_notes, shorten
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.text.diagnostics import Diagnostic, Fix, Note, diagnose
from coursebuild.core.text.python_code import compile_error
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span

_FRAME = regex(r'File "(?P<path>[^"\n]+)", line (?P<line>\d{1,9})')
_WARNING = regex(r"^(?P<path>[^\n]*?\.py):(?P<line>\d{1,9})(?=: )", re.MULTILINE)
_NOISE = regex(r"(?<=\b[Tt]hread )0x[0-9a-f]+ (?:\[[^\]\n]*\] )?|\n+Extension modules: [^\n]*\Z")
"""The parts of a crash dump that are of no use, or differ each time."""
_COLOURS = regex(r"\x1b\[[0-9;]*[A-Za-z]")
_CRASH = "Current thread "
_ABORTED = "Fatal Python error: Aborted\n\n"
"""How Python's answer begins when a script at its time limit is asked where it is."""
_LIBRARIES = ("site-packages", "dist-packages")

_FIRST_SIGNALS = "HUP INT QUIT ILL TRAP ABRT BUS FPE KILL USR1 SEGV USR2 PIPE ALRM TERM"
_SIGNALS = dict(enumerate(_FIRST_SIGNALS.split(), 1)) | {24: "XCPU", 25: "XFSZ", 31: "SYS"}
"""As Linux numbers them (signal(7))."""

_MISSING_MODULE = regex(r"ModuleNotFoundError: No module named '(\w+)")
_HELPS = (
    (
        _MISSING_MODULE,
        r"install `\1`, or say `requires=\1` on its fence, to skip it where `\1` is missing",
    ),
    (
        regex(r"FileNotFoundError: |.*Error opening file"),
        "a script runs in the project's folder: name files from there, as `models/box.xml`",
    ),
    (
        regex(r".*(?:GLFW|gladLoadGL|OpenGL platform library|X11|\bDISPLAY\b)"),
        "no window opens while a course is checked: leave it out, or say `norun` on its fence",
    ),
)

_TAIL_LINES = 30
_TAIL_CHARACTERS = 4000
_LABEL = 120


Scripts: TypeAlias = Mapping[str, Extraction]
"""All scripts of a course, by path."""
FindModule: TypeAlias = Callable[[str], str]
"""From the name of a module to its file in the course, or to an empty text."""


def _find_line(match: re.Match[str], scripts: Scripts) -> tuple[Extraction, Span] | None:
    """The script and the lesson's line that a traceback names, wherever the file lies."""
    parts = match["path"].split("/")
    if any(library in parts for library in _LIBRARIES):
        return None
    paths = ("/".join(parts[first:]) for first in range(len(parts)))
    extraction = next((scripts[path] for path in paths if path in scripts), None)
    span = extraction and extraction.line_span(int(match["line"]))
    return (extraction, without_indentation(span)) if extraction and span else None


def without_indentation(span: Span) -> Span:
    """A line from its first letter on."""
    lead = len(span.text) - len(span.text.lstrip())
    return Span(span.source, span.start + lead, span.end)


def failure_diagnostic(
    extraction: Extraction, run: ScriptRun, scripts: Scripts, find_module: FindModule = lambda _: ""
) -> Diagnostic | None:
    """What is wrong with a run, if anything; `find_module` knows modules in other folders."""
    wording = _failure_wording(extraction, run)
    if wording is None:
        return None
    rule, message, help = wording
    stderr = _COLOURS.sub("", run.stderr)
    fence = extraction.script.span.first_line()
    source, span, label = extraction, fence, ""
    if run.outcome in (Outcome.FAILED, Outcome.KILLED, Outcome.TIMEOUT):
        # The innermost line of a script, where a traceback or a crash dump ends
        dump = stderr.rfind(_CRASH)
        frames = list(_FRAME.finditer(stderr, max(0, dump)))
        lines = (_find_line(m, scripts) for m in (frames if dump >= 0 else reversed(frames)))
        source, span = next(filter(None, lines), (extraction, fence))
        if not extraction.script.is_python:  # as compilers and interpreters write a place
            place = re.search(rf"{re.escape(extraction.path)}:([0-9]{{1,9}})\b", stderr)
            span = (extraction.line_span(int(place[1])) if place else None) or fence
        label = "" if span is fence else "it was here"
    if run.outcome is Outcome.FAILED and extraction.script.is_python:
        if any(compile_error(script.text) for script in (source, extraction)):
            return None
        error = _last_message(stderr)
        label = shorten(error, _LABEL)
        matches = ((pattern.match(error), advice) for pattern, advice in _HELPS)
        help = next((match.expand(advice) for match, advice in matches if match), "")
        missing = _MISSING_MODULE.search(error)
        file = find_module(missing[1]) if missing else ""
        folder = file.removesuffix("/__init__.py").rpartition("/")[0] or "."
        if file and folder not in extraction.packages:
            packages = [*extraction.packages, folder]
            line = f"packages = {msgspec.json.encode(packages).decode()}".replace(",", ", ")
            help = f"`{file}` is there: add `{line}` to `[course]` in the map"
    notes = _stderr_notes(run.outcome, stderr, scripts)
    if source.path != extraction.path:
        notes.insert(0, Note(f"`{extraction.path}` was running", fence))
    return diagnose(rule, span, message, label=label, help=help, notes=notes)


def _failure_wording(extraction: Extraction, run: ScriptRun) -> tuple[str, str, str] | None:
    """The rule, the message and the help for a failed run; `None` for any other."""
    path = f"`{extraction.path}`"
    match run.outcome:
        case Outcome.OK | Outcome.SKIPPED | Outcome.NORUN | Outcome.UNRECORDED:
            return None
        case Outcome.FAILED:
            return "script-failed", f"{path} exited with status {run.status}", ""
        case Outcome.KILLED:
            signal = _SIGNALS.get(run.status)
            name = f"SIG{signal}" if signal else f"signal {run.status}"
            help = "the system ends a process that takes too much memory"
            return "script-killed", f"{path} was ended by {name}", help if name == "SIGKILL" else ""
        case Outcome.TIMEOUT:
            message = f"{path} was stopped after {extraction.script.timeout:g} s, its time limit"
            help = "make it do less, or set `timeout=SECONDS` on its fence to a higher limit"
            return "script-timeout", message, help
        case Outcome.OUTPUT_LIMIT:
            help = "print less: people read a recorded output"
            return "script-output-limit", f"{path} printed more than 1 MiB", help
        case Outcome.ENCODING:
            help = "print text"
            if extraction.script.is_python:
                help += "; `sys.stdout.buffer` takes bytes as they are"
            return "script-encoding", f"{path} printed bytes that are not UTF-8", help
        case _:
            assert_never(run.outcome)


def _last_message(stderr: str) -> str:
    """The exception's line of the last traceback, else the last line that was written."""
    frames = list(_FRAME.finditer(stderr))
    if frames:
        after = stderr[frames[-1].end() :].split("\n")[1:]
        lines = [line for line in after if line and not line[0].isspace()]
        if lines:
            return lines[0].strip()
    # Exception groups are drawn with lines and corners.
    lines = [line.strip(" \t\r|+-") for line in stderr.split("\n")]
    lines = [line for line in lines if line]
    return lines[-1] if lines else ""


def _stderr_notes(outcome: Outcome, text: str, scripts: Scripts) -> list[Note]:
    """The end of the standard error, with lines of lessons in place of those of their scripts."""

    def translate(form: str, match: re.Match[str]) -> str:
        line = _find_line(match, scripts)
        return form.format(line[1].path, line[1].line) if line else match.group()

    text = _FRAME.sub(partial(translate, 'File "{}", line {}'), text)
    text = _WARNING.sub(partial(translate, "{}:{}"), text).rstrip()
    text = _NOISE.sub("", text.removeprefix(_ABORTED) if outcome is Outcome.TIMEOUT else text)
    if not text.strip():
        return []
    lines = text.replace("\r\n", "\n").split("\n")
    tail = "\n".join(lines[-_TAIL_LINES:])
    is_cut = len(lines) > _TAIL_LINES or len(tail) > _TAIL_CHARACTERS
    lead = "its standard error ended with" if is_cut else "its standard error"
    return [Note(f"{lead}:\n{tail[-_TAIL_CHARACTERS:]}")]


# --- simulations

_MAX_INCIDENTS = 4
_DIVERGES = (
    "try a smaller timestep or another integrator; if that is intended, put `diverges` on its fence"
)
_DEEP = (
    "MuJoCo does not warn of this: try a smaller timestep, stiffer contacts (`solref`), or look at "
    "where they start; if that is intended, put `deep` on its fence"
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
        "keep the data in the course, where it does not change",
    ),
}


def is_lost(extraction: Extraction, run: ScriptRun) -> bool:
    """Whether a simulation was lost, without the script's saying so."""
    return not extraction.script.diverges and bool(_lost_simulations(run))


def divergence_diagnostics(
    extraction: Extraction, run: ScriptRun, scripts: Scripts
) -> Iterator[Diagnostic]:
    """What is wrong with the simulations of a script that was run."""
    divergences = () if run.trace is None else run.trace.divergences
    script = extraction.script
    deep = [divergence for divergence in divergences if divergence.sign is Sign.CONTACT]
    if run.outcome is Outcome.OK and run.trace is not None:
        if script.diverges and not divergences:
            reason = "none of its simulations did"
            yield _false_claim(extraction, "script-stable", "diverges", reason)
        if script.deep and not deep:
            reason = "no bodies overlapped deeply"
            yield _false_claim(extraction, "script-shallow", "deep", reason)
    if script.diverges or not divergences:
        return
    lost = _lost_simulations(run)
    if lost:
        message = f"a simulation of `{script.path}` diverged"
        yield _incident_diagnostic("script-diverged", extraction, lost, scripts, message, _DIVERGES)
    elif deep and not script.deep:  # bodies of a lost simulation may lie anywhere
        message = f"bodies of `{script.path}` overlap deeply"
        yield _incident_diagnostic("script-penetration", extraction, deep, scripts, message, _DEEP)


def effect_diagnostics(
    extraction: Extraction, run: ScriptRun, scripts: Scripts
) -> Iterator[Diagnostic]:
    """A diagnostic if the script wrote outside its temporary folder, one if it used the network."""
    effects = () if run.trace is None else run.trace.effects
    for kind, (rule, wording, help) in _EFFECTS.items():
        if selection := [effect for effect in effects if effect.kind is kind]:
            target = selection[0].target
            if kind is EffectKind.WRITE and target.endswith((".svg", ".png")):
                name = posixpath.basename(target)
                help = f"to show it, save it as `{name}`, and say `figure={name}` on the fence"
            yield _incident_diagnostic(
                rule, extraction, selection, scripts, f"`{run.path}` {wording}", help
            )


def _lost_simulations(run: ScriptRun) -> tuple[Divergence, ...]:
    divergences = () if run.trace is None else run.trace.divergences
    return tuple(divergence for divergence in divergences if divergence.sign is not Sign.CONTACT)


def _false_claim(extraction: Extraction, rule: str, key: str, reason: str) -> Diagnostic:
    fence = extraction.script.span.first_line()
    message = f"`{extraction.path}` says `{key}`, and {reason}"
    return diagnose(rule, fence, message, help=Fix(f"remove `{key}`", "", f" {key}", safe=True))


def _incident_diagnostic(
    rule: str,
    extraction: Extraction,
    incidents: Sequence[Divergence | Effect],
    scripts: Scripts,
    message: str,
    help: str,
) -> Diagnostic:
    """A diagnostic at the first incident, with some more in notes."""
    fence = extraction.script.span.first_line()
    notes = [Note(_describe_incident(i), _place(i, scripts)) for i in incidents[1:]]
    notes = limit_notes(notes, _MAX_INCIDENTS, "more like these")
    if incidents[0].path not in ("", extraction.path):
        notes.insert(0, Note(f"`{extraction.path}` was running", fence))
    place = _place(incidents[0], scripts) or fence
    return diagnose(
        rule, place, f"{message}: {_describe_incident(incidents[0])}", help=help, notes=notes
    )


def _place(incident: Divergence | Effect, scripts: Scripts) -> Span | None:
    extraction = scripts.get(incident.path)
    span = None if extraction is None else extraction.line_span(incident.line)
    return None if span is None else without_indentation(span)


def _describe_incident(incident: Divergence | Effect) -> str:
    if isinstance(incident, Effect):
        return f"`{incident.target}`"
    of = f" of model `{incident.model}`" if incident.model else ""
    at = f" at t = {incident.time} s" if incident.time else ""
    match incident.sign:
        case Sign.POSITIONS | Sign.VELOCITIES | Sign.ACCELERATIONS:
            return f"MuJoCo warned of bad {incident.sign.value}{of}{at}"
        case Sign.STATE:
            return f"the state{of} is not finite{at}"
        case Sign.CONTACT:
            first_geom, second_geom = (*incident.geoms, "", "")[:2]
            return f"{first_geom} and {second_geom}{of} by {incident.depth} m{at}"
        case _:
            assert_never(incident.sign)
