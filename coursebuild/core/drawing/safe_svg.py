"""SVG that draws, and does nothing else.

1. A drawing may hold the elements, attributes and styles listed here. They are judged as browsers
   read them: by namespace, with references and escapes decoded.
2. It refers to parts of itself, and to pixels that it holds, and to nothing else.
3. What passes is safe as it lies in its file, and as it is written again from its elements.
"""

from __future__ import annotations

import contextlib
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from xml.parsers import expat

SVG = "{http://www.w3.org/2000/svg}"
XLINK = "{http://www.w3.org/1999/xlink}"
MAX_BYTES = 4 << 20
MAX_STYLE = 2 << 20
"""Characters of style sheets and of different styles of elements."""
MAX_ELEMENTS = 100_000
"""Elements that are drawn: what `use` repeats counts each time."""
MAX_REASON = 160
MAX_DEPTH = 100
"""Elements inside each other, also those that `use` and `url(#…)` bring in."""

_ELEMENTS = frozenset(
    "a circle clipPath defs desc ellipse filter g image line linearGradient marker mask metadata "
    "path pattern polygon polyline radialGradient rect stop style svg switch symbol text textPath "
    "title tspan use view "
    "feBlend feColorMatrix feComponentTransfer feComposite feConvolveMatrix feDiffuseLighting "
    "feDisplacementMap feDistantLight feDropShadow feFlood feFuncA feFuncB feFuncG feFuncR "
    "feGaussianBlur feMerge feMergeNode feMorphology feOffset fePointLight feSpecularLighting "
    "feSpotLight feTile feTurbulence".split()
)
_ATTRIBUTES = frozenset(
    "amplitude azimuth baseFrequency baseProfile bias class clipPathUnits contentScriptType "
    "contentStyleType cx cy d diffuseConstant divisor dx dy edgeMode elevation exponent "
    "filterRes filterUnits focusable fr fx fy gradientTransform gradientUnits height id in in2 "
    "intercept k1 k2 k3 k4 kernelMatrix kernelUnitLength lang lengthAdjust limitingConeAngle "
    "markerHeight markerUnits markerWidth maskContentUnits maskUnits media method mode numOctaves "
    "offset operator order orient origin pathLength patternContentUnits patternTransform "
    "patternUnits points pointsAtX pointsAtY pointsAtZ preserveAlpha preserveAspectRatio "
    "primitiveUnits r radius refX refY requiredExtensions requiredFeatures result role rotate rx "
    "ry scale seed slope spacing specularConstant specularExponent spreadMethod startOffset "
    "stdDeviation stitchTiles surfaceScale systemLanguage tabindex tableValues target targetX "
    "targetY textLength title transform type values version viewBox width x x1 x2 "
    "xChannelSelector y y1 y2 yChannelSelector z zoomAndPan "
    # with a namespace
    f"{XLINK}actuate {XLINK}arcrole {XLINK}role {XLINK}show {XLINK}title {XLINK}type "
    "{http://www.w3.org/XML/1998/namespace}id {http://www.w3.org/XML/1998/namespace}lang "
    "{http://www.w3.org/XML/1998/namespace}space".split()
)
"""Attributes that may have any value, as may `data-…` and `aria-…`."""
_LINKS = frozenset(("href", f"{XLINK}href"))
_INERT = (
    "{http://creativecommons.org/ns#}",
    "{http://web.resource.org/cc/}",
    "{http://purl.org/dc/elements/1.1/}",
    "{http://purl.org/dc/terms/}",
    "{http://www.w3.org/1999/02/22-rdf-syntax-ns#}",
    "{http://www.inkscape.org/namespaces/inkscape}",
    "{http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd}",
)
"""Namespaces of what programs note about a drawing: browsers do nothing with it."""
_PROPERTIES = frozenset(
    "alignment-baseline all backface-visibility background background-color baseline-shift block-"
    "progression border border-radius box-sizing clip clip-path clip-rule color color-adjust "
    "color-interpolation color-interpolation-filters color-profile color-rendering color-scheme "
    "cursor cx cy d direction display dominant-baseline enable-background fill fill-opacity "
    "fill-rule filter flood-color flood-opacity font font-family font-feature-settings "
    "font-kerning font-optical-sizing font-palette font-size font-size-adjust font-smooth "
    "font-smoothing font-stretch font-style font-synthesis font-variant font-variant-alternates "
    "font-variant-caps font-variant-east-asian font-variant-ligatures font-variant-numeric "
    "font-variant-position font-variation-settings font-weight forced-color-adjust "
    "glyph-orientation-horizontal glyph-orientation-vertical height hyphens image-rendering "
    "inline-size isolation kerning left letter-spacing lighting-color line-height margin marker "
    "marker-end marker-mid marker-start mask mask-type max-height max-width min-height min-width "
    "mix-blend-mode object-fit opacity osx-font-smoothing outline outline-color outline-offset "
    "outline-style outline-width overflow overflow-x overflow-y padding paint-order "
    "pointer-events position print-color-adjust quotes r rotate rx ry scale shape-inside "
    "shape-margin shape-padding shape-rendering shape-subtract solid-color solid-opacity "
    "stop-color stop-opacity stroke stroke-alignment stroke-dasharray stroke-dashoffset "
    "stroke-linecap stroke-linejoin stroke-miterlimit stroke-opacity stroke-width tab-size "
    "tap-highlight-color text-align text-align-last text-anchor text-decoration "
    "text-decoration-color text-decoration-line text-decoration-style text-decoration-thickness "
    "text-indent text-orientation text-overflow text-rendering text-shadow text-size-adjust "
    "text-transform text-underline-offset top touch-action transform transform-box "
    "transform-origin transform-style transition transition-delay transition-duration "
    "transition-property transition-timing-function translate unicode-bidi user-select "
    "vector-effect vertical-align visibility white-space width will-change word-break "
    "word-spacing word-wrap overflow-wrap writing-mode x y z-index "
    "animation animation-delay animation-direction animation-duration animation-fill-mode "
    "animation-iteration-count animation-name animation-play-state animation-timing-function "
    # of `@font-face`
    "ascent-override descent-override font-display line-gap-override size-adjust src "
    "unicode-range".split()
)
_VENDOR = re.compile(r"^-(?:webkit|moz|ms|o|inkscape)-")
_AT_RULES = {"@media": True, "@supports": True, "@keyframes": True, "@font-face": False}
"""Whether they hold rules, or declarations."""
_FUNCTIONS = frozenset(
    "rgb rgba hsl hsla hwb lab lch oklab oklch color color-mix light-dark var calc min max clamp "
    "translate translatex translatey translate3d scale scalex scaley rotate skew skewx skewy "
    "matrix matrix3d blur brightness contrast drop-shadow grayscale hue-rotate invert opacity "
    "saturate sepia circle ellipse inset path polygon cubic-bezier steps linear format local tech "
    "not is where has lang dir nth-child nth-last-child nth-of-type nth-last-of-type".split()
)

_ESCAPE = r"\\(?:[0-9a-f]{1,6}(?:\r\n|[ \t\r\n\f])?|[^0-9a-f\r\n\f])"
_ESCAPED = re.compile(_ESCAPE, re.IGNORECASE)
_NAME = rf"(?>(?:[\w-]|[^\x00-\x7f]|{_ESCAPE})+)"
_TOKEN = re.compile(
    rf"""(?P<blank>(?>(?:\s|/\*.*?\*/)+))
    |(?P<string>"(?>(?:[^"\\\n\r\f]|\\.)*)"|'(?>(?:[^'\\\n\r\f]|\\.)*)')
    |(?P<link>url\(\s*(?P<q>["']?)\#(?>(?:[\w.:-]|[^\x00-\x7f])+)(?P=q)\s*\))
    |(?P<font>url\(\s*(?P<p>["']?)data:(?:font|application)/[\w.+-]+(?:;charset=utf-8)?;base64,
        [a-z0-9+/=]*+(?P=p)\s*\))
    |(?P<function>{_NAME}\()
    |(?P<at>@{_NAME})
    |(?P<name>{_NAME})
    |(?P<mark>[][(){{}};:,.+>~*|=^$!%\#?]|/(?!\*))""",
    re.VERBOSE | re.DOTALL | re.IGNORECASE | re.ASCII,
)
_RULE = re.compile(r"(?:\A|(?<=\}))[^{}]*+\{(?>(?:[^{}]++|\{[^{}]*+\})*)\}")
_PIXELS = re.compile(r"data:image/(?:png|jpe?g|webp);base64,[A-Za-z0-9+/=\s]*")
_REFERENCE = re.compile(r"""url\(\s*["']?#((?:[\w.:-]|[^\x00-\x7f])+)""", re.IGNORECASE)
_ENCODINGS = ("utf-8", "utf8", "us-ascii", "ascii")
"""Those in which a drawing is the same text as in UTF-8."""


class _RefusedError(Exception):
    """A drawing holds what it may not, in words."""


def read_svg(data: bytes) -> ET.Element | str:
    """The drawing in a file, without comments; or why it must not be shown, in words."""
    if len(data) > MAX_BYTES:
        return f"is larger than {MAX_BYTES >> 20} MiB"
    try:
        root = _Reader().read(data)
        _count_drawn(root)
    except _RefusedError as error:
        reason = str(error)  # names in it may be of any length
        return reason if len(reason) <= MAX_REASON else f"{reason[: MAX_REASON - 1]}…"
    return root


def without_refused(data: bytes) -> tuple[bytes, list[str]]:
    """Return a drawing without the parts that it may not hold, and these parts, in words.

    It is as it was where it holds none, or is refused as a whole.
    """
    parts: list[str] = []
    with contextlib.suppress(_RefusedError):
        root = _Reader(parts).read(data)
        if parts:
            ET.register_namespace("", SVG[1:-1])
            data = ET.tostring(root, encoding="utf-8")
    return data, parts


class _Reader:
    """The state of one reading; parts that a drawing may not hold are left out where they count."""

    def __init__(self, refused: list[str] | None = None) -> None:
        self._refused = refused
        self._left_depth = 0
        """Elements around the place of which the outermost is left out."""
        self._builder = ET.TreeBuilder()
        self._parser = parser = expat.ParserCreate("utf-8", "}")
        self._depth = self._count = self._style_length = 0
        self._style: list[str] | None = None
        """The text of the style sheet that is being read."""
        self._judged: set[tuple[str, str]] = set()
        """Attributes that were judged: many are alike."""
        parser.buffer_text = True
        parser.XmlDeclHandler = self._declaration
        parser.StartDoctypeDeclHandler = self._doctype
        parser.ProcessingInstructionHandler = self._instruction
        parser.SkippedEntityHandler = self._entity
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._data

    def read(self, data: bytes) -> ET.Element:
        try:
            data.decode("utf-8-sig")
            self._parser.Parse(data, True)
        except UnicodeDecodeError:
            raise _RefusedError("is not an SVG file in UTF-8") from None
        except (expat.ExpatError, ValueError, LookupError) as error:
            raise _RefusedError(f"is not an SVG file: {error}") from None
        return self._builder.close()

    def _add_style(self, css: str) -> None:
        self._style_length += len(css)
        if self._style_length > MAX_STYLE:
            self._refuse(f"styles of more than {MAX_STYLE >> 20} MiB")

    def _refuse(self, part: str) -> None:
        raise _RefusedError(f"contains {part} on line {self._parser.CurrentLineNumber}")

    def _leave_out(self, part: str) -> None:
        """Leave a part out, or refuse the drawing for it."""
        if self._refused is None:
            self._refuse(part)
        else:
            self._refused.append(part)

    def _declaration(self, version: str, encoding: str | None, standalone: int) -> None:
        if encoding is not None and encoding.lower() not in _ENCODINGS:
            raise _RefusedError(f"is not in UTF-8, but in `{encoding}`")

    def _doctype(self, name: str, system: str | None, public: str | None, internal: bool) -> None:
        """Allow that of SVG alone, which says nothing: browsers do not read it."""
        ours = system is None or system.startswith("http://www.w3.org/")
        if internal or name != "svg" or not ours:
            self._refuse("a document type of its own")

    def _instruction(self, target: str, _: str) -> None:
        self._refuse(f"`<?{target}?>`")

    def _entity(self, name: str, _: bool) -> None:
        self._refuse(f"`&{name};`")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        if self._left_depth:
            self._left_depth += 1
            return
        tag = _expanded(name)
        element = tag.removeprefix(SVG)
        self._depth += 1
        self._count += 1
        if self._count == 1 and tag != f"{SVG}svg":
            raise _RefusedError("is not an SVG file: its root is another element")
        if self._depth > MAX_DEPTH:
            self._refuse(f"more than {MAX_DEPTH} elements inside each other")
        if self._count > MAX_ELEMENTS:
            self._refuse(f"more than {MAX_ELEMENTS} elements")
        is_known = element in _ELEMENTS and tag != element
        is_inert = tag.startswith(_INERT)
        if self._style is not None or not (is_known or is_inert):
            self._leave_out(f"`<{element.rpartition('}')[2]}>`{_of_namespace(element)}")
            self._left_depth = 1
            return
        expanded = {_expanded(key): value for key, value in attributes.items()}
        for pair in tuple(expanded.items()):
            if pair not in self._judged or pair[0] in _LINKS or is_inert:
                if pair[0] not in _ATTRIBUTES and pair[0] not in _LINKS:
                    self._add_style(pair[1])
                fault = _attribute_fault(tag, *pair)
                if fault:
                    self._leave_out(f"{fault} of `<{element.rpartition('}')[2]}>`")
                    del expanded[pair[0]]
                elif not is_inert:
                    self._judged.add(pair)
        self._builder.start(tag, expanded)
        if element == "style":
            self._style = []

    def _data(self, text: str) -> None:
        if self._style is not None:
            self._style.append(text)
        elif not self._left_depth:
            self._builder.data(text)

    def _end(self, name: str) -> None:
        if self._left_depth:
            self._left_depth -= 1
            self._depth -= not self._left_depth
            return
        if self._style is not None:
            sheet = "".join(self._style)
            self._add_style(sheet)
            if fault := _css_fault(sheet, is_sheet=True):
                self._leave_out(f"{fault} of a style sheet")
                rules = _RULE.findall(sheet)
                sheet = "".join(rule for rule in rules if not _css_fault(rule, is_sheet=True))
            self._builder.data(sheet)
            self._style = None
        self._depth -= 1
        self._builder.end(_expanded(name))


def _expanded(name: str) -> str:
    """A name as `ElementTree` writes it, with its namespace."""
    return "{" + name if "}" in name else name


def _of_namespace(name: str) -> str:
    namespace, _, _ = name.rpartition("}")
    return f" of the namespace `{namespace[1:]}`" if namespace else ""


def _attribute_fault(tag: str, name: str, value: str) -> str:
    """The part of an attribute that must not be there, in words; empty where there is none."""
    if name in _LINKS:
        pixels = tag == f"{SVG}image" and _PIXELS.fullmatch(value)
        return "" if value.startswith("#") or pixels else f"the link `{_short(value)}`"
    if name == "style":
        return _css_fault(value)
    if name in _ATTRIBUTES or name.startswith(("data-", "aria-", *_INERT)):
        return ""
    if name in _PROPERTIES:
        return _css_fault(f"{name}:{value}")
    if tag.startswith(_INERT) and "}" not in name and not name.startswith("on"):
        return "" if name != "src" else "`src`"
    return f"`{name.rpartition('}')[2]}`{_of_namespace(name)}"


# --- CSS


def _css_fault(css: str, *, is_sheet: bool = False) -> str:
    """The part of declarations or a style sheet that must not be there, in words; else empty."""
    try:
        blocks = [is_sheet]
        """Whether each open block, the innermost last, holds rules; else it holds declarations."""
        part: list[str] = []
        """What was read of a declaration, or of what stands before a block."""
        brackets = 0
        for kind, token in _css_tokens(css):
            if kind == "mark" and token in "([":
                brackets += 1
            elif kind == "mark" and token in ")]":
                brackets -= 1
            if kind == "function":
                brackets += 1
                if token == "url(":
                    raise _RefusedError("a `url()` that leads elsewhere")
                if token[:-1] not in _FUNCTIONS:
                    raise _RefusedError(f"`{_short(token)})`")
            elif (kind == "at" and (part or not blocks[-1] or _plain(token) not in _AT_RULES)) or (
                kind == "font" and (blocks[-1] or part[:1] != ["src"])
            ):
                raise _RefusedError(f"`{_short(token)}`")
            is_end = kind == "mark" and token in "{};"
            if is_end and not brackets:
                if token == "{" and blocks[-1]:
                    blocks.append(_AT_RULES.get(_plain(part[0]) if part else "", False))
                elif token == "{" or (token == ";" and blocks[-1]):
                    raise _RefusedError(f"`{token}` after `{_short(' '.join(part))}`")
                elif token == "}" and (len(blocks) == 1 or (blocks.pop() and part)):
                    raise _RefusedError("an unpaired `}`")
                part = []
                continue
            if brackets < 0 or is_end:
                raise _RefusedError(f"an unpaired `{token}`")
            part.append(token)
            if not blocks[-1]:
                if len(part) == 1:
                    is_known = _plain(part[0]) in _PROPERTIES or part[0].startswith(
                        ("--", "-inkscape-")
                    )
                    if kind != "name" or not is_known:
                        raise _RefusedError(f"the property `{_short(part[0])}`")
                elif (part[-1] == ":" and kind == "mark") != (len(part) == 2):
                    raise _RefusedError(f"`{_short(''.join(part))}`")
        if brackets or len(blocks) > 1 or (part and blocks[-1]):
            raise _RefusedError("an unpaired bracket")
    except _RefusedError as error:
        return str(error)
    return ""


def _css_tokens(css: str) -> Iterator[tuple[str, str]]:
    """Yield kind and text of the parts of CSS, names with their escapes decoded."""
    at = 0
    while at < len(css):
        match = _TOKEN.match(css, at)
        if match is None:
            raise _RefusedError(f"`{_short(css[at:])}`")
        at, kind, token = match.end(), match.lastgroup or "", match[0]
        if kind in ("function", "at", "name"):
            yield kind, (_ESCAPED.sub(_unescape, token) if "\\" in token else token).lower()
        elif kind != "blank":
            yield kind, token


def _unescape(match: re.Match[str]) -> str:
    text = match[0][1:]
    code = int(text, 16) if text[0] in "0123456789abcdefABCDEF" else ord(text)
    return chr(code) if 0 < code <= 0x10FFFF else "\ufffd"


def _plain(name: str) -> str:
    """A name without a browser's prefix."""
    sign = "@" if name.startswith("@") else ""
    return sign + _VENDOR.sub("", name.removeprefix("@"), count=1)


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 40 else f"{text[:39]}…"


# --- what is drawn


def _count_drawn(root: ET.Element) -> None:
    """Refuse a drawing that repeats its parts too often, or inside themselves."""
    elements = reversed(list(root.iter()))  # of two with an id, the first is meant
    by_id = {element.attrib["id"]: element for element in elements if "id" in element.attrib}
    measures: dict[ET.Element, tuple[int, int]] = {}

    def measure(element: ET.Element, depth: int) -> tuple[int, int]:
        """How many elements this one draws, and how many inside each other."""
        if element in measures:
            return measures[element]
        names = [
            name
            for key, value in element.attrib.items()
            if key not in _ATTRIBUTES
            for name in _REFERENCE.findall(value)
        ]
        if element.tag == f"{SVG}use":
            names += [element.attrib[key][1:] for key in _LINKS & element.attrib.keys()]
        parts = [*element, *(by_id[name] for name in names if name in by_id)]
        sizes = [measure(part, depth + 1) for part in parts] if depth < MAX_DEPTH else [(0, depth)]
        height = 1 + max((height for _, height in sizes), default=0)
        if height > MAX_DEPTH:
            raise _RefusedError(f"repeats more than {MAX_DEPTH} elements inside each other")
        measures[element] = 1 + sum(count for count, _ in sizes), height
        return measures[element]

    count, _ = measure(root, 0)
    if count > MAX_ELEMENTS:
        raise _RefusedError(f"draws more than {MAX_ELEMENTS} elements, as it repeats some")
