"""Data classes that cost little to define and to make.

Entry point: `dataclass`, with the meaning of the one in the standard library; `field` and `replace`
go with it, and `dataclasses.fields` and `dataclasses.replace` work with its classes too.

The standard one writes and compiles half a dozen methods for each class, when it is defined: for
the classes of this tool that takes longer than building a lesson. Here

1. a class gets its `__init__` when it is first called, and the code of it from another class with
   fields of the same kinds: to compile one takes as long as making hundreds of values;
2. the other methods are the same for all classes, and know the fields;
3. fields of frozen values are set through their slots, which is four times as fast as
   `object.__setattr__`.

Type checkers take all of it for the standard library's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
    from dataclasses import field as field
    from dataclasses import replace as replace
else:
    from copyreg import dispatch_table
    from operator import attrgetter
    from reprlib import recursive_repr

    _MISSING = object()

    class _Field:
        """What is known of a field."""

        __slots__ = ("compare", "default", "factory", "init", "name", "repr", "type")

        def __init__(self, default, factory, init, repr, compare):
            self.default = default
            self.factory = factory
            self.init = init
            self.repr = repr
            self.compare = compare

    def field(
        *,
        default=_MISSING,
        default_factory=_MISSING,
        init=True,
        repr=True,
        compare=True,
        hash=None,
    ):
        """A field that is not made, shown or compared like others."""
        if hash is not None and hash != compare:
            raise TypeError("a field is hashed if it is compared")
        return _Field(default, default_factory, init, repr, compare)

    def dataclass(*, frozen=False, slots, eq=True, order=False):
        """Make a class with slots for its annotated names, and methods that go by them."""
        if not slots:
            raise TypeError("only classes with slots are made here")

        def made(cls):
            return _made(cls, frozen, eq, order)

        return made

    def replace(value, /, **changes):
        """The value with some of its fields changed."""
        parts = dict(zip(value.__match_args__, value.__value_parts__, strict=True))
        parts.update(changes)
        return type(value)(**parts)

    def _made(cls, frozen, eq, order):
        own = _own_fields(cls)
        known = {one.name: one for base in cls.__mro__[:0:-1] for one in _fields_of(base)}
        known |= {one.name: one for one in own}
        fields = tuple(known.values())
        namespace = {
            name: value
            for name, value in cls.__dict__.items()
            if name not in ("__dict__", "__weakref__") and name not in known
        }
        namespace |= {
            "__slots__": tuple(one.name for one in own),
            "__value_fields__": fields,
            "__value_parts__": property(_getter([one.name for one in fields if one.init])),
            "__match_args__": tuple(one.name for one in fields if one.init),
            "__dataclass_fields__": _StandardFields(),
        }
        methods = {"__init__": _first_init, "__reduce__": _reduce, "__repr__": _repr}
        if frozen:
            methods |= {"__setattr__": _refuse_set, "__delattr__": _refuse_delete}
        if eq:
            values = _getter([one.name for one in fields if one.compare])
            methods |= _comparisons(values, frozen, order)
        namespace = methods | namespace
        made = type(cls)(cls.__name__, cls.__bases__, namespace)
        made.__qualname__ = cls.__qualname__
        if made.__reduce__ is _reduce:
            dispatch_table[made] = _REDUCED
        return made

    def _fields_of(cls):
        if "__dataclass_fields__" in cls.__dict__ and "__value_fields__" not in cls.__dict__:
            raise TypeError(f"{cls.__qualname__} is a data class of the standard library")
        return cls.__dict__.get("__value_fields__", ())

    def _own_fields(cls):
        found = []
        for name, kind in cls.__annotations__.items():
            given = cls.__dict__.get(name, _MISSING)
            one = given if isinstance(given, _Field) else _Field(given, _MISSING, True, True, True)
            one.name, one.type = name, kind
            found.append(one)
        return found

    def _getter(names):
        """A function that gives the values of fields as a tuple."""
        if len(names) > 1:
            return attrgetter(*names)
        if names:
            name = names[0]
            return lambda value: (getattr(value, name),)
        return lambda value: ()

    # --- making a value

    _makers = {}
    """What makes an `__init__`, by the kinds of fields and whether `__post_init__` follows."""
    _LINES = {
        "given": "set{0}(self, value{0})",
        "given or made": "set{0}(self, make{0}() if value{0} is missing else value{0})",
        "made": "set{0}(self, make{0}())",
        "constant": "set{0}(self, make{0})",
        "left out": "pass",
    }

    def _kind(one):
        if one.factory is not _MISSING:
            return "given or made" if one.init else "made"
        if one.init:
            return "given"
        return "left out" if one.default is _MISSING else "constant"

    def _first_init(self, *args, **kwargs):
        """Gives a class its own `__init__`, and calls it."""
        # What was derived without being decorated has none of these, and maybe one of its own.
        cls = next(one for one in type(self).__mro__ if one.__dict__.get("__init__") in _ours)
        cls.__init__ = _own_init(cls)
        cls.__init__(self, *args, **kwargs)

    _ours = {_first_init}
    """Each `__init__` that was made here."""

    def _own_init(cls):
        """The code of another class with fields of the same kinds, with its own names in it."""
        fields = cls.__value_fields__
        follows = hasattr(cls, "__post_init__")
        kinds = (*map(_kind, fields), follows)
        maker = _makers.get(kinds)
        if maker is None:
            maker = _makers[kinds] = _maker(kinds[:-1], follows)
        own = maker(
            _MISSING,
            *[getattr(cls, one.name).__set__ for one in fields],
            *[one.default if one.factory is _MISSING else one.factory for one in fields],
        )
        given = [one for one in fields if one.init]
        optional = [
            one for one in given if one.default is not _MISSING or one.factory is not _MISSING
        ]
        if optional != given[len(given) - len(optional) :]:
            raise TypeError(f"{cls.__qualname__}: a field without a default follows one with it")
        own.__code__ = own.__code__.replace(co_varnames=("self", *[one.name for one in given]))
        own.__defaults__ = tuple([one.default for one in optional])
        own.__qualname__ = f"{cls.__qualname__}.__init__"
        _ours.add(own)
        return own

    def _maker(kinds, follows):
        numbers = range(len(kinds))
        parameters = [f"value{n}" for n, kind in enumerate(kinds) if kind.startswith("given")]
        lines = [_LINES[kind].format(n) for n, kind in enumerate(kinds)]
        lines += ["self.__post_init__()"] if follows else []
        known = ["missing", *[f"set{n}" for n in numbers], *[f"make{n}" for n in numbers]]
        text = f"def maker({', '.join(known)}):\n"
        text += f" def __init__({', '.join(['self', *parameters])}):\n  "
        text += "\n  ".join(lines or ["pass"]) + "\n return __init__"
        namespace = {}
        exec(text, namespace)
        return namespace["maker"]

    def _reduce(self):
        """Values are pickled as what they were made from."""
        return _REDUCED(self)

    _REDUCED = attrgetter("__class__", "__value_parts__")
    """The same, for the table that pickling looks into first: without a call of Python's."""

    # --- methods that all classes have

    @recursive_repr()
    def _repr(self):
        shown = (one.name for one in self.__value_fields__ if one.repr)
        inner = ", ".join(f"{name}={getattr(self, name)!r}" for name in shown)
        return f"{type(self).__qualname__}({inner})"

    def _comparisons(values, frozen, order):
        def equal(self, other):
            if other.__class__ is self.__class__:
                return values(self) == values(other)
            return NotImplemented

        def hashed(self):
            return hash(values(self))

        def less(self, other):
            if other.__class__ is self.__class__:
                return values(self) < values(other)
            return NotImplemented

        found = {"__eq__": equal, "__hash__": hashed if frozen else None}
        return found | {"__lt__": less} if order else found

    def _refuse_set(self, name, value):
        from dataclasses import FrozenInstanceError

        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def _refuse_delete(self, name):
        from dataclasses import FrozenInstanceError

        raise FrozenInstanceError(f"cannot delete field {name!r}")

    class _StandardFields:
        """The fields as the standard library knows them, when somebody asks for them."""

        def __get__(self, value, cls):
            import dataclasses

            found = {}
            for one in cls.__value_fields__:
                given = {"default": one.default, "default_factory": one.factory}
                given = {name: it for name, it in given.items() if it is not _MISSING}
                known = dataclasses.field(
                    **given, init=one.init, repr=one.repr, compare=one.compare
                )
                known.name, known.type, known._field_type = one.name, one.type, dataclasses._FIELD
                found[one.name] = known
            cls.__dataclass_fields__ = found
            return found
