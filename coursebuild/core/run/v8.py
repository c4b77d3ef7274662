"""JavaScript in this process as a browser runs it: V8 with limits on time and memory.

mini-racer brings V8, which runs scripts in a thread of its own, and notifies an event loop when one
has ended. Each isolate has such a loop, in one more thread. Both threads end when the isolate is
closed, so that this process can be forked again.
"""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import json
import os
import resource
import threading
import time
from collections.abc import Callable, Coroutine, Iterable
from concurrent.futures import CancelledError, Future
from pathlib import Path
from typing import Any, NamedTuple, Self

from coursebuild.core.files.errors import EffectError, LackError, lacking

_FLAGS = ("--single-threaded", "--wasm-sync-tier-up", "--no-opt")
"""V8 has no threads here to recompile hot WebAssembly, and would stay with its first code, which is
several times slower; so it recompiles at once, in the same thread. Of the two compilers for hot
JavaScript the slower one is off: the code of labs runs as fast with the other."""
_MEMORY = 128
"""MiB of JavaScript objects."""
_ADDRESSES = 1 << 40
"""Bytes of addresses that V8 needs to start; it reserves most of them and uses few."""
_THREADS = 4
"""Threads that V8 needs beside one for each processor."""
_START_SECONDS = 20.0
_LOOK = 1.0
"""Seconds between two checks of a script's progress."""
_SLOWEST = 10.0
"""How many times its limit of processor time a script may take in wall time."""


class StoppedError(BaseException):
    """Another thread has stopped the script.

    Like `KeyboardInterrupt` it is no `Exception`, so that no handler on the way catches it.
    """


class LimitError(Exception):
    """A script ran too long or took too much memory; its isolate should not be used any more."""


class ScriptError(Exception):
    """A script threw or does not parse; the text says what and where."""


def start() -> None:
    """Start V8 if it does not run yet; this starts no thread, and copies of this process share it.

    Raises:
        LackError: the limit on addresses would make it end this process.
        EffectError: it is not installed.
        MemoryError, OSError: the machine has run out of something.
    """
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < _ADDRESSES:
        raise LackError(
            f"V8 needs more than the {round(limit / (1 << 30), 2):g} GiB of address space that "
            "this process may use",
            help="`ulimit -v unlimited` removes the limit; V8 reserves addresses, not memory",
        )
    try:
        from py_mini_racer import init_mini_racer

        init_mini_racer(flags=_FLAGS, ignore_duplicate_init=True)
    except Exception as error:  # whatever an installation that is broken raises
        if isinstance(error, MemoryError | OSError | RuntimeError) and lacking(error):
            raise
        message = f"mini-racer's V8 cannot be used: {error}"
        raise EffectError(message, help="run `pip install coursebuild` again") from None


def _require_threads() -> None:
    """Start the threads that V8 will need, and end them.

    Raises:
        RuntimeError: there may not be so many; V8 would end this process.
    """
    is_over, threads = threading.Event(), list[threading.Thread]()
    try:
        for _ in range(_THREADS + (os.cpu_count() or 1)):
            threads.append(threading.Thread(target=is_over.wait))
            threads[-1].start()
    finally:
        is_over.set()
        for thread in threads:
            if thread.ident is not None:
                thread.join()


class Heartbeat(NamedTuple):
    """How others see that a script makes progress."""

    beats: memoryview
    """Bytes that it changes."""
    patience: float
    """Seconds for which they may stay as they are."""


class Isolate:
    """A JavaScript context of its own, with some scripts loaded, for one thread at a time.

    Close it: a process that ends with V8 running may hang.
    """

    def __init__(self, *scripts: str, memory: int = _MEMORY << 20) -> None:
        start()
        _require_threads()
        from py_mini_racer import mini_racer

        self._memory = memory
        self._lock = threading.Lock()
        """Guards the following two."""
        self._running: Future[Any] | None = None
        self._is_stopped = False
        self._resources = contextlib.ExitStack()
        self._loop = asyncio.new_event_loop()
        thread = threading.Thread(target=self._loop.run_forever, name="v8", daemon=True)
        thread.start()
        self._resources.callback(self._loop.close)  # the last one is called first
        self._resources.callback(thread.join)
        self._resources.callback(self._loop.call_soon_threadsafe, self._loop.stop)
        self._racer = self._resources.enter_context(mini_racer(self._loop))
        self._racer.set_hard_memory_limit(memory)
        self._resources.callback(lambda: self._submit(_end_tasks()).result())
        atexit.register(self.close)
        for script in scripts:
            self._evaluate(script, _START_SECONDS)

    def close(self) -> None:
        """End what runs, and free all memory; the isolate cannot be used any more."""
        atexit.unregister(self.close)
        self.stop()
        with self._lock:  # another thread may close it, too
            self._resources.close()

    def stop(self) -> None:
        """From another thread: end what runs, and all that comes after, by a `StoppedError`."""
        with self._lock:
            self._is_stopped = True
            if self._running is not None:
                self._running.cancel()

    def call(
        self, function: str, argument: str, seconds: float, progress: Heartbeat | None = None
    ) -> str:
        """Call a global function from string to string.

        Raises:
            LimitError: it ran for more than `seconds`, too long without progress, or out of memory.
            ScriptError: it threw.
        """
        result = self._evaluate(f"{function}({json.dumps(argument)})", seconds, progress)
        if not isinstance(result, str):
            raise TypeError(f"{function} returned no string")
        return result

    def beats(self) -> memoryview:
        """The bytes that the scripts' global `buffer("beats")` gives, shared with the scripts."""
        place = self._evaluate('buffer("beats")', _START_SECONDS)
        assert isinstance(place, memoryview)
        return place

    def fill(self, name: str, data: bytes) -> None:
        """Hand over bytes: the scripts' global `reserve(name, size)` gives the place for them."""
        place = self._evaluate(f"reserve({json.dumps(name)}, {len(data)})", _START_SECONDS)
        assert isinstance(place, memoryview)
        place[:] = data

    def _evaluate(self, code: str, seconds: float, progress: Heartbeat | None = None) -> object:
        from py_mini_racer import JSEvalException, JSOOMException

        with self._lock:
            if self._is_stopped:
                raise StoppedError
            self._running = running = self._submit(self._evaluate_in_time(code, seconds, progress))
        try:
            return running.result()
        except CancelledError:
            raise StoppedError from None
        except JSOOMException:
            raise LimitError(f"took more than {self._memory >> 20} MiB") from None
        except JSEvalException as error:
            raise ScriptError(str(error)) from None
        finally:
            running.cancel()  # where this thread was interrupted
            self._running = None

    def _submit(self, work: Coroutine[Any, Any, Any]) -> Future[Any]:
        return asyncio.run_coroutine_threadsafe(work, self._loop)

    async def _evaluate_in_time(
        self, code: str, seconds: float, progress: Heartbeat | None
    ) -> object:
        """The value of a script; runs in the loop's thread.

        The limit is one of processor time, since other work on this machine must not end a good
        script; but at most the wall time counts, as other threads of this process take some too.
        """
        task = asyncio.ensure_future(self._racer.eval_cancelable(code))
        start_time, start_cpu_time = time.monotonic(), time.process_time()
        try:
            spent, last_beats, limit = 0.0, b"", seconds
            while spent < limit:
                if progress is not None and last_beats != (now := bytes(progress.beats)):
                    last_beats, limit = now, min(seconds, spent + progress.patience)
                left = min(limit - spent, _LOOK if progress is not None else seconds)
                done, _ = await asyncio.wait((task,), timeout=max(left, 0.01))
                if done:
                    return task.result()
                elapsed = time.monotonic() - start_time
                spent = max(min(elapsed, time.process_time() - start_cpu_time), elapsed / _SLOWEST)
        finally:
            task.cancel()
        # If the script has just ended by itself, V8 would end the next one instead: run a dummy.
        await asyncio.gather(task, self._racer.eval_cancelable("0"), return_exceptions=True)
        shown_limit = seconds if progress is None else min(seconds, progress.patience)
        raise LimitError(f"ran for more than {shown_limit:g} s")


async def _end_tasks() -> None:
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


class V8Engine:
    """Scripts in V8, started when they are first needed; a context manager."""

    def __init__(self, memory: int, scripts: Callable[[], Iterable[Path]]) -> None:
        """`memory`: MiB of JavaScript objects; WebAssembly's memory comes on top."""
        self._memory = memory << 20
        self._scripts = scripts
        self._isolate: Isolate | None = None
        self._stopped = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free V8's memory; the engine can be used again."""
        if self._isolate is not None:
            self._isolate.close()
            self._isolate = None

    def stop(self) -> None:
        """End what runs, and what comes after, by a `StoppedError`; called from another thread."""
        self._stopped = True
        if (isolate := self._isolate) is not None:
            isolate.stop()

    def _running_isolate(self) -> Isolate:
        if self._stopped:
            raise StoppedError
        isolate = self._isolate or self._start()
        if self._stopped:  # before there was anything to stop
            raise StoppedError
        return isolate

    def _start(self) -> Isolate:
        scripts = (path.read_text(encoding="utf-8") for path in self._scripts())
        self._isolate = Isolate(*scripts, memory=self._memory)
        return self._isolate
