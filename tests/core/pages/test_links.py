"""Broken links of built pages: found with page, line and nearest target; good ones left alone."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.links import (
    BrokenLink,
    _read,
    all_lead_somewhere,
    check_links,
    ids_and_addresses,
    references,
)


def site(page: str, path: str = "lessons/a.html") -> tuple[OutputFile, ...]:
    return (
        OutputFile(path, page.encode()),
        OutputFile("index.html", b'<h1 id="top-level">x</h1><a name="old"></a>'),
        OutputFile("levels/1 x.html", b'<p id="\xc3\xbcber">x</p>'),
        OutputFile("assets/site.css", b""),
        OutputFile("deep/index.html", b"<p id=x>"),
    )


def test_links_that_lead_somewhere_are_not_told() -> None:
    page = """<p id=here>
    <a href="#here">1</a> <a href="../index.html#top-level">2</a> <a href="../#old">3</a>
    <a href="../levels/1%20x.html#%C3%BCber">4</a> <a href="">5</a> <a href="#top">6</a>
    <a href="https://elsewhere.org/nothing">7</a> <a href="mailto:a@b.c">8</a> <a href="tel:1">9</a>
    <a href="data:text/plain,x">10</a> <link rel=stylesheet href="../assets/site.css?v=1">
    <a href="../deep/#x">11</a>
    <img src=" ../assets/site.css " srcset="../assets/site.css 2x, a.html">
    <a href="//elsewhere.org/x">12</a> <a>13</a> <!-- <a href="gone.html"> -->
    """
    assert check_links(site(page)) == ()


def test_broken_links_are_listed_in_order() -> None:
    page = (
        '<p id="conservation">\n<a href="#conservatoin">1</a>\n'
        '<img src="../assets/sites.css" srcset="x.png 2x">\n<a href="../../up.html">2</a>'
        '<a href="b.html#x">3</a><script src=gone.js></script><a href="http://[">4</a>'
    )
    assert check_links(site(page)) == (
        BrokenLink(
            "lessons/a.html",
            2,
            "#conservatoin",
            "`lessons/a.html` has no anchor `#conservatoin`",
            "conservation",
        ),
        BrokenLink(
            "lessons/a.html",
            3,
            "../assets/sites.css",
            "no file `assets/sites.css` in the site",
            "assets/site.css",
        ),
        BrokenLink("lessons/a.html", 3, "x.png", "no file `lessons/x.png` in the site", None),
        BrokenLink("lessons/a.html", 4, "../../up.html", "no file `up.html` in the site", None),
        BrokenLink(
            "lessons/a.html",
            4,
            "b.html#x",
            "no file `lessons/b.html` in the site",
            "lessons/a.html",
        ),
        BrokenLink("lessons/a.html", 4, "gone.js", "no file `lessons/gone.js` in the site", None),
        BrokenLink("lessons/a.html", 4, "http://[", "the address cannot be read", None),
    )


def test_links_of_a_site_below_a_path_stay_below_it() -> None:
    page = (
        '<a href="/course/index.html">1</a><a href="/index.html">2</a>'
        '<a href="https://h.org/course/levels/">3</a><a href="https://h.org/other/">4</a>'
        '<a href="../../index.html">5</a>'
    )
    broken = check_links(site(page), "https://h.org/course/")
    assert [(b.url, b.reason) for b in broken] == [
        ("../../index.html", "the address leads out of the site"),
        ("/index.html", "the address leads out of the site"),
        ("https://h.org/course/levels/", "no file `levels/index.html` in the site"),
    ]


TAGS = [
    '<a href="x.html#y">',
    "</a>",
    '<p id="a&amp;b">',
    '<img src="../assets/x.png" srcset="a.png 1x, b.png 2x">',
    '<a name="old" href="?q=1&amp;r=2#%C3%BC">',
    '<math display="block"><mi id="m">x</mi></math>',
    '<div class="x" hidden>',
    "text &lt;a href=&quot;no&quot;&gt; and more",
    'a href="no"',
    "<br>",
    "<hr />",
    '<A HREF="upper.html" ID=big>',
    "<a href='single.html'>",
    "<!-- <a href='hidden'> -->",
    '<a title="a>b" href="after.html">',
    '<script src="x.js">"<a href=no>"</script>',
    "<",
    "&",
    "<p id=bare>",
]
SOUND = [
    '<a href="#here"><p id="here">',
    '<a href="#top">',
    '<a href="../index.html">',
    '<a href="../index.html#old">',
    '<img src="../assets/site.css#x">',
]


@given(st.lists(st.sampled_from(TAGS), max_size=8))
def test_ids_and_addresses_are_those_that_the_check_reads(parts: list[str]) -> None:
    html = "\n".join(parts)
    page = _read(html)
    assert ids_and_addresses(html) == (page.ids, {address.url for address in page.addresses})


@given(st.lists(st.sampled_from([*TAGS, *SOUND]), max_size=6))
def test_sound_references_are_those_in_which_nothing_is_broken(parts: list[str]) -> None:
    page = "".join(parts)
    files = site(page)
    pages = {f.path: ids_and_addresses(f.data.decode()) for f in files if "html" in f.path}
    ids = {path: found[0] for path, found in pages.items()}
    led = references("lessons/a.html", pages["lessons/a.html"][1], "")
    broken = [b for b in check_links(files) if b.page == "lessons/a.html"]
    assert all_lead_somewhere(led, {f.path for f in files}, ids) == (not broken)


def test_references_to_files_that_are_no_pages_lead_somewhere() -> None:
    """Whatever is behind their `#`; and so do those to a page as a whole."""
    files = {"a.html", "a.svg"}
    sound = {("a.html", ""), ("a.html", "top"), ("a.html", "id"), ("a.svg", "x")}
    assert all_lead_somewhere(sound, files, {"a.html": {"id"}})
    assert not all_lead_somewhere({("a.html", "x")}, files, {"a.html": {"id"}})
