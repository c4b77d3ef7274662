"""Broken links of built pages: found with the nearest target; good ones left alone."""

from __future__ import annotations

from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.references import check_links


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


def test_broken_links_are_reported_with_the_nearest_target() -> None:
    page = (
        '<p id="conservation">\n<a href="#conservatoin">1</a>\n'
        '<img src="../assets/sites.css" srcset="x.png 2x">\n<a href="../../up.html">2</a>'
        '<a href="b.html#x">3</a><script src=gone.js></script><a href="http://[">4</a>'
    )
    broken_links = [
        (broken.url, broken.reason, broken.suggestion) for broken in check_links(site(page))
    ]
    assert broken_links == [
        ("#conservatoin", "`lessons/a.html` has no anchor `#conservatoin`", "conservation"),
        ("../../up.html", "no file `up.html` in the site", None),
        ("../assets/sites.css", "no file `assets/sites.css` in the site", "assets/site.css"),
        ("b.html#x", "no file `lessons/b.html` in the site", "lessons/a.html"),
        ("gone.js", "no file `lessons/gone.js` in the site", None),
        ("http://[", "the address cannot be read", None),
        ("x.png", "no file `lessons/x.png` in the site", None),
    ]


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
