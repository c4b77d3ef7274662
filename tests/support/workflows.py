"""Workflows of GitHub, run step by step on this machine.

What the actions of others do is done here in a few lines; `pip`, `npx`, `rsync` and `sudo` are
programs that only note how they were called. An action or an expression that is not known fails.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from support.scratch_course import ROOT

_EXPRESSION = re.compile(r"\$\{\{ (.*?) \}\}")
_NOTING_PROGRAM = (
    '#!/bin/sh\necho "${0##*/} $*" >> "$NOTES"\n[ ! -d public ] || cp -R public/. "$SENT"\n'
)
_PYTHON = f'#!/bin/sh\nexec {sys.executable} "$@"\n'
_COURSEBUILD = _PYTHON.replace('"$@"', '-m coursebuild "$@"')


@dataclass(frozen=True, slots=True)
class Step:
    """A command of a workflow that was run."""

    command: str
    status: int
    out: str
    err: str


@dataclass
class Runner:
    """A service that runs the workflows of one repository."""

    folder: Path
    repository: Path
    secrets: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=dict)
    caches: dict[str, Path] = field(default_factory=dict)
    summary: str = ""
    """The job summary of the last run."""

    def __post_init__(self) -> None:
        for name in ("bin", "home", "tmp", "sent", "artifacts", "pages"):
            (self.folder / name).mkdir(parents=True)
        programs = dict.fromkeys(("pip", "npx", "rsync", "sudo"), _NOTING_PROGRAM) | {
            "python": _PYTHON,
            "coursebuild": _COURSEBUILD,
        }
        for name, text in programs.items():
            (self.folder / "bin" / name).write_text(text)
            (self.folder / "bin" / name).chmod(0o755)

    @property
    def notes(self) -> list[str]:
        """The recorded calls of programs that would reach other machines."""
        return (self.folder / "notes").read_text().splitlines()

    def run(self, workflow: dict[str, Any], ref: str, **github: str) -> dict[str, list[Step]]:
        """Run the jobs that the event triggers; returns the commands that ran, by job."""
        values = {f"github.{name}": value for name, value in github.items()}
        values |= {f"secrets.{name}": value for name, value in self.secrets.items()}
        values["github.sha"] = git(self.repository, "rev-parse", ref)
        (self.folder / "summary").write_text("")
        steps_by_job: dict[str, list[Step]] = {}
        for name, job in workflow["jobs"].items():
            applies = job.get("needs", name) in {name, *steps_by_job} and _holds(
                job.get("if"), values
            )
            if applies:
                steps_by_job[name] = self._job(name, job["steps"], ref, values)
        self.summary = (self.folder / "summary").read_text()
        return steps_by_job

    def action(self, place: Path, steps: list[dict[str, Any]], **inputs: str) -> list[Step]:
        values = {f"inputs.{name}": value for name, value in inputs.items()}
        return [self._command(place, step, values) for step in steps if "run" in step]

    def _job(
        self, name: str, steps: list[dict[str, Any]], ref: str, values: dict[str, str]
    ) -> list[Step]:
        place = self.folder / "work" / name
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        results: list[Step] = []
        cache_inputs: dict[str, Any] | None = None
        for step in steps:
            has_failure = any(result.status for result in results)
            if has_failure and "cancelled" not in step.get("if", ""):
                continue
            if "run" in step:
                results.append(self._command(place, step, values))
                continue
            uses, inputs = step["uses"].partition("@")[0], step.get("with", {})
            inputs = {key: _filled(str(value), values) for key, value in inputs.items()}
            match uses:
                case "actions/checkout":
                    depth = f"--depth={inputs.get('fetch-depth', 1)}"
                    url = f"file://{self.repository}"
                    git(place, "clone", "-q", depth, f"--branch={ref}", url, ".")
                case "actions/setup-python":
                    pass
                case "actions/cache" | "actions/cache/restore":
                    self._restore(place, inputs)
                    cache_inputs = inputs if uses == "actions/cache" else cache_inputs
                case "actions/upload-pages-artifact":
                    self._upload(place / inputs["path"])
                case "actions/download-artifact":
                    shutil.copy(self.folder / "artifacts" / f"{inputs['name']}.tar", place)
                    (place / f"{inputs['name']}.tar").rename(place / "artifact.tar")
                case "actions/deploy-pages":
                    with tarfile.open(self.folder / "artifacts" / "github-pages.tar") as archive:
                        archive.extractall(self.folder / "pages", filter="data")
                case _:
                    raise AssertionError(f"nobody knows what {uses} does")
        if cache_inputs is not None and not any(step.status for step in results):
            self._save(place, cache_inputs)
        return results

    def _command(self, place: Path, step: dict[str, Any], values: dict[str, str]) -> Step:
        step_environment = {
            key: _filled(value, values) for key, value in step.get("env", {}).items()
        }
        system = {name: os.environ[name] for name in ("LANG", "LC_ALL") if name in os.environ}
        environment = {
            "PATH": f"{self.folder / 'bin'}:/usr/bin:/bin",
            "HOME": str(self.folder / "home"),
            "TMPDIR": str(self.folder / "tmp"),
            "PYTHONPATH": str(ROOT),
            "NOTES": str(self.folder / "notes"),
            "SENT": str(self.folder / "sent"),
            "GITHUB_STEP_SUMMARY": str(self.folder / "summary"),
            "GITHUB_ACTION_PATH": str(ROOT),
            "RUNNER_TEMP": str(self.folder / "tmp"),
        }
        process = subprocess.run(
            ["bash", "-e", "-c", step["run"]],
            cwd=place / _filled(step.get("working-directory", "."), values),
            env=system | environment | self.environment | step_environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
        )
        return Step(step["run"], process.returncode, process.stdout, process.stderr)

    def _restore(self, place: Path, inputs: dict[str, str]) -> None:
        """Copy the cache of the key, else the newest that matches one of the restore keys."""
        newest = list(reversed(self.caches))
        applies = [key for key in newest if key == inputs["key"]]
        for start in inputs.get("restore-keys", "").split():
            applies += [key for key in newest if key.startswith(start)]
        if applies:
            shutil.copytree(self.caches[applies[0]], place, symlinks=True, dirs_exist_ok=True)

    def _save(self, place: Path, inputs: dict[str, str]) -> None:
        if inputs["key"] in self.caches:  # which is never replaced
            return
        target = self.folder / "caches" / inputs["key"]
        for path in inputs["path"].split():
            shutil.copytree(place / path, target / path, symlinks=True)
        self.caches[inputs["key"]] = target

    def _upload(self, site: Path) -> None:
        with tarfile.open(self.folder / "artifacts" / "github-pages.tar", "w") as archive:
            for path in sorted(site.iterdir()):
                if not path.name.startswith("."):
                    archive.add(path, path.name)


def git(place: Path, *arguments: str) -> str:
    """Run git without anyone's settings; returns its output."""
    names = {
        f"GIT_{role}_{part}": "a@b"
        for role in ("AUTHOR", "COMMITTER")
        for part in ("NAME", "EMAIL")
    }
    quiet = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}
    process = subprocess.run(
        ["git", *arguments],
        cwd=place,
        env=os.environ | names | quiet,
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout.strip()


def commit(place: Path) -> None:
    git(place, "add", "-A")
    git(place, "commit", "-q", "-m", "a change")


def _filled(text: str, values: dict[str, str]) -> str:
    return _EXPRESSION.sub(lambda match: values[match[1]], text)


def _holds(condition: str | None, values: dict[str, str]) -> bool:
    """Whether a job's `if` holds; knows only the kind of condition used here, `NAME == VALUE`."""
    if condition is None:
        return True
    name, _, value = condition.partition(" == ")
    return values[name] == value.strip("'")
