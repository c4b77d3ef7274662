"""Shapes of structs: objects with known fields.

Entry points: `StructShape`, `TaggedShape`, `FieldShape`.

A struct is made as soon as all its own fields are right: an unknown field beside them is a mistake,
but no reason to leave the rest unchecked. A misspelt field is one mistake: that the field it was
meant for is missing is not said again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from msgspec import Struct

from coursebuild.diagnostics import did_you_mean, nearest
from coursebuild.syntax.nodes import Node, ObjectNode, StringNode
from coursebuild.syntax.shapes import FAILED, Run, Shape, failed
from coursebuild.syntax.wording import STRING, named, quoted


class FieldShape(Struct, frozen=True):
    """A field of a struct."""

    name: str
    required: bool
    shape: Shape
    description: str


class StructShape(Shape, frozen=True):
    """An object with known fields."""

    cls: type[Struct]
    fields: dict[str, FieldShape]
    closed: bool
    """Whether an unknown field is a mistake."""

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, ObjectNode)
        return self.build(node, run, None, dict)

    def build(
        self,
        node: ObjectNode,
        run: Run,
        tag: str | None,
        elsewhere: Callable[[], dict[str, str]],
    ) -> object:
        """The struct.

        `tag` is the field that led here and is none of the struct's own; `elsewhere` says which
        tags have a field that this struct does not have.
        """
        values: dict[str, object] = {}
        unknown: dict[str, StringNode] = {}
        for member in node.members:
            key = member.key.value
            known = self.fields.get(key)
            if known is None and key != tag:
                unknown.setdefault(key, member.key)
            elif known is not None and key not in values:
                values[key] = known.shape.decode(member.value, key, run)
        missing = [f for f in self.fields.values() if f.required and f.name not in values]
        meant: set[str] = set()
        if self.closed and unknown:
            meant = self._unknown(unknown.values(), values, elsewhere(), run)
        for lacking in missing:
            if lacking.name not in meant:
                help = lacking.description and f"`{lacking.name}`: {lacking.description}"
                run.fault("field-missing", node.mark, f"`{lacking.name}` is missing", help)
        if missing or failed(values.values()):
            return FAILED
        struct = self.cls(**values)
        run.structs[node] = struct
        return struct

    def _unknown(
        self,
        unknown: Iterable[StringNode],
        given: Iterable[str],
        elsewhere: dict[str, str],
        run: Run,
    ) -> set[str]:
        """Report unknown fields; the fields that were surely meant."""
        meant: set[str] = set()
        for key in unknown:
            free = set(self.fields) - set(given) - meant
            near = nearest(key.value, free)
            if near is not None:
                meant.add(near)
                help = f"did you mean `{near}`?"
            elif key.value in elsewhere:
                help = f"it is a field of {elsewhere[key.value]}"
            else:
                help = did_you_mean(key.value, self.fields)
            run.fault("field-unknown", key.span, f"unknown field {named(key.value)}", help)
        return meant


class TaggedShape(Shape, frozen=True):
    """An object of which one field, the tag, says which of several structs it is."""

    tag: str
    variants: dict[str, StructShape]
    implied: str | None
    """The variant that an object without the tag is."""
    owners: dict[str, tuple[str, ...]]
    """For each field the variants that have it."""

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, ObjectNode)
        given = node.get(self.tag)
        if given is None:
            return self._untagged(node, run)
        if not isinstance(given, StringNode):
            return run.wrong_type(given, self.tag, STRING, did_you_mean("", self.variants))
        if given.value in self.variants:
            return self._variant(given.value, node, run)
        message = f"{named(self.tag)} cannot be {quoted(given)}"
        help = did_you_mean(given.value, self.variants)
        return run.fault("field-value", given.mark, message, help)

    def _variant(self, tag: str, node: ObjectNode, run: Run) -> object:
        def elsewhere() -> dict[str, str]:
            return {
                key: " and ".join(f'`"{self.tag}": "{other}"`' for other in tags)
                for key, tags in self.owners.items()
                if tag not in tags
            }

        return self.variants[tag].build(node, run, self.tag, elsewhere)

    def _untagged(self, node: ObjectNode, run: Run) -> object:
        """Without a tag: the implied variant, unless the fields are clearly those of another."""
        keys = [member.key for member in node.members]
        for key in keys:
            if key.value not in self.owners and nearest(key.value, [self.tag], cutoff=0.7):
                help = f"did you mean `{self.tag}`?"
                message = f"unknown field {named(key.value)}"
                return run.fault("field-unknown", key.span, message, help)
        help = did_you_mean("", self.variants)
        if self.implied is not None:
            owners = [self.owners.get(key.value, ()) for key in keys]
            foreign = [tags for tags in owners if tags and self.implied not in tags]
            if not foreign or (self.implied,) in owners:
                return self._variant(self.implied, node, run)
            help = f'its fields are those of `"{self.tag}": "{foreign[0][0]}"`'
        return run.fault("field-missing", node.mark, f"`{self.tag}` is missing", help)
