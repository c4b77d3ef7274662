"""Quizzes as a content package of IMS QTI 2.1.

Entry points: `quiz_paths` and `quiz_file`, `style_file`, `manifest`.

One test for each quiz, one item for each question, and the pictures that they show. Paths:
`imsmanifest.xml`, `style.css`, `tests/….xml`, `items/….xml`, `files/…`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec.structs import replace

from coursebuild.core.model import Course
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.packages.flow import STRUCK
from coursebuild.core.pages.packages.items import NAMESPACE, SCHEMA, STYLE, MadeItem, MadeQuiz
from coursebuild.core.pages.packages.xml import (
    XSI,
    Element,
    document,
    element,
    identifier,
    long_document,
)

MANIFEST = "imsmanifest.xml"
CP = "http://www.imsglobal.org/xsd/imscp_v1p1"
_CP_SCHEMA = "http://www.imsglobal.org/xsd/qti/qtiv2p1/qtiv2p1_imscpv1p2_v1p0.xsd"
_STYLE = f"""\
.{STRUCK} {{ text-decoration: line-through; }}
.align-center {{ text-align: center; }}
.align-right {{ text-align: right; }}
"""


def test_path(quiz: MadeQuiz) -> str:
    """Where a quiz is in the package."""
    return f"tests/{quiz.identifier}.xml"


def item_path(item: MadeItem) -> str:
    """Where a question is."""
    return f"items/{item.identifier}.xml"


def quiz_paths(quiz: MadeQuiz) -> Iterator[str]:
    """The files of a quiz: its test, and its items."""
    yield test_path(quiz)
    yield from map(item_path, quiz.items)


def quiz_file(quizzes: Iterable[MadeQuiz], path: str) -> bytes:
    """The bytes of one of the files of quizzes (`KeyError` where it is none)."""
    for quiz in quizzes:
        if path == test_path(quiz):
            return _test(quiz)
        for item in quiz.items:
            if path == item_path(item):
                return item.data
    raise KeyError(path)


def without_bytes(quiz: MadeQuiz) -> MadeQuiz:
    """What the manifest needs of a quiz."""
    return replace(quiz, items=tuple(replace(item, data=b"") for item in quiz.items), losses=())


def style_file() -> OutputFile:
    """The style sheet of all items."""
    return OutputFile(STYLE, _STYLE.encode())


def manifest(course: Course, quizzes: Iterable[MadeQuiz]) -> OutputFile:
    """The package's manifest, which lists every file with the item that shows it."""
    resources = element("resources")
    root = element(
        "manifest",
        {
            "xmlns": CP,
            "xmlns:xsi": XSI,
            "xsi:schemaLocation": f"{CP} {_CP_SCHEMA} {NAMESPACE} {SCHEMA}",
            "identifier": identifier("course.", course.key),
        },
        element(
            "metadata",
            {},
            element("schema", {}, "QTIv2.1 Package"),
            element("schemaversion", {}, "1.0.0"),
        ),
        element("organizations"),
        resources,
    )
    return OutputFile(MANIFEST, long_document(root, resources, _resources(quizzes)))


def _resources(quizzes: Iterable[MadeQuiz]) -> Iterator[Element]:
    """A test with its items, then these."""
    for quiz in quizzes:
        names = [f"RES-{item.identifier}" for item in quiz.items]
        path = test_path(quiz)
        given = {"identifier": f"RES-{quiz.identifier}", "type": "imsqti_test_xmlv2p1"}
        needs = (element("dependency", {"identifierref": name}) for name in names)
        yield element("resource", given | {"href": path}, _file(path), *needs)
        for item, name in zip(quiz.items, names, strict=True):
            path = item_path(item)
            files = (_file(path), _file(STYLE), *map(_file, item.pictures))
            given = {"identifier": name, "type": "imsqti_item_xmlv2p1", "href": path}
            yield element("resource", given, *files)


def _file(path: str) -> Element:
    return element("file", {"href": urls.encode(path)})


def _test(quiz: MadeQuiz) -> bytes:
    """A test of one section, whose points are the sum of those of its items."""
    items = (
        element(
            "assessmentItemRef", {"identifier": item.identifier, "href": f"../{item_path(item)}"}
        )
        for item in quiz.items
    )
    section = element(
        "assessmentSection",
        {"identifier": "section", "title": quiz.title, "visible": "true"},
        *items,
    )
    how = {"navigationMode": "nonlinear", "submissionMode": "individual"}
    score = {"identifier": "SCORE", "cardinality": "single", "baseType": "float"}
    total = element("sum", {}, element("testVariables", {"variableIdentifier": "SCORE"}))
    root = element(
        "assessmentTest",
        {
            "xmlns": NAMESPACE,
            "xmlns:xsi": XSI,
            "xsi:schemaLocation": f"{NAMESPACE} {SCHEMA}",
            "identifier": quiz.identifier,
            "title": quiz.title,
        },
        element("outcomeDeclaration", score),
        element("testPart", {"identifier": "part"} | how, section),
        element(
            "outcomeProcessing", {}, element("setOutcomeValue", {"identifier": "SCORE"}, total)
        ),
    )
    return document(root, pretty=True)
