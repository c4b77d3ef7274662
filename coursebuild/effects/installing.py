"""What pip says when it cannot install, told plainly.

Entry points: `pip_error`; `same_version`.
"""

from __future__ import annotations

import platform
import re
from collections.abc import Mapping, Sequence

from coursebuild.effects.errors import EffectError

_NEAR = 4
"""Versions that are named where one is not to be had."""
_LINES = 4
_NONE = re.compile(
    r"Could not find a version that satisfies the requirement (?P<what>\S+).*?"
    r"\(from versions: (?P<versions>[^)]*)\)"
)
_UNREACHABLE = re.compile(
    r"NewConnectionError|NameResolutionError|ConnectTimeoutError|ReadTimeoutError|ProxyError|"
    r"SSLError|ProtocolError|Failed to establish a new connection|Max retries exceeded|"
    r"connection (?:broken|error|timed out)",
    re.IGNORECASE,
)
_CONFLICT = "ResolutionImpossible"
_OFFLINE = (
    "check the network; or let pip find the wheels in a folder, by the environment variables "
    "PIP_FIND_LINKS and PIP_NO_INDEX"
)


def pip_error(engine: str, said: str, held: Mapping[str, str]) -> EffectError:
    """Why this version of MuJoCo was not installed.

    Args:
        engine: the version.
        said: what pip wrote.
        held: the distributions of here, with their versions, that were to be beside it.
    """
    none = _NONE.search(said)
    if none is not None:
        name, _, version = none["what"].partition("==")
        listed = [part.strip() for part in none["versions"].split(",")]
        versions = [part for part in listed if part not in ("", "none")]
        if not versions and _UNREACHABLE.search(said):
            return EffectError("the package index cannot be reached", help=_OFFLINE)
        return _not_to_be_had(name, version.rstrip(","), versions)
    if _CONFLICT in said:
        lines = [line.strip() for line in said.splitlines()]
        causes = [line for line in lines if " depends on " in line or "user requested" in line]
        told = "; ".join(causes[:_LINES])
        return EffectError(
            f"MuJoCo {engine} cannot be installed beside the packages of here: {told}".rstrip(": "),
            help="name a version of MuJoCo that goes with them",
        )
    if _UNREACHABLE.search(said):
        return EffectError("the package index cannot be reached", help=_OFFLINE)
    errors = [line.partition("ERROR:")[2].strip() for line in said.splitlines() if "ERROR:" in line]
    lines = errors or [line.strip() for line in said.splitlines() if line.strip()]
    if errors[-1:] == ["Exception:"]:  # pip itself failed: its traceback ends with what happened
        lines = [line.strip() for line in said.splitlines() if line.strip()][-1:]
    return EffectError(f"pip cannot install MuJoCo {engine}: {'; '.join(lines[-_LINES:])}")


def _not_to_be_had(name: str, version: str, versions: Sequence[str]) -> EffectError:
    called = "MuJoCo" if name == "mujoco" else name
    if called == name:
        return EffectError(
            f"{name} {version} is installed here, and pip does not find it again",
            help=f"its versions that pip finds: {', '.join(near(version, versions)) or 'none'}",
        )
    where = f"Python {'.'.join(platform.python_version_tuple()[:2])} on {platform.machine()}"
    if not versions:
        return EffectError(f"pip finds no MuJoCo at all for {where}", help=_OFFLINE)
    return EffectError(
        f"pip finds no MuJoCo {version} for {where}",
        help=f"near it are {', '.join(near(version, versions))}",
    )


def same_version(one: str, other: str) -> bool:
    """Whether two versions are the same: 3.13 is 3.13.0."""
    return one == other or _shortened(one) == _shortened(other)


def _shortened(version: str) -> str:
    return re.sub(r"(\.0)+(?=$|[a-z+]|\.(?:post|dev))", "", version)


def near(version: str, versions: Sequence[str]) -> list[str]:
    """The versions next to one, those before it and those after it, in order."""
    ordered = sorted(dict.fromkeys(versions), key=_parts)
    before = [one for one in ordered if _parts(one) < _parts(version)]
    after = [one for one in ordered if _parts(one) >= _parts(version)]
    half = _NEAR // 2
    some = max(half, _NEAR - len(after))
    return [*before[-some:], *after[: max(half, _NEAR - len(before))]]


def _parts(version: str) -> tuple[tuple[int, ...], int, str]:
    """By which versions are sorted: candidates come before the version itself."""
    numbers = re.match(r"[0-9.]*", version)
    text = "" if numbers is None else numbers.group().strip(".")
    rest = version[len(text) :]
    found = tuple(int(part) for part in text.split(".") if part)
    while found and found[-1] == 0:
        found = found[:-1]
    return found, 1 if not rest or rest.startswith((".post", "+")) else 0, rest
