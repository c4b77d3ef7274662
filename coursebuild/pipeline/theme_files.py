"""Reads and checks the files of a course's theme.

A copied template names in its first line the text that it was copied from, by some digits of its
hash. Where the tool has another text by now, the author gets a warning.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

from msgspec.structs import replace

from coursebuild import __version__
from coursebuild.core.drawing.picture_size import picture_size
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes, read_folder
from coursebuild.core.files.resources import template_texts
from coursebuild.core.model import Course
from coursebuild.core.model.course import PICTURES, TEMPLATES, Theme, ThemeFile
from coursebuild.core.pages.renderer import TemplateFailure, find_template_error
from coursebuild.core.pages.theme import course_face
from coursebuild.core.scripts.figures import prepare_figure
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, did_you_mean
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Source

_ORIGIN = regex(r"\{# Copied from coursebuild (\S+): (\w+)")
_LOADS = regex(r"""@import[^;]*|url\(\s*["']?(?!#|data:|["'\s])[^()]*\)""", re.IGNORECASE)
"""Parts of a style sheet that load another file."""


def load_theme(root: Path, theme: Theme) -> Parsed[Theme]:
    """Read the files of a theme, and check them."""
    diagnostics: list[Diagnostic] = []

    def read(file: ThemeFile | None) -> ThemeFile | None:
        if file is None:
            return None
        try:
            return replace(file, data=read_bytes(root, file.path))
        except EffectError as error:
            diagnostics.append(diagnose("theme-file", file.span, error.message))
            return None

    def read_all(files: tuple[ThemeFile, ...]) -> tuple[ThemeFile, ...]:
        return tuple(whole for file in files if (whole := read(file)) is not None)

    templates = read_folder(root, TEMPLATES.rstrip("/"))
    whole = replace(
        theme,
        **{name: read(getattr(theme, name)) for name in PICTURES},
        css=read_all(theme.css),
        fonts=tuple(
            replace(
                family,
                files=read_all(family.files),
                licence=read(family.licence) or family.licence,
            )
            for family in theme.fonts
        ),
        templates=templates.value,
    )
    mistakes = (
        *diagnostics,
        *templates.diagnostics,
        *_check_files(whole),
        *_check_templates(whole),
    )
    return Parsed(whole, mistakes)


def _check_files(theme: Theme) -> Iterator[Diagnostic]:
    for file in theme.pictures:
        picture = prepare_figure(file.path, file.data)
        if isinstance(picture, str):
            yield diagnose("theme-file", file.span, f"`{file.path}` {picture}")
        elif file in (theme.icon, theme.touch_icon):
            width, height = picture_size(file.data) or (1, 1)
            if width != height:
                message = f"`{file.path}` is not square: {width:g} × {height:g}"
                yield diagnose("theme-file", file.span, message)
    for file in theme.css:
        loads = _LOADS.search(re.sub(r"/\*.*?\*/", "", file.text, flags=re.DOTALL))
        if loads is not None:
            message = f"`{file.path}` loads another file: `{loads[0].strip()}`"
            help = "name style sheets in `css`, and write pictures into them, as `url(data:…)`"
            yield diagnose("theme-file", file.span, message, help=help)
    for family in theme.fonts:
        for file in family.files:
            face = course_face(family.use, file.path.rpartition("/")[2], file.data)
            if isinstance(face, str):
                yield diagnose("theme-file", file.span, f"`{file.path}` {face}")


# --- templates


def _originals() -> dict[str, str]:
    return {name: text for name, text in template_texts() if name.endswith(".html")}


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def template_copies() -> dict[str, str]:
    """The tool's templates by name, each below a line that says which version it is of."""
    return {
        name: f"{{# Copied from coursebuild {__version__}: {_digest(text)} #}}\n{text}"
        for name, text in _originals().items()
    }


def _check_templates(theme: Theme) -> Iterator[Diagnostic]:
    originals = _originals() if theme.templates else {}
    for source in theme.templates:
        name = source.path.removeprefix(TEMPLATES)
        if name not in originals:
            message, help = f"coursebuild has no template `{name}`", did_you_mean(name, originals)
            yield diagnose("template-unknown", source.span(0, 0), message, help=help)
            continue
        mistake = find_template_error(source.text)
        if mistake is not None:
            yield _diagnose_template(source, *mistake)
        first = source.text.partition("\n")[0]
        origin, now = _ORIGIN.match(first), _digest(originals[name])
        if origin is None or origin[2] != now:
            message = f"`{name}` of coursebuild has changed since it was copied"
            if origin is None:
                message = f"it is not said which `{name}` of coursebuild this was copied from"
            help = (
                f"`coursebuild new template {name} --print` prints it; take over its first line too"
            )
            yield diagnose("template-outdated", source.span(0, len(first)), message, help=help)


def template_diagnostic(course: Course, failure: TemplateFailure) -> Diagnostic:
    """The diagnostic of a template that failed while a page was drawn."""
    sources = {source.path: source for source in course.theme.templates}
    return _diagnose_template(sources[failure.path], failure.line, failure.message)


def _diagnose_template(source: Source, line: int, message: str) -> Diagnostic:
    start = source.line_starts[min(line, len(source.line_starts)) - 1]
    span = source.span(start, start + len(source.line_text(line).rstrip()))
    return diagnose("template-broken", span, message[:1].lower() + message[1:].rstrip("."))
