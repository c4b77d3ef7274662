"""`coursebuild rename`: change a lesson's id wherever the course names it."""

from __future__ import annotations

import argparse

from msgspec.structs import replace

from coursebuild.api import (
    FAILURE,
    Lesson,
    UsageError,
    did_you_mean,
    load_course,
    options_of,
)
from coursebuild.core.files.course_root import FOLDERS
from coursebuild.core.files.read import read_bytes, read_folder
from coursebuild.core.files.write import FileChange
from coursebuild.core.model.lesson_record import record_path
from coursebuild.core.scripts.edit import edited_texts
from coursebuild.core.text.characters import printable
from coursebuild.features.authoring.commands import apply_changes
from coursebuild.features.authoring.course_map import (
    doubtful_places,
    rename_references,
    with_lesson_renamed,
)
from coursebuild.output import fail
from coursebuild.pipeline.options import documents_by_name
from coursebuild.report.text import location
from coursebuild.report.values import plural

EXAMPLES = """\
examples:
  coursebuild rename 1.4 1.6
  coursebuild rename 1.4 2.1 --leave      where code, comments or ranges mention it as well
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("old", metavar="LESSON", help="id, slug or file of the lesson")
    parser.add_argument("new", metavar="ID", help="the new id")
    parser.add_argument("--leave", action="store_true", help="leave ambiguous mentions as they are")


def run(arguments: argparse.Namespace) -> int:
    """Change the map, the lesson's file, and all references to it."""
    root = options_of(arguments).root
    course, new = load_course(root), arguments.new
    lesson = documents_by_name(course).get(arguments.old)
    if not isinstance(lesson, Lesson):
        help = did_you_mean(arguments.old, [lesson.id for lesson in course.lessons])
        raise UsageError(f"no lesson is called `{arguments.old}`", help=help)
    edits = rename_references(course, lesson, new)
    in_map = [edit for edit in edits if edit.span.source == course.map]
    texts = edited_texts(edits) | {course.map: with_lesson_renamed(course, lesson, new, in_map)}
    changes = [FileChange.of(*change) for change in texts.items()]
    if lesson.document is not None:
        new_path = replace(lesson, id=new).path
        for old_file, new_file in (
            (lesson.path, new_path),
            (record_path(lesson.path), record_path(new_path)),
        ):
            if (root / old_file).is_file():
                data = read_bytes(root, old_file)
                unchanged = FileChange(old_file, data, data)
                change = next((c for c in changes if c.path == old_file), unchanged)
                changes = [c for c in changes if c is not change]
                changes.append(FileChange(new_file, None, change.new))
                changes.append(FileChange(old_file, change.old, None))
    folders = sorted((*FOLDERS, "src"))
    sources = [s for top in folders for s in read_folder(root, top, (".py", ".js")).value]
    doubtful = doubtful_places(course, lesson, new, edits, sources)
    if doubtful and not arguments.leave:
        lines = [f"{plural(len(doubtful), 'place')} may mean lesson {lesson.id}:"]
        for span in doubtful:
            text = printable(span.source.line_text(span.line).strip())
            lines.append(f"  {location(span)}: {text}")
        help = "edit them first, or leave them as they are with --leave; nothing was changed"
        return fail(FAILURE, "\n".join(lines), help)
    return apply_changes(root, changes)
