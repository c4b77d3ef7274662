"""Data classes that cost little to define and to make.

Entry point: `dataclass`, with the meaning of the one in the standard library; `field` and `replace`
go with it, and `dataclasses.fields` and `dataclasses.replace` work with its classes too.

The standard one writes and compiles half a dozen methods for each class, when it is defined: for
the classes of this tool that takes longer than building a lesson. Here

1. a class gets its `__init__` when it has been called some times: of most only few values are made
   in a run, and to write it takes as long as making thirty without;
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
        for one in type(value).__value_fields__:
            if one.init and one.name not in changes:
                changes[one.name] = getattr(value, one.name)
        return type(value)(**changes)

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
            "__value_parts__": staticmethod(_getter([one.name for one in fields if one.init])),
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

    _calls = {}
    _FEW = 12
    """Calls of a class for which no `__init__` is written."""

    def _first_init(self, *args, **kwargs):
        """Makes the first values of a class, then writes the class's own `__init__`."""
        cls = type(self)
        while "__init__" not in cls.__dict__:  # a class that was derived without being decorated
            cls = cls.__mro__[1]
        calls = _calls[cls] = _calls.get(cls, 0) + 1
        if calls <= _FEW and _is_call(cls, args, kwargs):
            _init(cls, self, args, kwargs)
            return
        cls.__init__ = _written_init(cls)
        _calls.pop(cls, None)
        cls.__init__(self, *args, **kwargs)

    def _is_call(cls, args, kwargs):
        """Whether there is a value for each parameter; what else is wrong a written one tells."""
        parameters = [one for one in cls.__value_fields__ if one.init]
        if len(args) > len(parameters):
            return False
        named = parameters[len(args) :]
        left = len(kwargs)
        for one in named:
            if one.name in kwargs:
                left -= 1
            elif one.default is _MISSING and one.factory is _MISSING:
                return False
        return left == 0

    def _init(cls, self, args, kwargs):
        """What a written `__init__` does."""
        given = iter(args)
        for one in cls.__value_fields__:
            value = next(given, _MISSING) if one.init else _MISSING
            if value is _MISSING and one.init:
                value = kwargs.get(one.name, _MISSING)
            if value is _MISSING:
                if one.factory is not _MISSING:
                    value = one.factory()
                elif one.default is not _MISSING:
                    value = one.default
                else:
                    continue
            getattr(cls, one.name).__set__(self, value)
        if hasattr(cls, "__post_init__"):
            self.__post_init__()

    def _written_init(cls):
        parameters, lines, names = [], [], {"_missing": _MISSING}
        for number, one in enumerate(cls.__value_fields__):
            names[f"_set{number}"] = getattr(cls, one.name).__set__
            value = one.name
            if one.factory is not _MISSING:
                names[f"_make{number}"] = one.factory
                value = f"_make{number}()"
                if one.init:
                    parameters.append(f"{one.name}=_missing")
                    value += f" if {one.name} is _missing else {one.name}"
            elif one.default is not _MISSING:
                names[f"_default{number}"] = one.default
                if one.init:
                    parameters.append(f"{one.name}=_default{number}")
                else:
                    value = f"_default{number}"
            elif one.init:
                parameters.append(one.name)
            else:
                continue
            lines.append(f"_set{number}(self, {value})")
        if hasattr(cls, "__post_init__"):
            lines.append("self.__post_init__()")
        text = f"def __init__(self, {', '.join(parameters)}):\n " + "\n ".join(lines or ["pass"])
        exec(text, names)
        written = names["__init__"]
        written.__qualname__ = f"{cls.__qualname__}.__init__"
        return written

    def _reduce(self):
        """Values are pickled as what they were made from."""
        cls = self.__class__
        return cls, cls.__value_parts__(self)

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
