"""Texts with HTML that nobody should write, but somebody does."""

from __future__ import annotations

from hypothesis import strategies as st

HOSTILE = [
    "<b>bold <i>both</i></b> & <br> text",
    "<div><p>a</p>loose <span lang='de'>Wort</span></div>",
    "<ul><li>one<li>two</ul>",
    "<table><tr><td>1<td>2<tr><th colspan=2>3</table>",
    "<table></table><ul></ul><ol></ol><dl></dl>",
    "<table><caption>C</caption><thead><tr><th>h</th></tr></thead></table>",
    "<dl><dt>t<dd>d<div><dt>u</dt><dd>v</dd></div></dl>",
    "<blockquote>text <b>and</b> more</blockquote>",
    "<h4>head <div>in</div></h4>",
    "<p>a<sub>1</sub><sup>2</sup> <kbd>k</kbd> <abbr title='X < Y'>xy</abbr></p>",
    "<pre>a\n <sub>b</sub> <b>c</b></pre>",
    "<del>no</del> <ins>yes</ins> <mark>m</mark> <u>u</u> <s>s</s>",
    "<ruby>漢<rp>(</rp><rt>kan</rt><rp>)</rp></ruby>",
    "<svg width='1'><title>t</title><circle r='1'/></svg> after",
    "<details><summary>More</summary>hidden $x$</details>",
    "<a href='https://example.org/?a=1&amp;b=2'>out</a> <a href='#hello'>in</a>",
    "<ol start='5'><li>five</li></ol>",
    "<img src='sketch.svg' alt='raw'>",
    "a\u200f\u202eb \ufffe \x0b end",
    "<math><mi>x</mi><mo>=</mo><mn>1</mn></math>",
    "<p style='color:red' onclick='alert(1)' data-x='1' id='y'>p</p>",
    "<b>bold\n\n<div>block</div>\n\n</b>",
    "</textarea ><i>x</i>]]>&#0; &bogus; &lt;script&gt;",
    "<custom-element a=1>text</custom-element>",
    "<figure><img src='sketch.svg' alt=''><figcaption>cap</figcaption></figure>",
]  # fmt: skip

REFUSED_TEXTS = [
    text for text in HOSTILE if text.startswith(("<b>bold\n", "</textarea")) or "\x0b" in text
]
"""Those that a check rejects: elements that are not closed, or not open; a control character."""

_PIECES = (
    "a|&nbsp;|&lt;|&|<|>|<p>|</p>|<br>|<div class=x>|</div>|<ul><li>|<li>|</ul>|<table><tr><td>"
    "|<td>|</table>|<b|</b>|<i>|</i>|<img src=a.png>|<img src='b.avif' alt='\"&'>|<!-- c -->"
    "|<!doctype x>|<script>if (a<b) {}</script>|<svg><path d='M0'/></svg>|<math><mi>x</mi></math>"
    "|<a href='#é b'>|</a>|<input disabled>|<x-y @z=1 1a=2 onclick=e>|\x07|\ufffe|\ud800|\0|\r"
    "|<details><summary>|</details>|<button>|</button>|<style>p{}</style>|<p id='a b:c'>"
    "|<a name=n>|<span class=k>|</span>|<math>|</math>|<mi>|<mspace/>|<textarea><p></textarea>"
    "|<![CDATA[ > <math> ]]>|<TITLE>a<b</Title>|<svg><title>b</title></svg>|<IMG SRC=a.png>"
    "|<h2 ID=x>|</h2>|<p title='|<svg xlink:href=a xmlns=b xmlns:c=d>|</svg>|<template>|</body>"
    "|<use href='#a' xmlns='b'>|<i a:b=c>|<select><option>|<frameset>|<plaintext>|<annotation-xml>"
)
PAGES = st.lists(st.sampled_from(_PIECES.split("|")), max_size=20).map("".join)
"""Pages of pieces that fit together or do not."""
