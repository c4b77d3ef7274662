"""Kinds of changes of which nothing can know that they are wrong, each with its reason."""

from __future__ import annotations

from msgspec import Struct


class Reason(Struct, frozen=True):
    """Why nothing can know that a change of some sort is wrong."""

    text: str
    place: str
    """What `Change.place` is, as a pattern, like all of these."""
    letters: str = r"[\w.]*"
    """The letters that the change took away and put in."""
    line: str = ".*"
    """The line as it is now."""
    slip: str = ".*"


REASONS = (
    Reason("another level that a heading may have", "heading", "#+", "#{2,6} .*"),
    Reason("without a heading, the one before it", "heading", "(?s).*", "(?s).*", "line lost"),
    Reason(
        "another formula that is whole: what it says is proven where it has numbers",
        "formula",
        r"[^$`\\]*",
    ),
    Reason("another word or number, with which all holds that is claimed of the lab", "lab"),
    Reason("the script prints and draws the same", "script", "(?s).*", "(?s).*"),
    Reason("an address or a setting that nothing contradicts", "map", r"[\w.]*", r"\w+ = .*"),
    Reason("a setting of the map that may be left out", "map", r"\w+ = .*\n?", slip="line lost"),
    Reason("what is measured is the author's choice", "declarations", r"[\w.]*", r"\w+ = .*"),
    Reason("a callout without its first line is a quotation", "callout", slip="line lost"),
    Reason(
        "without the first line of its item, or all of it: the rest belongs to the item above",
        "list",
        "(?s).*",
        r" +\S.*|[-*] .*|\d+\. .*|",
        "line lost",
    ),
    Reason("a name that nothing else names", "fence", r"[\w.]*", r".*file=\S+.*"),
    Reason("given by the author: no script prints it", "number", r"[\d.°-]*", r".*\{given.*"),
    Reason("another number that the script printed", "number", r"[\d.-]*", r".*\{out.*"),
    Reason("another name of a source", "out", r"[\w ]*", r".*\{given=.*"),
    Reason(
        "another language of a block that is only shown",
        "fence",
        r"[a-z]*",
        r"[ >]*`{3}(?:bash|c|cl|css|d|hs|html|js|json|md|pl|py|r|rs|s|sh|toml|xml|yaml)?",
    ),
    Reason("another side to which a column is aligned", "list", ":*", r"[ >]*\|[ :|-]+\|"),
    Reason(
        "a setting of a lab that may be left out, with which all holds that is claimed of it",
        "lab",
        r' *"(?:stopAt|height|dock|camera|toggles|overlays|autoplay|forceScale)": .*\n?',
        slip="line lost",
    ),
    Reason("an answer may have no unit", "quiz", r' *"unit": .*\n?', slip="line lost"),
    Reason("another number that a quiz may have", "quiz", r"[\d.]*", r".*\d.*"),
    Reason("a formula that nothing links to", "formula|list", r"[\w-]*", r".*\{#eq:.*"),
    Reason("a table without one of its rows", ".*", r"[ >]*\|.*\|\n?", slip="line lost"),
    Reason("a paragraph in another place", ".*", "(?s).*", "(?s).*", "paragraph moved"),
    Reason("a printed number with a digit less, or a zero more", "output", r"\d"),
    Reason("no name, as the author says", "number", r"[a-z]+", r".*\{code\}.*"),
    Reason("a whole number without a unit, as words say one", "digits|emphasis", r"\d+"),
    Reason("a whole number without a unit, as words say one", "number|code", r"\{?(out|given)\}?"),
    Reason("a number in code that names something", "code", r"\d+"),
)
