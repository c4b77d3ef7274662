"""The process of an engine: it may crash or hang, and takes nothing else along."""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import resource
import signal
import tempfile
import time
from multiprocessing.connection import Connection
from typing import Self

from msgspec import Struct

from mjbench.engines import engine_trial
from mjbench.machine import this_machine

_MEMORY = 16 << 30
"""Bytes that an engine may take: 4,096 worlds need more than most programs do."""
_LONGEST = 300
"""Characters of a refusal."""


class Request(Struct, frozen=True):
    """What an engine is asked: without a variant, which of these there are."""

    variant: engine_trial.Variant | None = None
    trial: engine_trial.EngineTrial | None = None
    worlds: int = 1
    moves: bool = False
    """Whether for a motion too, which comes with the costs: it is compiled only once."""


class Reply(Struct, frozen=True):
    """What it says: what was asked for, or why there is none."""

    variants: tuple[engine_trial.Variant, ...] = ()
    motion: engine_trial.EngineMotion | None = None
    cost: engine_trial.EngineCost | None = None
    refusal: str = ""
    """In the engine's own words."""
    unsupported: bool = False
    """Whether it says that it does not have a feature."""


class EngineChild:
    """An engine in a process of its own, in a temporary folder where it leaves what it compiles."""

    def __init__(self, module: str, name: str, seconds: float) -> None:
        """`seconds`: how long, by the wall, one answer may take."""
        self._engine, self._seconds = (module, name), seconds
        self._folder = tempfile.TemporaryDirectory()
        self._process: multiprocessing.context.SpawnProcess | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
        self._folder.cleanup()

    def reply(self, request: Request) -> Reply:
        """What the engine says; a refusal where its process crashed or took too long."""
        if self._process is None:
            self._start()
        with contextlib.suppress(EOFError, OSError):  # it died
            self._connection.send(request)
            if self._connection.poll(self._seconds):
                reply: Reply = self._connection.recv()
                return reply
        return Reply(refusal=f"its process {self._death()}")

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, other_end = context.Pipe()
        arguments = other_end, *self._engine, self._folder.name
        self._process = context.Process(target=_serve, args=arguments, daemon=True)
        self._process.start()
        other_end.close()

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError):
            os.killpg(process.pid or 0, signal.SIGKILL)
        process.kill()
        process.join()
        self._connection.close()

    def _death(self) -> str:
        """What ended the child, after it gave no answer."""
        assert self._process is not None
        self._process.join(1.0)
        status = self._process.exitcode
        self._stop()
        if status is None:
            return f"took longer than {self._seconds:g} s"
        if status < 0:
            return f"crashed ({signal.Signals(-status).name})"
        return f"ended with status {status}"


def _serve(connection: Connection, module: str, name: str, folder: str) -> None:
    """Answer requests, in the child, until the parent goes."""
    os.setsid()
    os.chdir(folder)
    null = os.open(os.devnull, os.O_WRONLY)
    for output in (1, 2):
        os.dup2(null, output)  # engines print what they compile
    # The threads of JAX's pool on the processor, by default one for each core. Two wait for each
    # other: 4,096 worlds of a model with contacts stopped for ever within some hundred steps
    # (jaxlib 0.10.2, two cores), and ran through with eight.
    os.environ.setdefault("NPROC", str(max(8, 2 * (os.cpu_count() or 1))))
    os.environ["TMPDIR"] = folder
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with contextlib.suppress(OSError, ValueError):  # only Linux counts data so
        resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
    with contextlib.suppress(EOFError):
        while True:
            request: Request = connection.recv()
            try:
                reply = _answer(module, name, request)
            except MemoryError:
                reply = Reply(refusal="there is not enough memory")
            except Exception as error:  # whatever it raises is its answer
                is_missing = isinstance(error, NotImplementedError)
                reply = Reply(refusal=_words(error), unsupported=is_missing)
            connection.send(reply)


def _answer(module: str, name: str, request: Request) -> Reply:
    engine: engine_trial.Engine = importlib.import_module(module).ENGINES[name]
    variant, trial, clock = request.variant, request.trial, time.perf_counter_ns
    if variant is None or trial is None:
        return Reply(tuple(engine.variants(this_machine().processors)))
    batch = engine_trial.begin(engine, variant, trial, request.worlds, clock)
    motion = engine_trial.run_motion(batch, trial) if request.moves else None
    return Reply(motion=motion, cost=engine_trial.run_costs(batch, trial, clock))


def _words(error: Exception) -> str:
    """An exception in one line, cut where it gets long."""
    text = " ".join(str(error).split())
    if isinstance(error, engine_trial.RefusalError):
        return text
    text = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
