"""Another id for a lesson, wherever the course names it, as `coursebuild rename` gives it.

Entry points: `lesson_id`, one at a place; `rename`, the edits and the file's new path.
"""

from __future__ import annotations

from lsprotocol import types
from msgspec.structs import replace
from pygls.exceptions import JsonRpcInvalidParams

from coursebuild.core.files.errors import UsageError
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Source
from coursebuild.features.authoring.course_map import with_lesson_renamed
from coursebuild.features.authoring.references import references
from coursebuild.features.language_server.commands.lookup import look_up
from coursebuild.features.language_server.commands.texts import OpenTexts


def lesson_id(
    texts: OpenTexts, source: Source, asked: types.PrepareRenameParams
) -> types.Range | None:
    """Where the id of a lesson stands, if it is named at a place."""
    found = look_up(texts, source, asked.position)
    if found is None or found.lesson is None:
        return None
    id = found.lesson.id
    start = found.span.start + max(found.span.text.rfind(id), 0)
    return texts.places.range(source.span(start, start + len(id)))


def rename(
    texts: OpenTexts, source: Source, asked: types.RenameParams
) -> types.WorkspaceEdit | None:
    """The edits that give the lesson at a place another id, and then its file another name.

    Raises:
        JsonRpcInvalidParams: the map cannot have this id.
    """
    found = look_up(texts, source, asked.position)
    if found is None or found.lesson is None:
        return None
    lesson, id, course, places = found.lesson, asked.new_name, texts.library.course, texts.places
    edits = references(course, lesson, id)
    of_map = [edit for edit in edits if edit.span.source == course.map]
    try:
        whole_map = Edit(course.map.span(), with_lesson_renamed(course, lesson, id, of_map))
    except UsageError as error:
        raise JsonRpcInvalidParams(str(error)) from None
    changes = places.changes([whole_map, *(edit for edit in edits if edit not in of_map)])
    named = types.OptionalVersionedTextDocumentIdentifier
    files = [types.TextDocumentEdit(named(uri), its) for uri, its in changes.items()]
    old, new = places.uri(lesson.path), places.uri(replace(lesson, id=id).path)
    moved = [] if lesson.document is None else [types.RenameFile(old, new)]
    return types.WorkspaceEdit(document_changes=[*files, *moved])
