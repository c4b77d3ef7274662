"""Texts with HTML that nobody should write, but somebody does."""

from __future__ import annotations

from hypothesis import strategies as st

from support.fixture_cases import fixture_tables

HOSTILE: list[str] = fixture_tables("hostile_html")["texts"]

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
