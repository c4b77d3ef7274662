"""coursebuild and its peers: their places, commands and configurations, as `tools.toml` has them.

Entry point: `all_tools(places)`. A peer that is not installed has no version and is not measured.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.run import gate

ROOT = Path(__file__).resolve().parents[2]


class Places(Struct, frozen=True):
    """Where the peers are installed."""

    python: Path | None
    """The folder `bin` of an environment with `benchmarks/peers.txt` in it."""
    node: Path | None
    """A folder `node_modules` with what `benchmarks/package.json` names."""

    def python_tool(self, name: str) -> str | None:
        """A command of that environment."""
        return None if self.python is None else shutil.which(name, path=str(self.python))

    def command(self, tool: Tool, program: str) -> tuple[str, ...]:
        """The beginning of the commands of a tool; empty where it is not installed."""
        if program == "coursebuild":
            return sys.executable, "-m", "coursebuild"
        if tool.package:
            path = None if self.node is None else self.node / tool.package / program
            return () if path is None or not path.exists() else ("node", str(path))
        path_of_program = self.python_tool(program)
        if program == "hugo":
            path_of_program = path_of_program or shutil.which("hugo")
        return () if path_of_program is None else (path_of_program,)

    def version(self, tool: Tool) -> str | None:
        """The version of a tool; `None` where it is not installed."""
        if not tool.package:
            return read_version((*tool.command, tool.version_option)) if tool.command else None
        if not tool.command or self.node is None or shutil.which("node") is None:
            return None
        package = self.node / tool.package / "package.json"
        return str(json.loads(package.read_text(encoding="utf-8"))["version"])


class Tool(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One generator of sites, in one configuration."""

    key: str
    title: str
    flavor: str
    """Of the course that it builds."""
    math: Literal["build", "reader"]
    """Where formulas are typeset."""
    configuration: str
    """In words."""
    package: str = ""
    """The package of Node that it is, if it is one."""
    program: str
    """Its command, or the path of its script in this package."""
    version_option: str = "--version"
    build: str = ""
    """Its options for a build; empty: not built."""
    products: tuple[str, ...] = ()
    """Patterns of the paths that a cold build must not find."""
    spared: tuple[str, ...] = ()
    """Names that match, and that it may find."""
    page: str = ""
    """The built page of a lesson."""
    source: str
    """The file of a lesson."""
    serve_program: str = ""
    """The command of its preview, if that is another one."""
    serve: str
    """Its options for a preview."""
    address: str
    """Where the preview has a lesson."""
    only_incremental: bool = False
    """Whether this is a variant of another tool that differs only in builds that are not cold."""
    command: tuple[str, ...] = ()
    """The beginning of its commands on this machine; found by `Places`, like the next two."""
    serve_command: tuple[str, ...] = ()
    """The beginning of the command of its preview; empty where that is not installed."""
    version: str | None = None

    def build_command(self, folder: Path) -> list[str]:
        """The command for a build of a course."""
        return [*self.command, *(part.format(folder=folder) for part in shlex.split(self.build))]

    def preview_command(self, folder: Path, port: int) -> list[str]:
        """The command for a preview of a course."""
        options = (part.format(folder=folder, port=port) for part in shlex.split(self.serve))
        return [*self.serve_command, *options]


def lesson_place(pattern: str, name: str) -> str:
    """The path or address of a lesson with this name; most peers want dashes for dots there."""
    return pattern.format(name=name, dashed=name.replace(".", "-"))


def all_tools(places: Places) -> list[Tool]:
    """All tools, also those that are not installed."""
    text = Path(__file__).with_name("tools.toml").read_text(encoding="utf-8")
    tools = []
    for tool in msgspec.convert(tomllib.loads(text)["tool"], list[Tool]):
        serve_command = places.command(tool, tool.serve_program or tool.program)
        command = places.command(tool, tool.program)
        located = replace(tool, command=command, serve_command=serve_command)
        tools.append(replace(located, version=places.version(located)))
    return tools


def environment(places: Places) -> dict[str, str]:
    """The environment variables for all tools.

    Python keeps what it compiled, as it does for readers: a tool that is tried out of its sources
    would otherwise compile them anew in each run, which those that are installed do not.
    """
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    inherited = {name: v for name, v in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {
        **inherited,
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "NO_MKDOCS_2_WARNING": "1",
        "ELEVENTY_TELEMETRY": "0",
        "NODE_OPTIONS": "",
    }


def read_version(command: Sequence[str]) -> str | None:
    """The first number with dots in the output of a version command."""
    answer = gate.finish(command, {**os.environ, "PYTHONPATH": str(ROOT)}, seconds=60.0)
    match = re.search(r"\d+\.\d[\w.]*", (answer.output + answer.errors).decode(errors="replace"))
    return match[0] if match and answer.status == 0 else None
