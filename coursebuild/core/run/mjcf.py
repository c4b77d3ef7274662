"""Compile MJCF with MuJoCo itself, in a child process.

Entry points: `compile_or_recall`, for results kept under a `model_key`; `compile_all`;
`model_files`, what a model is made of; `readable_error`, for people.

1. One child compiles everything; it starts again if a model crashes it or takes too long. One
   model may take half of the processor time that all may take together.
2. A text is compiled as if it stood in `models/`, so that its includes and assets are found there.
3. The messages are MuJoCo's own and whole, without the paths of this machine; a line is read from
   them if it is one of the compiled text, and not of a file that it includes.
4. A result, also an error, is kept under a hash of the text, its place, and the state of every
   other file that MuJoCo looks for. If one of these changed meanwhile, or time was up, nothing is
   kept.
"""

from __future__ import annotations

import contextlib
import functools
import os
import re
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from xml.parsers import expat

import msgspec

from coursebuild.core.engine.digests import SPECIAL, file_state
from coursebuild.core.engine.store import Store
from coursebuild.core.model import Limits
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.run import compile_main, mujoco_files
from coursebuild.core.run.child import LIMITS, JsonChild
from coursebuild.core.run.mujoco_files import ModelFiles
from coursebuild.core.run.script_environment import engine_version
from coursebuild.core.values import fingerprint

_ONE = 0.5
"""The part of the time of all models that one may take, so that one alone leaves the others some.
"""
_LEAST = 0.01
"""Seconds; where less is left, nothing is compiled any more."""
OWN_FAULT = "MuJoCo's compiler "
"""How messages begin that are about the process that compiles."""
_NO_MEMORY = re.compile(r"unknown exception|allocate memory|MemoryError|bad_alloc", re.IGNORECASE)
_KIND = "models"
_TEXT_NAME = ".coursebuild-text.xml"
TEXT_PATH = f"models/{_TEXT_NAME}"
"""Where a text without a file would stand; no file has this name."""


def compile_all(
    root: Path,
    texts: Sequence[tuple[str, str]],
    *,
    limits: Limits = LIMITS,
    python: str | None = None,
) -> tuple[CompileResult, ...]:
    """Compile models, all in one child; a result for each.

    Args:
        root: the course folder.
        texts: each with the path where it stands, or would (`TEXT_PATH`).
        limits: those of the course.
        python: another interpreter than the one that runs this, with a MuJoCo of its own.

    Raises:
        EffectError: MuJoCo cannot be loaded.
    """
    if not texts:
        return ()
    with _Compiler(root.resolve(), limits, python) as compiler:
        return tuple(compiler.compile(*text) for text in texts)


def compile_or_recall(
    root: Path,
    store: Store,
    texts: Sequence[tuple[str, str]],
    stage: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext,
    limits: Limits = LIMITS,
) -> tuple[CompileResult, ...]:
    """A result for each text, see `compile_all`.

    `stage` is entered only if anything has to be compiled.
    """
    keys = {model: model_key(root, *model) for model in texts}
    entries = {model: store.get_value(_KIND, key, CompileResult) for model, key in keys.items()}
    results = {model: result for model, result in entries.items() if result is not None}
    uncompiled = [model for model in keys if model not in results]
    if uncompiled:
        with stage():
            new_results = compile_all(root, uncompiled, limits=limits)
        for model, result in zip(uncompiled, new_results, strict=True):
            results[model] = result
            is_lasting = not result.timeout and not result.error.startswith(OWN_FAULT)
            if is_lasting and model_key(root, *model) == keys[model]:
                with contextlib.suppress(UnicodeEncodeError):  # a name of a file that is no text
                    store.put_value(_KIND, keys[model], result)
    return tuple(results[model] for model in texts)


def model_key(root: Path, path: str, text: str) -> str:
    """A hash of all that a compiled model depends on."""
    files = model_files(root, path, text)
    states = tuple((file, file_state(str(root / file))) for file in files)
    return fingerprint((engine_version(), _code(), path, text, states))


@functools.cache
def _code() -> tuple[bytes, ...]:
    """The code that compiles models and reads their facts."""
    files = (__file__, compile_main.__file__, mujoco_files.__file__)
    return tuple(Path(file).read_bytes() for file in files)


class _Compiler(JsonChild):
    """The child that compiles."""

    def __init__(self, root: Path, limits: Limits, python: str | None) -> None:
        super().__init__(compile_main.__file__, limits.models, python, memory=limits.memory)
        self.root = root
        self.seconds = self.left = limits.models

    def compile(self, path: str, text: str) -> CompileResult:
        limit = min(_ONE * self.seconds, self.left)
        if limit < _LEAST:
            return self._no_time_left()
        for file in model_files(self.root, path, text):
            if file_state(str(self.root / file)) == SPECIAL:  # to read it may take for ever
                return CompileResult(f"'{file}' is a device or a pipe")
        start = time.monotonic()
        reply = self.ask((str(self.root / path), text, limit), limit)
        if reply is None:
            death = self.death()
            if not self.timed_out:
                self.left -= time.monotonic() - start
                return CompileResult(f"{OWN_FAULT}{death}")
            self.left -= limit
            if limit < _ONE * self.seconds:
                return self._no_time_left()
            return CompileResult(f"takes more than {limit:g} s to compile", timeout=True)
        error, facts, seconds = reply
        self.left -= seconds
        if facts is not None:
            facts |= {"includes": existing_files(self.root, path, text)}
            return CompileResult("", facts=msgspec.convert(facts, ModelFacts))
        message = error.strip().replace(f"{self.root}/", "")  # as it would be on any machine
        message = message.replace(f"models/{_TEXT_NAME}", _TEXT_NAME)
        message = message.replace(f"'{_TEXT_NAME}'", "this text").replace(_TEXT_NAME, "this text")
        if _PARSER.search(message):
            return CompileResult(message, _line_of_xml_error(text) or error_line(message, text))
        if _NO_MEMORY.search(message):
            return CompileResult(f"{OWN_FAULT}takes more than {self.memory} MiB of memory for it")
        return CompileResult(message, error_line(message, text))

    def _no_time_left(self) -> CompileResult:
        message = f"was not compiled: others took the {self.seconds:g} s that all may take"
        return CompileResult(message, timeout=True)


def model_files(root: Path, path: str, text: str) -> tuple[str, ...]:
    """Every file that MuJoCo looks for when it compiles a text, besides that of the text itself.

    Those that are not there are among them: it would compile something else if they were.

    Args:
        root: the course folder.
        path: where the text stands, or would, relative to it.
        text: the model.

    Returns:
        Paths relative to the root, or absolute where they lie outside, sorted.
    """
    names: set[str] = set()
    ModelFiles(names.add).scan_text(text, folder=os.path.dirname(root / path))  # noqa: PTH120
    paths = [Path(os.path.normpath(name)) for name in names]
    files = {(p.relative_to(root) if p.is_relative_to(root) else p).as_posix() for p in paths}
    # MuJoCo joins an absolute path to another one; nothing is there, on any machine.
    nowhere = f"{root}/".lstrip("/")
    return tuple(sorted(file for file in files if file != path and nowhere not in file[1:]))


def _line_of_xml_error(text: str) -> int | None:
    """Where a text stops to be XML: MuJoCo names where the element begins that goes on there."""
    try:
        expat.ParserCreate().Parse(text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        return min(error.lineno, len(text.splitlines()))
    return None


def existing_files(root: Path, path: str, text: str) -> tuple[str, ...]:
    """The `model_files` that exist."""
    return tuple(file for file in model_files(root, path, text) if (root / file).is_file())


_LINE = re.compile(r"\bline (\d+)|Line number=(\d+)", re.IGNORECASE)
_ELEMENT_AND_LINE = re.compile(r"Element name '([^']*)', id -?\d+, line \d+$")


def error_line(message: str, text: str) -> int | None:
    """The line of `text`, from 1, that a message of MuJoCo's speaks of; `None` if of none.

    MuJoCo gives line 0 for what comes from an included file. It gives no hint for what comes from
    an attached model: there the line counts only if the name of the element stands on it or below
    it.
    """
    numbers = [int(a or b) for a, b in _LINE.findall(message)]
    lines = text.splitlines()
    # A message about an inner file is quoted before the place of the element that pulls it in.
    if not numbers or not 1 <= numbers[-1] <= max(len(lines), 1):
        return None
    line = numbers[-1]
    match = _ELEMENT_AND_LINE.search(message)
    if match and "<attach" in text:
        name = match.group(1)
        if not name or name not in "\n".join(lines[line - 1 : line + 3]):
            return None
    return line


_NOISE = re.compile(r"^(?:XML Error|Error|ParseXML)\s*[:=]\s*")
_PLACE = re.compile(r"\n?Element name '([^']*)', id -?\d+(?:, line \d+)?\s*$")
_ELEMENT = re.compile(r"\n?Element '([^']*)', line \d+\s*")
_CAPITAL = re.compile(r"^[A-Z](?=[a-z]*\b)")
_PARSER = re.compile(
    r"XML parse error \d+:\s*Error=(?:XML_)?(?:ERROR_)?(\w+) ErrorID=\d+ \(0x[0-9a-f]+\)"
    r" Line number=\d+(?:: )?(?:XMLElement name=(\S+))?"
)


def readable_error(error: str) -> str:
    """A message of MuJoCo's as one line in our style: no prefixes, no line numbers."""
    text = _PARSER.sub(_describe_parser_error, error)
    while (shorter := _NOISE.sub("", text)) != text:
        text = shorter
    text = _PLACE.sub(lambda m: f" (element `{m.group(1)}`)" if m.group(1) else "", text)
    text = _ELEMENT.sub(lambda m: f" in <{m.group(1)}> ", text)
    text = " ".join(text.split()).rstrip(". ")
    return _CAPITAL.sub(lambda m: m.group().lower(), text)


def _describe_parser_error(match: re.Match[str]) -> str:
    kind = match.group(1).removeprefix("PARSING_").replace("_", " ").lower()
    element = f" <{match.group(2)}>" if match.group(2) else ""
    return f"not well-formed XML ({kind}{element})"
