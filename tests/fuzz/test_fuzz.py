"""Every target with kept inputs, in `make test-all`; with new ones in `make test-slow`."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import signal
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from fuzz.__main__ import main, read_corpus
from fuzz.attempts import MOST_MEMORY, Attempts
from fuzz.targets import TARGETS, Target
from fuzz.texts import ROOT

SAMPLE = 12
"""Seeds of a target that are tried, besides its corpus."""


def signatures_of(attempts: Attempts) -> list[str]:
    return [json.loads(path.read_text())[0] for path in attempts.folder.glob("found-*.json")]


@pytest.mark.long
@pytest.mark.parametrize("name", TARGETS)
def test_kept_inputs_survive(name: str, tmp_path: Path) -> None:
    attempts = Attempts(TARGETS[name], tmp_path)
    for data in (b"", *itertools.islice(TARGETS[name].seeds(), SAMPLE), *read_corpus(name)):
        attempts(data)
    attempts.interval = 1
    for data in read_corpus(f"{name}-found"):
        attempts(data)
    assert signatures_of(attempts) == []


@pytest.mark.long
def test_input_that_takes_long_or_much_or_fails_is_found(tmp_path: Path) -> None:
    """A limit holds though the code under test lets no exception through."""

    def attempt(data: bytes) -> None:
        match data:
            case b"endless":
                with contextlib.suppress(Exception):
                    signal.raise_signal(signal.SIGPROF)
            case b"large":
                assert len(bytearray(b"\1" * (MOST_MEMORY + 64 << 20)))
            case b"wrong":
                raise ValueError

    attempts = Attempts(Target(lambda: iter([b""]), attempt, repeatable=False), tmp_path)
    for data in (b"", b"endless", b"large", b"wrong", b"wrong"):
        attempts(data)
    signatures = sorted(signature.split()[0] for signature in signatures_of(attempts))
    assert signatures == ["HungerError", "SlownessError", "ValueError"]


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
def test_nothing_is_found(target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("atheris", reason="there is none for this system")
    status = main([target, "--runs", "1000", "--seed", "21", "--out", str(tmp_path)])
    assert status == 0, capsys.readouterr().out


@pytest.mark.slow
def test_harness_tries_the_target_that_it_is_named_after(tmp_path: Path) -> None:
    pytest.importorskip("atheris", reason="there is none for this system")
    harness = tmp_path / "fuzz_slices.py"
    harness.write_bytes((Path(__file__).parent / "oss_fuzz/fuzz_target.py").read_bytes())
    assert main(["--write-seeds", str(tmp_path)]) == 0
    with zipfile.ZipFile(tmp_path / "fuzz_slices_seed_corpus.zip") as archive:
        archive.extractall(tmp_path / "seeds")
    options = ["-runs=200", f"-dict={tmp_path / 'fuzz_slices.dict'}", str(tmp_path / "seeds")]
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    command = [sys.executable, str(harness), *options]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert "Done 200 runs" in process.stderr
