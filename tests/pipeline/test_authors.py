"""What a course says of itself: who wrote it, and how it is cited."""

from __future__ import annotations

import json
import re
import zipfile
from html import unescape

from lxml import etree

from support.archives import LOM, NAMESPACES, entries, mistakes, packaging_schema, scorm_schema
from support.fixture_cases import fixture_text
from support.scratch_course import GOOD, Make

AUTHORS = """\
version = "2026"
doi = "10.5281/zenodo.1234567"
authors = [{name = "Ada & Noether", orcid = "0000-0002-1825-0097"}, {name = "李明"}]
"""


def test_pages_and_exports_name_the_authors_and_say_how_to_cite(make: Make) -> None:
    folder = make(GOOD)
    text = folder.text("content/course.toml")
    folder.write("content/course.toml", text.replace("[course]\n", f"[course]\n{AUTHORS}", 1))
    assert folder.main("build").status == 0
    title = json.loads(re.findall(r'^title = (".*")', text, re.MULTILINE)[0])
    lesson = json.loads(re.findall(r'^title = (".*")', text, re.MULTILINE)[-1])
    link = "https://doi.org/10.5281/zenodo.1234567"

    home, page = (
        unescape(folder.text(f"public/{path}")) for path in ("index.html", "lessons/1.1-one.html")
    )
    assert f"Cite as: Ada & Noether, 李明. {title}. 2026. {link}" in home
    assert f"Cite as: Ada & Noether, 李明. {lesson}. {title}. 2026. {link}" in page
    orcid = "https://orcid.org/0000-0002-1825-0097"
    for html in (home, page):
        assert f'<a href="{orcid}" rel="author">Ada & Noether</a>' in html
        assert '<meta name="citation_author" content="李明">' in html
        assert '<meta name="citation_doi" content="10.5281/zenodo.1234567">' in html
    (data,) = re.findall(r'<script type="application/ld\+json">(.*?)</script>', home)
    course = json.loads(data)
    assert course["identifier"] == link
    assert course["author"][0] == {"@type": "Person", "name": "Ada & Noether", "@id": orcid}

    notebook = json.loads(folder.text("public/lessons/1.1-one.ipynb"))
    assert notebook["metadata"]["authors"] == [{"name": "Ada & Noether"}, {"name": "李明"}]

    book = folder.root / "book.epub"
    assert folder.main("export", "epub", "--out", str(book)).status == 0
    with zipfile.ZipFile(book) as archive:
        names = archive.namelist()
        package = archive.read(next(n for n in names if n.endswith(".opf"))).decode()
        front = "".join(archive.read(n).decode() for n in names if "title" in n)
    assert "Ada &amp; Noether</dc:creator>" in package
    assert "<dc:identifier>doi:10.5281/zenodo.1234567</dc:identifier>" in package
    assert f"Cite as: Ada &amp; Noether, 李明. {title}. 2026. {link}" in front


PREDICTION = fixture_text("documents/prediction.md")


def test_packages_for_learning_platforms_name_the_authors_too(make: Make) -> None:
    folder = make(GOOD + PREDICTION)
    text = folder.text("content/course.toml")
    facts = AUTHORS.replace("Ada & Noether", "Ada; Noether") + 'licence = "CC-BY-4.0"\n'
    folder.write("content/course.toml", text.replace("[course]\n", f"[course]\n{facts}", 1))
    for export, space, schema, names in (
        ("scorm", NAMESPACES["imsmd_rootv1p2p1.xsd"], scorm_schema(), ("vcard", "catalogentry")),
        ("qti", LOM, packaging_schema(), ("entity", "identifier")),
    ):
        folder.main("export", export, "--out", "package.zip").require_success()
        manifest = entries(folder.root / "package.zip")["imsmanifest.xml"]
        assert mistakes(schema, manifest) == []
        root = etree.fromstring(manifest)
        cards, doi = ([*root.iter(f"{{{space}}}{name}")] for name in names)
        assert [card.text.splitlines()[2:] for card in cards] == [
            [
                "FN:Ada\\; Noether",
                "N:Ada\\; Noether",
                "URL:https://orcid.org/0000-0002-1825-0097",
                "END:VCARD",
            ],
            ["FN:李明", "N:李明", "END:VCARD"],
        ]
        assert "".join(doi[0].itertext()) == "DOI10.5281/zenodo.1234567"
        (rights,) = root.iter(f"{{{space}}}rights")
        assert "".join(rights.itertext()).split() == ["LOMv1.0yes", "CC-BY-4.0"]
        (folder.root / "package.zip").unlink()


def test_a_course_without_authors_is_not_cited(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    assert "citation_" not in folder.text("public/index.html")
    assert "Cite as" not in folder.text("public/index.html")
