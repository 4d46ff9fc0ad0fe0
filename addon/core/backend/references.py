"""How kernels take named tuples of arrays by reference: a type for Numba, in its own extension interface.

Numba hands a tuple on by value: each array in it as seven numbers, so that a scene is 400 arguments of every part that
looks at it, and a part takes a second to compile. As a reference it is one pointer to where the kernel's wrapper laid
the tuple out. What the pointer leads to does not change while a kernel runs, which every load from it says, so that
the compiler may keep such values in registers across stores. (The arrays' elements may change.)
"""

from hashlib import sha256
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import NativeValue, lower_getattr_generic, models, register_model, typeof_impl, unbox
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.core.typing.typeof import typeof


class Reference(types.Type):
    """A named tuple that is handed on as a pointer.

    Parameters
    ----------
    tuple_class : type
    members : tuple of Numba's types
    """

    def __init__(self, tuple_class: type, members: tuple[types.Type, ...]) -> None:
        self.tuple_class, self.members = tuple_class, members
        of = sha256(", ".join(map(str, members)).encode()).hexdigest()[:12]  # short: it is in each function's name
        super().__init__(f"{tuple_class.__qualname__}_{of}")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the members."""
        return self.tuple_class._fields  # type: ignore[attr-defined, no-any-return]


def register(tuple_class: type) -> None:
    """Have kernels take tuples of a class by reference."""

    @typeof_impl.register(tuple_class)
    def type_of(value: Any, context: Any) -> Reference:
        return Reference(tuple_class, tuple(typeof(member, context.purpose) for member in value))


@register_model(Reference)
class _Model(models.PrimitiveModel):
    """A pointer to a structure of the members; references in it lie within."""

    def __init__(self, manager: Any, of: Reference) -> None:
        super().__init__(manager, of, _structure(manager, of).as_pointer())


def _structure(manager: Any, of: Reference) -> ir.LiteralStructType:
    return ir.LiteralStructType(
        [
            _structure(manager, member) if isinstance(member, Reference) else manager[member].get_value_type()
            for member in of.members
        ]
    )


@infer_getattr
class _Attributes(AttributeTemplate):
    """Members by name."""

    key = Reference

    def generic_resolve(self, of: Reference, name: str) -> types.Type | None:
        return of.members[of.names.index(name)] if name in of.names else None


@lower_getattr_generic(Reference)
def _get(context: Any, builder: Any, of: Reference, pointer: Any, name: str) -> Any:
    index = of.names.index(name)
    place = cgutils.gep_inbounds(builder, pointer, 0, index)
    return place if isinstance(of.members[index], Reference) else _loaded(builder, place)


def _loaded(builder: Any, place: Any) -> Any:
    """What lies at a place, number by number, since aggregates are not optimised."""
    of = place.type.pointee
    if not isinstance(of, ir.Aggregate):
        value = builder.load(place)
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value
    whole = ir.Constant(of, ir.Undefined)
    for i in range(len(of)):
        whole = builder.insert_value(whole, _loaded(builder, cgutils.gep_inbounds(builder, place, 0, i)), i)
    return whole


@unbox(Reference)
def _unbox(of: Reference, tuple_: Any, c: Any) -> NativeValue:
    place = cgutils.alloca_once(c.builder, c.context.get_value_type(of).pointee)
    failed = cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    cleanups = _lay_out(of, tuple_, place, failed, c)

    def cleanup() -> None:
        for each in reversed(cleanups):
            each()

    return NativeValue(place, is_error=c.builder.load(failed), cleanup=cleanup if cleanups else None)


def _lay_out(of: Reference, tuple_: Any, place: Any, failed: Any, c: Any) -> list[Any]:
    """Store the members of a Python tuple; returns what is to be called when they are no longer needed."""
    cleanups = []
    for i, member in enumerate(of.members):
        value, at = c.pyapi.tuple_getitem(tuple_, i), cgutils.gep_inbounds(c.builder, place, 0, i)
        if isinstance(member, Reference):
            cleanups += _lay_out(member, value, at, failed, c)
        elif isinstance(member, types.Array):  # as Numba does, but in few instructions, since a scene has many
            error = c.pyapi.numba_array_adaptor(value, c.builder.bitcast(at, c.pyapi.voidptr))
            c.builder.store(c.builder.or_(c.builder.load(failed), cgutils.is_not_null(c.builder, error)), failed)
        else:
            native = c.unbox(member, value)
            c.builder.store(native.value, at)
            c.builder.store(c.builder.or_(c.builder.load(failed), native.is_error), failed)
            if native.cleanup is not None:
                cleanups.append(native.cleanup)
    return cleanups
