r"""What the symbols of a document stand for at each place: their units and values.

Entry points: `read_symbols(document)`; `check_formulas(document)`, which compares the numbers of
all formulas with these values.

1. `{symbol=…}` after a formula declares a symbol for the whole document. Its value is `value=…`, or
   what stands after the sign in `$m = 2\ \mathrm{kg}$`. From then on `{given}` after such a
   formula, or `{value=…}` after the symbol, gives it another value.
2. A value holds in its section, before it and after it, and in later sections, up to one that gives
   another. In a callout, or a question of a quiz, it holds there alone, unless it stands there with
   the declaration. Two values at the same level are an error.
3. A formula that leaves out the unit of its last number may have it in the text right after it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping
from decimal import Decimal
from fractions import Fraction

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Diagnostic, Note, Span, diagnose, model, regex
from coursebuild.core.registry import kind_of_block
from coursebuild.core.text.quantities import unit_behind
from coursebuild.core.text.units import Unit, find_unit
from coursebuild.features.arithmetic.chains import check_arithmetic
from coursebuild.features.arithmetic.evaluate import (
    FormulaComparison,
    WrongDimensions,
    describe_dimension,
    evaluate,
    measure,
    read_numeral,
)
from coursebuild.features.arithmetic.expressions import NotUnderstood
from coursebuild.features.arithmetic.real import ONE, Real
from coursebuild.features.arithmetic.statements import read_statements
from coursebuild.features.arithmetic.symbol_comparison import SymbolQuantity

_NUMBER = Unit(Fraction(1))
_WORD_BEHIND = regex(r"\s*[^\W\d_]")
_Formula = model.Math | model.MathBlock
_Level = tuple[int, ...]
"""The number of a section, then the offsets of the callouts and questions inside it."""


class _Place(Struct, frozen=True):
    """A formula, and what belongs to its place."""

    formula: _Formula
    level: _Level
    unit: str
    """The unit in the text right after it."""
    has_word: bool
    """Whether a word stands there."""
    comma: bool
    """Whether it may stand before decimals."""


class _GivenValue(Struct, frozen=True):
    """A value of a symbol, and where it is given."""

    quantity: SymbolQuantity
    level: _Level
    span: Span


class DocumentQuantities(Struct, frozen=True):
    """The symbols that a document declares, and what is wrong with their values."""

    declarations: Mapping[str, SymbolQuantity]
    values: Mapping[str, tuple[_GivenValue, ...]]
    places: tuple[_Place, ...]
    diagnostics: tuple[Diagnostic, ...]

    def at(self, level: _Level) -> tuple[SymbolQuantity, ...]:
        """The symbols with the values that hold at a level."""
        quantities = dict(self.declarations)
        for name, values in self.values.items():
            scope_values = [v for v in values if v.level == level[: len(v.level)]]
            earlier_values = [v for v in values if len(v.level) == 1 and v.level < level]
            nearest = max(
                scope_values or earlier_values, key=lambda value: value.level, default=None
            )
            if nearest is not None:
                quantities[name] = nearest.quantity
        return tuple(quantities.values())


def read_symbols(document: model.Document) -> DocumentQuantities:
    """Read the symbols of a document, once."""
    return model.computed_once(document, "symbol_values", lambda: _read_symbols(document))


def check_formulas(document: model.Document) -> Mapping[int, tuple[FormulaComparison, ...]]:
    """Compare what each formula states; by the offset of its TeX.

    What has a source is taken from there, and an identity is compared elsewhere.
    """

    def compare() -> dict[int, tuple[FormulaComparison, ...]]:
        comparisons = _compare_all(symbols, ())
        letters = {c.letter for group in comparisons.values() for c in group} - {""}
        if letters:  # a π that is defined in the document is none of the number's
            unknown = tuple(SymbolQuantity(name, "", None) for name in sorted(letters))
            comparisons = _compare_all(symbols, unknown)
        return comparisons

    symbols = read_symbols(document)
    return model.computed_once(document, "formula_comparisons", compare)


def _compare_all(
    symbols: DocumentQuantities, letters: tuple[SymbolQuantity, ...]
) -> dict[int, tuple[FormulaComparison, ...]]:
    definitions = {value.span for values in symbols.values.values() for value in values}
    definitions |= {diagnostic.span for diagnostic in symbols.diagnostics}
    levels = {place.level: symbols.at(place.level) for place in symbols.places}
    comparisons: dict[int, tuple[FormulaComparison, ...]] = {}
    for place in symbols.places:
        formula = place.formula
        is_identity = formula.label is not None and formula.label.domain is not None
        if formula.span in definitions or is_identity or _source(formula) is not None:
            continue
        tex, quantities = formula.tex, (*letters, *levels[place.level])
        comparisons[tex.span().start] = check_arithmetic(
            tex.text, quantities, place.unit, place.comma, place.has_word
        )
    return comparisons


def _source(formula: _Formula) -> str | None:
    """The source of a formula's numbers."""
    if formula.label is not None:
        return formula.label.source
    return formula.source if isinstance(formula, model.Math) else None


def _value_beside(formula: _Formula) -> model.NumberBinding | None:
    """The value that a formula does not say itself."""
    value = formula.value if isinstance(formula, model.Math) else None
    return None if value is None or value.text_span.start < value.span.start else value


def _read_symbols(document: model.Document) -> DocumentQuantities:
    places = tuple(_read_places(document))
    declarations: dict[str, SymbolQuantity] = {}
    values: dict[str, list[_GivenValue]] = {}
    diagnostics: list[Diagnostic] = []
    for place in sorted(places, key=lambda place: place.formula.meaning is None):
        formula, span = place.formula, place.formula.span
        number = _value_beside(formula)
        if formula.meaning is None and number is None and _source(formula) is None:
            continue
        try:
            quantity = _read_quantity(place, declarations, values)
        except NotUnderstood as error:
            if number is not None or error.kind == "wrong":
                message = f"`{formula.tex.text}` cannot have this value: {error.reason}"
                diagnostics.append(diagnose("symbol-value", span, message))
            continue
        if quantity is None:
            continue
        if formula.meaning is not None:
            declarations.setdefault(quantity.name, replace(quantity, value=None))
        if quantity.value is None:
            continue
        level = place.level if formula.meaning is None else place.level[:1]
        rivals = values.setdefault(quantity.name, [])
        rival = next((value for value in rivals if value.level == level), None)
        if rival is None:
            rivals.append(_GivenValue(quantity, level, span))
        elif rival.quantity.value != quantity.value:
            texts = quantity.text, rival.quantity.text
            message = f"`{quantity.name}` is {texts[0]}, and {texts[1]} in the same section"
            help = "give the other quantity another letter or index, or a section of its own"
            note = Note("given here", rival.span)
            diagnostics.append(diagnose("symbol-value", span, message, help=help, notes=[note]))
    return DocumentQuantities(
        declarations,
        {name: tuple(group) for name, group in values.items()},
        places,
        tuple(diagnostics),
    )


def _read_quantity(
    place: _Place, declarations: Mapping[str, SymbolQuantity], values: Collection[str]
) -> SymbolQuantity | None:
    """The symbol that a formula names, with its value if it says that; `None` for other formulas.

    Raises:
        NotUnderstood: the formula is not understood.
    """
    formula, tex = place.formula, place.formula.tex.text
    number = _value_beside(formula)
    sides = [side for statement in read_statements(tex, place.comma) for side in statement.sides]
    if number is not None and (len(sides) != 1 or sides[0].get_expression().kind != "symbol"):
        raise NotUnderstood("it is not a single symbol", 0, len(tex))
    if len(sides) > 2 or not sides or (len(sides) == 2 and not sides[1].is_numeric):
        return None
    symbol = sides[0].get_expression()
    if symbol.kind != "symbol":
        return None
    name = symbol.text
    unit_text = formula.meaning.unit if formula.meaning is not None else ""
    if formula.meaning is None and name in declarations:
        unit_text = declarations[name].unit_text
    unit = find_unit(unit_text) if unit_text else None
    if number is not None:
        unit, decimal = unit or _NUMBER, Decimal(number.text.replace("−", "-"))
        size, last_place = measure(unit), Fraction(10) ** int(decimal.as_tuple().exponent)
        step = Real.of(last_place) * size if "." in number.text else None
        value = (Real.of(Fraction(decimal)) + Real.of(unit.zero)) * size
        text = f"{number.text} {unit_text}".rstrip()
        return SymbolQuantity(name, unit_text, unit, value, step, text)
    if len(sides) == 1:
        return SymbolQuantity(name, unit_text, unit)
    if formula.meaning is None and name not in values:
        return None  # an assumption about a symbol without a value
    expression = sides[1].get_expression()
    quantity, numeral = evaluate(expression), read_numeral(expression)
    units = [part.text for part in expression.walk() if part.kind == "unit"]
    unit_name = units[-1] if units else place.unit or unit_text
    scale = Unit(Fraction(1), quantity.dimension)
    if not units and unit_name:
        scale = find_unit(unit_name) or scale
    if unit is not None and unit.dimension != scale.dimension:
        dimensions = " and not ".join(map(describe_dimension, (unit.dimension, scale.dimension)))
        raise WrongDimensions(f"it is {dimensions}", sides[1].start, sides[1].end)
    unit = (find_unit(unit_text or unit_name) if unit_text or unit_name else None) or scale
    factor = ONE if units else measure(scale)
    own_unit = find_unit(unit_name) or _NUMBER
    value = quantity.value * factor
    step = numeral.step * factor if numeral is not None and not numeral.is_whole else None
    text = f"{value / measure(own_unit) - Real.of(own_unit.zero):.10g} {unit_name}".rstrip()
    return SymbolQuantity(name, unit_text or unit_name, unit, value, step, text)


def _read_places(document: model.Document) -> Iterator[_Place]:
    """Yield the formulas of a document with their levels and the units after them."""
    blocks = tuple(model.document_blocks(document))
    headings = [block.span.start for block in blocks if isinstance(block, model.Heading)]
    parts = sorted(
        (part.start, part.end)
        for block in blocks
        if isinstance(block, model.Callout | model.FeatureBlock)
        for part in (
            kind_of_block(block).scopes(block)
            if isinstance(block, model.FeatureBlock)
            else (block.span,)
        )
    )
    texts = {i.span.start: i.text for i in model.find_inlines(document, model.Text)}
    for _, formula in model.find_formulas(document):
        start = formula.tex.span().start
        level = bisect_right(headings, start), *(s for s, end in parts if s <= start < end)
        text = texts.get(formula.span.end, "") if isinstance(formula, model.Math) else ""
        unit = unit_behind(text).text if text else ""
        has_word = _WORD_BEHIND.match(text) is not None
        yield _Place(formula, level, unit, has_word, document.comma)
