"""Finds the numbers that a document claims, and what proves each.

Entry points: `document_claims(document)`, `course_claims(course)`, `sum_claims(claims)`;
`check_sources`, of the numbers that name a file of the course as their source.

1. A number in digits is a claim, except: a whole number up to twelve without a unit, which counts
   or names as a word does; a year; what only looks like a number (versions, dates, `x1`).
2. Headings, footnotes (which name sources), code, addresses, links to lessons, pages and models,
   and recorded outputs have no claims.
3. In formulas a side that is a number is one claim, and so is a side with symbols in which a number
   has a point. A chain whose arithmetic was checked is one claim, with symbols that have values
   too. The value of a symbol is one where it is given, and proven by its source or its script.
4. A number bound to the output of a script that was not run is not proven.
5. A number in an alternative text, where nothing can be marked, is proven if the same number is
   bound or given in the document.
6. A file that is named as a source must have the number: in the unit of the text or in base units,
   perhaps with more digits. A model may have half of it, since MJCF writes radii and half-lengths.
   A source that is no path is for readers to judge.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from operator import itemgetter

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose, did_you_mean
from coursebuild.core.text.numbers import Number, point_decimals, scan_prose
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.core.text.units import UNIT_PATTERN, find_unit
from coursebuild.features.arithmetic.evaluate import FormulaComparison, measure, read_numeral
from coursebuild.features.arithmetic.expressions import Expression
from coursebuild.features.arithmetic.statements import FormulaSide, read_statements
from coursebuild.features.arithmetic.symbol_values import check_formulas

_PATH = re.compile(r"[\w.-]+(?:/[\w.-]+)+\.[a-z]+|(?:content|examples|lib|models|runs)/.*")
"""A source that is a file, also where its name is misspelt."""
_NUMBER = re.compile(r"(?<![\w.])(?:\d+(?:_\d{3})*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


class NamedNumber(Struct, frozen=True):
    """A number whose source is a file."""

    span: Span
    path: str
    text: str
    values: tuple[tuple[float, float], ...]
    """Its value and one unit of its last place: as literals, and in base units."""

    def is_in(self, numbers: Iterable[float]) -> bool:
        """Whether one of these, rounded to its digits, is this number."""
        return any(
            2 * abs(abs(number) - abs(value)) <= step * (1 + 1e-9)
            for number in numbers
            for value, step in self.values
        )


def named_numbers(document: model.Document) -> Iterator[NamedNumber]:
    """Yield the numbers of a document whose source is a path."""
    for inline in model.document_inlines(document):
        source = getattr(inline, "source", None) or ""
        if _PATH.fullmatch(source) is None:
            continue
        if isinstance(inline, model.NumberBinding):
            text = point_decimals(inline.text) if inline.comma else inline.text
            numbers = scan_prose(text)
            unit_text = inline.text[numbers[-1].end :].strip() if numbers else ""
            unit = find_unit(unit_text) if unit_text else None
            size = float(measure(unit)) if unit is not None else 1.0
            zero = float(unit.zero) if unit is not None else 0.0
            for number in numbers:
                value, step = float(number.value), 10.0**number.place
                values = (value, step), ((value + zero) * size, step * size)
                yield NamedNumber(inline.text_span, source, number.text, values)
        elif isinstance(inline, model.Math):
            statements = read_statements(inline.tex.text, document.comma)
            sides = (side for statement in statements for side in statement.sides)
            for side in sides:
                expression = side.expression if side.is_numeric else None
                numeral = read_numeral(expression) if isinstance(expression, Expression) else None
                if numeral is not None:
                    step, size = float(numeral.step), float(numeral.unit_size)
                    value = float(numeral.express(numeral.value))
                    values = (value, step / size), (float(numeral.value), step)
                    text = inline.tex.text[side.start : side.end].strip()
                    yield NamedNumber(inline.tex.span(side.start, side.end), source, text, values)


def check_sources(course: model.Course, numbers: Iterable[NamedNumber]) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each number that its file does not hold."""
    scripts = (s for document in course.documents for s in model.document_scripts(document))
    texts = {f"models/{file.name}.xml": file.source.text for file in course.models}
    texts |= {script.path: script.code.text for script in scripts}
    numbers_by_path: dict[str, set[float]] = {}
    for number in numbers:
        if number.path not in texts:
            message = f"`{number.path}` is no script and no model of this course"
            help = did_you_mean(number.path, texts)
            if isinstance(help, Fix):  # the path stands behind the number
                source, end = number.span.source, number.span.end
                line_end = source.line_start(number.span.end_line + 1)
                help = help.at(source.span(end, line_end))
            yield diagnose("given-source", number.span, message, help=help)
            continue
        if number.path not in numbers_by_path:
            matches = _NUMBER.finditer(texts[number.path])
            literals = {float(match[0].replace("_", "").rstrip(".")) for match in matches}
            doubles = {2 * value for value in literals if number.path.endswith(".xml")}
            numbers_by_path[number.path] = literals | doubles
        if not number.is_in(numbers_by_path[number.path]):
            message = f"`{number.path}` has no number `{number.text}`"
            help = "bind the number to an output, or name where it is from"
            yield diagnose("given-source", number.span, message, help=help)


KINDS = ("bound", "computed", "given")
"""The fields of `Claims` that count what is proven."""
_NO_SOURCE = "unsourced"

_COUNTS = 12
_YEARS = range(1600, 2100)
_UNIT = re.compile(rf"[\s\u00a0\u202f]*(?:{UNIT_PATTERN})")
_DECIMAL = re.compile(r"\d\.\d")
_MAY_CLAIM = re.compile(r"\d\.?\d|\d(?:\\[ ,;]|[\s~])*(?:\\(?:mathrm|text|%)|\^?\{?\\circ|°)")
"""Every formula with claims matches this."""
_DIGIT = re.compile("[0-9]")


class Claims(Struct, frozen=True):
    """The number of proven claims of a document, and the places of those that are not proven."""

    bound: int
    """Printed by a script."""
    computed: int
    """Computed in a formula."""
    given: int
    """Given by the author, with a source."""
    open: tuple[Span, ...]
    """The places of the others."""
    places: tuple[tuple[Span, tuple[str, ...]], ...] = ()
    """Of those that scripts print: where each stands, and the scripts of which any proves it."""
    unsourced: tuple[Span, ...] = ()
    """The places of those that are given without a source, which count as unproven."""
    named: tuple[NamedNumber, ...] = ()
    """Those whose source is a file."""

    def drop(self, scripts: Collection[str]) -> Claims:
        """The claims where these scripts prove nothing."""
        lost = tuple(at for at, proofs in self.places if proofs and {*proofs} <= {*scripts})
        if not lost:
            return self
        order = sorted((*self.open, *lost), key=lambda span: span.start)
        return replace(self, bound=self.bound - len(lost), open=tuple(order), places=())

    @property
    def proven(self) -> int:
        return self.bound + self.computed + self.given

    @property
    def all(self) -> int:
        return self.proven + len(self.unsourced) + len(self.open)

    @property
    def share(self) -> str:
        """The share of proven claims, rounded down."""
        return f"{1000 * self.proven // self.all / 10:.1f} %" if self.all else "–"

    @property
    def counts(self) -> tuple[str, ...]:
        """The numbers of all claims, of those proven in each way, and of the others."""
        rest = len(self.unsourced), len(self.open)
        return tuple(map(str, (self.all, self.bound, self.computed, self.given, *rest)))


def course_claims(
    course: model.Course, runs: Iterable[ScriptRun] = ()
) -> Iterator[tuple[model.Owner, Claims]]:
    """Yield what counts, with its claims: lessons, and pages in the menu.

    `runs`: those of scripts, as far as they are known.
    """
    unrun = {run.path for run in runs if not run.did_run}
    for document in course.documents:
        unrun |= {script.path for script in model.document_scripts(document) if script.norun}
    for owner, document in course.owned_documents:
        if isinstance(owner, model.Lesson) or owner.menu:
            summary = (document.summaries or {}).get("truth")
            claims = summary if isinstance(summary, Claims) else document_claims(document)
            yield owner, claims.drop(unrun)


def sum_claims(claims: Iterable[Claims]) -> Claims:
    """Return the claims of several documents."""
    terms = tuple(claims)
    bound_count, computed_count, given_count = (
        sum(getattr(term, kind) for term in terms) for kind in KINDS
    )
    return Claims(
        bound_count,
        computed_count,
        given_count,
        open=tuple(place for term in terms for place in term.open),
        unsourced=tuple(place for term in terms for place in term.unsourced),
    )


def document_claims(document: model.Document) -> Claims:
    """Find the claims of a document in its text."""
    outputs = sorted(
        (r.body_span.end, r.script)
        for r in model.find_blocks(document, model.Recording)
        if r.script
    )
    counter = _Counter(outputs, check_formulas(document), document.comma)
    output_ids: set[int] = set()
    for block in model.walk_blocks(document.blocks):
        if isinstance(block, model.Recording):
            output_ids.add(id(block.body))
        if isinstance(block, model.MathBlock):
            counter.formula(block.tex, block.label.source if block.label is not None else None)
        elif not isinstance(block, model.Heading) and id(block) not in output_ids:
            counter.inlines(model.block_inlines(block))
    for span, number in counter.alternatives:
        counter.add(*counter.marked.get(number, ("", ())), span)
    bound_count, computed_count, given_count = map(counter.kinds.count, KINDS)
    return Claims(
        bound_count,
        computed_count,
        given_count,
        open=tuple(counter.open),
        places=tuple(counter.places),
        unsourced=tuple(counter.unsourced),
        named=tuple(named_numbers(document)),
    )


class _Counter:
    def __init__(
        self,
        outputs: Sequence[tuple[int, str]],
        comparisons: Mapping[int, tuple[FormulaComparison, ...]],
        comma: bool,
    ) -> None:
        """`outputs` are the ends of recorded outputs, in order, with their scripts."""
        self.outputs, self.comparisons, self.comma = outputs, comparisons, comma
        self.kinds: list[str] = []
        self.open: list[Span] = []
        self.unsourced: list[Span] = []
        self.places: list[tuple[Span, tuple[str, ...]]] = []
        self.marked: dict[str, tuple[str, tuple[str, ...]]] = {}
        """How a number is proven, and the scripts that print it; none if it is given."""
        self.alternatives: list[tuple[Span, str]] = []

    def add(self, kind: str, proofs: tuple[str, ...], span: Span) -> None:
        """Add a claim and what proves it; an empty kind stands for no proof."""
        if kind in KINDS:
            self.kinds.append(kind)
            self.places += [(span, proofs)] if proofs else []
        else:
            (self.unsourced if kind else self.open).append(span)

    def inlines(self, inlines: Iterable[model.Inline]) -> None:
        """Add the claims of inlines."""
        for inline in inlines:
            match inline:
                case model.Text():
                    self.text(inline)
                case model.NumberBinding():
                    self.marked_number(inline)
                case model.Math():
                    source = inline.source
                    if source is None and inline.label is not None:
                        source = inline.label.source
                    if inline.meaning is not None and source is None and inline.value is None:
                        source = ""  # a symbol stands for a value because the author says so
                    self.formula(inline.tex, source)
                    if inline.value is not None:
                        self.marked_number(inline.value)
                case model.Image():
                    numbers = {number.text for number in find_claims(inline.alt, self.comma)}
                    self.alternatives += [(inline.span, number) for number in sorted(numbers)]
                case model.Link(target=model.UrlTarget() | model.TermTarget() as target):
                    texts = (child for child in inline.children if isinstance(child, model.Text))
                    text = "".join(child.text for child in texts)
                    if isinstance(target, model.TermTarget) or text not in target.url:
                        self.inlines(inline.children)
                case model.Emphasis() | model.Strong() | model.Strikethrough() | model.Term():
                    self.inlines(inline.children)
                case _:
                    pass

    def marked_number(self, number: model.NumberBinding) -> None:
        """Add the claims of a number that is bound or given."""
        proofs: tuple[str, ...] = ()
        if number.source is None:
            at = bisect_right(self.outputs, number.span.start, key=itemgetter(0))
            above = self.outputs[at - 1][1] if at else ""
            proofs = tuple(filter(None, (number.script or above,)))
        kind = _given_kind(number.source) if number.source is not None else "bound"
        text = point_decimals(number.text) if number.comma else number.text
        for part in scan_prose(text):
            first_kind, scripts = self.marked.setdefault(part.text, (kind, proofs))
            # What one place gives, or another script prints, is proven by that.
            if first_kind == kind == "bound":
                union = tuple(sorted({*scripts, *proofs})) if scripts and proofs else ()
                self.marked[part.text] = kind, union
            elif "given" in (first_kind, kind):
                self.marked[part.text] = "given", ()
            elif kind == "bound":
                self.marked[part.text] = kind, proofs
            self.add(kind, proofs, number.text_span)

    def text(self, text: model.Text) -> None:
        """Add the claims of plain text."""
        is_verbatim = text.span.end - text.span.start == len(text.text)
        for number in find_claims(text.text, self.comma):
            span = text.span
            if is_verbatim:
                span = Span(span.source, span.start + number.start, span.start + number.end)
            self.add("", (), span)

    def formula(self, tex: Excerpt, source: str | None) -> None:
        """Add the claims of a formula."""
        if _MAY_CLAIM.search(tex.text) is None:
            return
        comparisons = self.comparisons.get(tex.span().start, ())
        proofs = [comparison for comparison in comparisons if comparison.kind == "holds"]
        for statement in read_statements(tex.text, self.comma):
            first, last = statement.sides[0], statement.sides[-1]
            if any(first.start <= proof.start < last.end for proof in proofs):
                self.add("computed", (), tex.span(first.start, last.end))
                continue
            for side in statement.sides:
                if _is_claim(side):
                    part = tex.text[side.start : side.end]
                    start, end = side.end - len(part.lstrip()), side.start + len(part.rstrip())
                    place = tex.span(start, end)
                    self.add("" if source is None else _given_kind(source), (), place)


def find_claims(text: str, comma: bool = False) -> Iterator[Number]:
    """Yield the numbers of a text that are claims; `comma`: it may stand before decimals."""
    text = point_decimals(text) if comma else text
    if _DIGIT.search(text) is None:
        return  # saves time: most texts have no number, and scanning is slow
    for number in scan_prose(text):
        if not number.is_finite:
            continue
        is_whole = number.is_integer or number.text.endswith(".")
        is_small = is_whole and (number.value in _YEARS or abs(number.value) <= _COUNTS)
        if not is_small or _UNIT.match(text, number.end):
            yield number


def _given_kind(source: str) -> str:
    return "given" if source else _NO_SOURCE


def _is_claim(side: FormulaSide) -> bool:
    tex = side.tex
    if not side.is_numeric and "." not in tex[side.start : side.end]:
        return False
    if not isinstance(side.expression, Expression):
        return side.is_numeric or _DECIMAL.search(tex, side.start, side.end) is not None
    parts = tuple(side.expression.walk())
    numbers = [part.text for part in parts if part.kind == "number"]
    if any("." in number for number in numbers):
        return True
    units = any(part.kind == "unit" for part in parts)
    powers = any(part.kind == "^" and part.parts[0].text == "10" for part in parts)
    large = any(int(number) > _COUNTS for number in numbers)
    return bool(side.is_numeric and numbers and (units or powers or large))
