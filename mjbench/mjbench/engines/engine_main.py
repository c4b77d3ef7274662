"""The child process in which an engine runs: a crash or a hang takes nothing else along.

It is run as a file in a temporary folder, where engines leave what they compile. The protocol is
JSON lines: first this process says that it is ready, then it replies to each request.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from typing import Literal

import msgspec
from msgspec import Struct

from mjbench.engines import engine_trial


class Request(Struct, frozen=True):
    """What an engine is asked."""

    path: tuple[str, ...]
    """Where the tool finds modules."""
    module: str
    name: str
    processors: int
    action: Literal["list", "motion", "costs"]
    """A motion comes with the costs of one world, so that it is compiled only once."""
    variant: engine_trial.Variant | None = None
    trial: engine_trial.EngineTrial | None = None
    worlds: int = 1


class Reply(Struct, frozen=True):
    """What it says: what was asked for, or why there is none."""

    variants: tuple[engine_trial.Variant, ...] = ()
    motion: engine_trial.EngineMotion | None = None
    cost: engine_trial.EngineCost | None = None
    refusal: str = ""
    """In the engine's own words."""
    unsupported: bool = False
    """Whether it says that it does not have a feature."""


_LONGEST = 300
"""Characters of a refusal."""


def main() -> None:
    """Serve until the input closes."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)  # engines print what they compile
    os.dup2(null, 2)
    # The threads of JAX's pool on the processor, by default one for each core. Two wait for each
    # other: 4,096 worlds of a model with contacts stopped for ever within some hundred steps
    # (jaxlib 0.10.2, two cores), and ran through with eight.
    os.environ.setdefault("NPROC", str(max(8, 2 * (os.cpu_count() or 1))))
    print("ready", file=replies, flush=True)
    for line in sys.stdin:
        request = msgspec.json.decode(line, type=Request)
        try:
            reply = _answer(request)
        except MemoryError:
            reply = Reply(refusal="there is not enough memory")
        except Exception as error:  # whatever it raises is its answer
            reply = Reply(refusal=_words(error), unsupported=isinstance(error, NotImplementedError))
        print(json.dumps(msgspec.to_builtins(reply)), file=replies, flush=True)


def _answer(request: Request) -> Reply:
    sys.path[:] = request.path
    engine: engine_trial.Engine = importlib.import_module(request.module).ENGINES[request.name]
    if request.action == "list":
        return Reply(tuple(engine.variants(request.processors)))
    assert request.variant is not None and request.trial is not None
    trial, clock = request.trial, time.perf_counter_ns
    batch = engine_trial.begin(engine, request.variant, trial, request.worlds, clock)
    motion = engine_trial.run_motion(batch, trial) if request.action == "motion" else None
    return Reply(motion=motion, cost=engine_trial.run_costs(batch, trial, clock))


def _words(error: Exception) -> str:
    """An exception in one line, cut where it gets long."""
    text = " ".join(str(error).split())
    name = type(error).__name__
    if name == "RefusalError":
        return text
    text = f"{name}: {text}" if text else name
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"


if __name__ == "__main__":
    main()
