"""coursebuild and its peers: their places, commands and configurations.

Entry point: `all_tools(places)`. A peer that is not installed has no version and is not measured.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCRIPT_KINDS = ("scripts", "last", "installed")
"""The folders of `.coursebuild/` with results of scripts, which a cold build may use."""


@dataclass(frozen=True, slots=True)
class Places:
    """Where the peers are installed."""

    python: Path | None
    """The folder `bin` of an environment with `benchmarks/peers.txt` in it."""
    node: Path | None
    """A folder `node_modules` with what `benchmarks/package.json` names."""

    def python_tool(self, name: str) -> str | None:
        """A command of that environment."""
        return None if self.python is None else shutil.which(name, path=str(self.python))

    def node_tool(self, package: str, script: str) -> str | None:
        """A script of a package."""
        path = None if self.node is None else self.node / package / script
        return str(path) if path is not None and path.exists() else None

    def node_version(self, package: str) -> str | None:
        """The version of a package, if it is there."""
        path = None if self.node is None else self.node / package / "package.json"
        if path is None or not path.exists() or shutil.which("node") is None:
            return None
        return str(json.loads(path.read_text(encoding="utf-8"))["version"])


@dataclass(frozen=True, slots=True)
class Tool:
    """One generator of sites, in one configuration."""

    key: str
    title: str
    flavor: str
    """Of the course that it builds."""
    math: str
    """Where formulas are typeset."""
    version: str | None
    """`None` where it is not installed."""
    configuration: str
    """In words."""
    build: list[str] | None
    """The command for a build; none: not built."""
    products: tuple[str, ...]
    """What a cold build must not find; a pattern with a last part `!a,b` spares those names."""
    page: Callable[[str], str]
    """From a lesson's name to its built page."""
    source: Callable[[str], str]
    """From a lesson's name to its file."""
    serve: Callable[[int], list[str]] | None
    """The command for a preview on a port; none: not measured."""
    address: Callable[[str], str]
    """From a lesson's name to where the preview has it."""
    only_incremental: bool = False
    """Whether this is a variant of another tool that differs only in builds that are not cold."""


def all_tools(places: Places) -> list[Tool]:
    """All tools, also those that are not installed."""
    return [
        coursebuild(),
        *mkdocs(places),
        zensical(places),
        sphinx(places),
        pelican(places),
        *hugo(places),
        eleventy(places),
        vitepress(places),
    ]


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


def dash_name(name: str) -> str:
    """A lesson's name with dashes for dots, as most peers want it in addresses."""
    return name.replace(".", "-")


def read_version(command: list[str] | None) -> str | None:
    """The first number with dots in the output of a version command."""
    if command is None:
        return None
    process = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        timeout=60,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    match = re.search(r"\d+\.\d[\w.]*", process.stdout + process.stderr)
    return match[0] if match and process.returncode == 0 else None


def command_if_installed(tool: str | None, *arguments: str) -> list[str] | None:
    """A command, if its program is there."""
    return None if tool is None else [tool, *arguments]


def coursebuild() -> Tool:
    """This project."""
    command = [sys.executable, "-m", "coursebuild"]
    return Tool(
        "coursebuild",
        "coursebuild",
        "coursebuild",
        "build",
        read_version([*command, "--version"]),
        "as it comes; scripts' results known, all else made anew in a cold build",
        [*command, "build", "--quiet"],
        ("public", f".coursebuild/!{','.join(SCRIPT_KINDS)}"),
        lambda name: f"public/lessons/{name}.html",
        lambda name: f"content/lessons/{name}.md",
        lambda port: [*command, "serve", "--quiet", "--port", str(port)],
        lambda name: f"/lessons/{name}.html",
    )


def mkdocs(places: Places) -> list[Tool]:
    """MkDocs with Material, and its option that skips pages whose file is older than the page."""
    program = places.python_tool("mkdocs")
    version = read_version(command_if_installed(program, "--version"))
    tools = []
    for key, extra in (("mkdocs", []), ("mkdocs-dirty", ["--dirty"])):
        tools.append(
            Tool(
                key,
                "MkDocs with Material" + (" --dirty" if extra else ""),
                "mkdocs",
                "reader",
                version,
                "Material, pymdownx, search; " + ("with --dirty" if extra else "as it comes"),
                [program or "", "build", "--quiet", *extra],
                ("site",),
                lambda name: f"site/lessons/{name}/index.html",
                lambda name: f"docs/lessons/{name}.md",
                lambda port, extra=extra: [  # type: ignore[misc]
                    *[program or "", "serve", "--quiet", *extra],
                    *["--dev-addr", f"127.0.0.1:{port}"],
                ],
                lambda name: f"/methods/lessons/{name}/",
                only_incremental=bool(extra),
            )
        )
    return tools


def zensical(places: Places) -> Tool:
    """Zensical, on the files of MkDocs."""
    program = places.python_tool("zensical")
    return Tool(
        "zensical",
        "Zensical",
        "mkdocs",
        "reader",
        read_version(command_if_installed(program, "--version")),
        "the files of MkDocs with Material",
        [program or "", "build"],
        ("site", ".cache"),
        lambda name: f"site/lessons/{name}/index.html",
        lambda name: f"docs/lessons/{name}.md",
        lambda port: [program or "", "serve", "--dev-addr", f"127.0.0.1:{port}"],
        lambda name: f"/methods/lessons/{name}/",
    )


def sphinx(places: Places) -> Tool:
    """Sphinx with MyST-Parser."""
    program = places.python_tool("sphinx-build")
    preview = places.python_tool("sphinx-autobuild")
    arguments = ["--quiet", "--jobs", "auto", ".", "_build"]
    return Tool(
        "sphinx",
        "Sphinx with MyST",
        "sphinx",
        "reader",
        read_version(command_if_installed(program, "--version")),
        "MyST-Parser, the default theme, --jobs auto; preview by sphinx-autobuild",
        [program or "", *arguments],
        ("_build",),
        lambda name: f"_build/lessons/{name}.html",
        lambda name: f"lessons/{name}.md",
        None
        if preview is None
        else lambda port: [preview, "--port", str(port), "--ignore", "*/_build/*", *arguments],
        lambda name: f"/lessons/{name}.html",
    )


def pelican(places: Places) -> Tool:
    """Pelican."""
    program = places.python_tool("pelican")
    serving = ["--listen", "--autoreload", "--quiet", "--bind", "127.0.0.1", "--port"]
    return Tool(
        "pelican",
        "Pelican",
        "pelican",
        "reader",
        read_version(command_if_installed(program, "--version")),
        "the theme `simple`, no feeds, content cache on",
        [program or "", "--quiet"],
        ("output", "cache", "__pycache__"),
        lambda name: f"output/{dash_name(name)}.html",
        lambda name: f"content/{name}.md",
        lambda port: [program or "", *serving, str(port)],
        lambda name: f"/{dash_name(name)}.html",
    )


def hugo(places: Places) -> list[Tool]:
    """Hugo with formulas in the build, and without."""
    program = places.python_tool("hugo") or shutil.which("hugo")
    version = read_version(command_if_installed(program, "version"))
    cache_option = ["--cacheDir", "{folder}/.cache"]  # with formulas in it: a cold build has none
    serving = ["server", "--bind", "127.0.0.1", *cache_option, "--port"]
    return [
        Tool(
            key,
            "Hugo" + ("" if math == "build" else ", math by the reader"),
            key,
            math,
            version,
            "layouts of a few lines; " + typesetting,
            [program or "", "build", "--quiet", *cache_option],
            ("public", "resources", ".cache", ".hugo_build.lock"),
            lambda name: f"public/lessons/{dash_name(name)}/index.html",
            lambda name: f"content/lessons/{name}.md",
            lambda port: [program or "", *serving, str(port), "--baseURL", "http://127.0.0.1/"],
            lambda name: f"/lessons/{dash_name(name)}/",
        )
        for key, math, typesetting in (
            ("hugo", "build", "transform.ToMath"),
            ("hugo_reader", "reader", "formulas as they are"),
        )
    ]


def eleventy(places: Places) -> Tool:
    """Eleventy."""
    program = places.node_tool("@11ty/eleventy", "cmd.cjs")
    return Tool(
        "eleventy",
        "Eleventy",
        "eleventy",
        "build",
        places.node_version("@11ty/eleventy"),
        "markdown-it, KaTeX, Prism, a layout of a few lines; preview with --incremental",
        ["node", program or "", "--quiet"],
        ("_site", ".cache"),
        lambda name: f"_site/lessons/{dash_name(name)}/index.html",
        lambda name: f"content/lessons/{dash_name(name)}.md",
        lambda port: [
            *["node", program or "", "--quiet", "--serve", "--incremental", f"--port={port}"]
        ],
        lambda name: f"/lessons/{dash_name(name)}/",
    )


def vitepress(places: Places) -> Tool:
    """VitePress, for its preview."""
    program = places.node_tool("vitepress", "bin/vitepress.js")
    return Tool(
        "vitepress",
        "VitePress",
        "vitepress",
        "build",
        places.node_version("vitepress"),
        "MathJax and Shiki; renders the page that is asked for, as a module",
        None,
        (),
        lambda name: "",
        lambda name: f"lessons/{dash_name(name)}.md",
        lambda port: [
            "node",
            program or "",
            "dev",
            ".",
            "--port",
            str(port),
            "--host",
            "127.0.0.1",
        ],
        lambda name: f"/lessons/{dash_name(name)}.md",
    )
