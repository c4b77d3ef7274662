"""`coursebuild fmt`: format lessons and pages."""

from __future__ import annotations

import argparse

from coursebuild.api import CLEAN, FAILURE, Lesson, Source, load_course, options_of, write
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import FileChange
from coursebuild.features.authoring.commands import apply_changes
from coursebuild.features.authoring.format import format_document
from coursebuild.output import fail
from coursebuild.pipeline.arguments import add_lessons
from coursebuild.pipeline.options import select
from coursebuild.pipeline.outputs import changed_text
from coursebuild.report.text import location

EXAMPLES = """\
examples:
  coursebuild fmt
  coursebuild fmt 1.2 --diff              what would change
  coursebuild fmt --check                 in a workflow, or before a commit
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add_lessons(parser)
    parser.add_argument("--check", action="store_true", help="only say which files would change")
    parser.add_argument("--diff", action="store_true", help="only show what would change")


def run(arguments: argparse.Namespace) -> int:
    """Format the files, all or none of them; those with mistakes stay as they are."""
    root = options_of(arguments).root
    course, status = load_course(root), CLEAN
    new_texts: dict[Source, str] = {}
    documents = select(course, tuple(arguments.lessons), root)
    for owner, document in course.owned_documents:
        if documents is not None and owner.path not in documents:
            continue
        source, lesson, width = document.source, isinstance(owner, Lesson), course.width
        callouts, words = course.callout_names, course.words_of(owner)
        new = format_document(source, callouts, lesson=lesson, width=width, words=words)
        mistakes = [f"{location(d.span)}: {d.message}" for d in new.diagnostics]
        if read_bytes(root, source.path) != source.text.encode():
            mistakes = [f"{source.path} is not UTF-8"]
        if mistakes:
            message = f"{source.path} has mistakes, and is left as it is"
            status = fail(FAILURE, message, f"fix this first: {mistakes[0]}")
        elif new.value != source.text:
            new_texts[source] = new.value
    if arguments.diff:
        lines = [changed_text("would format", source, new) for source, new in new_texts.items()]
    elif arguments.check:
        lines = [f"would format {source.path}" for source in new_texts]
    else:
        changes = [FileChange.of(*change) for change in new_texts.items()]
        return max(status, apply_changes(root, changes))
    return write("".join(f"{line}\n" for line in lines), FAILURE if lines else status)
