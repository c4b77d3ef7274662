"""`coursebuild import`: convert, write, try, check.

Entry point: `import_course`.
"""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from coursebuild.importer.convert import convert, write_course
from coursebuild.importer.trial import try_scripts
from coursebuild.importer.values import Leftover
from coursebuild.pipeline.check import check
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.report import Report
from coursebuild.report.values import plural


def import_course(source: Path, options: Options) -> Report:
    """Write the course in a folder as one of coursebuild to that of the options, and check it.

    Raises:
        UsageError: there is nothing to import, or the new folder is not empty enough.
    """
    converted = convert(source)
    write_course(converted, options.root, source)
    progress = Progress(quiet=options.quiet)
    proposed = try_scripts(options, progress)
    report = check(options)
    remarks = (
        f"wrote {plural(len(converted.files), 'file')} to {options.root}",
        *proposed,
        *(_said(one) for one in converted.left),
    )
    return replace(report, remarks=(*remarks, *report.remarks), depends=None)


def _said(left: Leftover) -> str:
    place = f", {left.place}" if left.place else ""
    return f"left: {left.path}{place}: {left.what}"
