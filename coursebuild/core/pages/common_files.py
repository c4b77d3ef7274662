"""The files that every page refers to: fonts, the style sheet, the page's script, the icon.

The fonts are cut down to the characters that the pages use, and the style sheet holds the fonts'
names and the styles taken out of single elements. A changed page therefore changes these files only
if it is the first or the last one with some character or style.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

from msgspec import Struct

from coursebuild.core.model.course import Theme, ThemeFile
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.pages import fonts
from coursebuild.core.pages.assets import SCRIPTS, Assets, Names, hashed_name, page_script
from coursebuild.core.pages.frame import LOGO_HEIGHT, script_words
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.record import style_rules
from coursebuild.core.pages.theme import picture_size, theme_faces, theme_style
from coursebuild.core.registry import features


class PageFacts(Struct, frozen=True):
    """What the shared files depend on in a page."""

    text: frozenset[str]
    """Characters of its text, without those that every font has."""
    mathematics: frozenset[str]
    """Characters of its formulas outside ASCII; and a blank if it has a formula."""
    declarations: frozenset[str]
    """Styles taken out of its elements."""
    parts: frozenset[str]
    """See `parts_of`."""


def common_characters(library: Library, parts: frozenset[str]) -> frozenset[str]:
    """The characters that frames may show, and the scripts of pages with these parts."""
    course, texts = library.course, library.words.texts
    titles = (course.title, course.licence, *(page.title for page in course.pages))
    own_texts = (text for key, text in texts.items() if key.startswith(("site.", "search.")))
    script_texts = (texts[key] for key in script_words(texts, parts))
    return frozenset().union(*titles, *own_texts, *script_texts)


def needed_fonts(assets: Assets, facts: PageFacts, theme: Theme) -> tuple[fonts.FontJob, ...]:
    """The fonts to cut for pages with these facts, merged."""
    faces = fonts.read_faces(assets.file("fonts/fonts.json"))
    fonts_with_data = ((face, assets.file(f"fonts/{face.file}")) for face in faces)
    text, mathematics = "".join(sorted(facts.text)), "".join(sorted(facts.mathematics))
    return fonts.font_jobs(fonts_with_data, text, mathematics, theme_faces(theme))


def common_files(
    assets: Assets,
    cut_font: Callable[[fonts.FontJob], bytes] | None,
    facts: PageFacts,
    theme: Theme,
) -> tuple[tuple[SiteFile, ...], Names]:
    """The files for pages with these facts, merged, and their names.

    Without a function `cut_font`, fonts are published whole.
    """
    shared = _SharedFiles(assets)
    cut_fonts = [
        (job, shared.add_font(job, cut_font)) for job in needed_fonts(assets, facts, theme)
    ]
    rules = fonts.face_rules((job, name.removeprefix("assets/")) for job, name in cut_fonts)
    style = style_rules(facts.declarations) + "".join(f.style for f in features())
    style += theme_style(theme)
    part_scripts = tuple(shared.add_part_scripts(facts.parts))
    icon, touch_icon = shared.add_icons(theme)
    sheet = rules.encode() + assets.file("css/site.css") + style.encode()
    logo = theme.logo or theme.logo_dark
    size = picture_size(logo) if logo is not None else None
    licences = [
        (path.removeprefix("licences/").removesuffix(".txt"), data.decode())
        for path, data in assets.files("licences")
    ]
    for family in theme.fonts:
        files = (file.path.rpartition("/")[2] for file in family.files)
        licences.append((", ".join(files), family.licence.text))
    parts = [f"{name}\n{'=' * len(name)}\n\n{text.strip()}\n" for name, text in licences]
    names = Names(
        style=shared.add("site.css", sheet),
        theme_script=shared.add_script("theme.js"),
        script=shared.add_script("site.js"),
        icon=icon,
        credits=shared.add("licences.txt", "\n\n".join(parts).encode()),
        touch_icon=touch_icon,
        scripts=part_scripts,
        logo=shared.add_picture("logo", theme.logo),
        logo_dark=shared.add_picture("logo-dark", theme.logo_dark),
        logo_width=round(LOGO_HEIGHT * size[0] / size[1]) if size else 0,
    )
    return tuple(shared.files), names


class _SharedFiles:
    """Collects files for all pages; each method returns the site path of what it adds."""

    def __init__(self, assets: Assets) -> None:
        self._assets = assets
        self._script_names: dict[str, str] = {}
        self.files: list[SiteFile] = []

    def add(self, path: str, data: bytes) -> str:
        name = hashed_name(f"assets/{path}", data)
        self.files.append(OutputFile(name, data))
        return name

    def add_script(self, name: str) -> str:
        """Add a bundled script, once."""
        if name not in self._script_names:
            code = self._assets.file(SCRIPTS.get(name, f"js/{name}"))
            self._script_names[name] = self.add(name, page_script(code))
        return self._script_names[name]

    def add_part_scripts(self, marks: frozenset[str]) -> Iterator[tuple[str, str]]:
        """Add the scripts of the parts that pages have, each after the mark of the part."""
        for feature in features():
            for part in feature.parts:
                if part.mark not in marks:
                    continue
                if part.bundled:
                    yield part.mark, self.add_script(part.bundled)
                elif part.code:
                    yield part.mark, self.add(f"{feature.name}.js", page_script(part.code.encode()))

    def add_font(
        self, job: fonts.FontJob, cut_font: Callable[[fonts.FontJob], bytes] | None
    ) -> str:
        stem, _, ending = job.face.file.rpartition(".")
        if cut_font is None:
            ending = "woff2" if job.data.startswith(b"wOF2") else ending
            return self.add(f"fonts/{stem}.{ending}", job.data)
        # The name comes from the input, so that it can be cut while pages are written.
        key = job.key
        name = f"assets/fonts/{stem}.{key[:8]}.woff2"
        self.files.append(CachedFile(name, key, functools.partial(cut_font, job)))
        return name

    def add_picture(self, name: str, file: ThemeFile | None) -> str:
        return "" if file is None else self.add(f"{name}.{file.ending}", file.data)

    def add_icons(self, theme: Theme) -> tuple[str, str]:
        """Add the icon and the one for touch screens: those of the course, if it has any."""
        if theme.icon is None and theme.touch_icon is None:
            return (
                self.add("icon.svg", self._assets.template("icon.svg").encode()),
                self.add("icon-touch.png", self._assets.file("icons/icon-touch.png")),
            )
        return (
            self.add_picture("icon", theme.icon or theme.touch_icon),
            self.add_picture("icon-touch", theme.touch_icon),
        )
