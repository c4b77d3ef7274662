"""What something in a text stands for, and where that is said.

Entry points: `hover`, `definition`.

1. In a document it is the smallest thing at the place that stands for something: a link, a term, a
   bound number, a formula, a kind of callout, a model or a name of the engine in code.
2. In JSON and TOML it is a key, of which its declaration says what it is, or the id of a lesson.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from urllib.parse import unquote

from lsprotocol import types
from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.checks.links import anchors
from coursebuild.core.model import Owner
from coursebuild.core.model.equations import display_formulas
from coursebuild.core.model.results import Formula, ModelFacts
from coursebuild.core.pages.library import Library, models_named
from coursebuild.core.scripts.bindings import PrintedOutputs
from coursebuild.core.scripts.bound_numbers import BoundText
from coursebuild.core.syntax.decode import field_description
from coursebuild.core.text.rules import RULES
from coursebuild.core.text.source import Source, Span
from coursebuild.features.glossary.sentences import definition_of
from coursebuild.features.language_server.commands.engine import described_name
from coursebuild.features.language_server.commands.fields import field_place
from coursebuild.features.language_server.commands.texts import OpenTexts
from coursebuild.features.symbols.mathml import only_symbol, symbols
from coursebuild.pipeline.reading import kept_formulas

_QUOTED = re.compile(r"""(["'])([^"'\s]+)\1""")


class Referent(Struct, frozen=True):
    """What something stands for."""

    span: Span
    """That which stands for it."""
    text: str
    """What it is, as Markdown."""
    place: Span | None = None
    """Where that is said."""
    target: model.Target | None = None
    """Of a link, and of a name of a lesson or a term."""


def hover(texts: OpenTexts, source: Source, asked: types.HoverParams) -> types.Hover | None:
    """What stands at a place of a text."""
    found = look_up(texts, source, asked.position)
    if found is None:
        return None
    text = types.MarkupContent(types.MarkupKind.Markdown, found.text)
    return types.Hover(text, texts.places.range(found.span))


def definition(
    texts: OpenTexts, source: Source, asked: types.DefinitionParams
) -> types.Location | None:
    """Where it is said what stands at a place."""
    found = look_up(texts, source, asked.position)
    place = None if found is None else found.place
    return None if place is None else texts.places.location(place)


def look_up(texts: OpenTexts, source: Source, position: types.Position) -> Referent | None:
    """What stands at a place of a text, if it stands for anything."""
    offset, document = texts.places.offset(source, position), texts.document(source)
    if document is not None:
        lookup = _Lookup(texts, document)
        blocks = (b for b in model.document_blocks(document) if _covers(b.span, offset))
        inlines = (i for i in model.document_inlines(document) if _touches(i.span, offset))
        for node in reversed([*blocks, *inlines]):
            if found := lookup.of_node(node, offset):
                return found
    return _of_field(texts.library, source, offset)


def _covers(span: Span, offset: int) -> bool:
    return span.start <= offset < span.end


def _touches(span: Span, offset: int) -> bool:
    return span.start <= offset <= span.end


def _of_field(library: Library, source: Source, offset: int) -> Referent | None:
    place = field_place(source, offset)
    if place is None or place.field is None or not place.text:
        return None
    key, lesson = place.key, library.lessons.get(place.text)
    if lesson is not None and key in ("id", "prerequisites"):
        at = lesson.span if lesson.document is None else lesson.document.source.span(0, 0)
        title = f"**Lesson {lesson.id}: {lesson.title}**"
        return Referent(place.span, title, at, model.LessonTarget(lesson.id, None))
    if key == "rule" and place.text in RULES:
        return Referent(place.span, RULES[place.text].summary)
    said = "" if key else field_description(place.field.type)
    return Referent(place.span, f"`{place.text}`: {said}") if said else None


class _Lookup:
    """Of things in one document."""

    def __init__(self, texts: OpenTexts, document: model.Document) -> None:
        self.texts, self.library, self.document = texts, texts.library, document

    def of_node(self, node: model.Block | model.Inline, offset: int) -> Referent | None:
        """What a node stands for, or what stands at the offset in it."""
        match node:
            case model.Link():
                course = self.library.course
                return self.link(node, model.resolve(node.target, course, node.span.path))
            case model.Term():
                return self.link(node, model.TermTarget(node.id))
            case model.NumberBinding():
                return self.binding(node)
            case model.Math() | model.MathBlock():
                return self.formula(node, offset)
            case model.Callout() if _covers(node.kind_span, offset):
                kind = self.library.callout(node.kind)
                return Referent(node.kind_span, f"**{kind.label}**\n\n{kind.promise}")
            case model.Script() | model.PlainCode() | model.FeatureBlock() | model.CodeSpan():
                return self.code(node, offset)
            case _:
                return None

    # --- what links lead to

    def link(self, node: model.Link | model.Term, target: model.Target) -> Referent | None:
        found = self.target(target)
        return found and Referent(node.span, *found, target)

    def target(self, target: model.Target) -> tuple[str, Span | None] | None:
        """What a link leads to, and where that is; `None` where there is no such thing."""
        library = self.library
        match target:
            case model.LessonTarget(id=id, anchor=anchor) if id in library.lessons:
                lesson = library.lessons[id]
                learnt = "\n".join(f"- {one}" for one in lesson.objectives)
                title = f"**Lesson {id}: {lesson.title}** ({lesson.status})"
                return self.owner(lesson, anchor, title, lesson.summary, learnt)
            case model.PageTarget(id=id, anchor=anchor) if id in library.pages:
                return self.owner(library.pages[id], anchor, f"**{library.pages[id].title}**")
            case model.LevelTarget(id=id) if id in library.levels:
                level = library.levels[id]
                return f"**Level {id}: {level.title}**\n\n{level.summary}", level.span
            case model.ModelTarget(name=name):
                return self.of_model(name)
            case model.ExampleTarget(path=path) if path in library.scripts:
                script, owner = library.scripts[path]
                return f"`{path}`, a script of {owner.id}: {owner.title}", script.path_span
            case model.TermTarget(id=id) if id in library.terms:
                return self.term(id, library.terms[id])
            case model.UrlTarget(url=url) if url.startswith("#"):
                return self.anchor(self.document, url[1:])
            case model.UrlTarget(url=url):
                path = model.local_file(url, self.document.source.path)
                known = path in library.course.files
                return (f"`{path}`", Source(path, "").span()) if known else None
            case _:
                return None

    def owner(self, owner: Owner, anchor: str | None, *lines: str) -> tuple[str, Span]:
        document = self.texts.document(self.texts.source(owner.path))
        if document is None:
            return _paragraphs(*lines), owner.span
        text, place = self.anchor(document, anchor or "") or ("", document.source.span(0, 0))
        return _paragraphs(*lines, text), place

    def anchor(self, document: model.Document, anchor: str) -> tuple[str, Span] | None:
        """What an id of a page is: a formula, or the line at its place."""
        name = unquote(anchor)
        place = anchors(document).get(name)
        tex = next((f.tex for f in display_formulas(document) if name and f.id == name), None)
        if place is None:
            return None
        line = place.first_line().text.lstrip("# ")
        return line if tex is None else f"```tex\n{tex.strip()}\n```", place

    def of_model(self, name: str) -> tuple[str, Span] | None:
        found = next((one for one in self.library.course.models if one.name == name), None)
        if found is None:
            return None
        facts = self.facts((name,))
        held = facts and (
            f"{facts.bodies} bodies, {facts.geoms} geoms; nq = {facts.nq}, nv = {facts.nv}, "
            f"nu = {facts.nu}; {facts.integrator}, timestep {facts.timestep:g} s"
        )
        path = found.source.path
        return _paragraphs(f"**{path}**", found.description, held or ""), found.source.span(0, 0)

    def facts(self, models: Iterable[str]) -> ModelFacts | None:
        """Those of the first of some models that compiles."""
        return next(filter(None, map(self.library.facts.get, models)), None)

    def term(self, id: str, owner: Owner) -> tuple[str, Span] | None:
        """What the glossary says of a term."""
        document = self.texts.document(self.texts.source(owner.path))
        for block in () if document is None else model.document_blocks(document):
            inlines = block.children if isinstance(block, model.Paragraph) else ()
            for term in model.walk_inlines(inlines):
                if isinstance(term, model.Term) and term.id == id:
                    inlines = model.without_links(definition_of(inlines, term))
                    said = (i.text if isinstance(i, model.Text) else i.span.text for i in inlines)
                    return _paragraphs(f"**{term.name}**", "".join(said).strip()), term.span
        return None

    # --- formulas, numbers, code

    def formula(self, formula: model.Math | model.MathBlock, offset: int) -> Referent | None:
        """The symbols in a formula whose meaning the text declares."""
        known = kept_formulas(self.texts.store, self.document.source.path)

        def mathml(one: model.Math | model.MathBlock) -> str:
            display = isinstance(one, model.MathBlock) or one.display
            return known.get(Formula(one.tex.text, display), "")

        shown = symbols(mathml(formula))
        found = [
            one
            for one in model.document_inlines(self.document)
            if isinstance(one, model.Math) and one.meaning and only_symbol(mathml(one)) in shown
        ]
        if not found:
            return None
        said = (
            f"- `{one.tex.text}`: {meaning.text}{meaning.unit and f', {meaning.unit}'}"
            for one in found
            if (meaning := one.meaning)
        )
        at = (one for one in found if _stands_at(one.tex.text, formula.span, offset))
        return Referent(formula.span, "\n".join(said), next(at, found[0]).span)

    def binding(self, binding: model.NumberBinding) -> Referent | None:
        """The printed line that bears a number out."""
        results, shown = self.library.results, BoundText.of(binding.text)
        printed = PrintedOutputs(results.verdicts, results.runs, self.library.scripts)
        for verdict in printed.of_binding(binding) if shown.numbers else ():
            for window in shown.windows(printed.lines(verdict)):
                if shown.shows(window) and window.line.locate is not None:
                    place = window.line.locate(window.numbers[0].start, window.numbers[-1].end)
                    said = f"`{verdict.recording.script}` printed\n```text\n{window.line.text}\n```"
                    return Referent(binding.span, said, place)
        return None

    def code(
        self,
        node: model.Script | model.PlainCode | model.FeatureBlock | model.CodeSpan,
        offset: int,
    ) -> Referent | None:
        """A model in quotes, or a name of the engine."""
        text = node.span.source.text
        for quoted in _QUOTED.finditer(text, node.span.start, node.span.end):
            if _covers(place := node.span.source.span(*quoted.span(2)), offset):
                found = self.of_model(place.text.removeprefix("models/").removesuffix(".xml"))
                if found is not None:
                    return Referent(place, *found)
        named: Iterable[str] = ()
        if isinstance(node, model.Script):
            named = models_named(node)
        elif isinstance(node, model.FeatureBlock):
            named = node.models()
        described = described_name(node.span, offset, self.facts(sorted(named)))
        return described and Referent(*described)


def _stands_at(tex: str, span: Span, offset: int) -> bool:
    """Whether some TeX stands at an offset of a formula."""
    found = re.finditer(re.escape(tex), span.text)
    return any(one.start() <= offset - span.start < one.end() for one in found)


def _paragraphs(*texts: str) -> str:
    return "\n\n".join(filter(None, texts))
