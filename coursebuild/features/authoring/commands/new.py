"""`coursebuild new`: add a lesson, a level, a page, a model, a template or a feature."""

from __future__ import annotations

import argparse
import keyword
import re
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment

from coursebuild.api import CLEAN, UsageError, did_you_mean, load_course, options_of, regex, write
from coursebuild.core.files.write import FileChange
from coursebuild.core.model.course import TEMPLATES
from coursebuild.core.registry import CORE_FENCES, features, fence_names
from coursebuild.core.syntax.course_schema import slug_of
from coursebuild.features.authoring.commands import apply_changes
from coursebuild.features.authoring.course_map import (
    with_feature,
    with_lesson,
    with_level,
    with_page,
)
from coursebuild.pipeline.theme_files import template_copies

EXAMPLES = """\
examples:
  coursebuild new lesson 1.4 "Large swings"
  coursebuild new level 2 "Two degrees of freedom"
  coursebuild new page "About this course"
  coursebuild new model pendulum
  coursebuild new template base.html
  coursebuild new feature timeline
"""
_LESSON = "## First section\n\nText.\n"
_MODEL = """\
<mujoco model="{}">
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1"/>
    <body name="ball" pos="0 0 0.8">
      <freejoint/>
      <geom name="ball" size="0.3" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""
_FEATURE = Path(__file__).parents[1] / "feature"
_NAME = regex(r"\w[\w-]*(?:/\w[\w-]*)*", re.ASCII)


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    kinds = parser.add_subparsers(metavar="KIND", required=True, prog=parser.prog)
    lesson = kinds.add_parser("lesson", help="a draft, and its entry in the course map")
    lesson.add_argument("id", metavar="ID", help="id in the course, such as 1.4 in level 1")
    lesson.add_argument("title", metavar="TITLE", help="title shown to readers")
    lesson.add_argument("--slug", help="name in its file and address (default: from the title)")
    lesson.set_defaults(add=_new_lesson)
    level = kinds.add_parser("level", help="an empty level in the course map")
    level.add_argument("id", metavar="ID", help="id in the course: a number or a word")
    level.add_argument("title", metavar="TITLE", help="title shown to readers")
    level.set_defaults(add=_new_level)
    page = kinds.add_parser(
        "page", help="a page outside the lessons, and its entry in the course map"
    )
    page.add_argument("title", metavar="TITLE", help="title shown to readers")
    page.add_argument("--id", help="name in its file, address and links (default: from the title)")
    page.set_defaults(add=_new_page)
    model = kinds.add_parser("model", help="a model of a ball above a floor, in models/")
    model.add_argument(
        "name", metavar="NAME", help="name of letters, digits, `_` and `-`; `/` for folders"
    )
    model.set_defaults(add=_new_model)
    template = kinds.add_parser("template", help="a copy of a page template, for you to change")
    template.add_argument(
        "name",
        metavar="NAME",
        help="name of the template, such as base.html or blocks/callout.html",
    )
    template.add_argument(
        "--print", action="store_true", help="print the template without writing a file"
    )
    template.set_defaults(add=_new_template)
    feature = kinds.add_parser(
        "feature", help="a kind of fence with its tests, and its entry in the course map"
    )
    feature.add_argument("name", metavar="NAME", help="name of its fence, in lower-case letters")
    feature.add_argument(
        "--script", action="store_true", help="add a script that runs on its pages"
    )
    feature.set_defaults(add=_new_feature)


def run(arguments: argparse.Namespace) -> int:
    """Write the files."""
    root = options_of(arguments).root
    changes: Sequence[FileChange] = arguments.add(root, arguments)
    if getattr(arguments, "print", False):
        return write("".join((change.new or b"").decode() for change in changes), CLEAN)
    return apply_changes(root, changes)


def _new_lesson(root: Path, arguments: argparse.Namespace) -> list[FileChange]:
    course = load_course(root, code="none")
    id, title = arguments.id, arguments.title
    _check_text(title)
    slug = arguments.slug or _name_from(title, "--slug")
    new_map = with_lesson(course, id, slug, title)
    return [
        FileChange.of(course.map, new_map),
        FileChange(f"content/lessons/{id}-{slug}.md", None, _LESSON.encode()),
    ]


def _new_level(root: Path, arguments: argparse.Namespace) -> list[FileChange]:
    course = load_course(root, code="none")
    _check_text(arguments.title)
    return [FileChange.of(course.map, with_level(course, arguments.id, arguments.title))]


def _new_page(root: Path, arguments: argparse.Namespace) -> list[FileChange]:
    course, title = load_course(root, code="none"), arguments.title
    _check_text(title)
    id = arguments.id or _name_from(title, "--id")
    path = f"content/pages/{id}.md"
    new_map = with_page(course, id, title, path)
    return [
        FileChange.of(course.map, new_map),
        FileChange(path, None, _LESSON.encode()),
    ]


def _name_from(title: str, option: str) -> str:
    slug = slug_of(title)
    if slug == slug_of(""):
        raise UsageError(f"`{title}` makes no name for a file", help=f"choose one with `{option}`")
    return slug


def _check_text(title: str) -> None:
    if any("\ud800" <= char <= "\udfff" for char in title):
        raise UsageError("the title is not UTF-8")


def _new_model(root: Path, arguments: argparse.Namespace) -> list[FileChange]:
    name = arguments.name
    if not _NAME.fullmatch(name):
        raise UsageError(f"`{name}` is not a name for a model: use letters, digits, `_` and `-`")
    return [FileChange(f"models/{name}.xml", None, _MODEL.format(name).encode())]


def _new_template(root: Path, arguments: argparse.Namespace) -> list[FileChange]:
    name, copies = arguments.name, template_copies()
    if name not in copies:
        raise UsageError(f"there is no template `{name}`", help=did_you_mean(name, copies))
    return [FileChange(f"{TEMPLATES}{name}", None, copies[name].encode())]


def _new_feature(root: Path, arguments: argparse.Namespace) -> list[FileChange]:
    course, name = load_course(root, code="none"), arguments.name
    if not re.fullmatch("[a-z][a-z0-9]*", name) or keyword.iskeyword(name):
        raise UsageError(f"`{name}` is not a name for a feature: use lower-case letters")
    if name in {*CORE_FENCES, *fence_names(), *(feature.name for feature in features())}:
        raise UsageError(f"there is already a feature or a fence `{name}`")
    path = f"features/{name}.py"
    templates = {path: "feature.txt", f"tests/test_{name}.py": "test.txt"}
    new_map = with_feature(course, path)
    changes = [FileChange.of(course.map, new_map)]
    jinja = Environment(trim_blocks=True, keep_trailing_newline=True)
    for path, file in templates.items():
        template = jinja.from_string((_FEATURE / file).read_text(encoding="utf-8"))
        text = template.render(script=arguments.script)
        text = text.replace("example", name).replace("Example", name.capitalize())
        changes.append(FileChange(path, None, text.encode()))
    return changes
