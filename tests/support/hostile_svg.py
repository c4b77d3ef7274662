"""SVG files that nobody should publish, but somebody tries to; most stand in `hostile_svg.toml`.

Every one tries to run something, or to ask `FAR`, when it is opened at its own address, clicked, or
read by a tool; or it takes time, memory or the stack. `HARMLESS` are files that only look so.
"""

from __future__ import annotations

import base64
import gzip
import random
import struct
import tomllib
import zlib
from collections.abc import Iterator

from support.fixture_cases import fixture_text

FAR = "http://far.test"
"""The address that the files ask."""
JS = f"new Image().src='{FAR}/ran'"
"""What they run."""
_XMLNS = 'xmlns="http://www.w3.org/2000/svg"'
_ROOT = (
    f'<svg {_XMLNS} xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:h="http://www.w3.org/1999/xhtml" xmlns:ev="http://www.w3.org/2001/xml-events" '
    'xmlns:m="http://www.w3.org/1998/Math/MathML" viewBox="0 0 100 100">'
)
_RECT = '<rect width="100" height="100" fill="red"/>'
_SVG_URI = (
    "data:image/svg+xml;base64,"
    + base64.b64encode(
        f'<svg {_XMLNS} id="x"><script>{JS}</script><image href="{FAR}/i.png"/></svg>'.encode()
    ).decode()
)
_HTML_URI = "data:text/html;base64," + base64.b64encode(f"<script>{JS}</script>".encode()).decode()

_INSERTS = {
    "SVG_URI": _SVG_URI,
    "HTML_URI": _HTML_URI,
    "JS_ESCAPED": "".join(f"&#{ord(character)};" for character in f"javascript:{JS}"),
    "JS": JS,
    "FAR": FAR,
    "RECT": _RECT,
    "ROOT": _ROOT,
    "XMLNS": _XMLNS,
}


def _file(inside: str) -> bytes:
    return f"{_ROOT}{inside}</svg>".encode()


_TEXT = _file(f"<script>{JS}</script>").decode()


def _insert(text: str) -> str:
    """A text of the fixture with what its names in braces stand for."""
    for name, value in (*_INSERTS.items(), ("DRAWING", base64.b64encode(_TEXT.encode()).decode())):
        text = text.replace(f"{{{name}}}", value)
    return text


_CASES = tomllib.loads(fixture_text("hostile_svg.toml"))
_INSIDE = {name: _insert(text) for name, text in _CASES["hostile"].items()} | {
    f"{kind}: {css.replace('{FAR}', 'FAR')}": _insert(whole.format(css=css))
    for kind, whole in (
        ("style", '<g style="{css}">{{RECT}}</g>'),
        ("sheet", "<style>{css}</style>{{RECT}}"),
    )
    for css in _CASES["css"][kind]
}
"""What stands in the root element."""
_HARMLESS = {name: _insert(text) for name, text in _CASES["harmless"].items()}
_SPICES = [_insert(text) for text in _CASES["mutations"]["pieces"]]


def _nested(count: int, inside: str = "") -> bytes:
    return _file("<g>" * count + inside + "</g>" * count)


def _pixel_bomb(side: int) -> bytes:
    """A PNG of very many pixels in few bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
    rows = zlib.compress(bytes(1 << 20), 9)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", rows), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


_FILES = {name: _insert(text).encode() for name, text in _CASES["files"].items()} | {
    "quadratic blowup": (
        f'<!DOCTYPE svg [<!ENTITY a "{"a" * 50_000}">]>{_ROOT}{"&a;" * 50_000}</svg>'
    ).encode(),
    # encodings
    "UTF-16 with a mark": _TEXT.encode("utf-16"),
    "UTF-16 without a mark": _TEXT.encode("utf-16-le"),
    "UTF-16, big end first": b"\xfe\xff" + _TEXT.encode("utf-16-be"),
    "UTF-32": _TEXT.encode("utf-32"),
    "EBCDIC": ('<?xml version="1.0" encoding="cp037"?>' + _TEXT).encode("cp037"),
    "Shift_JIS": b'<?xml version="1.0" encoding="shift_jis"?>'
    + _ROOT.encode()
    + b'<g class="\x83"/><g id="\x83\x22 onload="x"/></svg>',
    "not UTF-8": _file("<text>é</text>").replace(b"\xc3", b""),
    "overlong UTF-8": _file("<text>X</text>").replace(b"X", b"\xc0\xbcscript\xc0\xbe"),
    "surrogates in UTF-8": _file("<text>X</text>").replace(b"X", b"\xed\xa0\x80"),
    "compressed": gzip.compress(_TEXT.encode()),
    "a mark twice": b"\xef\xbb\xbf" * 2 + _TEXT.encode(),
    # shape
    "blanks": b" \n" * 1000,
    "1,000 inside each other": _nested(1_000),
    "100,000 inside each other": _nested(100_000),
    "500,000 inside each other": _nested(500_000, _RECT),
    "100,000 that are never closed": _file("<g>" * 100_000),
    "elements of namespaces inside each other": _file(
        '<s:g xmlns:s="http://www.w3.org/2000/svg">' * 10_000
    ),
    "200,000 elements": _file("<g/>" * 200_000),
    "200,000 attributes": _file("<g " + " ".join(f'a{n}=""' for n in range(200_000)) + "/>"),
    "100,000 namespaces": _file(
        "<g " + " ".join(f'xmlns:n{n}="urn:{n}"' for n in range(100_000)) + "/>"
    ),
    "an attribute of 5 MB": _file(f'<path d="{"M0 0" * 1_250_000}"/>'),
    "a name of 3 MB": _file(f"<{'g' * 3_000_000}/>"),
    "a text of 5 MB": _file("x" * 5_000_000),
    "repeated tenfold ten times": _file(
        "".join(f'<g id="a{n}">' + f'<use href="#a{n - 1}"/>' * 10 + "</g>" for n in range(1, 11))
        + f'<g id="a0">{_RECT}</g><use href="#a10"/>'
    ),
    "repeated by patterns": _file(
        "".join(
            f'<pattern id="a{n}" width="1" height="1">'
            + f'<rect width="9" height="9" fill="url(#a{n - 1})"/>' * 10
            + "</pattern>"
            for n in range(1, 11)
        )
        + '<rect width="99" height="99" fill="url(#a10)"/>'
    ),
    "repeated by masks": _file(
        "".join(
            f'<mask id="a{n}">' + f'<g style="mask: url(#a{n - 1})">{_RECT}</g>' * 10 + "</mask>"
            for n in range(1, 11)
        )
        + f'<g mask="url(#a10)">{_RECT}</g>'
    ),
    "a chain of 20,000": _file(
        "".join(f'<g id="a{n}"><use href="#a{n + 1}"/></g>' for n in range(20_000))
    ),
    "a chain of 20,000 from its end": _file(
        '<g id="a0"/>'
        + "".join(f'<g id="a{n}"><use href="#a{n - 1}"/></g>' for n in range(1, 20_000))
    ),
    "CSS of 1,000,000 brackets": _file(f'<g style="fill:{"(" * 1_000_000}"/>'),
    "CSS of 1,000,000 braces": _file(f"<style>{'{' * 1_000_000}</style>"),
    "CSS of 300,000 escapes": _file(
        f'<g style="fill:{chr(92) + "41414141"}"/>'.replace(
            chr(92) + "41414141", (chr(92) + "4141 ") * 300_000
        )
    ),
    "CSS of a comment that never ends": _file(f"<style>{'/*' * 1_000_000}</style>"),
    "CSS of a string that never ends": _file(f"<style>{chr(39) + 'a' * 2_000_000}</style>"),
    "CSS of 1,000,000 ids": _file(f"<style>{'#a' * 1_000_000}</style>"),
    # other formats under this name
    "PNG": _pixel_bomb(10),
}

HOSTILE: tuple[tuple[str, bytes], ...] = (
    *((name, _file(inside)) for name, inside in _INSIDE.items()),
    *_FILES.items(),
)
"""Name and bytes of each file."""
HARMLESS: tuple[tuple[str, bytes], ...] = tuple(
    (name, _file(inside)) for name, inside in _HARMLESS.items()
)


def mutants(count: int, seed: int) -> Iterator[tuple[str, bytes]]:
    """Files made from the others by a few random edits, with their names."""
    chance = random.Random(seed)
    sources = {**_INSIDE, **_HARMLESS}
    for number in range(count):
        name = chance.choice(list(sources))
        text = sources[name] + (
            chance.choice(list(sources.values())) if chance.random() < 0.3 else ""
        )
        for _ in range(chance.randint(1, 3)):
            at = chance.randrange(len(text) + 1)
            end = at + chance.choice((0, 0, 0, 1, 3, 8))
            kind = chance.random()
            piece = chance.choice(_SPICES)
            if kind < 0.2:
                piece = text[at : at + chance.randint(1, 12)].swapcase()
            elif kind < 0.4:
                piece = "".join(f"&#{ord(character)};" for character in text[at:end])
            text = text[:at] + piece + text[end:]
        yield f"{name}, mutant {number}", _file(text)
