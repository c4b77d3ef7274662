"""Labs as pages and copies show them before they run: subject, controls, displays and recording.

No control is drawn, as none would work yet: the page's script puts the live instrument into
`data-lab` when it starts, and reads its configuration there. A model that no lab of a text shows
gets a lab of its own.
"""

from __future__ import annotations

from urllib.parse import quote

from markupsafe import Markup, escape
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    Document,
    IndexReader,
    Library,
    MarkdownWriter,
    MjcfModel,
    PageContext,
    Picture,
    Place,
    Renderer,
    find_blocks,
    urls,
)
from coursebuild.core.model import Mjcf, ModelTarget, Owner
from coursebuild.core.pages.library import BY_LAB
from coursebuild.core.pages.marks import escape_marks, link, picture
from coursebuild.core.pages.renderer import Strings
from coursebuild.core.text.quantities import with_unit
from coursebuild.features.lab.engines.native import LAB_ENGINE
from coursebuild.features.lab.model import MJCF, ODE, PLOT, Lab, gallery_lab, labs_by_model
from coursebuild.features.lab.relations import is_editable
from coursebuild.features.lab.reply import LabRecord, PublishedLab
from coursebuild.features.lab.schema import (
    Control,
    Plot,
    Select,
    Slider,
)


class RecordedView(Struct, frozen=True):
    """What the trial recorded, with its words."""

    record: LabRecord
    picture: str
    alt: str
    length: str
    """Length of the bar that shows the scale of the picture."""
    at: str
    """When the readouts were taken."""
    verification: str
    """How the build has checked the lab."""


class LabView(Struct, frozen=True):
    """A lab in its static form, apart from what its author wrote about it."""

    kind: str
    subject: str
    """What it is of, in words that the name of its model may follow."""
    title: str
    number: str
    """As in "Lab 4.2.1"; like `label`, its id, empty without one."""
    label: str
    key: str
    """Its name in the course; like `config` and `script` (addresses), empty if it cannot run."""
    config: str
    script: str
    model: str | None
    model_href: str
    start: str | None
    stop: str | None
    still: str
    """Why nothing moves by itself; empty where something does."""
    controls: tuple[tuple[str, str], ...]
    """Labels; range or options, and the initial value, in words."""
    readouts: tuple[str, ...]
    plots: tuple[tuple[str, tuple[str, ...]], ...]
    """Axes, and the names of lines and reference lines."""
    overlays: tuple[str, ...]
    recorded: RecordedView | None


def draw_lab(page: PageContext, block: Lab) -> Markup:
    """Draw a lab in its static form."""
    view, words, address = page_view(page, block), page.renderer.words, ""
    opens_page = page.document.blocks[:1] == (block,)
    if view.key and page.inputs.address:  # leads from paper to the lab
        address = f"{page.inputs.address}#{quote(view.key)}"
    return page.template(
        "lab/lab.html",
        lab=view,
        fields=block.fields,
        arrows=0 if view.recorded is None else view.recorded.record.arrows,
        docked=block.fields.dock,
        opens_page=opens_page,
        keeps_room=opens_page and view.config and not view.controls,
        address=address,
        code=qr_svg(address, words("lab.code")) if address else "",
        goal=page.inlines(block.goal),
        goal_key=(block.progress_keys() or ("",))[0],
        legend=[
            (entry.overlay, page.inlines(text))
            for entry, text in zip(block.fields.legend, block.legend, strict=True)
        ],
        source=_source(page, block),
        note=page.blocks(block.note),
    )


def _source(page: PageContext, block: Lab) -> Markup:
    """The model that a reader edits."""
    if block.kind != MJCF or block.xml is None:
        return Markup("")
    html = page.highlight("xml", block.xml.text.rstrip("\n"))
    return page.template("blocks/code.html", language="xml", html=html)


def page_view(page: PageContext, block: Lab) -> LabView:
    """The view of a lab of a document on its page."""
    trial, model = page.inputs.trials.get(block.span.start), block.fields.model
    live = trial if isinstance(trial, PublishedLab) else None
    view = lab_view(page.renderer.words, page.place, block, live)
    href = "" if model is None else page.href(ModelTarget(model))
    key = block.fields.key
    if key is None or isinstance(key, str):
        start = key
    else:
        names = page.inputs.keyframes.get(block.fields.model or "", ())
        start = (names[key] if 0 <= key < len(names) else "") or str(key)
    recorded = view.recorded
    if recorded is not None and recorded.record.scale is not None:
        # Why the labs of a page run with another MuJoCo than its scripts
        runs, words = page.inputs.runs.values(), page.renderer.words
        versions = {version for run in runs for version in run.versions}
        engines = {v.removeprefix("MuJoCo ") for v in versions if v.startswith("MuJoCo ")}
        other_engines = words.join(sorted(engines - {LAB_ENGINE}))
        remark = words("lab.two_engines", scripts=other_engines) if other_engines else ""
        recorded = replace(recorded, verification=f"{recorded.verification} {remark}".rstrip())
    view = replace(view, model_href=href, start=start, recorded=recorded)
    if block.label is None:
        return view
    return replace(view, number=page.number(block.label), label=block.label.id)


def lab_view(words: Strings, place: Place, block: Lab, live: PublishedLab | None) -> LabView:
    """The view of a lab for the page at a place; `live` is the lab as it was published."""
    fields = block.fields
    title = fields.title or words("lab.untitled")
    model_subject = "lab.static_xml" if fields.model is None else "lab.static"
    return LabView(
        kind=block.kind,
        subject=words(_SUBJECTS.get(block.kind, model_subject)),
        title=title,
        number="",
        label="",
        key=live.name if live is not None else "",
        config=place.href(live.config) if live is not None else "",
        script=place.href(live.script) if live is not None else "",
        model=fields.model,
        model_href="",
        start=None,
        stop=words.number(fields.stopAt) if fields.stopAt is not None else None,
        still=fields.still,
        controls=tuple((control.label, _values(words, control)) for control in fields.controls),
        readouts=tuple(readout.label for readout in fields.readouts),
        plots=tuple(_plot(words, plot) for plot in fields.plots),
        overlays=tuple(words(f"overlay.{name}") for name in fields.toggles),
        recorded=_recorded_view(words, place, title, live),
    )


_SUBJECTS = {PLOT: "lab.static_plot", ODE: "lab.static_ode"}


def lab_picture(block: Lab, lab: Struct | None) -> Picture | None:
    """Return the picture that the trial recorded; `None` if it did not come to its end."""
    if not isinstance(lab, PublishedLab) or lab.record is None:
        return None
    width, height = lab.record.size
    return Picture(lab.picture, width, height, block.fields.title, lab.name, lab.film)


def index_lab(reader: IndexReader, lab: Lab) -> None:
    """Give the search a lab's title, note, labels and model."""
    reader.add("text", lab.fields.title)
    for text in (lab.goal, *lab.legend):
        reader.add("text", reader.text(text))
    reader.blocks(lab.note)
    labels = [control.label for control in lab.fields.controls]
    labels += [readout.label for readout in lab.fields.readouts]
    reader.add("text", ", ".join(filter(None, labels)))
    if lab.fields.model is not None:
        reader.add_name(lab.fields.model)
    if lab.xml is not None:
        reader.add("code", lab.xml.text)


def _recorded_view(
    words: Strings, place: Place, title: str, live: PublishedLab | None
) -> RecordedView | None:
    record = live.record if live is not None else None
    if live is None or record is None:
        return None
    count, (key, values) = str(live.attempt_count), live.parity
    parity = words(key, **values) if key else ""
    if record.scale is None:
        alt, length = words("lab.curves", title=title), ""
        at = words("lab.at_place", place=record.place)
        verification = words("lab.computed", tried=count, parity=parity)
    else:
        alt = words("lab.picture", title=title, t=words.number(record.time))
        length = f"{words.number(record.scale[0])} m"
        at = words("lab.at", t=words.number(record.end))
        verification = words("lab.proven", engine=LAB_ENGINE, tried=count, parity=parity)
    return RecordedView(record, place.href(live.picture), alt, length, at, verification)


def _values(words: Strings, control: Control) -> str:
    match control:
        case Slider():
            ends = words("lab.between", min=control.min, max=control.max)
            ends = with_unit(ends, control.unit)
            values = words("lab.step", range=ends, step=control.step) if control.step else ends
            initial = with_unit(words.number(control.value, control.digits), control.unit)
        case Select():
            values = words.join(label for label, _ in control.options)
            initial = next(label for label, value in control.options if value == control.start)
        case _:
            return words("lab.button")
    return words("lab.initial", values=values, initial=initial)


def _plot(words: Strings, plot: Plot) -> tuple[str, tuple[str, ...]]:
    title = words(
        "lab.plot",
        ylabel=plot.ylabel or words("lab.value"),
        xlabel=plot.xlabel or plot.x or words("lab.time"),
    )
    lines = ((line.label, words.number(line.y)) for line in plot.refLines)
    marks = (f"{label} ({y})" if label else y for label, y in lines)
    return title, (*(trace.label for trace in plot.traces), *marks)


def _find_lab(library: Library, model: MjcfModel) -> tuple[Lab, PublishedLab | None]:
    documents = (use.owner.document for use in library.uses[model.name] if BY_LAB in use.ways)
    labs = (labs_by_model(document).get(model.name) for document in documents if document)
    lab = next(filter(None, labs), None) or gallery_lab(model)
    publication = library.trial_value(lab)
    return lab, publication if isinstance(publication, PublishedLab) else None


def model_view(library: Library, place: urls.Place, model: MjcfModel) -> LabView | None:
    """What the page of a model shows; `None` if the trial recorded nothing."""
    lab, publication = _find_lab(library, model)
    if publication is None or publication.record is None:
        return None
    view = lab_view(library.words, place, lab, publication)
    return replace(view, model_href=place.href(place.path))


def draw_model(renderer: Renderer, view: LabView) -> Markup:
    """Draw the lab on the page of its model."""
    return renderer.render(
        "lab/lab.html",
        lab=view,
        docked=False,
        opens_page=True,
        keeps_room=False,
        address="",
        source="",
        note="",
        goal="",
        legend=(),
    )


def model_picture(library: Library, model: MjcfModel) -> Picture | None:
    """Return the picture of a model's lab."""
    return lab_picture(*_find_lab(library, model))


def editor_links(library: Library, place: Place, document: Document) -> dict[int, str]:
    """Return the address of the lab in which readers edit a listing of MJCF, by its offset.

    It is the first of the kind `mjcf` on a page of the course, or else in a lesson.
    """
    listings = [
        block.span.start
        for block in find_blocks(document, Mjcf)
        if block.error is None and is_editable(block.code.text)
    ]
    owners: tuple[Owner, ...] = (*library.course.pages, *library.order) if listings else ()
    for owner in owners:
        for lab in () if owner.document is None else find_blocks(owner.document, Lab):
            publication = library.trial_value(lab)
            if lab.kind == MJCF and isinstance(publication, PublishedLab):
                href = place.href(urls.owner_path(owner), publication.name)
                return dict.fromkeys(listings, href)
    return {}


def qr_svg(text: str, label: str) -> Markup:
    """The QR code of a text as an `svg` element with a label; empty for a text that is too long.

    Up to a seventh of the code may be damaged (level M), or more if that takes no more room.
    """
    import segno  # only pages with labs need it

    try:
        code = segno.make_qr(text, error="m", boost_error=True)
    except segno.DataOverflowError:  # more than 2,331 bytes
        return Markup()
    svg = code.svg_inline(omitsize=True, svgclass="qr", lineclass=None)
    return Markup(svg.replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1))


def lab_markdown(writer: MarkdownWriter, lab: Lab) -> str:
    """Write a lab as its trial recorded it, with a link to where it runs."""
    words, view = writer.words, page_view(writer.page, lab)
    parts = [f"**{words('lab.label')}: {escape_marks(view.title)}**"]
    if view.recorded is not None and view.recorded.record.scale is None:
        # Plots, which the page has as drawings
        parts.append(picture(view.recorded.alt, writer.locate(view.recorded.picture)))
    values = {"lab": view, "source": _source(writer.page, lab), "goal": "", "opens_page": False}
    static = writer.page.template("lab/static.html", **values, copied=True)
    parts.append(writer.html(static))
    if lab.goal:
        parts.append(f"**{words('lab.goal')}:** {writer.inlines(lab.goal)}")
    parts += ["\n".join(f"- {writer.inlines(text)}" for text in lab.legend)]
    parts += [writer.blocks(lab.note), link(words("exports.run_lab"), writer.live)]
    return "\n\n".join(filter(None, parts))
