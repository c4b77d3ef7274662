"""The scripts of a course: what is extracted to which path, and which lesson line each line is.

Two paths clash when they are equal, when they differ only in upper and lower case, or when one is a
folder on the way to the other. The first in the order of the course stays.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable

from msgspec import Struct

from coursebuild.core.model import Course, Limits, Script, document_scripts
from coursebuild.core.model.results import ScriptJob
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.core.text.source import Span


class Extraction(Struct, frozen=True):
    """A script and the file that it becomes."""

    script: Script
    owner: str
    """The id of the lesson or page that it stands in."""
    packages: tuple[str, ...] = ()
    environment: tuple[tuple[str, str], ...] = ()
    memory: int = Limits().scripts
    is_run: bool = True
    commands: tuple[tuple[str, ...], ...] = ()
    """What runs it, where Python does not; see `Course.runners`."""

    @property
    def path(self) -> str:
        """POSIX path relative to the project root."""
        return self.script.path

    @property
    def text(self) -> str:
        """LF line ends, ending in exactly one newline."""
        return self.script.code.text.rstrip("\n") + "\n"

    @property
    def data(self) -> bytes:
        return self.text.encode()

    @property
    def document(self) -> str:
        """The path of the lesson or page."""
        return self.script.span.path

    def line_span(self, line: int) -> Span | None:
        """Where a line of the file (from 1) stands in the lesson; `None` if it has no such line."""
        lines = self.script.code.lines()
        if not 1 <= line <= len(lines) or (line == len(lines) and not lines[-1].text):
            return None
        return lines[line - 1].span()


def is_run(course: Course, script: Script) -> bool:
    """Whether a script is to be run; one of another language needs a runner of the map."""
    return not script.norun and (script.is_python or script.language in course.runners)


def extract(course: Course) -> Parsed[tuple[Extraction, ...]]:
    """The scripts of a course in order, no two of which clash."""
    extractions: list[Extraction] = []
    diagnostics: list[Diagnostic] = []
    files: dict[str, Extraction] = {}
    folders: dict[str, Extraction] = {}
    packages = tuple(package.path for package in course.packages)
    for owner, document in course.owned_documents:
        for script in document_scripts(document):
            extraction = Extraction(
                script,
                owner.id,
                packages,
                course.environment,
                course.limits.scripts,
                is_run(course, script),
                course.runners.get(script.language, ()),
            )
            # Equal for paths that some file system takes for the same file
            key = unicodedata.normalize("NFC", script.path).casefold()
            blocking_file = next((files[f] for f in _folders(key) if f in files), None)
            first = files.get(key) or folders.get(key) or blocking_file
            if first is None:
                files[key] = extraction
                for folder in _folders(key):
                    folders.setdefault(folder, extraction)
                extractions.append(extraction)
                continue
            path, first_path = script.path, first.path
            help = "give one of them another path"
            note = f"`{first_path}` is written here"
            if first_path == path:
                message, note = f"two blocks have the file `{path}`", "the first one is here"
                if first.document == document.source.path:
                    help += ", or say `part` if it goes on with the file"
            else:
                message = f"`{path}` and `{first_path}` cannot both be written everywhere"
            notes = [Note(note, first.script.path_span)]
            diagnostics.append(
                diagnose("script-repeated", script.path_span, message, help=help, notes=notes)
            )
    return Parsed(tuple(extractions), tuple(diagnostics))


_PATIENCE = 3.0
"""How many times as long a script may take when its initial states are moved."""


def jobs(
    extractions: Iterable[Extraction], perturbation: int = 0, *, keeps_going: bool = False
) -> tuple[ScriptJob, ...]:
    """The jobs that run these scripts; see `ScriptJob.perturbation`, which takes longer."""
    patience = _PATIENCE if perturbation else 1.0
    return tuple(
        ScriptJob(
            extraction.path,
            extraction.script.args,
            extraction.script.timeout * patience,
            extraction.script.requires,
            perturbation,
            extraction.packages,
            extraction.environment,
            extraction.script.writes,
            tuple(figure.name for figure in extraction.script.figures),
            extraction.memory,
            extraction.script.part_lines,
            keeps_going,
            extraction.commands,
        )
        for extraction in extractions
    )


def _folders(key: str) -> list[str]:
    """The folders that a path lies in."""
    parts = key.split("/")
    return ["/".join(parts[:end]) for end in range(1, len(parts))]
