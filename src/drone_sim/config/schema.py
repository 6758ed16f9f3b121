"""The types of the values in parameter models, as their annotations declare them."""

from __future__ import annotations

from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin

from pydantic.fields import FieldInfo

_Mark = TypeVar("_Mark")


class ValueType(NamedTuple):
    """The type of a value without Annotated and `| None`, the marks of Annotated (outer ones first), and whether the
    value may be None.
    """

    kind: Any
    marks: tuple[Any, ...] = ()
    has_none: bool = False

    @property
    def words(self) -> tuple[Any, ...]:
        """The values of a Literal; empty for other types."""
        return get_args(self.kind) if get_origin(self.kind) is Literal else ()

    @property
    def elements(self) -> tuple[Any, ...]:
        """The types of a tuple's elements; empty for other types."""
        return get_args(self.kind) if get_origin(self.kind) is tuple else ()

    @property
    def fields(self) -> dict[str, FieldInfo]:
        """The fields of a model, by their keys; empty for other types."""
        fields = getattr(self.kind, "model_fields", {})
        return {field.alias or name: field for name, field in fields.items()}

    @property
    def description(self) -> str:
        """The description of a field or an annotation, '' if there is none."""
        return next((str(mark.description) for mark in self.marks if getattr(mark, "description", None)), "")

    def mark(self, kind: type[_Mark]) -> _Mark | None:
        """Return the first mark of a class, or None."""
        return next((mark for mark in self.marks if isinstance(mark, kind)), None)


def value_type(annotation: Any, marks: tuple[Any, ...] = ()) -> ValueType:
    """Return the type of the values of an annotation; `marks` are those around it."""
    has_none = False
    while True:
        arguments = get_args(annotation)
        others = [inner for inner in arguments if inner is not NoneType]
        if get_origin(annotation) is Annotated:
            annotation, marks = arguments[0], (*marks, *arguments[1:])
        elif get_origin(annotation) in (Union, UnionType) and len(others) == 1:
            annotation, has_none = others[0], True
        else:
            return ValueType(annotation, marks, has_none)


def field_type(field: FieldInfo) -> ValueType:
    """Return the type of a model's field."""
    return value_type(field.annotation, (*field.metadata, field))
