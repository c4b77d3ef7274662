"""The functions of mini-racer's library: those that there are, and what is made of them."""

from __future__ import annotations

import asyncio
import ctypes
import importlib.metadata
import importlib.util
import random
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from coursebuild.effects import v8_library
from coursebuild.effects.errors import EffectError
from coursebuild.effects.v8_library import (
    VERSION,
    Context,
    LimitError,
    ScriptError,
    StoppedError,
    library,
    library_path,
)
from coursebuild.effects.v8_start import start

pytestmark = pytest.mark.engine

ROOT = Path(v8_library.__file__).parents[2]
ANEW = (
    "effects/v8_library.py was written for another version of mini-racer: compare its `_FUNCTIONS`,"
    " `_Value` and kinds with py_mini_racer's `_dll.py` and `_objects.py`, then change `VERSION`"
)


@pytest.fixture
def context() -> Iterator[Context]:
    start()
    context = Context(128 << 20)
    yield context
    context.close()


def values(context: Context) -> int:
    """How many values the library holds for a context."""
    count = library().mr_value_count
    count.argtypes, count.restype = [ctypes.c_uint64], ctypes.c_size_t
    return int(count(context._id))


class TestPinned:
    def test_the_version_is_the_one_that_this_was_written_for(self) -> None:
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        (pin,) = (d for d in project["dependencies"] if d.startswith("mini-racer"))
        assert pin == f"mini-racer=={VERSION}", ANEW
        assert importlib.metadata.version("mini-racer") == VERSION, ANEW

    @pytest.mark.parametrize("name", v8_library._FUNCTIONS)
    def test_functions_take_and_give_what_mini_racer_says(self, name: str) -> None:
        from py_mini_racer import _dll

        assert hasattr(library(), name), f"{name} is not in {library_path()}: {ANEW}"
        theirs = getattr(_dll._build_dll_handle(library_path()), name)
        gives, *takes = v8_library._FUNCTIONS[name]
        assert [size(t) for t in takes] == [size(t) for t in theirs.argtypes], ANEW
        if gives is not None:
            assert size(gives) == size(theirs.restype), ANEW

    def test_values_are_what_mini_racer_says(self) -> None:
        from py_mini_racer import _dll
        from py_mini_racer._objects import _ERRORS, _MiniRacerTypes

        names = {"data": "value", "size": "len", "kind": "type"}
        for ours, name in names.items():
            one, other = getattr(v8_library._Value, ours), getattr(_dll._RawValue, name)
            assert (one.offset, one.size) == (other.offset, other.size), ANEW
        kinds = v8_library._TEXT, v8_library._BUFFER, v8_library._OUT_OF_MEMORY
        theirs = _MiniRacerTypes
        assert kinds == (theirs.str_utf8, theirs.array_buffer, theirs.oom_exception), ANEW
        assert {*v8_library._ERRORS, v8_library._OUT_OF_MEMORY} == set(_ERRORS), ANEW

    def test_mini_racer_is_not_imported(self) -> None:
        code = (
            "import sys\n"
            "from coursebuild.effects.pool import can_fork\n"
            "from coursebuild.effects.v8 import MathEngine\n"
            "from coursebuild.results import Formula\n"
            "before = can_fork()\n"
            "with MathEngine() as engine: engine.typeset([Formula('x', False)])\n"
            "print(sorted({'asyncio', 'py_mini_racer'} & set(sys.modules)), before, can_fork())\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True
        )
        assert done.stdout.splitlines() == [f"[] {sys.platform != 'darwin'} False"]


def size(kind: Any) -> int:
    return ctypes.sizeof(kind)


class TestMissing:
    """What is told where the library is not what it should be."""

    def test_not_installed(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
        with pytest.raises(
            EffectError, match=r"^mini-racer is not installed for this Python$"
        ) as e:
            library_path.__wrapped__()
        assert e.value.help == "run `pip install coursebuild` again"

    def test_another_version(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(v8_library, "package_version", lambda name: "0.99.0")
        said = rf"^mini-racer is 0\.99\.0, and has to be {VERSION}$"
        with pytest.raises(EffectError, match=said) as e:
            library.__wrapped__()
        assert e.value.help == "run `pip install coursebuild` again"

    def test_a_function_is_missing(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(v8_library._FUNCTIONS, "mr_gone", (None,))
        with pytest.raises(EffectError, match=r"^mini-racer's V8 cannot be used: .*mr_gone"):
            library.__wrapped__()

    def test_no_library(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        monkeypatch.setattr(v8_library, "library_path", lambda: tmp_path / "libmini_racer.so")
        with pytest.raises(EffectError, match=r"^mini-racer's V8 cannot be used: .*libmini_racer"):
            library.__wrapped__()


class TestValues:
    @pytest.mark.parametrize(
        "text", ["", "a\0b", "é\u2028\U0001d4b3", "\ud800x", "x" * 5_000_000], ids=range(5)
    )
    def test_texts_come_back(self, context: Context, text: str) -> None:
        code = "".join(f"\\u{ord(c):04x}" if "\ud7ff" < c < "\ue000" else c for c in text)
        code = code.replace("\0", "\\0")
        assert context.evaluate(f"'{code}'", 20.0) == text

    @pytest.mark.parametrize("code", ["1", "1.5", "null", "undefined", "[]", "({})", "true", ""])
    def test_what_is_no_text_is_none(self, context: Context, code: str) -> None:
        assert context.evaluate(code, 20.0) is None

    def test_bytes_are_copied(self, context: Context) -> None:
        context.fill("var place = new ArrayBuffer(3); place", b"\x00\x80\xff", 20.0)
        assert context.evaluate("String(new Uint8Array(place))", 20.0) == "0,128,255"
        context.fill("new ArrayBuffer(0)", b"", 20.0)

    @pytest.mark.parametrize("code", ["'abc'", "new ArrayBuffer(2)", "1"])
    def test_there_must_be_room_for_bytes(self, context: Context, code: str) -> None:
        with pytest.raises(TypeError, match="no ArrayBuffer of 3 bytes"):
            context.fill(code, b"abc", 20.0)

    @pytest.mark.parametrize(
        ("code", "message"),
        [
            ("throw new Error('no')", "<anonymous>:1: Error: no\n"),
            ("throw new Error('a\\ud800')", "<anonymous>:1: Error: a"),
            ("throw ''", "<anonymous>:1: \n"),
            ("(", "<anonymous>:1: SyntaxError: Unexpected end of input\n"),
        ],
    )
    def test_errors(self, context: Context, code: str, message: str) -> None:
        with pytest.raises(ScriptError) as error:
            context.evaluate(code, 20.0)
        assert str(error.value).startswith(message)

    def test_nothing_is_kept(self, context: Context) -> None:
        for code in ("'a'", "1", "[]", "new ArrayBuffer(9)") * 3:
            context.evaluate(code, 20.0)
        context.fill("new ArrayBuffer(1)", b"a", 20.0)
        with pytest.raises(ScriptError):
            context.evaluate("throw 1", 20.0)
        assert values(context) == 0


class TestEnding:
    def test_a_context_can_be_used_after_its_time_was_over(self, context: Context) -> None:
        context.evaluate("var count = 0", 20.0)
        for limit, said in ((0.1, "0.1"), (0.1, "0.1"), (5.0, "5")):
            with pytest.raises(LimitError, match=rf"^ran for more than {said} s$") as error:
                context.evaluate("for (;;) count++", limit)
            assert error.value.resumable
            assert context.evaluate("'used'", 20.0) == "used"
        assert context.evaluate("String(count > 0)", 20.0) == "true"
        assert values(context) <= 1  # what was ended last may be told after the next

    def test_a_late_result_is_never_taken_for_the_next(self, context: Context) -> None:
        source = random.Random(0)
        in_time = 0
        for n in range(600):
            busy = source.choice((0, 0, 2_000, 100_000))
            code = f"for (let i = 0; i < {busy}; i++); '{n}'"
            try:
                found = context.evaluate(code, source.choice((0.0, 0.00002, 0.0002, 120.0)))
            except LimitError:
                continue
            assert found == str(n)
            in_time += 1
        assert 100 < in_time < 600
        assert context.evaluate("'last'", 20.0) == "last"

    def test_a_context_out_of_memory_says_so(self) -> None:
        start()
        context = Context(32 << 20)
        try:
            with pytest.raises(LimitError, match=r"^took more than 32 MiB$") as error:
                context.evaluate("const a = []; for (;;) a.push(new Array(1e4).fill(1.5))", 60.0)
            assert not error.value.resumable
        finally:
            context.close()

    def test_stopped_from_another_thread(self, context: Context) -> None:
        timer = threading.Timer(0.2, context.stop)
        timer.start()
        began = time.monotonic()
        with pytest.raises(StoppedError):
            context.evaluate("for (;;) ;", 600.0)
        assert time.monotonic() - began < 300.0
        assert context.evaluate("'on'", 20.0) == "on"

    def test_stopped_before_it_began(self, context: Context) -> None:
        context.stop()
        with pytest.raises(StoppedError):
            context.evaluate("'no'", 20.0)
        assert context.evaluate("'on'", 20.0) == "on"

    def test_closed_while_it_runs(self) -> None:
        start()
        context = Context(128 << 20)
        found: list[BaseException] = []

        def work() -> None:
            try:
                context.evaluate("for (;;) ;", 600.0)
            except BaseException as error:
                found.append(error)

        thread = threading.Thread(target=work)
        thread.start()
        while context._task is None:
            time.sleep(0.001)
        began = time.monotonic()
        context.close()
        thread.join()
        assert time.monotonic() - began < 300.0
        assert [type(error) for error in found] == [StoppedError]
        context.close()
        context.stop()
        with pytest.raises(RuntimeError, match="the context is closed"):
            context.evaluate("'no'", 20.0)

    def test_threads_take_turns(self, context: Context) -> None:
        context.evaluate("const same = (x) => x", 20.0)
        wrong: list[tuple[str, str | None]] = []

        def work(name: str) -> None:
            for n in range(200):
                found = context.evaluate(f"same('{name}{n}')", 20.0)
                if found != f"{name}{n}":
                    wrong.append((f"{name}{n}", found))

        threads = [threading.Thread(target=work, args=(name,)) for name in "abcd"]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert wrong == []

    def test_whoever_calls_may_run_an_event_loop(self, context: Context) -> None:
        async def work() -> str | None:
            return context.evaluate("'here'", 20.0)

        with ThreadPoolExecutor(1) as apart:  # in this thread there may be a loop of Playwright's
            assert apart.submit(asyncio.run, work()).result() == "here"


class TestStoppedAtTheSeams:
    """A stop is neither lost nor taken for an error, whenever it comes."""

    def test_when_the_value_is_on_its_way(
        self, context: Context, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        wait = context._result

        def late(number: int, seconds: float) -> int:
            address = wait(number, seconds)
            context.stop()
            return address

        with monkeypatch.context() as patch:
            patch.setattr(context, "_result", late)
            with pytest.raises(StoppedError):
                context.evaluate("'value'", 120.0)
        assert context.evaluate("'next'", 120.0) == "next"
        assert values(context) == 0

    def test_when_v8_says_first_that_it_was_ended(
        self, context: Context, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        class Slow:
            """Whoever stops a script does not get on until V8 has told that it ended."""

            def __getattr__(self, name: str) -> Any:
                function = getattr(library(), name)
                if name != "mr_cancel_task":
                    return function

                def cancel(*arguments: int) -> None:
                    function(*arguments)
                    time.sleep(0.05)

                return cancel

        monkeypatch.setattr(context, "_library", Slow())
        stopper = threading.Timer(0.2, context.stop)
        stopper.start()
        with pytest.raises(StoppedError):
            context.evaluate("for(;;);", 600.0)
        stopper.join()
        assert context.evaluate("'next'", 120.0) == "next"
