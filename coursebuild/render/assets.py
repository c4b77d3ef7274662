"""The tool's own files: templates, interface texts, and the browser's half as it was bundled.

Entry points: `Assets`, a value that whoever reads the disk makes; `template_environment`;
`hashed_name`.

1. `templates` holds every file of `templates/` as text, `dist` every file of the bundle as bytes,
   by path relative to their folder.
2. A file that a page refers to is published under a name that has a hash of its content in it, so
   that a browser may keep it for ever.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Protocol

from coursebuild.render.strings import DEFAULT_LANGUAGE, Strings, parse_strings
from coursebuild.values import dataclass

if TYPE_CHECKING:
    from jinja2 import BytecodeCache, Environment


@dataclass(frozen=True, slots=True)
class Assets:
    """Templates and bundled files, sorted by path."""

    templates: tuple[tuple[str, str], ...]
    """Path relative to `templates/`, and text."""
    dist: tuple[tuple[str, bytes], ...] | Mapping[str, bytes]
    """Path relative to the bundle (`css/site.css`, `js/site.js`, `fonts/fonts.json`, …), and
    bytes; a mapping may read them when they are asked for."""

    def template(self, path: str) -> str:
        """The text of a file of `templates/` (`KeyError` where there is none)."""
        return dict(self.templates)[path]

    def file(self, path: str) -> bytes:
        """The bytes of a bundled file (`KeyError` where there is none)."""
        return self._bundle()[path]

    def files(self, folder: str) -> tuple[tuple[str, bytes], ...]:
        """The bundled files of a folder."""
        bundle = self._bundle()
        return tuple((path, bundle[path]) for path in bundle if path.startswith(f"{folder}/"))

    def _bundle(self) -> Mapping[str, bytes]:
        return self.dist if isinstance(self.dist, Mapping) else dict(self.dist)


def hashed_name(path: str, data: bytes) -> str:
    """`assets/site.css` with eight digits of its content's hash: `assets/site.1b4f0e98.css`."""
    stem, dot, suffix = path.rpartition(".")
    digest = hashlib.sha256(data).hexdigest()[:8]
    return f"{stem}.{digest}.{suffix}" if dot else f"{path}.{digest}"


def page_script(code: bytes) -> bytes:
    """A bundled module without imports or exports as a plain script in a scope of its own.

    Browsers refuse to load modules from a disk, and plain scripts of one page share their top-level
    names.
    """
    return b'"use strict";(()=>{' + code.rstrip() + b"\n})();\n"


class Compiled(Protocol):
    """Keeps the code that templates are compiled to."""

    def __hash__(self) -> int:
        """Engines are made once for each."""

    def load(self, name: str) -> bytes | None:
        """What was kept under a name."""

    def generated(self, name: str) -> str | None:
        """The Python that `generated` made ahead of the template of this name."""

    def keep(self, name: str, data: bytes) -> None:
        """Keep a template's code."""


def templates_of(
    templates: tuple[tuple[str, str], ...], compiled: Compiled | None = None
) -> Callable[[], Environment]:
    """Gives the template engine, which is imported when it is first asked for."""
    return functools.cache(lambda: template_environment(templates, compiled))


@functools.lru_cache(maxsize=8)
def template_environment(
    templates: tuple[tuple[str, str], ...], compiled: Compiled | None = None
) -> Environment:
    """The template engine: it escapes all that is not `Markup`, and refuses undefined names."""
    from jinja2 import DictLoader, Environment, StrictUndefined

    environment = Environment(
        loader=DictLoader({path: text for path, text in templates if path.endswith(".html")}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        bytecode_cache=None if compiled is None else _bytecode_cache(compiled),
    )
    return environment


def generated(templates: tuple[tuple[str, str], ...]) -> dict[str, str]:
    """The Python that templates become, by a name for all that it depends on."""
    from jinja2.bccache import BytecodeCache

    environment, cache = template_environment(templates), BytecodeCache()
    return {
        _name(cache.get_cache_key(path), cache.get_source_checksum(text)): environment.compile(
            text, path, raw=True
        )
        for path, text in templates
        if path.endswith(".html")
    }


def _name(key: str, checksum: str) -> str:
    import jinja2

    return f"{jinja2.__version__}/{key}/{checksum}"


def _bytecode_cache(compiled: Compiled) -> BytecodeCache:
    from jinja2.bccache import Bucket, BytecodeCache

    class Cache(BytecodeCache):
        def load_bytecode(self, bucket: Bucket) -> None:
            name = _name(bucket.key, bucket.checksum)
            data = compiled.load(name)
            if data is not None:
                bucket.bytecode_from_string(data)
            elif (code := compiled.generated(name)) is not None:
                bucket.code = compile(code, "<template>", "exec")
                self.dump_bytecode(bucket)

        def dump_bytecode(self, bucket: Bucket) -> None:
            compiled.keep(_name(bucket.key, bucket.checksum), bucket.bytecode_to_string())

    return Cache()


@functools.lru_cache(maxsize=8)
def strings_for(templates: tuple[tuple[str, str], ...], language: str) -> Strings:
    """The interface texts of a language (`pt-BR`): its file over `pt` over English."""
    texts = dict(templates)
    strings = parse_strings(texts[f"strings/{DEFAULT_LANGUAGE}.toml"], None, language)
    for name in (language.split("-")[0].lower(), language):
        if name != DEFAULT_LANGUAGE and f"strings/{name}.toml" in texts:
            strings = parse_strings(texts[f"strings/{name}.toml"], strings, language)
    return strings
