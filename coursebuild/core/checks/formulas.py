"""Check formulas: what cannot be typeset, brackets that belong to none, commands in letters.

What a formula is, its MathML says; the TeX only tells the place. What may be right is not told: an
interval may be open, so that `[` and `]` may each begin or end one, and a set may stand in several
formulas of its paragraph. Brackets and letters are warnings: nearly all that is told is wrong, but
a text may be about `((x)` itself.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import groupby
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from msgspec.structs import replace

from coursebuild.core.model import (
    Block,
    Document,
    Text,
    block_inlines,
    feature_block_ids,
    find_formulas,
    walk_inlines,
)
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.macros import PARAMETER, expand_macros
from coursebuild.core.text.near import nearest
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt

SYMBOLS = frozenset(
    """
    alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta iota kappa lambda mu nu xi pi
    rho varrho sigma tau upsilon phi varphi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma
    Upsilon Phi Psi Omega ell hbar infty
    """.split()
)
_FUNCTIONS = frozenset(
    """
    arccos arcsin arctan arg cos cosh cot coth csc deg det dim exp gcd inf ker lim log max min sec
    sin sinh sup tan tanh
    """.split()
)
"""Those of TeX that are longer than two letters; they are meant where a bracket follows."""
_WITH_BRACES = frozenset(
    """
    bar boldsymbol ddot dfrac dot frac hat mathbb mathbf mathcal mathrm overline sqrt text tfrac
    tilde vec
    """.split()
)
"""Commands whose argument stands in braces."""
_LETTERS = regex(
    r"(?<![\\A-Za-z])((?:\\\\)?([A-Za-z]{2,}))(?![A-Za-z0-9])"
    r"(?=(\s*(?:\\(?:left|[bB]igg?l?)\s*)?\()|(\{)|)"
)
_COMMAND = regex(r"(?<!\\)\\([A-Za-z]+)")
_LETTER = regex(r"(?<![A-Za-z\\])[A-Za-z](?![A-Za-z])")
_BRACKET = regex(r"\\[{}]|\\.|[()\[\]]", re.DOTALL)
_NAMED_BRACKET = regex(r"\\[lr](?:brack|brace|paren)(?![A-Za-z])")
"""The commands by which an author says that a bracket stands alone."""
_STEPS = {"(": (1,), "{": (1,), ")": (-1,), "}": (-1,), "[": (1, -1), "]": (1, -1)}
"""By how much a bracket may change the number of those that are open."""
_EITHER = (-1, 0, 1)
_INDEXED = ("msub", "msubsup", "munder", "munderover")


def _formula_uses(document: Document) -> Iterator[tuple[Block, Formula, Excerpt]]:
    """Every formula with its TeX in the text; empty ones were reported by the parser."""
    for block, formula in find_formulas(document):
        if formula.tex.text.strip():
            yield block, Formula(formula.tex.text, formula.display), formula.tex
        label = formula.label
        if label is not None and label.domain is not None and label.conditions:
            yield block, Formula(label.conditions, display=False), label.domain


def document_formulas(document: Document) -> tuple[Formula, ...]:
    """Each different formula of one document, in order of first use."""
    return tuple(dict.fromkeys(formula for _, formula, _ in _formula_uses(document)))


def check_formulas(
    document: Document, typeset: Mapping[Formula, str | MathError]
) -> tuple[Diagnostic, ...]:
    """What is wrong with the formulas of a document, at each place where one stands."""
    diagnostics: list[Diagnostic] = []
    uses = [*_formula_uses(document)]
    letters = {letter for _, _, tex in uses for letter in _LETTER.findall(tex.text)}
    commands = {command for _, _, tex in uses for command in _COMMAND.findall(tex.text)}
    in_features = feature_block_ids(document)
    for _, group in groupby(uses, key=lambda use: id(use[0])):
        typeset_ones: list[tuple[Excerpt, str]] = []
        for block, formula, tex in group:
            result = typeset[formula]
            if isinstance(result, MathError):
                diagnostics.append(_syntax_error(tex, result))
                continue
            typeset_ones.append((tex, result))
            # In JSON a backslash may need another one, so that nothing is written there.
            can_write = id(block) not in in_features
            diagnostics += _check_letters(tex, result, letters, commands, can_write)
        diagnostics += _check_brackets(block, typeset_ones)
    return tuple(diagnostics)


_OUT_HELP = (
    r"write `\out{}{9.81}` or `\out{words before it}{9.81}`: the last braces hold one number, with "
    "all its digits and its power of ten"
)
_IN_MACRO = "it stands in a macro of the course, in `[macros]` of its map"


def check_macros(
    macros: Mapping[str, Excerpt], typeset: Callable[[Formula], str | MathError]
) -> Iterator[Diagnostic]:
    """Report macros with a command that there is not; one may begin what another one ends."""
    texts = {name: body.text for name, body in macros.items()}
    for body in macros.values():
        plain_body = replace(body, text=PARAMETER.sub(" x", body.text))
        tex = expand_macros(plain_body, texts)
        result = typeset(Formula(tex.text, display=True))
        if isinstance(result, MathError) and "unknown command" in result.message:
            diagnostic = _syntax_error(tex, result)
            if diagnostic.help != _IN_MACRO:  # else it is told where that one is defined
                yield diagnostic


def _syntax_error(tex: Excerpt, error: MathError) -> Diagnostic:
    span, help = tex.span(), ""
    if error.position is not None:
        at = min(error.position, len(tex.text) - 1)
        span = tex.span(at, at + 1)
        if tex.offset(at) == tex.offset(at + 1):
            help = _IN_MACRO
    if not help and (command := re.search(r"unknown command (\\([A-Za-z]+))", error.message)):
        likely = nearest(command[2], SYMBOLS | _FUNCTIONS | _WITH_BRACES)
        help = f"a macro of the course is defined in `[macros]` of its map: `{command[2]} = '…'`"
        start = tex.text.find(command[2])
        if command[2] == "out":
            help = _OUT_HELP
        elif likely is not None and start >= 0:
            place = tex.span(start, start + len(command[2]))
            help = Fix(f"did you mean `\\{likely}`?", likely).at(place)
    message = f"the formula cannot be typeset: {error.message}"
    return diagnose("math-syntax", span, message, help=help)


@lru_cache(maxsize=256)
def parse_mathml(mathml: str) -> Element | None:
    """The tree of a formula, which nobody changes; `None` for characters that XML does not have."""
    try:
        return ElementTree.fromstring(mathml)
    except ElementTree.ParseError:
        return None


def _shown_elements(mathml: str) -> Sequence[Element]:
    """The elements of a formula without its TeX."""
    tree = parse_mathml(mathml)
    return () if tree is None else tree[0][:-1]


# --- letters


def _letter_runs(elements: Iterable[Element], parent: str = "") -> Iterator[str]:
    """The letters that stand beside each other as names of their own; indices are words."""
    run = ""
    for at, child in enumerate(elements):
        base = child[0] if child.tag in ("msup", *_INDEXED) else child  # as in `omega^2`
        text = base.text or ""
        if base.tag == "mi" and len(text) == 1 and text.isascii():
            run += text
            if base is child:
                continue
        yield run
        run = ""
        if at != 1 or parent not in _INDEXED:
            yield from _letter_runs(child, child.tag)
    yield run


def _check_letters(
    tex: Excerpt, mathml: str, letters: set[str], commands: set[str], can_write: bool
) -> Iterator[Diagnostic]:
    """Report commands without their backslash: the formula shows a product of letters.

    `letters` are those that stand alone in formulas of the document, of which `ell` is a product;
    `commands` are those of the document: two letters, as `mu`, are a product where it has none, but
    not beside the command itself, or right behind two backslashes.
    """
    words = [*_LETTERS.finditer(tex.text)]
    for word in words:
        text, name, bracket, brace = word.groups()
        is_name = name in SYMBOLS and not letters >= {*name}
        is_name &= len(name) > 2 or name in commands
        is_name |= name in (commands if text != name else _COMMAND.findall(tex.text))
        is_call = name in _FUNCTIONS and (bracket or brace)
        if not (is_name or is_call or (name in _WITH_BRACES and brace)):
            continue
        runs = _letter_runs(_shown_elements(mathml))
        if sum(run.count(name) for run in runs) < sum(name == match[2] for match in words):
            continue
        message = f"`{name}` would be shown as a product of letters"
        help = f"write `\\{name}`, or `\\mathrm{{{name}}}` for a name"
        fix = Fix(help, f"\\{name}" if can_write else None)
        yield diagnose("math-command", tex.span(*word.span(1)), message, help=fix)


# --- brackets


@lru_cache(maxsize=1024)
def _formula_brackets(mathml: str) -> tuple[tuple[int, ...], ...]:
    """What each bracket of a formula may be; many lessons have the same ones."""
    signs = {*mathml[: mathml.rfind("<annotation")]}
    return tuple(_brackets(_shown_elements(mathml))) if _STEPS.keys() & signs else ()


def _brackets(elements: Iterable[Element]) -> Iterator[tuple[int, ...]]:
    children = [*elements]
    for before, child, after in zip(
        (None, *children), children, (*children[1:], None), strict=False
    ):
        text = child.text or ""
        if child.tag != "mo":
            # In words, as in `a) first`, a bracket need not have another one.
            yield from (_EITHER for sign in text if sign in _STEPS)
            yield from _brackets(child)
        elif text in _STEPS:
            inside = after if text in "([{" else before
            is_operand = inside is not None and "separator" in inside.attrib  # as in `(q, (, z)`
            yield _EITHER if is_operand else _STEPS[text]
        elif not text and "fence" in child.attrib:
            yield _EITHER  # as in `\\left.`


def _text_brackets(text: str) -> Iterator[tuple[int, ...]]:
    """What each bracket of a text may be, those of other scripts too."""
    sides = {"Ps": (1,), "Pe": (-1,)}
    for sign in text:
        if (steps := _STEPS.get(sign) or sides.get(unicodedata.category(sign))) is not None:
            yield steps


def _may_match(brackets: Iterable[tuple[int, ...]]) -> bool:
    """Whether each bracket may have another one, whatever kind it is of."""
    depths = {0}
    for steps in brackets:
        depths = {depth + step for depth in depths for step in steps if depth + step >= 0}
    return 0 in depths


def _check_brackets(block: Block, formulas: Sequence[tuple[Excerpt, str]]) -> Iterator[Diagnostic]:
    """Report brackets that have no other one in any formula of their block."""
    open_ones = [
        (tex, brackets)
        for tex, mathml in formulas
        if not _may_match(brackets := _formula_brackets(mathml))
        and not _NAMED_BRACKET.search(tex.text)
    ]
    at = 0
    while at < len(open_ones):
        end = _joint_end(open_ones, at)
        if end is None:
            yield from _unmatched_bracket(block, open_ones[at][0])
        at = (at if end is None else end) + 1


def _joint_end(
    formulas: Sequence[tuple[Excerpt, tuple[tuple[int, ...], ...]]], at: int
) -> int | None:
    """The last one of several formulas that hold a set together, if it begins in this one."""
    joint = [*formulas[at][1]]
    for end in range(at + 1, len(formulas)):
        before, after = formulas[end - 1][0].span(), formulas[end][0].span()
        if not _may_match(_text_brackets(before.source.text[before.end : after.start])):
            break  # a bracket of the prose may be the other one
        joint += formulas[end][1]
        if _may_match(joint):
            return end
    return None


def _unmatched_bracket(block: Block, tex: Excerpt) -> Iterator[Diagnostic]:
    if len(re.findall(r"\w+", tex.text)) <= 1:
        return  # it names the sign, or counts as in `a)`
    start, end = _find_unmatched(tex.text)
    is_edge = not tex.text[:start].strip() or not tex.text[end:].strip()
    inlines = walk_inlines(block_inlines(block))
    prose = "".join(inline.text for inline in inlines if isinstance(inline, Text))
    if is_edge and not _may_match(_text_brackets(prose)):
        return  # it belongs to one of the sentence, as in `(where $x > 0)$`
    message = f"`{tex.text[start:end]}` has no matching bracket"
    help = "write the missing one, or `\\lbrack`, `\\rbrack` where one stands alone"
    yield diagnose("math-brackets", tex.span(start, end), message, help=help)


def _find_unmatched(tex: str) -> tuple[int, int]:
    """Where the bracket is that closes nothing, or the last that nothing closes."""
    unclosed: list[re.Match[str]] = []
    for bracket in _BRACKET.finditer(tex):
        sign = bracket[0][-1]
        if sign in "([{" or (sign == "]" and not unclosed):
            unclosed.append(bracket)
        elif sign in _STEPS and not unclosed:
            return bracket.span()
        elif sign in _STEPS:
            unclosed.pop()
    return unclosed[-1].span() if unclosed else (0, len(tex))
