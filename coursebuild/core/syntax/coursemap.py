"""The course map, content/course.toml, becomes a `Course` without documents.

Ids that differ in upper and lower case only count as the same, as not every file system tells them
apart.
"""

from __future__ import annotations

import graphlib
import re
from collections.abc import Iterable, Iterator
from decimal import Decimal
from itertools import pairwise

from msgspec.structs import asdict, replace

from coursebuild.core import model
from coursebuild.core.model.course import CALLOUTS, ENGLISH, Launch
from coursebuild.core.model.fields import Author, Silence
from coursebuild.core.syntax.course_schema import (
    CourseFile,
    LevelTable,
    PageTable,
    ThemeTable,
    VerifyTable,
    check_contrast,
    check_launch,
    theme,
)
from coursebuild.core.syntax.decode import Decoding, check_unique, decode
from coursebuild.core.syntax.fence import Prose
from coursebuild.core.syntax.nodes import (
    TOML,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
    format_name,
    shorten,
)
from coursebuild.core.syntax.other_tools import is_known_kind
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.syntax.tree import NestedTextParser
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Note,
    Parsed,
    diagnose,
    did_you_mean,
    sort_diagnostics,
)
from coursebuild.core.text.macros import COMMAND, split_argument
from coursebuild.core.text.patterns import makes_alike, pattern_mistake
from coursebuild.core.text.regex import regex
from coursebuild.core.text.rules import RULES
from coursebuild.core.text.source import Source, Span


def parse_course_map(source: Source) -> Parsed[model.Course | None]:
    """The course that the map describes, its lessons and pages not read yet. Never raises."""
    parsed_toml = parse_toml(source)
    root = parsed_toml.value
    if root is None:
        return Parsed(None, sort_diagnostics(parsed_toml.diagnostics))
    decoding = decode(root, CourseFile, "the course map", TOML)
    levels, strays = [], []
    for level_node in root.objects("level"):
        level_id, lessons = _read_id(level_node.get("id")), []
        for node, table in decoding.find_structs(model.LessonTable, level_node.objects("lesson")):
            if level_id and not table.id.startswith(f"{level_id}."):
                message = f"the lesson `{table.id}` is in the level `{shorten(level_id)}`"
                help = f"an id in this level begins with `{shorten(level_id)}.`"
                strays.append(diagnose("field-value", node.place("id"), message, help=help))
            spans = tuple(item.span for item in node.items("prerequisites"))
            lessons.append(
                model.Lesson(
                    **asdict(table),
                    span=node.span,
                    prerequisite_spans=spans,
                    level=level_id,
                    document=None,
                )
            )
        fields = decoding.structs.get(level_node)
        texts = (fields.title, fields.summary) if isinstance(fields, LevelTable) else ("", "")
        levels.append(model.Level(level_node.span, level_id, *texts, tuple(lessons)))
    nodes = [node for level in root.objects("level") for node in level.objects("lesson")]
    diagnostics = [
        *parsed_toml.diagnostics,
        *decoding.diagnostics,
        *_check_ids(root, nodes),
        *_check_files(decoding),
        *check_settings(root, decoding),
    ]
    unusable = any(diagnostic.is_error for diagnostic in diagnostics)
    diagnostics += strays
    diagnostics += _check_prerequisites(
        [lesson for level in levels for lesson in level.lessons],
        [name for node in nodes if (name := _read_id(node.get("id")))],
    )
    diagnostics += _check_paths(root, [lesson for level in levels for lesson in level.lessons])
    if unusable or decoding.value is None:
        return Parsed(None, sort_diagnostics(diagnostics))
    prose = Prose.read(decoding.texts, NestedTextParser(ParsingState(frozenset(), False, ENGLISH)))
    course = _build_course(source, root, decoding.value, tuple(levels))
    course = replace(course, bound_numbers=prose.numbers)
    diagnostics += check_contrast(root.object("theme"), course.theme)
    return Parsed(course, sort_diagnostics(diagnostics))


def _build_course(
    source: Source, root: ObjectNode, fields: CourseFile, levels: tuple[model.Level, ...]
) -> model.Course:
    settings, verify = fields.course, fields.verify or VerifyTable()
    table, gate = root.object("course"), root.object("verify")
    launch = fields.launch
    if launch is not None:
        launch = replace(launch, repository=launch.repository or settings.repository)
    kinds = {name: model.CalloutKind(name) for name in CALLOUTS}
    for name, callout in fields.callouts.items():
        texts = (callout,) if isinstance(callout, str) else (callout.label, callout.promise)
        kinds[name] = model.CalloutKind(name, *texts)
    return model.Course(
        map=source,
        title=settings.title,
        summary=settings.summary,
        language=settings.language,
        base_url=settings.base_url or "",
        repository=settings.repository or "",
        licence=settings.licence,
        authors=settings.authors,
        doi=settings.doi or "",
        version=settings.version or "",
        folds=settings.folds,
        id=settings.id or "",
        engine=settings.engine,
        engine_span=table.place("engine"),
        comparison=comparison(gate, verify),
        filters=verify.filter,
        callouts=tuple(kinds.values()),
        silences=fields.silence,
        levels=levels,
        pages=tuple(
            model.Page(
                node.span,
                page.id,
                page.title,
                page.file,
                None,
                page.menu,
                page.names,
                page.section,
                page.language,
            )
            for node, page in zip(root.objects("page"), fields.page, strict=True)
        ),
        models=(),
        paths=fields.path,
        features=_named_paths(table, "features", settings.features),
        packages=_named_paths(table, "packages", settings.packages),
        environment=tuple(sorted(verify.env.items())),
        runners=fields.runners,
        macros={
            name: member.value.excerpt
            for name, member in root.object("macros").members.items()
            if isinstance(member.value, StringNode)
        },
        width=fields.format.width if fields.format is not None else 0,
        html=fields.security.html,
        limits=fields.limits,
        launch=launch,
        theme=theme(root.object("theme"), fields.theme or ThemeTable()),
        python=model.NamedPath(verify.python, gate.place("python")) if verify.python else None,
        strict=verify.strict,
        unproven=_named_paths(gate, "unproven", verify.unproven),
        names=verify.names,
    )


def _named_paths(
    table: ObjectNode, field: str, paths: tuple[str, ...]
) -> tuple[model.NamedPath, ...]:
    places = (item.span for item in table.items(field))
    return tuple(map(model.NamedPath, paths, places))


def _read_id(node: Node | None) -> str:
    """The text of an id, even if its quotes are missing; empty if it is of another type."""
    match node:
        case StringNode():
            return node.value
        case NumberNode():
            return node.raw if isinstance(node.value, float) else str(node.value)
        case _:
            return ""


# ---------------------------------------------------------------------------------------- checks

RESERVED_IDS = frozenset({"index", "404"})
_PAGE_FILE = regex(r"(?!~|[A-Za-z]:)(?:(?!\.{0,2}/)[^\x00-\x1f\\/]+/)*(?!\.md)[^\x00-\x1f\\/]*\.md")


def _check_ids(root: ObjectNode, lessons: Iterable[ObjectNode]) -> Iterator[Diagnostic]:
    kinds = (("level", root.objects("level")), ("lesson", lessons), ("page", root.objects("page")))
    for kind, nodes in kinds:
        first_by_id: dict[str, Span] = {}
        for node in (id_node for node in nodes if (id_node := node.get("id"))):
            name = _read_id(node)
            span = first_by_id.setdefault(name.casefold(), node.span)
            if not name or span == node.span:
                continue
            message, help = f"the {kind} id `{shorten(name)}` is used twice", "case does not count"
            notes = (Note("the first one is here", span),)
            yield diagnose("id-repeated", node.span, message, help=help, notes=notes)


def _check_files(decoding: Decoding[CourseFile]) -> Iterator[Diagnostic]:
    files: list[tuple[str, Span]] = []
    for node, fields in decoding.find_structs(PageTable):
        place = node.place("file")
        files.append((fields.file, place))
        if fields.id in RESERVED_IDS:
            message = f"a page cannot have the id `{fields.id}`"
            help = "the site has a file of this name already"
            yield diagnose("field-value", node.place("id"), message, help=help)
        if not _PAGE_FILE.fullmatch(fields.file):
            message = f"`{shorten(fields.file)}` is no path of a Markdown file"
            help = "a path relative to the project, as in `content/pages/about.md`"
            yield diagnose("field-value", place, message, help=help)
    yield from check_unique(files, "field-value", "two pages have the file `{}`")


# ---------------------------------------------------------------------------------- prerequisites


def _check_prerequisites(lessons: list[model.Lesson], ids: Iterable[str]) -> Iterator[Diagnostic]:
    """Report unknown and repeated prerequisites, and lessons that require each other in a circle.

    `ids` has those of all lessons, even of those with mistakes in other fields.
    """
    lesson_by_id = {lesson.id: lesson for lesson in reversed(lessons)}
    names = {*lesson_by_id, *ids}
    for lesson in lessons:
        pairs = list(zip(lesson.prerequisites, lesson.prerequisite_spans, strict=True))
        yield from check_unique(pairs, "field-value", "the prerequisite `{}` is named twice")
        for name, span in pairs:
            if name not in names:
                message = f"no lesson of the map has the id `{shorten(name)}`"
                help = did_you_mean(name, names)
                yield diagnose("prerequisite-unknown", span, message, help=help)
    graph = {lesson.id: lesson_by_id[lesson.id].prerequisites for lesson in lessons}
    while True:
        try:
            graphlib.TopologicalSorter(graph).prepare()
            return
        except graphlib.CycleError as error:
            circle: list[str] = error.args[1][:0:-1]
        at = circle.index(next(name for name in graph if name in circle))  # the first in the map
        circle = [*circle[at:], *circle[: at + 1]]
        graph = {name: graph[name] for name in graph if name not in circle}
        notes = []
        for name, required in pairwise(circle):
            lesson = lesson_by_id[name]
            span = lesson.prerequisite_spans[lesson.prerequisites.index(required)]
            notes.append(Note(f"{name} requires {required} here", span))
        message, help = f"lesson {circle[0]} requires itself", "remove it"
        if len(notes) > 1:
            message = f"lessons require each other in a circle: {' → '.join(circle)}"
            help = "remove one of these prerequisites"
        place = notes[0].span or lesson_by_id[circle[0]].span
        yield diagnose("prerequisite-cycle", place, message, help=help, notes=notes[1:])


def _check_paths(root: ObjectNode, lessons: Iterable[model.Lesson]) -> Iterator[Diagnostic]:
    """Report lessons of paths that the map does not have, or that are named twice in one."""
    names = [lesson.id for lesson in lessons]
    for path in root.objects("path"):
        items = [item for item in path.items("lessons") if isinstance(item, StringNode)]
        steps = [(item.value, item.span) for item in items]
        yield from check_unique(steps, "field-value", "the lesson `{}` is named twice")
        picture = path.get("picture")
        pictured = [(picture.value, picture.span)] if isinstance(picture, StringNode) else []
        for name, span in (*steps, *pictured):
            if name not in names:
                message = f"no lesson of the map has the id `{shorten(name)}`"
                yield diagnose("path-unknown", span, message, help=did_you_mean(name, names))


_DIFFERENT_TEXTS = (("length 1.962 cm", "length 2.481 cm"), ("length 1.962 cm", "weight 1.962 cm"))
"""What no filter may take for the same, or else it would do so with any numbers or words."""
_VARIABLE = regex(r"(?!PYTHON|PATH$|TMPDIR$)[A-Za-z_][A-Za-z0-9_]*")
_LANGUAGE = regex(r"[a-z0-9][a-z0-9+#._-]*")
_CALLOUT = regex(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


def check_settings(root: ObjectNode, decoding: Decoding[CourseFile]) -> Iterator[Diagnostic]:
    """Check what the types of these tables cannot say."""
    for node, fields in decoding.find_structs(VerifyTable):
        tolerances = [m for name in ("rtol", "atol") if (m := node.members.get(name)) is not None]
        if fields.compare == "rtol" and not tolerances:
            message = '`compare = "rtol"` needs `rtol` or `atol`'
            yield diagnose("field-missing", node.place("compare"), message)
        if fields.compare in ("exact", "digits"):
            for member in tolerances:
                message = f'`{member.key.value}` counts only with `compare = "rtol"`'
                yield diagnose("field-value", member.key.span, message)
    for node, author in decoding.find_structs(Author):
        if author.is_misspelt:
            message = f"`{author.orcid}` is no ORCID iD: its last digit does not fit the others"
            yield diagnose("field-value", node.place("orcid"), message)
    for node, places in decoding.find_structs(Launch):
        repository = root.object("course").get("repository")
        address = repository.value if isinstance(repository, StringNode) else None
        yield from check_launch(node, places, address)
    for node, filter in decoding.find_structs(model.Filter):
        if (mistake := pattern_mistake(filter.pattern)) is not None:
            message = f"the pattern does not compile: {mistake[0]}"
            yield diagnose("field-value", _place(node, "pattern", mistake[1]), message)
        elif (mistake := pattern_mistake(filter.pattern, filter.replacement)) is not None:
            message = f"the replacement cannot be used: {mistake[0]}"
            yield diagnose("field-value", _place(node, "replacement", mistake[1]), message)
        else:
            for texts in _DIFFERENT_TEXTS:
                if makes_alike(filter.pattern, filter.replacement, texts):
                    message = "to this filter `{}` and `{}` are the same".format(*texts)
                    help = "say what stands beside what varies, as in `took [0-9.]+ s`; or write "
                    help += '`volatile="…"` on a fence, so that its page tells readers what varies'
                    yield diagnose("field-value", node.place("pattern"), message, help=help)
                    break
    for name, member in root.object("verify").object("env").members.items():
        if not _VARIABLE.fullmatch(name):
            message = f"{format_name(name)} cannot be set for scripts"
            help = "expected: a name of your own, as in `FAST`"
            yield diagnose("field-value", member.key.span, message, help=help)
    yield from _check_macros(root.object("macros"))
    for name, member in root.object("callouts").members.items():
        if not _CALLOUT.fullmatch(name):
            message = f"{format_name(name)} cannot be a kind of callout"
            help = "expected: lower-case letters and digits in words joined by single hyphens"
            yield diagnose("field-value", member.key.span, message, help=help)
    for _, course in decoding.find_structs(CourseFile):
        for name, commands in course.runners.items():
            if not any("{file}" in word for command in commands for word in command):
                message = f"no argument of `{name}` has `{{file}}`, the path of the script"
                yield diagnose("field-value", root.object("runners").place(name), message)
    for name, member in root.object("runners").members.items():
        if is_known_kind(name) or not _LANGUAGE.fullmatch(name):
            message = f"{format_name(name)} is no kind of block that holds another language"
            help = "expected: the first word of the fence, in lower case, as in `c`"
            if name == model.PYTHON:
                help = "Python scripts are run by `python` in `[verify]`"
            yield diagnose("field-value", member.key.span, message, help=help)
    for node, silence in decoding.find_structs(Silence):
        rule = RULES.get(silence.rule)
        if rule is None:
            names = [name for name, entry in RULES.items() if entry.severity != "error"]
            message = f"there is no rule {format_name(silence.rule)}"
            help = did_you_mean(silence.rule, names)
            yield diagnose("silence-rule", node.place("rule"), message, help=help)
        elif rule.severity == "error":
            message = f"`{silence.rule}` is an error; only warnings and hints can be silenced"
            yield diagnose("silence-rule", node.place("rule"), message)
        if not silence.reason.strip():
            message, help = "the silence gives no reason", 'say why: `reason = "…"`'
            yield diagnose("silence-rule", node.place("reason"), message, help=help)


def _check_macros(table: ObjectNode) -> Iterator[Diagnostic]:
    """Report names that no command has, braces that do not match, and macros without an end."""
    bodies: dict[str, StringNode] = {}
    for name, member in table.members.items():
        if not re.fullmatch("[A-Za-z]+", name):
            message = f"{format_name(name)} cannot be the name of a macro"
            help = "expected: letters, without a backslash, as in `RR`"
            yield diagnose("field-value", member.key.span, message, help=help)
        elif isinstance(member.value, StringNode):
            bodies[name] = member.value
    for name, node in bodies.items():
        whole = Source("", f"{{{node.value}}}")
        if (split := split_argument(whole.excerpt())) is None or split[1].text:
            message = f"the braces of the macro `\\{name}` do not match"
            yield diagnose("field-value", node.span, message)
    graph = {name: COMMAND.findall(node.value) for name, node in bodies.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        name = next(name for name in bodies if name in error.args[1])
        message = f"the macro `\\{name}` stands for itself, so that it has no end"
        yield diagnose("field-value", bodies[name].span, message)


def comparison(node: ObjectNode, fields: VerifyTable) -> model.Comparison:
    """The comparison of outputs whose fence names none; tolerances alone mean `rtol`."""
    rtol, atol = _decimal(node, "rtol"), _decimal(node, "atol")
    implied = "exact" if rtol is None and atol is None else "rtol"
    mode = model.Mode(fields.compare or implied)
    return model.Comparison(mode, rtol or Decimal(0), atol or Decimal(0), fields.ellipsis)


def _decimal(node: ObjectNode, name: str) -> Decimal | None:
    """The number as it is written, not its nearest double."""
    value = node.get(name)
    if not isinstance(value, NumberNode):
        return None
    return Decimal(value.raw) if isinstance(value.value, float) else Decimal(value.value)


def _place(node: ObjectNode, name: str, at: int | None) -> Span:
    """The character at an offset of a string, or the whole string."""
    value = node.get(name)
    if not isinstance(value, StringNode) or at is None or at >= len(value.value):
        return node.place(name)
    return value.excerpt.span(at, at + 1)
