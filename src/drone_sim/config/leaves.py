"""The single values of a model, numbers, switches and words, and what each may be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from drone_sim.config.types import Checked, Location, Parts, Within

_UNIONS = (Union, UnionType)


class Leaf(NamedTuple):
    """One value of a model, or one part of a list: where it stands, what it may be."""

    location: Location  # keys, and an index for a part of a list
    kind: type  # float, int, bool or str
    part: str = ""  # what that part is called
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()  # of a str
    none: float | None = None  # stands for a value, or for a list, that may also be none
    said: str = ""  # what the model says of it

    @property
    def name(self) -> str:
        """What it is called: its keys with slashes, and a part's name."""
        keys = (*self.location[:-1], self.part) if self.part else self.location
        return "/".join(map(str, keys))


@lru_cache(maxsize=1024)
def leaves(model: type[Checked], above: Location = ()) -> tuple[Leaf, ...]:
    """Return the values of a model, whose own keys stand below `above`; mappings of any keys are left out."""
    fields = model.model_fields.items()
    return tuple(
        leaf
        for name, field in fields
        for leaf in _of(field.annotation, [*field.metadata, field], Leaf((*above, name), float))
    )


def _of(annotation: Any, marks: Sequence[Any], here: Leaf) -> Iterator[Leaf]:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        yield from _of(arguments[0], [*marks, *arguments[1:]], here)
    elif origin in _UNIONS and type(None) in arguments:
        (inner,) = (one for one in arguments if one is not type(None))
        yield from _of(inner, marks, here._replace(none=0.0))
    elif origin is tuple:
        yield from _parts(arguments, marks, here)
    elif origin is Literal and all(isinstance(one, str) for one in arguments):
        yield here._replace(kind=str, choices=arguments)
    elif isinstance(annotation, type) and issubclass(annotation, Checked):
        yield from leaves(annotation, here.location)
    elif annotation in (float, int, bool):
        yield _number(annotation, marks, here)


def _number(kind: type, marks: Sequence[Any], here: Leaf) -> Leaf:
    within = next((one for one in marks if isinstance(one, Within)), None)
    said = next((one.description for one in marks if getattr(one, "description", None)), "")
    if within is None:
        return here._replace(kind=kind, said=said)
    low = 0.0 if within.or_zero or here.none is not None else within.low
    return here._replace(kind=kind, low=kind(low), high=kind(within.high), said=said)


def _parts(arguments: Sequence[Any], marks: Sequence[Any], here: Leaf) -> Iterator[Leaf]:
    names = next((one.names for one in marks if isinstance(one, Parts)), tuple(map(str, range(len(arguments)))))
    for index, (name, argument) in enumerate(zip(names, arguments)):
        part = here._replace(location=(*here.location, index), part=name, none=None)
        for leaf in _of(argument, (), part):
            widest = leaf.high if index else leaf.low  # [lowest, highest] that are none hold nothing back
            yield leaf._replace(none=None if here.none is None else widest)
