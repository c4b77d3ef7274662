"""A course with the theme of docs/how-to/theme.md: built, changed and previewed."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image

from coursebuild.core.drawing.contrast import GROUNDS_DARK, GROUNDS_LIGHT, contrast, legible
from coursebuild.core.model.course import Theme
from coursebuild.core.pages.theme import accents
from support.archives import epub_messages
from support.live_course import Live
from support.live_course import live as live
from support.markdown_files import DOCS, fences
from support.scratch_course import ROOT, Folder

pytestmark = pytest.mark.site

MAP, LESSON = "content/course.toml", "public/lessons/1.1-pendulum.html"
LOGO = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 48 32"><path d="M4 4{}"/></svg>'
ICON = LOGO.replace("48", "32").format("h3")
STYLE = next(fence.text for fence in fences(DOCS / "how-to/theme.md") if fence.kind == "css")
FONTS = ROOT / "site/dist/fonts"


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    """The course of the docs, with fonts of ours."""
    picture = io.BytesIO()
    Image.new("RGB", (64, 64)).save(picture, "PNG")
    folder = Folder(tmp_path / "course")
    (course_map,) = (fence for fence in fences(DOCS / "how-to/theme.md") if fence.kind == "toml")
    folder.write(MAP, course_map.text)
    folder.write("content/lessons/1.1-pendulum.md", "## Swing\n\n*It* swings: θ, ж.\n")
    for name, part in (("logo", "h40"), ("logo-dark", "v9")):
        folder.write(f"theme/{name}.svg", LOGO.format(part))
    folder.write("theme/icon.svg", ICON)
    folder.write("theme/icon.png", picture.getvalue())
    folder.write("theme/style.css", STYLE)
    for name, style in (("Regular", "normal"), ("Italic", "italic"), ("Bold", "normal")):
        font = (FONTS / f"source-serif-4-latin-opsz-{style}.ttf").read_bytes()
        folder.write(f"theme/Caladea-{name}.ttf", font)
    folder.write("theme/Caladea.txt", "Apache licence")
    folder.borrow(stores)
    return folder


def asset(course: Folder, pattern: str) -> str:
    """The only file of `assets/` with this name, and its text."""
    (path,) = (path for path in course.tree("public") if re.fullmatch(f"assets/{pattern}", path))
    return course.text(f"public/{path}")


def test_theme_is_on_every_page_and_in_what_pages_share(course: Folder) -> None:
    result = course.main("build")
    assert (result.status, "warning" in result.out) == (0, False), result.out
    html = course.text(LESSON)
    logo = r'<img src="../assets/logo{}\.\w+\.svg" alt="" class="figure-{}" width="42" height="28">'
    title = logo.format("", "light") + logo.format("-dark", "dark") + "<span>Oscillations</span>"
    assert re.search(title, html)
    assert re.search(r'rel="icon" href="../assets/icon\.\w+\.svg" type="image/svg\+xml"', html)
    assert re.search(r'rel="apple-touch-icon" href="../assets/icon-touch\.\w+\.png"', html)
    css = asset(course, r"site\.\w+\.css")
    assert css.endswith(f"--accent:light-dark(#7a1f3d,#e8a9bd)}}}}\n{STYLE.rstrip()}\n")
    fonts = re.findall(r'"Course Text";font-style:(\w+).*?url\("fonts/(Caladea-\w+)', css)
    assert fonts == [
        ("normal", "Caladea-Regular"),
        ("italic", "Caladea-Italic"),
        ("normal", "Caladea-Bold"),
    ]
    assert "font-synthesis:weight style" not in css, "bold and italic have fonts"
    font_files = re.findall(r'"Source Serif 4 Variable";.*?url\("fonts/([\w-]+)', css)
    assert sorted(font_files) == [
        f"source-serif-4-{x}-opsz-{y}" for x in ("cyrillic", "greek") for y in ("italic", "normal")
    ]
    assert "Caladea-Regular.ttf, Caladea-Italic.ttf, Caladea-Bold.ttf\n" in asset(
        course, r"licences.*txt"
    )
    manifest = json.loads(course.text("public/manifest.webmanifest"))
    assert [icon["sizes"] for icon in manifest["icons"]] == ["any", "64x64"]
    shell_files = json.loads(course.text("public/files.json"))["shell"]["files"]
    assert {icon["src"] for icon in manifest["icons"]} & shell_files.keys()
    assert len([path for path in shell_files if "logo" in path]) == 2
    assert course.main("export", "page").status == 0
    assert "#e8a9bd" in course.text("course.html")


@pytest.mark.long
def test_theme_is_in_the_ebook(course: Folder) -> None:
    assert course.main("export", "epub").status == 0
    with zipfile.ZipFile(course.root / "course.epub") as book:
        css = book.read("EPUB/style.css").decode()
        assert "(prefers-color-scheme:light){a{color:#7a1f3d}" in css
        assert "(prefers-color-scheme:dark){a{color:#e8a9bd}" in css
        assert 'body{font-family:"Course Text",serif}' in css
        fonts = re.findall(r'url\("(fonts/Caladea[^"]+)"\) format\("woff2"\)', css)
        assert [book.read(f"EPUB/{name}")[:4] for name in fonts] == [b"wOF2"] * 3
        assert book.read("EPUB/fonts/licence-1.txt") == b"Apache licence"
        assert b'fill="#7a1f3d"' in book.read("EPUB/cover.svg")
        package = book.read("EPUB/package.opf").decode()
        assert package.count('media-type="font/woff2"') == 3
    assert epub_messages(course.root / "course.epub") == []


def test_each_change_of_a_theme_is_in_the_next_build_and_in_the_preview(
    course: Folder, live: Callable[[Folder], Live]
) -> None:
    assert course.main("new", "template", "base.html").status == 0
    preview = live(course)
    preview.site()
    base = course.text("theme/templates/base.html")
    changes = {
        "theme/logo.svg": LOGO.format("h30"),
        "theme/style.css": "h2 { color: var(--accent) }",
        "theme/templates/base.html": base.replace("<body ", "<body data-own "),
        MAP: course.text(MAP)
        .replace("7a1f3d", "702040")
        .replace('"theme/Caladea-Italic.ttf", ', ""),
    }
    for path, text in changes.items():
        before = course.tree("public")
        course.write(path, text)
        preview.save(path)
        site = preview.site()
        result = course.main("build")
        assert (result.status, "warning" in result.out) == (0, False), result.out
        site_files = course.tree("public")
        assert site_files != before, path
        assert site == {name: site_files[name] for name in site}, path
    assert "<body data-own " in course.text(LESSON)
    assert "font-synthesis:weight style" in asset(course, r"site\.\w+\.css"), "for italics"
    clean = course.main("build", "--no-cache", "--out", "clean")
    assert (clean.status, course.tree("clean")) == (0, course.tree("public"))


def test_template_that_fails_is_told_in_the_preview_until_it_is_mended(
    course: Folder, live: Callable[[Folder], Live]
) -> None:
    course.main("new", "template", "lesson.html")
    path = "theme/templates/lesson.html"
    good = course.text(path)
    preview = live(course)
    page = LESSON.removeprefix("public/")
    assert preview.find(page)
    course.write(path, f"{good}{{{{ nothing.here }}}}\n")
    preview.save(path)
    assert (preview.find(page), preview.error_rules()) == (None, ["template-broken"])
    course.write(path, good)
    preview.save(path)
    assert (preview.find(page) is not None, preview.error_rules()) == (True, [])


def test_grounds_and_accent_are_those_of_the_style_sheet() -> None:
    tokens = (ROOT / "site/css/tokens.css").read_text(encoding="utf-8")
    colours = dict(re.findall(r"--(paper|sheet|accent): light-dark\((.*?)\)", tokens))
    pairs = {name: tuple(value.split(", ")) for name, value in colours.items()}
    assert (*zip(GROUNDS_LIGHT, GROUNDS_DARK, strict=True),) == (pairs["paper"], pairs["sheet"])
    assert accents(Theme()) == pairs["accent"]


def test_contrast_is_that_of_the_w3c_and_the_nearest_legible_colour_has_it() -> None:
    assert contrast("#000000", ["#ffffff", "#808080"]) == pytest.approx(5.32, abs=0.005)
    assert contrast("#767676", ["#ffffff"]) == pytest.approx(4.54, abs=0.005)
    assert legible("#767676", ["#ffffff"]) == "#767676"
    assert legible("#ff0000", ["#ffffff"]) == "#ee0000"
    assert legible("#0000ff", ["#000000"]) == "#5e5eff"
