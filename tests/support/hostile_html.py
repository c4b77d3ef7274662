"""Texts with HTML in them that nobody should write, and somebody does."""

from __future__ import annotations

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

REFUSED = [text for text in HOSTILE if text.startswith(("<b>bold\n", "</textarea"))]
"""Those that a check calls a mistake: elements that are not closed, or not open."""
