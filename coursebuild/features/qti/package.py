"""Quizzes as a content package of IMS QTI 2.1.

Entry point: `package_files(context)`: one test for each quiz, one item for each question, the
pictures that they show, and a manifest that lists every file with the item that shows it.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

from coursebuild.core.model import Course, document_blocks
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.library import owners
from coursebuild.core.pages.xml import XSI, Element, add, document, element, identifier
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.features.qti.flow import STRUCK
from coursebuild.features.qti.items import NAMESPACE, SCHEMA, STYLE, QuizItems, quiz_items
from coursebuild.features.quiz.model import Quiz

_CP = "http://www.imsglobal.org/xsd/imscp_v1p1"
_CP_SCHEMA = "http://www.imsglobal.org/xsd/qti/qtiv2p1/qtiv2p1_imscpv1p2_v1p0.xsd"
_STYLE_SHEET = f"""\
.{STRUCK} {{ text-decoration: line-through; }}
.align-center {{ text-align: center; }}
.align-right {{ text-align: right; }}
"""


def package_files(context: ExportContext) -> Iterator[SiteFile | Diagnostic]:
    """The files, none where no question has an answer; and what items cannot hold."""
    quizzes: list[QuizItems] = []
    for quiz in _quizzes(context):
        for span, loss in quiz.losses:
            message = f"this question is not whole in the QTI package: {loss}"
            yield diagnose("package-reduced", span, message)
        if quiz.items:
            quizzes.append(quiz)
            yield OutputFile(_test_path(quiz), _test(quiz))
            for item in quiz.items:
                yield OutputFile(f"items/{item.identifier}.xml", item.data)
    if quizzes:
        shown = {path for quiz in quizzes for item in quiz.items for path in item.pictures}
        for path in context.course.files:
            if urls.file_path(path) in shown:
                read = functools.partial(context.read, path)
                yield CachedFile(urls.file_path(path), "", read)
        yield OutputFile(STYLE, _STYLE_SHEET.encode())
        root = _manifest(context.course, quizzes)
        yield OutputFile("imsmanifest.xml", document(root, pretty=True))


def _quizzes(context: ExportContext) -> Iterator[QuizItems]:
    """All quizzes, in the order of the course."""
    for owner in owners(context.course):
        summary = owner.document
        if summary and any(isinstance(block, Quiz) for block in document_blocks(summary)):
            page = context.page(summary)
            for block in document_blocks(page.document):
                if isinstance(block, Quiz):
                    yield quiz_items(page, block, context.course)


def _test_path(quiz: QuizItems) -> str:
    return f"tests/{quiz.identifier}.xml"


def _manifest(course: Course, quizzes: list[QuizItems]) -> Element:
    resources = element("resources")
    for quiz in quizzes:
        add(resources, *_resources(quiz))
    return element(
        "manifest",
        {
            "xmlns": _CP,
            "xmlns:xsi": XSI,
            "xsi:schemaLocation": f"{_CP} {_CP_SCHEMA} {NAMESPACE} {SCHEMA}",
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


def _resources(quiz: QuizItems) -> Iterator[Element]:
    """A test with its items, then these."""
    path = _test_path(quiz)
    given = {"identifier": f"RES-{quiz.identifier}", "type": "imsqti_test_xmlv2p1", "href": path}
    names = (f"RES-{item.identifier}" for item in quiz.items)
    needs = (element("dependency", {"identifierref": name}) for name in names)
    yield element("resource", given, _file(path), *needs)
    for item in quiz.items:
        path = f"items/{item.identifier}.xml"
        given = {"identifier": f"RES-{item.identifier}", "type": "imsqti_item_xmlv2p1"}
        files = (_file(path), _file(STYLE), *map(_file, item.pictures))
        yield element("resource", given | {"href": path}, *files)


def _file(path: str) -> Element:
    return element("file", {"href": urls.encode(path)})


def _test(quiz: QuizItems) -> bytes:
    """A test of one section, whose points are the sum of those of its items."""
    items = (
        element(
            "assessmentItemRef",
            {"identifier": item.identifier, "href": f"../items/{item.identifier}.xml"},
        )
        for item in quiz.items
    )
    section = {"identifier": "section", "title": quiz.title, "visible": "true"}
    part = {"identifier": "part", "navigationMode": "nonlinear", "submissionMode": "individual"}
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
        element("testPart", part, element("assessmentSection", section, *items)),
        element(
            "outcomeProcessing", {}, element("setOutcomeValue", {"identifier": "SCORE"}, total)
        ),
    )
    return document(root, pretty=True)
