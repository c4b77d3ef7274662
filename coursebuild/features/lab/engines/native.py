"""Native MuJoCo for labs: saves models as MJB files, and repeats runs of the browser's engine.

Only the version that wrote an MJB file can read it. Where another MuJoCo is installed than that of
the browser, the child runs in an environment with that one, in the user's state folder.
"""

from __future__ import annotations

import base64
import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeAlias

import msgspec
from msgspec import Struct

from coursebuild.api import EffectError, Interpreter
from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.resources import assets_dir
from coursebuild.core.run.child import LIMITS, JsonChild
from coursebuild.core.run.environments import find_environment, prepare_environment
from coursebuild.core.run.sandbox import Sandbox
from coursebuild.core.run.script_environment import engine_version

LAB_ENGINE = "3.14.0"
"""The version of MuJoCo in the browser, as `site/package.json` names it."""


WASM, TRIAL, EQUATION_TRIAL = "mujoco/mujoco.wasm", "js/lab-trial.js", "js/equation-trial.js"
"""MuJoCo for browsers, and the scripts that run trials in V8, with and without it."""


def asset_path(name: str) -> Path:
    """The path of a file that a trial runs."""
    return assets_dir() / name


@functools.cache
def asset_digest(*names: str) -> str:
    """Return a hash of files that a trial runs."""
    return hashlib.sha256(b"".join(asset_path(name).read_bytes() for name in names)).hexdigest()


@functools.cache
def lab_digest(*parts: str) -> str:
    """Return a hash of parts of this feature's code: `picture`, `engines/native_worker.py`."""
    return code_digest(*(f"coursebuild/features/lab/{part}" for part in parts))


_WORKER = Path(__file__).with_name("native_worker.py")


class NativeError(Exception):
    """Native MuJoCo could not do what a request asks; the text says why."""


class EngineDescription(Struct, frozen=True):
    """What of MuJoCo the scripts of labs use."""

    fields: dict[str, Literal["number", "array", "rows", "single"]]
    """By paths such as `model.opt.gravity`: a number; an array; one with rows, which is flat in
    JavaScript; one of 32-bit numbers."""
    functions: frozenset[str]
    """Those that do nothing but compute."""


Readout: TypeAlias = tuple[str, float | str]
"""Its label and its value."""


class ScriptReply(Struct, frozen=True):
    """What a script of a lab does natively."""

    failure: str = ""
    """Why it fails, if it does."""
    steps: int = 0
    last: int = 0
    """The checksum of its last state."""
    state: tuple[float, ...] = ()
    """The one at the step that was asked for."""
    start: tuple[Readout, ...] = ()
    end: tuple[Readout, ...] = ()


class NativeEngine(JsonChild):
    """The child that runs MuJoCo; requests raise a `NativeError` if it dies.

    `seconds` and `compiling` are the processor time that a request and a model may take; `memory`
    is in MiB; `say` tells of an environment that has to be made. With a `sandbox` none is made, and
    each script runs in a child of its own in there, so that it can falsify only its own result.
    """

    def __init__(
        self,
        root: Path,
        seconds: float = 120.0,
        memory: int = LIMITS.memory,
        compiling: float = LIMITS.models,
        say: Callable[[str], None] = lambda _: None,
        sandbox: Sandbox | None = None,
    ) -> None:
        super().__init__(str(_WORKER), seconds, memory=memory)
        self._say = say
        self._sandbox = sandbox
        self._script_child: JsonChild | None = None
        self._root = root.resolve()
        self._compiling = compiling

    def save(self, path: str, text: str) -> bytes:
        """Compile a text as if it stood at a path of the course, and return the MJB file.

        The same text and files give the same bytes wherever the course lies. A text that does not
        compile raises a `NativeError`; it is reported before.
        """
        request = {"task": "save", "path": str(self._root / path), "text": text}
        return base64.b64decode(self._request(request, self._compiling)["mjb"])

    def parity(self, mjb: bytes, run: dict[str, Any], horizon: int) -> dict[str, Any]:
        """Repeat a recorded run of the browser's engine; say where and by how much it differs.

        `run` is the `parity` part of a trial's reply; the size of a difference counts up to the
        step `horizon`.
        """
        model = run["mjb"]["data"] if run["mjb"] else base64.b64encode(mjb).decode()
        return self._request({"task": "parity", "mjb": model, "run": run, "horizon": horizon})

    @functools.cached_property
    def description(self) -> EngineDescription:
        """What of the engine scripts may use."""
        return msgspec.convert(self._request({"task": "describe"}), EngineDescription)

    def script(self, request: dict[str, Any]) -> ScriptReply:
        """Run an exported script natively.

        `request` has the script's `path` (nothing need be there), its `text`, its `buttons`,
        `variants` (the text with other values), and `near`, the step whose state is returned.
        """
        request = {"task": "script", **request}
        if self._sandbox is None:
            return msgspec.convert(self._request(request), ScriptReply)
        python = None if self.interpreter is None else self.interpreter.python
        enclose = self._sandbox.enclosure(self._root, self.interpreter, self.memory)
        with JsonChild(str(_WORKER), self._seconds, python, self.memory, enclose) as child:
            self._script_child = child
            if self._interrupted:
                child.interrupt()
            reply = child.ask({**request, "limit": self._seconds})
            if reply is None:
                raise NativeError(child.death())
        try:
            return msgspec.convert(reply, ScriptReply)
        except msgspec.ValidationError as error:
            return ScriptReply(f"its report is none: {error}")

    def interrupt(self) -> None:
        """From another thread: end what runs, and refuse all further requests."""
        super().interrupt()
        if (child := self._script_child) is not None:
            child.interrupt()

    @functools.cached_property
    def interpreter(self) -> Interpreter | None:
        """The environment with the labs' MuJoCo; none where that is installed here."""
        if engine_version() == LAB_ENGINE:
            return None
        if self._sandbox is None:
            return prepare_environment(self._root, LAB_ENGINE, self._say, locked=True)
        environment = find_environment(self._root, LAB_ENGINE, locked=True)
        if fault := environment.fault():
            raise EffectError(
                f"labs need MuJoCo {LAB_ENGINE}, {engine_version()} is installed here, and with "
                f"`--sandbox` nothing is installed: {environment.prefix} {fault}",
                help="run `coursebuild doctor --install-engine` before",
            )
        return environment.interpreter

    def _request(self, request: dict[str, Any], seconds: float | None = None) -> dict[str, Any]:
        if self._process is None and self.interpreter is not None:
            self._python = self.interpreter.python
        limit = self._seconds if seconds is None else min(seconds, self._seconds)
        reply: dict[str, Any] | None = self.ask({**request, "limit": limit}, limit)
        if reply is None:
            raise NativeError(self.death())
        if reply["error"]:
            raise NativeError(f"says: {reply['error'].strip()}")
        return reply
