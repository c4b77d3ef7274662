"""The inline parser: markdown-it's rules, chosen by the first character of a piece of text.

Entry point: `Inlines`. Its rules are markdown-it's own, with those for formulas, footnotes, terms
and bound numbers. Tokens get their places in the text; runs of more than `MAX_RUN` emphasis marks
are text.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from markdown_it import MarkdownIt
from markdown_it.helpers import parseLinkLabel
from markdown_it.parser_inline import ParserInline
from markdown_it.rules_inline import (
    StateInline,
    autolink,
    backtick,
    emphasis,
    entity,
    escape,
    html_inline,
    image,
    link,
    newline,
    strikethrough,
)
from markdown_it.token import Token
from markdown_it.utils import EnvType

from coursebuild.core.syntax.attributes import Braces
from coursebuild.core.syntax.math import math_inline
from coursebuild.core.syntax.spans import InlineState, PositionedToken
from coursebuild.core.text.patterns import pattern

MAX_NESTING = 20
"""Brackets inside each other that may still become links and images."""
MAX_RUN = 200
"""Emphasis marks in a row."""

InlineRule = Callable[[StateInline, bool], bool]


def _emphasis(state: StateInline, silent: bool) -> bool:
    """Emphasis marks; an absurd run of them is text."""
    start, mark = state.pos, state.src[state.pos]
    if state.src.startswith(mark * MAX_RUN, start):
        end = start
        while end < state.posMax and state.src[end] == mark:
            end += 1
        if not silent:
            state.append_pending(state.src[start:end])
        state.pos = end
        return True
    rule = strikethrough.tokenize if mark == "~" else emphasis.tokenize
    return rule(state, silent)


_BRACE = pattern(r"\{\s*([A-Za-z]{2,20})")
_BINDING = pattern(r"""\{out(?:=(?:"([^\s{}"']+)"|([^\s{}"']+)))?\}""")


def _like_out(key: str) -> bool:
    """Whether the key of an attribute is `out`, or looks like it."""
    key = key.lower()
    return key.startswith("out") or key in ("ou", "ot", "ut", "otu", "uot", "oput", "oout", "oit")


def _code_span(state: StateInline, silent: bool) -> bool:
    """A code span; with `{out}` after it a `number_binding`, the script's path in its `info`."""
    start = state.pos
    if not backtick(state, silent):
        return False
    key = _BRACE.match(state.src, state.pos, state.posMax)
    if key is None or not _like_out(key[1]) or not state.src[start : state.pos].strip("`"):
        return True
    end = state.pos
    found = _BINDING.match(state.src, end, state.posMax)
    if found:
        state.pos = found.end()
    if not silent:
        token = state.tokens[-1]
        token.type = "number_binding" if found else "number_unbound"
        token.info = (found[1] or found[2] or "") if found else ""
        token.map = [start + len(token.markup), end - len(token.markup)]
    return True


_FOOTNOTE = pattern(r"\[\^([^\s\[\]]+)\]")


def _footnote_reference(state: StateInline, silent: bool) -> bool:
    """`[^label]`; whether the footnote exists is seen later."""
    found = _FOOTNOTE.match(state.src, state.pos, state.posMax)
    if found is None:
        return False
    if not silent:
        token = state.push("footnote_ref", "", 0)
        token.content = found[1]
    state.pos = found.end()
    return True


def _term(state: StateInline, silent: bool) -> bool:
    """`[text]{term}`: tokens `term_open` and `term_close`, the braces where `map` says.

    Who passes over it sees brackets, so that a term may stand in a link.
    """
    if silent:
        return False
    assert isinstance(state, InlineState)
    if state.last_braced is None:
        state.last_braced = state.src.rfind("]{")
    if state.pos > state.last_braced:
        return False
    start, limit = state.pos, state.posMax
    end = parseLinkLabel(state, start)
    braces = Braces.of_term(state.src, end + 1, limit) if end >= 0 else None
    if braces is None:
        return False
    state.pos, state.posMax = start + 1, end
    state.push("term_open", "dfn", 1)
    state.md.inline.tokenize(state)
    token = state.push("term_close", "dfn", -1)
    token.map = [braces.start, braces.end]
    token.info = "" if braces.closed else "unclosed"
    state.pos, state.posMax = braces.end, limit
    return True


def _link(state: StateInline, silent: bool) -> bool:
    """A link or image, unless no bracket closes after this one."""
    assert isinstance(state, InlineState)
    if state.last_bracket is None:
        state.last_bracket = state.src.rfind("]")
    if state.pos > state.last_bracket:
        return False
    rule = link if state.src[state.pos] == "[" else image
    return rule(state, silent)


_STOP = pattern(r"[\n\\`*_~\[\]<&$!](?:(?<!!)|(?=\[))")
"""A `!` is nothing without a bracket. One set of characters at the beginning is searched for many
times as fast as several choices."""


_INLINE: dict[str, tuple[InlineRule, ...]] = {
    "\n": (newline,),
    "\\": (escape,),
    "`": (_code_span,),
    "*": (_emphasis,),
    "_": (_emphasis,),
    "~": (_emphasis,),
    "[": (_term, _link, _footnote_reference),
    "]": (),
    "!": (_link,),
    "<": (autolink, html_inline),
    "&": (entity,),
    "$": (math_inline,),
}


class Inlines(ParserInline):
    """The inline parser."""

    def tokenize(self, state: StateInline) -> None:
        """Add the tokens up to `state.posMax`; links call it again for their text."""
        assert isinstance(state, InlineState)
        src, end, tokens = state.src, state.posMax, state.tokens
        state.mark = state.pos
        while (pos := state.pos) < end:
            stop = _STOP.search(src, pos, end)
            if stop is None:
                state.append_pending(src[pos:end])
                state.pos = end
                break
            at = stop.start()
            if at > pos:
                state.append_pending(src[pos:at])
                state.pos = at
            before = len(tokens)
            for rule in _INLINE[src[at]] if state.level < MAX_NESTING else ():
                if rule(state, False):
                    if len(tokens) > before:
                        _place_inline(state, before, at)
                    break
            else:
                state.append_pending(src[at])
                state.pos = at + 1
        text = state.pending
        if text:
            state.push_text(text)

    def skipToken(self, state: StateInline) -> None:  # noqa: N802
        """Move past one token without making it."""
        assert isinstance(state, InlineState)
        pos = state.pos
        if pos in state.cache:
            state.pos = state.cache[pos]
            return
        if state.level >= MAX_NESTING:
            state.pos = state.posMax
        else:
            self._skip(state)
        state.cache[pos] = state.pos

    def _skip(self, state: StateInline) -> None:
        stop = _STOP.search(state.src, state.pos, state.posMax)
        at = state.posMax if stop is None else stop.start()
        if at > state.pos:
            state.pos = at
            return
        for rule in _INLINE[state.src[at]]:
            state.level += 1
            found = rule(state, True)
            state.level -= 1
            if found:
                return
        state.pos = at + 1

    def parse(self, src: str, md: MarkdownIt, env: EnvType, tokens: list[Token]) -> list[Token]:
        """Add the tokens of a whole text."""
        state = InlineState(src, md, env)
        self.tokenize(state)
        if state.delimiters or any(state.tokens_meta):  # there are marks to be paired
            for rule in self.ruler2.getRules(""):
                rule(state)
            _order_lone_tildes(state.tokens)
        tokens.extend(state.tokens)
        return tokens


def _place_inline(state: InlineState, before: int, at: int) -> None:
    """Say how far the tokens reach that a rule made from position `at` on."""
    tokens, after = state.tokens, state.pos
    cursor = at
    for token in tokens[before:]:
        assert isinstance(token, PositionedToken)
        if token.end >= 0:
            continue
        if token.markup == "autolink":
            opens = token.type == "link_open"
            token.start, token.end = (at, at + 1) if opens else (after - 1, after)
            cursor = at + 1
        elif token.type in ("link_open", "term_open"):
            token.start, token.end = at, at + 1
        elif token.type != "text":
            token.end = after
        elif tokens[-1].markup == "autolink":
            token.start, token.end = at + 1, after - 1
        else:
            token.start, token.end = cursor, cursor + len(token.content)
            cursor = token.end
    state.mark = after


def _order_lone_tildes(tokens: Sequence[Token]) -> None:
    """Give places to the tilde that markdown-it moves behind a closing tag.

    Of `~~a~~~` it makes the first tilde of the closing run text, and the two after it the tag.
    """
    for i, token in enumerate(tokens):
        if (
            token.type != "text"
            or token.content != "~"
            or i == 0
            or tokens[i - 1].type != "s_close"
        ):
            continue
        first = i
        while first > 0 and tokens[first - 1].type == "s_close":
            first -= 1
        moved = [t for t in tokens[first : i + 1] if isinstance(t, PositionedToken)]
        cursor = min(t.start for t in moved)
        for t in moved:
            width = t.end - t.start
            t.start, t.end = cursor, cursor + width
            cursor += width
