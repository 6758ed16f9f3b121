"""Parameters of the shapes of a scene file."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

from pydantic import Field, create_model

from drone_sim.config.types import (
    Angles,
    Checked,
    Color,
    Finite,
    Mass,
    OptionalFile,
    ParameterError,
    Point,
    Switch,
    Within,
    one_of,
)
from drone_sim.mechanics.frames import from_rpy
from drone_sim.scene.entry import EntryParameters
from drone_sim.shapes import SCENE_SHAPES
from drone_sim.shapes.compound import MAX_PARTS, Compound, Part
from drone_sim.shapes.mass import PrincipalInertia
from drone_sim.shapes.shape import SceneShape

_Moment = Annotated[Finite, Within(1e-12, 1e12)]  # kg m²
_NO_PARTS = ("urdf",)  # shapes that a compound cannot contain


class InertiaParameters(Checked):
    """Principal moments of inertia, and the pose of the centre of mass and principal axes in the shape's frame."""

    moments: Annotated[tuple[_Moment, _Moment, _Moment], Field(description="3 numbers, principal moments in kg m²")]
    position: Point = (0.0, 0.0, 0.0)
    rpy: Angles = (0.0, 0.0, 0.0)

    @property
    def inertia(self) -> PrincipalInertia:
        return PrincipalInertia(self.moments, from_rpy(self.position, self.rpy))


class ObjectParameters(EntryParameters):
    """A shape in the scene: the keys that all shapes have in common.

    A shape with mass 0 is static; a `static` one is until a script makes it dynamic. Friction and restitution of two
    shapes in contact are multiplied; the floor has 1 and 1.
    """

    mass: Mass = 0.0
    inertia: InertiaParameters | None = None
    static: Switch = False
    respondable: Switch = True
    friction: Annotated[Finite, Within(0, 100)] = 1.0
    restitution: Annotated[Finite, Within(0, 1)] = 0.0
    visible: Switch = True
    color: Color
    texture: OptionalFile = ""
    shape: str

    def model_post_init(self, context: Any) -> None:
        """Raise ParameterError for the inertia of a URDF."""
        super().model_post_init(context)
        if self.inertia is not None and self.shape == "urdf":
            raise ParameterError("is not allowed for a urdf, which has its own", ("inertia",))

    @property
    def moves(self) -> bool:
        """Whether the dynamics moves it."""
        return bool(self.mass) and not self.static

    def to_shape(self) -> SceneShape | Compound:
        return _shape_of(self)


class PartParameters(Checked):
    """A part of a compound, with its pose in the compound's frame."""

    position: Point = (0.0, 0.0, 0.0)
    rpy: Angles = (0.0, 0.0, 0.0)
    color: Color
    shape: str

    @property
    def part(self) -> Part:
        return Part(_shape_of(self), from_rpy(self.position, self.rpy), self.color)


def _shape_of(parameters: ObjectParameters | PartParameters) -> SceneShape:
    shape = SCENE_SHAPES[parameters.shape]
    return shape(**{field.name: getattr(parameters, field.name) for field in fields(shape)})


def _with_keys_of(shape: type[SceneShape], base: type[Checked]) -> type[Checked]:
    keys: dict[str, Any] = {"color": (Color, shape.default_color), "shape": (Literal[shape.word], ...)}
    types = get_type_hints(shape, include_extras=True)
    for field in fields(shape):
        keys[field.name] = (types[field.name], ... if field.default is MISSING else field.default)
    return create_model(f"{shape.__name__}{base.__name__}", __base__=base, **keys)


if TYPE_CHECKING:
    _Part = PartParameters
else:
    _PARTS = (shape for word, shape in SCENE_SHAPES.items() if word not in _NO_PARTS)
    _Part = one_of(*(_with_keys_of(shape, PartParameters) for shape in _PARTS), key="shape")


class CompoundParameters(ObjectParameters):
    """Several shapes as one rigid body."""

    shape: Literal["compound"]
    color: Color = (1.0, 1.0, 1.0, 1.0)  # unused: each part has its own color
    parts: Annotated[list[_Part], Field(min_length=1, max_length=MAX_PARTS)]

    def to_shape(self) -> Compound:
        return Compound(tuple(part.part for part in self.parts))


SHAPES = (*(_with_keys_of(shape, ObjectParameters) for shape in SCENE_SHAPES.values()), CompoundParameters)
