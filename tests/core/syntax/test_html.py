"""Raw HTML that a course allows, as a browser's parser reads the page that shows it."""

from __future__ import annotations

import html
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import (
    HtmlBlock,
    RawInline,
    block_inlines,
    document_blocks,
    walk_inlines,
)
from coursebuild.core.pages.html_tree import HtmlContent, HtmlElement, parse_html
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.hostile_html import PAGES
from support.plain_html import PlainWriter

REFUSED_TAGS = (
    '<meta http-equiv=refresh content="0;url=https://evil.example">',
    "<script>alert(1)</script>",
    "<SCRIPT/x>alert(1)</SCRIPT>",
    '<p onclick="alert(1)">x</p>',
    "<p\nONPOINTERENTER\n=\nalert(1)>x</p>",
    '<img src="a.png"onerror=alert(1)>',
    "<img/src=a.png/onerror=alert(1)>",
    "<iframe src=frame.html></iframe>",
    "<form action=https://evil.example><button>Log in</button></form>",
    "<input type=password>",
    "<base href=https://evil.example/>",
    "<link rel=stylesheet href=a.css>",
    "<object data=a.svg></object>",
    "<embed src=a.svg>",
    '<a href="java&#9;script:alert(1)">x</a>',
    '<a href=" &#1; JaVaScRiPt&colon;alert(1)">x</a>',
    "<a href='vbscript:x'>x</a>",
    '<a title=" href=" href="javascript:alert(1)">x</a>',
    "<a href=x href=javascript:alert(1)>x</a>",
    '<svg><a xlink:href="javascript:alert(1)"><path/></a></svg>',
    "<svg><animate attributeName=href to=javascript:alert(1) /></svg>",
    "<svg><foreignObject><p>x</p></foreignObject></svg>",
    "<svg><use href='https://evil.example/a.svg#x'></use></svg>",
    '<svg><path fill="url(https://evil.example/a)"/></svg>',
    "<svg><style>@import 'https://evil.example';</style></svg>",
    "<svg><p><title><!--</title><img src=x onerror=alert(1)>--></title></p></svg>",
    '<p style="background:u\\72l(https://evil.example)">x</p>',
    '<p style="background: URL( https://evil.example )">x</p>',
    '<div style="position:fixed;inset:0">all of it</div>',
    "<math><annotation-xml encoding='text/html'><b>x</b></annotation-xml></math>",
    "<noscript><p title='</noscript><img src=x onerror=alert(1)>'></p></noscript>",
    "<textarea><b></textarea>",
    "<template><b>x</b></template>",
    "<x-y>a</x-y>",
    "<p data-lab='{}'>x</p>",
    "<img name=currentScript src=a.png alt=a>",
    "<video src=a.mp4 is=x></video>",
    "<![CDATA[<img src=x onerror=alert(1)>]]>",
    "<?php ?>",
    "<!DOCTYPE html>",
    "<!--> <img src=x onerror=alert(1)> -->",
    "<!-- --!> <img src=x onerror=alert(1)> -->",
    '<img src="x" alt="<" `onerror=alert(1)>',
    "<div <p onclick=alert(1)></div>",
)
ALLOWED_TAGS = (
    '<video src="fall.mp4" controls muted></video>',
    "<details open><summary>More</summary>text</details>",
    '<p style="color: #b00; margin-left: 2em">x</p>',
    "<kbd>Ctrl</kbd>+<kbd>C</kbd> H<sub>2</sub>O <br/> <wbr> a < b && c > d",
    "<table class=wide><tr><td colspan=2 align=right>1<td>2</table>",
    '<svg viewBox="0 0 9 9" role="img" aria-label="a line"><title>A line</title>'
    '<defs><linearGradient id="g"><stop offset="0" stop-color="#b00"/></linearGradient></defs>'
    '<path d="M0 0L9 9" stroke="url(#g)" style="fill: none"/><use href="#g"/></svg>',
    "<math><mi>x</mi><mo>=</mo><mn>1</mn></math>",
    "<!-- <script>a comment</script> -->",
    '<a href="https://example.org/?a=1&amp;b=2" target=_blank rel=noopener>out</a>',
    '<a name="there" title=" onclick=x <b> "></a>',
)
ACTIVE = frozenset(
    "script iframe object embed form input button base meta link style foreignobject animate set "
    "template noscript textarea select frame frameset applet portal".split()
)
PIECES = (
    *(
        piece
        for text in (*REFUSED_TAGS, *ALLOWED_TAGS)
        for piece in re.split(r"(?=[<>\"'= ])", text)
    ),
    *("\n\n", "\n", "`", "*", "$", "&lt;", "> ", "| a | b |\n|---|---|\n| ", " |\n"),
)


def check_page(text: str) -> tuple[list[str], str]:
    """The messages about the HTML of a lesson, and its page."""
    parsed_page = parse_document(Source("x.md", text), frozenset(), lesson=False)
    messages = [d.message for d in parsed_page.diagnostics if d.rule == "link-scheme"]
    for block in document_blocks(parsed_page.value):
        raw = [i for i in walk_inlines(block_inlines(block)) if isinstance(i, RawInline)]
        for node in [*raw, *([block] if isinstance(block, HtmlBlock) else ())]:
            messages += [part.message for part in node.forbidden]
    return messages, str(PlainWriter().render_blocks(parsed_page.value.blocks))


def find_active(content: list[HtmlContent]) -> list[str]:
    """What could run, load or send something, as a browser reads it."""
    offenders = []
    for element in (item for item in content if isinstance(item, HtmlElement)):
        offenders += [element.name] if element.name.lower() in ACTIVE else []
        for name, value in element.attributes.items():
            address = re.sub(r"[\x00-\x20]", "", html.unescape(value)).lower()
            acts = name.startswith("on") or name in ("srcdoc", "formaction", "is", "ping")
            if acts or address.startswith(("javascript:", "vbscript:", "data:text")):
                offenders.append(f"{element.name} {name}={value}")
        offenders += find_active(element.children)
    return offenders


@pytest.mark.parametrize("context", ["{}", "a {} b", "> {}", "- {}", "| a |\n|---|\n| {} |"])
def test_active_html_is_refused_in_every_context(context: str) -> None:
    accepted = [
        tag for tag in REFUSED_TAGS if not check_page(context.format(tag.replace("\n", " ")))[0]
    ]
    pages = {tag: check_page(context.format(tag))[1] for tag in accepted}
    assert not [tag for tag, page in pages.items() if find_active(parse_html(page))]
    assert len(accepted) < 5, "some are no tags in a line of Markdown, and shown as text"


def test_harmless_html_is_allowed() -> None:
    assert [check_page(tag)[0] for tag in ALLOWED_TAGS] == [[] for _ in ALLOWED_TAGS]


@given(st.lists(st.sampled_from(PIECES), max_size=25).map("".join) | PAGES | st.text())
def test_a_browser_finds_nothing_active_in_a_page_that_is_allowed(text: str) -> None:
    messages, page = check_page(text)
    if not messages:
        assert find_active(parse_html(page)) == []
