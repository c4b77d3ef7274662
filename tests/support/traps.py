"""A course whose folder is full of traps: files that run, or are obeyed, by whoever is careless.

Each writes its name into a file beside the course. A trap in the place of a module does so and
nothing else: what imports it fails as well.
"""

from __future__ import annotations

import os
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

from coursebuild.core.registry import features
from support.fixture_cases import fixture_text
from support.scratch_course import Folder, course_map
from support.workflows import git

PROGRAMS = """
uv pip3 git node npm chromium chromium-headless-shell google-chrome python python3 gvim bwrap sh
systemd-run sysctl uname fc-list gcc cc ldconfig emacs subl xdg-open git-order
""".split()
HOOKS = "usercustomize sitecustomize conftest"
COMMANDS: dict[str, tuple[tuple[str, ...], ...]] = {
    "bench": (("bench", "--quick"),),
    "build": (("build",), ("build", "--sandbox")),
    "check": (
        ("check",),
        ("check", "--sandbox", "--strict"),
        ("check", "--fix"),
        ("check", "--propose"),
        ("check", "--sensitivity"),
        ("check", "--truth"),
        ("check", "--against", "3.9.1"),
    ),
    "completion": (("completion", "bash"), ("completion", "bash", "--", "bench", "-")),
    "diet": (("diet", "--quick"),),
    "diff": (("diff", "HEAD"), ("diff", "HEAD", "--sandbox")),
    "doctor": (("doctor",), ("doctor", "--install-engine")),
    "explain": (("explain", "link-text"), ("explain", "1.1"), ("explain", "models/box.xml")),
    "export": tuple(
        ("export", exporter.name, *(("1.1",) if exporter.of_lesson else ()))
        for feature in features()
        for exporter in feature.exporters
    ),
    "extract": (("extract",),),
    "fmt": (("fmt",), ("fmt", "--check")),
    "help": (("help",), ("help", "bench"), ("--version",)),
    "import": tuple(
        ("import", "content/lessons", "--out", "../new", *options)
        for options in ((), ("--prove", "--sandbox"))
    ),
    "init": (("init", "new"),),
    "new": (("new", "lesson", "1.2", "B"), ("new", "feature", "x"), ("new", "model", "y")),
    "rename": (("rename", "1.1", "1.2"),),
    "schema": (("schema", "course"),),
    "stability": (("stability", "projectile"),),
    "undo": (("undo",),),
    "update": (("update",),),
}
"""Each command with the options by which it does something else."""
OF_MJBENCH = (
    ("--help",),
    ("models/box.xml", "--quick", "--engines", "threads"),
    ("diet", "models/box.xml", "--quick"),
)
"""Commands of mjbench, which are given without a course as well."""
LESSON = fixture_text("documents/trapped_lesson.md")
RUNNERS = """
[runners]
sh = [["sh", "{file}"]]
"""
BOX = fixture_text("documents/trapped_model.xml")
SCENARIO = """[[scenario]]
name = "fall"
title = "It falls"
duration = 0.1
"""


class TrapFolder:
    """The course, and which of its traps have run."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self._file_of_marks = folder.root.with_name("marks")
        folder.write("content/course.toml", course_map(1) + RUNNERS)
        folder.write(folder.lesson(), LESSON)
        folder.write("models/box.xml", BOX)
        folder.write("models/box.toml", SCENARIO)
        folder.write(".gitattributes", "* filter=trap diff=trap\n")
        folder.tmp.mkdir(exist_ok=True)
        git(folder.root, "init", "--quiet")
        git(folder.root, "add", ".")
        git(folder.root, "commit", "--quiet", "-m", "a course")
        self._set_module_traps()
        for program in PROGRAMS:
            self._set_program(program)
        self._set_settings()
        # Python opens a file of this name for the line of a mistake: that would never end.
        os.mkfifo(folder.root / "<unknown>")

    def marks(self) -> list[str]:
        """The names of the traps that have run."""
        return (
            sorted({*self._file_of_marks.read_text().splitlines()})
            if self._file_of_marks.exists()
            else []
        )

    def _code(self, name: str) -> str:
        """Code that needs no module, each of which may be a trap."""
        return f"open({str(self._file_of_marks)!r}, 'a').write({name!r} + '\\n')\n"

    def _set_module_traps(self) -> None:
        for name in {*sys.stdlib_module_names, *packages_distributions(), *HOOKS.split()}:
            if name.isidentifier() and name not in ("mjcourse", "coursebuild"):
                self.folder.write(f"{name}.py", self._code(f"module {name}"))
        for package in ("pip", "coursebuild", "coursebuild_cluster"):
            for part in ("__init__", "__main__"):
                self.folder.write(f"{package}/{part}.py", self._code(f"package {package}"))

    def _set_program(self, name: str) -> None:
        self.folder.write(
            name, f"#!/bin/sh\necho 'program {name}' >> '{self._file_of_marks}'\nexit 1\n"
        )
        (self.folder.root / name).chmod(0o755)

    def _set_settings(self) -> None:
        write = self.folder.write
        index = "http://127.0.0.1:9/simple"
        write("uv.toml", f'[pip]\nindex-url = "{index}"\n')
        write("pyproject.toml", f'[tool.uv]\nindex-url = "{index}"\n[tool.uv.pip]\nsystem = true\n')
        write("pip.conf", f"[global]\nindex-url = {index}\n")
        write(".npmrc", f"registry={index}\n")
        write("matplotlibrc", "backend: module://trap_of_matplotlib\n")
        write("trap_of_matplotlib.py", self._code("matplotlibrc"))
        write(".env", "PYTHONSTARTUP=sitecustomize.py\n")
        write("setup.cfg", "[tool:pytest]\naddopts = -p sitecustomize\n")
        write(".git/info/attributes", "* filter=trap diff=trap\n")
        order = str(self.folder.root / "git-order")
        config = (self.folder.root / ".git/config").read_text()
        for section, *keys in (
            (
                "core",
                "fsmonitor",
                "pager",
                "sshCommand",
                "editor",
                "askPass",
                "alternateRefsCommand",
            ),
            ('filter "trap"', "clean", "smudge", "process"),
            ('diff "trap"', "textconv", "command"),
            ("pager", "rev-parse", "ls-tree", "cat-file", "archive"),
            ("alias", "rev-parse", "ls-tree", "cat-file", "merge-base"),
            ("uploadpack", "packObjectsHook"),
        ):
            config += f"[{section}]\n" + "".join(f"\t{key} = {order}\n" for key in keys)
        write(".git/config", f"{config}[core]\n\thooksPath = .\n")


def variables(**more_variables: str) -> dict[str, str]:
    """Of a user whose PATH begins with the working folder, and who reaches no package index."""
    return {
        "PATH": f".::{os.environ['PATH']}",
        "PIP_NO_INDEX": "1",
        "PYTHONPATH": "",
        **more_variables,
    }


def tool(*arguments: str) -> list[str]:
    """A command as users give it: by the script that an installer makes."""
    return [str(Path(sys.executable).with_name("coursebuild")), *arguments]


def mjbench(*arguments: str) -> list[str]:
    """The same of mjbench; the script of an installer only begins it."""
    return [sys.executable, "-P", "-m", "mjbench", *arguments]
