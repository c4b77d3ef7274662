"""Compile MJCF with MuJoCo itself, in a child process.

1. One child compiles everything; it starts again if a model crashes it or takes too long. One
   model may take half of the processor time that all may take together.
2. A text is compiled as if it stood in `models/`, so that its includes and assets are found there.
3. The messages are MuJoCo's own and whole, without the paths of this machine; a line is read from
   them if it is one of the compiled text, and not of a file that it includes.
4. A result, also an error, is kept under a hash of the text, its place, and the state of every
   other file that MuJoCo looks for (`model_key`). If one of these changed meanwhile, or time was
   up, nothing is kept.
"""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

import msgspec

from coursebuild.core.engine.digests import SPECIAL, file_state
from coursebuild.core.engine.store import Store
from coursebuild.core.model import Limits
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.run import mujoco_files
from coursebuild.core.run.child import LIMITS, JsonChild
from coursebuild.core.run.mujoco_files import ATTRIBUTE, MARKUP, ModelFiles
from coursebuild.core.run.script_environment import engine_version
from coursebuild.core.values import fingerprint

_ONE = 0.5
"""The part of the time of all models that one may take, so that one alone leaves the others some.
"""
_LEAST = 0.01
"""Seconds; where less is left, nothing is compiled any more."""
PROGRAM = str(Path(__file__).with_name("compile_main.py"))
"""That of the child."""
_CODE = tuple(Path(m).read_bytes() for m in (__file__, PROGRAM, mujoco_files.__file__))
"""The code that compiles models and reads their facts."""
OWN_FAULT = "MuJoCo's compiler "
"""How messages begin that are about the process that compiles."""
_NO_MEMORY = re.compile(
    r"unknown exception|allocate memory|memory allocation|MemoryError|bad_alloc", re.IGNORECASE
)
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

    Each text comes with the path in the course where it stands, or would (`TEXT_PATH`). `python` is
    another interpreter than the one that runs this, with a MuJoCo of its own.

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
    """A result for each text, see `compile_all`; `stage` is entered if one has to be compiled."""
    keys = {model: model_key(root, *model) for model in texts}
    results = {
        model: result
        for model, key in keys.items()
        if (result := store.get_value(_KIND, key, CompileResult)) is not None
    }
    uncompiled = [model for model in keys if model not in results]
    if uncompiled:
        with stage():
            new_results = compile_all(root, uncompiled, limits=limits)
        for model, result in zip(uncompiled, new_results, strict=True):
            results[model] = result
            is_lasting = not result.timeout and not result.error.startswith(OWN_FAULT)
            if is_lasting and model_key(root, *model) == keys[model]:
                store.put_value(_KIND, keys[model], result)
    return tuple(results[model] for model in texts)


def model_key(root: Path, path: str, text: str) -> str:
    """A hash of all that a compiled model depends on."""
    files = model_files(root, path, text)
    states = tuple((file, file_state(str(root / file))) for file in files)
    return fingerprint((engine_version(), _CODE, path, text, states))


class _Compiler(JsonChild):
    def __init__(self, root: Path, limits: Limits, python: str | None) -> None:
        super().__init__(PROGRAM, limits.models, python, memory=limits.memory)
        self.root = root
        self.seconds = self.left = limits.models

    def compile(self, path: str, text: str) -> CompileResult:
        is_shared = self._process is not None
        result = self._try(path, text)
        if is_shared and result.error.startswith(OWN_FAULT) and not result.timeout:
            result = self._try(path, text)  # alone: MuJoCo keeps meshes of other models
        return result

    def _try(self, path: str, text: str) -> CompileResult:
        """Compile a text as the model at a path."""
        if file := _outer_file(self.root, path, text):
            # Its content, or that it exists, is nothing for those who wrote the course.
            lines = (
                tag.line
                for tag in read_tags(text)
                for _, value, _ in tag.attributes
                if value and Path(value).name == Path(file).name
            )
            return CompileResult(f"'{file}' leads out of the course", next(lines, None))
        for file in model_files(self.root, path, text):
            if file_state(str(self.root / file)) == SPECIAL:  # to read it may take for ever
                return CompileResult(f"'{file}' is a device or a pipe")
        limit = min(_ONE * self.seconds, self.left)
        if limit < _LEAST:
            return self._no_time_left()
        start = time.monotonic()
        full_path = str(self.root / path)
        reply = self.ask((full_path, {full_path: text}, limit), limit)
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
        includes = existing_files(self.root, path, text)
        if facts is not None:
            facts |= {"includes": includes}
            return CompileResult("", facts=msgspec.convert(facts, ModelFacts))
        message = error.strip().replace(f"{self.root}/", "")  # as it would be on any machine
        message = message.replace(f"models/{_TEXT_NAME}", _TEXT_NAME)
        message = message.replace(f"'{_TEXT_NAME}'", "this text").replace(_TEXT_NAME, "this text")
        line = error_line(message, text)
        if _PARSER.search(message):  # MuJoCo names where the element begins that goes on there
            try:
                expat.ParserCreate().Parse(text.encode("utf-8", "surrogatepass"), True)
            except expat.ExpatError as error:
                line = min(error.lineno, len(text.splitlines())) or line
        elif _NO_MEMORY.search(message):
            self.stop()  # where memory was refused, MuJoCo may not go on
            return CompileResult(f"{OWN_FAULT}takes more than {self.memory} MiB of memory for it")
        return CompileResult(message, line, includes=includes)

    def _no_time_left(self) -> CompileResult:
        message = f"was not compiled: others took the {self.seconds:g} s that all may take"
        return CompileResult(message, timeout=True)


def model_files(root: Path, path: str, text: str) -> tuple[str, ...]:
    """Every file that MuJoCo looks for when it compiles a text, besides that of the text itself.

    Those that are not there are among them: it would compile something else if they were. The paths
    are relative to the course's folder, or absolute where they lie outside, and sorted.
    """
    paths = [Path(os.path.normpath(name)) for name in _sought_paths(root, path, text)]
    files = {(p.relative_to(root) if p.is_relative_to(root) else p).as_posix() for p in paths}
    # MuJoCo joins an absolute path to another one; nothing is there, on any machine.
    nowhere = f"{root}/".lstrip("/")
    return tuple(sorted(file for file in files if file != path and nowhere not in file[1:]))


def _sought_paths(root: Path, path: str, text: str) -> set[str]:
    """The paths that MuJoCo opens for a text, as it names them."""
    paths: set[str] = set()
    ModelFiles(paths.add).scan_text(text, folder=os.path.dirname(root / path))  # noqa: PTH120
    return paths


def _outer_file(root: Path, path: str, text: str) -> str:
    """A file outside the course that MuJoCo would open for a text; empty if there is none."""
    own_root = os.path.realpath(root)
    for sought_path in sorted(_sought_paths(root, path, text)):
        target = os.path.realpath(root / sought_path)
        if os.path.lexists(target) and not Path(target).is_relative_to(own_root):
            is_relative = sought_path.startswith(f"{root}/")
            return os.path.relpath(sought_path, root) if is_relative else sought_path
    return ""


def existing_files(root: Path, path: str, text: str) -> tuple[str, ...]:
    """The `model_files` that exist."""
    return tuple(file for file in model_files(root, path, text) if (root / file).is_file())


_LINE = re.compile(r"\bline (\d+)|Line number=(\d+)", re.IGNORECASE)
_QUOTED = re.compile(r"'([^'\s]+)'")
_ELEMENT_AND_LINE = re.compile(r"Element name '([^']*)', id -?\d+, line \d+$")


def error_line(message: str, text: str) -> int | None:
    """The line of `text`, from 1, that a message of MuJoCo's speaks of; `None` if of none.

    MuJoCo gives line 0 for what comes from an included file, and no hint for what comes from an
    attached model: there the line counts only if the name of the element stands on it or below it.
    Without a line, it is that of the element with a name that the message quotes, if only one has
    that name.
    """
    numbers = [int(a or b) for a, b in _LINE.findall(message)]
    lines = text.splitlines()
    # A message about an inner file is quoted before the place of the element that pulls it in.
    if numbers and 1 <= numbers[-1] <= max(len(lines), 1):
        line = numbers[-1]
        match = _ELEMENT_AND_LINE.search(message)
        name = match.group(1) if match and "<attach" in text else None
        if name is None or (name and name in "\n".join(lines[line - 1 : line + 3])):
            return line
    values = [(v, tag.line) for tag in read_tags(text) for _, v, _ in tag.attributes]
    for name in _QUOTED.findall(message):  # of a file perhaps with the folder of its kind
        places = [n for v, n in values for w in v.split() if f"/{name}".endswith(f"/{w}")]
        if len(places) == 1:
            return places[0]
    return None


# --- names in MJCF

_SCHEMA_LINE = re.compile(r"( *)(?:\((\w+)\))?(\w+) \(.\) +(.*)|( {20,})(\S.*)")


class _Tag(NamedTuple):
    name: str
    line: int
    attributes: list[tuple[str, str, tuple[int, int]]]
    """Each with its value, and the place of that."""


def read_schema(text: str) -> dict[str, dict[str, list[str]]]:
    """The elements of MJCF: of each the elements that it stands in, with its attributes there."""
    elements: dict[str, dict[str, list[str]]] = {"include": {"mujoco": ["file", "prefix"]}}
    elements["mujocoinclude"] = {"": []}
    elements["worldbody"] = {"mujoco": ["name"]}
    elements["frame"] = {"body": "axisangle childclass euler name pos quat xyaxes zaxis".split()}
    elements["replicate"] = {"body": "count euler offset sep".split()}  # not in what is printed
    parents: dict[int, str] = {}
    attributes: list[str] = []
    for match in map(_SCHEMA_LINE.match, text.splitlines()):
        if match is None:
            continue
        if match[6]:
            attributes += match[6].split()
            continue
        depth, name = len(match[1]), match[3]
        parent = next((parents[d] for d in sorted(parents, reverse=True) if d < depth), "")
        parents = {d: p for d, p in parents.items() if d < depth} | {depth: name}
        attributes = elements.setdefault(name, {}).setdefault(parent, [])
        attributes += match[4].split()
    return elements


def read_tags(text: str) -> Iterator[_Tag]:
    """The tags with which elements of a text begin."""
    line, offset = 1, 0
    for match in MARKUP.finditer(text):
        line, offset = line + text.count("\n", offset, match.start()), match.start()
        if match["name"] is None or match["end"]:
            continue
        start, attributes = match.start("rest"), []
        for attribute in ATTRIBUTE.finditer(match["rest"]):
            number = 2 if attribute[2] is not None else 3
            place = (start + attribute.start(number), start + attribute.end(number))
            attributes.append((attribute[1], attribute[number], place))
        yield _Tag(match["name"], line, attributes)


# --- messages

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

    def describe(match: re.Match[str]) -> str:
        kind = match[1].removeprefix("PARSING_").replace("_", " ").lower()
        return f"not well-formed XML ({kind}{f' <{match[2]}>' if match[2] else ''})"

    text = _PARSER.sub(describe, error)
    while (shorter := _NOISE.sub("", text)) != text:
        text = shorter
    text = _PLACE.sub(lambda m: f" (element `{m.group(1)}`)" if m.group(1) else "", text)
    text = _ELEMENT.sub(lambda m: f" in <{m.group(1)}> ", text)
    text = " ".join(text.split()).rstrip(". ")
    return _CAPITAL.sub(lambda m: m.group().lower(), text)
