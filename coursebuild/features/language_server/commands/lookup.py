"""What something in a text refers to, and where that is defined.

Editors read a description as Markdown, some with HTML and commands in it. What an author wrote is
text there, by `escape_text`, or code, by `code_span` and `fence`.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping
from urllib.parse import unquote

from lsprotocol import types
from msgspec import Struct

from coursebuild.api import Library, ModelFacts, Source, Span, model, regex
from coursebuild.core.checks.links import anchors
from coursebuild.core.model import Owner
from coursebuild.core.model.results import Formula
from coursebuild.core.model.walk import display_formulas
from coursebuild.core.pages.library import models_named
from coursebuild.core.pages.marks import code_span, escape_text, fence
from coursebuild.core.pages.numbering import (
    item_name,
    name_outside,
    number_items,
    number_prefix,
)
from coursebuild.core.scripts.bound_places import BoundNumber
from coursebuild.core.syntax.decode import field_description
from coursebuild.core.text.rules import RULES
from coursebuild.features.glossary import definition_of
from coursebuild.features.language_server.commands.texts import OpenTexts, field_place
from coursebuild.features.names.claims import document_names
from coursebuild.features.names.known_names import EngineName, KnownName, engine_names
from coursebuild.features.names.resolve import resolver_of
from coursebuild.features.references import reference_text, works_of
from coursebuild.features.symbols import declared_symbol, symbols
from coursebuild.pipeline.reader import kept_formulas
from coursebuild.preview.messages import printed_outputs

_ASSIGNMENT = regex(r"(\w+)\s*=\s*mujoco\.(Mj(?:Data|Model))\b")
_NAME = regex(r"(?<![\w.])[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+")
_STRING = regex(r"""(["'])([^"'\s]+)\1""")


class Referent(Struct, frozen=True):
    """What something in a text refers to."""

    span: Span
    """The place of the reference."""
    text: str
    """A description in Markdown."""
    place: Span | None = None
    """The place of the definition."""
    target: model.Target | None = None
    """The target of a link, or of a name of a lesson or a term."""


def hover(texts: OpenTexts, source: Source, params: types.HoverParams) -> types.Hover | None:
    """Describe what is at a place of a text."""
    referent = look_up(texts, source, params.position)
    if referent is None:
        return None
    text = types.MarkupContent(types.MarkupKind.Markdown, referent.text)
    return types.Hover(text, texts.places.range(referent.span))


def definition(
    texts: OpenTexts, source: Source, params: types.DefinitionParams
) -> types.Location | None:
    """Return where something at a place is defined."""
    referent = look_up(texts, source, params.position)
    place = None if referent is None else referent.place
    return None if place is None else texts.places.location(place)


def look_up(texts: OpenTexts, source: Source, position: types.Position) -> Referent | None:
    """Return what is referred to at a place of a text, if anything."""
    offset, document = texts.places.offset(source, position), texts.document(source)
    if document is not None:
        lookup = _Lookup(texts, document)
        blocks = (b for b in model.document_blocks(document) if _covers(b.span, offset))
        inlines = (i for i in model.document_inlines(document) if _touches(i.span, offset))
        for node in reversed([*blocks, *inlines]):
            if referent := lookup.look_up_node(node, offset):
                return referent
    place = field_place(source, offset)
    if place is None or place.field is None or not place.text:
        return None
    key, lesson = place.key, texts.library.lessons.get(place.text)
    if lesson is not None and key in ("id", "prerequisites"):
        definition = lesson.span if lesson.document is None else lesson.document.source.span(0, 0)
        title = f"**Lesson {lesson.id}: {escape_text(lesson.title)}**"
        return Referent(place.span, title, definition, model.LessonTarget(lesson.id, None))
    if key == "rule" and place.text in RULES:
        return Referent(place.span, RULES[place.text].summary)
    text = "" if key else field_description(place.field.type)
    return Referent(place.span, f"{code_span(place.text)}: {text}") if text else None


def label_titles(library: Library, owner: Owner | None, document: model.Document) -> dict[str, str]:
    """The names and captions of what has a label in a document: `Figure 1.2.1: The flip`."""
    prefix = number_prefix(owner.id) if isinstance(owner, model.Lesson) else ""
    items = number_items(document, library.mathml).values()
    kinds = {kind.name: library.callout(kind.name) for kind in library.course.callouts}
    titles = {item.id: item_name(item, prefix, library.words, kinds) for item in items}
    captions = {formula.id: formula.tex for formula in display_formulas(document)}
    for block, label in model.labelled_blocks(document):
        match block:
            case model.Table(caption=inlines) | model.Paragraph(children=inlines):
                captions[label.id] = model.plain_text(inlines)
            case model.Callout(title=inlines):
                captions[label.id] = model.plain_text(inlines)
            case model.Script(path=path) | model.ScriptPart(path=path):
                captions[label.id] = path
            case _:
                captions[label.id] = block.span.first_line().text
    return {id: ": ".join(filter(None, (name, captions[id]))) for id, name in titles.items()}


def _covers(span: Span, offset: int) -> bool:
    return span.start <= offset < span.end


def _touches(span: Span, offset: int) -> bool:
    return span.start <= offset <= span.end


class _Lookup:
    """Looks up what things in a document refer to."""

    def __init__(self, texts: OpenTexts, document: model.Document) -> None:
        self.texts, self.library, self.document = texts, texts.library, document

    def look_up_node(self, node: model.Block | model.Inline, offset: int) -> Referent | None:
        match node:
            case model.Link():
                course = self.library.course
                return self.look_up_link(node, model.resolve(node.target, course, node.span.path))
            case model.Term():
                return self.look_up_link(node, model.TermTarget(node.id))
            case model.Citation():
                return self.look_up_citation(node, offset)
            case model.NumberBinding():
                return self.look_up_binding(node)
            case model.Math() | model.MathBlock():
                return self.look_up_formula(node, offset)
            case model.Callout() if _covers(node.kind_span, offset):
                kind = self.library.callout(node.kind)
                label, promise = escape_text(kind.label), escape_text(kind.promise)
                return Referent(node.kind_span, f"**{label}**\n\n{promise}")
            case model.CodeSpan():
                return self.look_up_code(node, offset) or self.look_up_name(node, offset)
            case model.Script() | model.ScriptPart() | model.PlainCode() | model.FeatureBlock():
                return self.look_up_code(node, offset)
            case _:
                return None

    # --- targets of links

    def look_up_link(self, node: model.Link | model.Term, target: model.Target) -> Referent | None:
        text_and_place = self.describe_target(target)
        return text_and_place and Referent(node.span, *text_and_place, target)

    def describe_target(self, target: model.Target) -> tuple[str, Span | None] | None:
        library = self.library
        match target:
            case model.LessonTarget(id=id, anchor=anchor) if id in library.lessons:
                lesson = library.lessons[id]
                objectives = "\n".join(f"- {escape_text(text)}" for text in lesson.objectives)
                title = f"**Lesson {id}: {escape_text(lesson.title)}** ({lesson.status})"
                summary = escape_text(lesson.summary)
                return self.describe_owner(lesson, anchor, title, summary, objectives)
            case model.PageTarget(id=id, anchor=anchor) if id in library.pages:
                page = library.pages[id]
                return self.describe_owner(page, anchor, f"**{escape_text(page.title)}**")
            case model.LevelTarget(id=id) if id in library.levels:
                level = library.levels[id]
                title = f"**Level {escape_text(id)}: {escape_text(level.title)}**"
                return _paragraphs(title, escape_text(level.summary)), level.span
            case model.ModelTarget(name=name):
                return self.describe_model(name)
            case model.ExampleTarget(path=path) if path in library.scripts:
                script, owner = library.scripts[path]
                text = f"{code_span(path)}, a script of {owner.id}: {escape_text(owner.title)}"
                return text, script.path_span
            case model.TermTarget(id=id) if id in library.terms:
                return self.describe_term(id, library.terms[id])
            case model.UrlTarget(url=url) if url.startswith("#"):
                return self.describe_anchor(self.document, url[1:])
            case model.UrlTarget(url=url):
                path = model.local_file(url, self.document.source.path)
                is_file = path in library.course.files
                return (code_span(path), Source(path, "").span()) if is_file else None
            case _:
                return None

    def describe_owner(self, owner: Owner, anchor: str | None, *lines: str) -> tuple[str, Span]:
        document = self.texts.document(self.texts.source(owner.path))
        if document is None:
            return _paragraphs(*lines), owner.span
        text, place = self.describe_anchor(document, anchor or "") or (
            "",
            document.source.span(0, 0),
        )
        return _paragraphs(*lines, text), place

    def describe_anchor(self, document: model.Document, anchor: str) -> tuple[str, Span] | None:
        name = unquote(anchor)
        place = anchors(document).get(name)
        tex = next((f.tex for f in display_formulas(document) if name and f.id == name), None)
        if place is None:
            return None
        titles = label_titles(self.library, self.texts.owner(document.source), document)
        line = escape_text(titles.get(name) or place.first_line().text.lstrip("# "))
        return line if tex is None else fence("tex", tex.strip(), wary=True), place

    def describe_model(self, name: str) -> tuple[str, Span] | None:
        model_file = next((m for m in self.library.course.models if m.name == name), None)
        if model_file is None:
            return None
        facts = self.facts((name,))
        sizes = facts and (
            f"{facts.bodies} bodies, {facts.geoms} geoms; nq = {facts.nq}, nv = {facts.nv}, "
            f"nu = {facts.nu}; {facts.integrator}, timestep {facts.timestep:g} s"
        )
        source = model_file.source
        description = escape_text(model_file.description)
        text = _paragraphs(f"**{code_span(source.path)}**", description, sizes or "")
        return text, source.span(0, 0)

    def facts(self, models: Iterable[str]) -> ModelFacts | None:
        return next(filter(None, map(self.library.facts.get, models)), None)

    def describe_term(self, id: str, owner: Owner) -> tuple[str, Span] | None:
        document = self.texts.document(self.texts.source(owner.path))
        for block in () if document is None else model.document_blocks(document):
            inlines = block.children if isinstance(block, model.Paragraph) else ()
            for term in model.walk_inlines(inlines):
                if isinstance(term, model.Term) and term.id == id:
                    reference = functools.partial(name_outside, self.library, owner)
                    sentences = model.without_links(definition_of(inlines, term), reference)
                    text = model.plain_text(sentences)
                    name = f"**{escape_text(term.name)}**"
                    return _paragraphs(name, escape_text(text)), term.span
        return None

    # --- citations, formulas, numbers, code

    def look_up_citation(self, citation: model.Citation, offset: int) -> Referent | None:
        """Return the source that is cited at an offset, as pages show it."""
        cited = next((work for work in citation.works if _touches(work.span, offset)), None)
        work = None if cited is None else works_of(self.library.course).get(cited.key)
        if cited is None or work is None:
            return None
        text = reference_text(self.library.course, work.key)
        return Referent(cited.span, escape_text(text or work.field("title")), work.span)

    def look_up_formula(
        self, formula: model.Math | model.MathBlock, offset: int
    ) -> Referent | None:
        """List the symbols of a formula whose meaning the text declares."""
        mathml_by_formula = kept_formulas(
            self.texts.session.options.store, self.document.source.path
        )

        def mathml(math: model.Math | model.MathBlock) -> str:
            return mathml_by_formula.get(Formula(math.tex.text, math.display), "")

        formula_symbols = symbols(mathml(formula))
        declarations = [
            math
            for math in model.find_inlines(self.document, model.Math)
            if math.meaning and declared_symbol(mathml(math)) in formula_symbols
        ]
        if not declarations:
            return None
        lines = (
            f"- {code_span(math.tex.text)}: "
            + escape_text(meaning.text + (meaning.unit and f", {meaning.unit}"))
            for math in declarations
            if (meaning := math.meaning)
        )
        at_offset = (
            math
            for math in declarations
            for match in re.finditer(re.escape(math.tex.text), formula.span.text)
            if match.start() <= offset - formula.span.start < match.end()
        )
        return Referent(formula.span, "\n".join(lines), next(at_offset, declarations[0]).span)

    def look_up_binding(self, binding: model.NumberBinding) -> Referent | None:
        printed = printed_outputs(self.library)
        number = BoundNumber(binding, printed).text
        for verdict in printed.of_binding(binding) if number.numbers else ():
            for place in number.shown_places([printed.text(verdict)]):
                if place.span is not None:
                    printed_line = fence("text", place.line.text, wary=True)
                    text = f"{code_span(verdict.recording.script or '')} printed\n{printed_line}"
                    return Referent(binding.span, text, place.span)
        return None

    def look_up_code(
        self,
        node: (
            model.Script | model.ScriptPart | model.PlainCode | model.FeatureBlock | model.CodeSpan
        ),
        offset: int,
    ) -> Referent | None:
        text, code = node.span.source.text, node.span.text
        for string in _STRING.finditer(text, node.span.start, node.span.end):
            if _covers(place := node.span.source.span(*string.span(2)), offset):
                model_name = place.text.removeprefix("models/").removesuffix(".xml")
                if text_and_place := self.describe_model(model_name):
                    return Referent(place, *text_and_place)
        model_names: Iterable[str] = ()
        if isinstance(node, model.Script | model.ScriptPart):
            scripts = model.document_scripts(self.document)
            script = next(script for script in scripts if script.path == node.path)
            model_names, code = models_named(script), script.code.text
        elif isinstance(node, model.FeatureBlock):
            model_names = node.models()
        names = _NAME.finditer(text, node.span.start, node.span.end)
        match = next((match for match in names if match.start() <= offset < match.end()), None)
        if match is None:
            return None
        end = text.find(".", offset, match.end())
        span = node.span.source.span(match.start(), end if end >= 0 else match.end())
        *path, last = span.text.split(".")
        name = members(self.texts, tuple(path), code).get(last) if path else None
        if name is None:
            return None
        head = fence("python" if "(" in name.text else "c", name.text)
        shape = _describe_shape(name.extent, self.facts(sorted(model_names)))
        return Referent(span, _paragraphs(f"{head}\n{escape_text(name.doc)}", shape))

    def look_up_name(self, code: model.CodeSpan, offset: int) -> Referent | None:
        note = document_names(self.document)
        resolver, library = resolver_of(self.library.course), self.library
        claims = [] if note is None else [c for c in note.claims if c[1].start == code.span.start]
        for claim, _, span in sorted(claims, key=lambda claim: not _touches(claim[2], offset)):
            assert note is not None
            meaning = resolver.resolve(claim, note)
            if not isinstance(meaning, KnownName) or not meaning.text:
                continue
            path, line = note.definitions.get(claim.name, ("", 0))
            text, place = fence("python", meaning.text), None
            if path in library.scripts:
                script = library.scripts[path][0].code
                lines = script.text.splitlines(keepends=True)
                start = sum(map(len, lines[: line - 1]))
                place = script.span(start, start + len(lines[line - 1].rstrip()))
                text = fence("python", place.text)
            shape = _describe_shape(meaning.extent, None)
            return Referent(span, _paragraphs(text, escape_text(meaning.doc), shape), place)
        return None


def members(texts: OpenTexts, path: tuple[str, ...], code: str) -> Mapping[str, EngineName]:
    """Return what can follow `data.`, `model.opt.` or `mujoco.`, by name.

    The type of a variable follows from its assignment in the code, or else from its name.
    """
    engine = resolver_of(texts.library.course).engine
    if engine is None:  # no text names anything of it
        engine = engine_names(texts.session.options.store, None).names
    if path == ("mujoco",):
        return engine.functions
    roots = {"data": "MjData", "model": "MjModel"} | dict(_ASSIGNMENT.findall(code))
    fields = engine.classes.get(roots.get(path[0], ""), {})
    for name in path[1:]:
        fields = engine.classes.get(fields[name].type, {}) if name in fields else {}
    return fields


def _describe_shape(extent: tuple[str, ...], facts: ModelFacts | None) -> str:
    """Say the shape of an array, if it is one, with numbers for the sizes that are known."""
    sizes: dict[str, int] = {}
    if facts is not None:
        sizes = {"nq": facts.nq, "nv": facts.nv, "nu": facts.nu, "nbody": facts.bodies + 1}
        sizes |= {"ngeom": facts.geoms, "njnt": facts.joints, "nkey": len(facts.keyframes)}
    text = f"({', '.join(extent)}{',' * (len(extent) == 1)})"
    numbers = re.sub(r"\w+", lambda size: str(sizes.get(size[0], size[0])), text)
    suffix = f", here `{numbers}`" if numbers != text else ""
    return f"shape `{text}`{suffix}" if extent else ""


def _paragraphs(*texts: str) -> str:
    return "\n\n".join(filter(None, texts))
