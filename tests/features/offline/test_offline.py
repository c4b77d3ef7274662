"""The manifest, and the list of files that a browser may keep."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model.results import FileFacts
from coursebuild.features.offline import PAPER, listing, short_name
from support.fixture_cases import check_lines, fixture_text
from support.rendered_course import Make

ROOT = Path(__file__).parents[3]
SHELL = frozenset({"index.html", "offline/index.html", "assets/site.0123abcd.css"})


@pytest.fixture(scope="module")
def site(make: Make) -> dict[str, bytes]:
    files: dict[str, bytes] = make("## One\n\nText.\n").site()
    return files


def read_listing(*files: FileFacts) -> dict[str, Any]:
    groups: dict[str, Any] = json.loads(listing(SHELL, files))
    return groups


def digest(name: str) -> str:
    return hashlib.sha256(name.encode()).hexdigest()


def file(path: str, size: int = 100) -> FileFacts:
    """Return a file; `#` in its name stands for the digits of its content's hash."""
    return FileFacts(path.replace("#", digest(path)[:8]), digest(path), size)


GROUPS = {
    "shell": "index.html offline/index.html assets/fonts/f.#.woff2",
    "text": "lessons/1.1-a.html manifest.webmanifest assets/offline.#.js search/index.js"
    " assets/labs/1.1-lab-1.#.png files/lessons/s.svg files/lessons/Foto.jpeg",
    "rest": "assets/labs/mujoco.#.wasm assets/labs/1.1-lab-1.#.json files/data.csv files/film.mp4"
    " models/box.xml examples/a.py",
    "": "404.html robots.txt sitemap.xml service-worker.js llms.txt examples.zip lessons/1.1-a.zip"
    " lessons/1.1-a.ipynb lessons/1.1-a.md assets/site.#.css.br assets/site.#.css.gz",
}


def test_each_file_is_in_the_group_of_those_who_need_it() -> None:
    for group, paths in GROUPS.items():
        for path in paths.split():
            data = read_listing(file(path))
            groups = {name for name in ("shell", "text", "rest") if data[name]["files"]}
            assert groups == ({group} if group else set()), path
            if group:
                assert data[group]["bytes"] == 100
                expected = "" if "#" in path else digest(path)[:12]
                assert list(data[group]["files"].values()) == [expected], path


def test_a_page_of_more_than_a_mebibyte_is_for_those_who_ask_for_everything() -> None:
    large = 1 << 20, (1 << 20) + 1
    pages = (file(f"{size}.html", size) for size in large)
    groups = read_listing(*pages, file("assets/a.#.js", 1 << 21))
    assert [*groups["rest"]["files"]] == [f"{large[1]}.html"]
    assert len(groups["text"]["files"]) == 2, "what scripts of every page need is kept with them"


def test_a_name_with_a_foreign_hash_needs_a_digest() -> None:
    groups = read_listing(FileFacts("assets/a.0123abcd.js", digest("a"), 1))
    assert groups["text"]["files"] == {"assets/a.0123abcd.js": digest("a")[:12]}


def test_an_edit_changes_its_line_and_no_other(site: dict[str, bytes], make: Make) -> None:
    def lines(files: dict[str, bytes]) -> set[str]:
        return set(files["files.json"].decode().splitlines())

    new_site = make("## One\n\nTxet.\n").site()
    old_lines, new_lines = lines(site) - lines(new_site), lines(new_site) - lines(site)
    paths = {line.split('"')[1] for line in new_lines if line.startswith('"')}
    assert "lessons/0.1-falling.html" in paths
    assert not {path for path in paths if path.endswith((".css", ".woff2"))}
    assert len(old_lines) == len(new_lines)


def test_the_list_has_the_files_of_the_site(site: dict[str, bytes]) -> None:
    data = json.loads(site["files.json"])
    files = {
        path: d for name in ("shell", "text", "rest") for path, d in data[name]["files"].items()
    }
    assert files.keys() <= site.keys()
    for path, digits in files.items():
        digest = hashlib.sha256(site[path]).hexdigest()
        assert digest.startswith(digits or path.split(".")[-2])
    shell = data["shell"]["files"]
    for page in ("index.html", "offline/index.html"):
        text = site[page].decode()
        for name in re.findall(r'(?:src|href)="(?:\.\./)?(assets/[^"]+\.(?:css|js|svg))"', text):
            assert name in shell, name
    assert data["text"]["bytes"] == sum(len(site[path]) for path in data["text"]["files"])


@given(st.lists(st.text(alphabet='ab"\\\n,é\ud800/.', max_size=6), unique=True, max_size=5))
def test_the_list_is_json_with_a_line_for_each_file(names: list[str]) -> None:
    files = [FileFacts(f"assets/{name}.js", "0" * 64, size) for size, name in enumerate(names)]
    text = listing(SHELL, files).decode("utf-8", "surrogatepass")
    assert f"{json.dumps(json.loads(text), ensure_ascii=False, indent=0)}\n" == text
    assert [*json.loads(text)["text"]["files"]] == [file.path for file in files]


def test_the_manifest_names_existing_icons(site: dict[str, bytes]) -> None:
    manifest = json.loads(site["manifest.webmanifest"])
    assert (manifest["start_url"], manifest["scope"], manifest["id"]) == ("./", "./", "./")
    for icon in manifest["icons"]:
        data = site[icon["src"]]
        if icon["type"] == "image/png":
            width = int.from_bytes(data[16:20], "big")
            assert data.startswith(b"\x89PNG") and icon["sizes"] == f"{width}x{width}"
    purposes = [icon.get("purpose", "any") for icon in manifest["icons"]]
    assert purposes == ["any", "any", "any", "maskable"]


def test_every_page_names_the_manifest(site: dict[str, bytes]) -> None:
    for path, data in site.items():
        if path.endswith(".html"):
            root = "/course/" if path == "404.html" else "../" * path.count("/")
            assert f'<link rel="manifest" href="{root}manifest.webmanifest">' in data.decode()


def test_the_colours_of_the_manifest_are_those_of_the_style_sheet() -> None:
    tokens = (ROOT / "site/css/tokens.css").read_text(encoding="utf-8")
    light, dark = re.findall(r"--paper: light-dark\((#\w+), (#\w+)\)", tokens)[0]
    base = (ROOT / "templates/base.html").read_text(encoding="utf-8")
    assert light == PAPER
    assert re.findall(r'name="theme-color" content="(#\w+)"', base) == [light, dark]


def test_a_name_below_an_icon_has_whole_words(rewriting: bool) -> None:
    path = Path(__file__).with_name("names.md")
    check_lines(path, lambda title: [short_name(title)], rewriting=rewriting)


def test_hostile_titles_stay_text(make: Make) -> None:
    title = 'A "course" </script> & \\ more'
    site = make("## One\n", course=MAP.replace("TITLE", title)).site()
    assert json.loads(site["manifest.webmanifest"])["name"] == title


MAP = fixture_text("documents/offline.toml")
