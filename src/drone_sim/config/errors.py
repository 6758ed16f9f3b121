"""Values that come from outside, checked: every wrong key, in plain words, with its line."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from drone_sim.config.types import (
    PATTERNS,
    Checked,
    Key,
    Location,
    ParameterError,
    ParameterProblem,
    Word,
    merged,
    one_line,
    word_of,
)
from drone_sim.files.yaml_files import YamlLines
from drone_sim.message_text import near_names, shown

_UNIONS = (Union, UnionType)  # Union[A, B] and A | B
_Model = TypeVar("_Model", bound=Checked)


def changed(model: _Model, changes: Mapping[str, Any]) -> _Model:
    """Return a model with other values laid over some of its own. Raises ParameterError."""
    return checked(type(model), merged(model.model_dump(), changes))


def checked(model: type[_Model], values: Any, lines: YamlLines | None = None, file: str = "") -> _Model:
    """Return a model of values. Raises ParameterError, which says where in the `lines` of a `file` they stand."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        found = problems(error, model)
        placed = [(line_of(lines, one) if lines else None, one.sentence) for one in found]
        in_file = any(line for line, _ in placed)  # else it is for whoever says it to name what it is of
        raise ParameterError.of(found, one_line(placed, file) if in_file else "") from None


def problems(error: ValidationError, model: type[BaseModel]) -> list[ParameterProblem]:
    """Return what is wrong; the keys that one mapping lacks are one problem."""
    found: dict[ParameterProblem, None] = {}  # a list that is too short is reported once for each number that it lacks
    missing: dict[Location, list[_ErrorPlace]] = {}
    for one in error.errors():
        place = _place(model, one["loc"])
        if one["type"] == "missing" and not place.is_in_list:
            missing.setdefault(place.location[:-1], []).append(place)
        else:
            found.update(dict.fromkeys(_problems(one, place, model)))
    return [*found, *map(_missing, missing.values())]


def line_of(lines: YamlLines, problem: ParameterProblem) -> int | None:
    """Return the line of a wrong key, or of the mapping that has it not; None for what the file does not have."""
    depth, line = lines.find(problem.location)
    return line if depth >= max(1, len(problem.location) - problem.or_above) else None


# ---- where


class _ErrorPlace(NamedTuple):
    location: Location  # without pydantic's own additions
    annotation: Any  # of the value that stands there, or of the list that it stands in
    is_in_list: bool
    known: tuple[str, ...]  # the keys beside it


def _place(model: Any, loc: Location) -> _ErrorPlace:
    location: list[Key] = []
    annotation = model
    known: tuple[str, ...] = ()
    for part in loc:
        if part == "[key]":
            break
        choice = _choice(annotation)
        if part in choice.models:
            annotation = choice.models[str(part)]
            continue
        location.append(part)
        if get_origin(_bare(annotation)) is tuple:
            return _ErrorPlace(tuple(location), annotation, True, ())
        annotation, known = _inside(annotation, part)
    return _ErrorPlace(tuple(location), annotation, False, known)


def _inside(annotation: Any, part: Key) -> tuple[Any, tuple[str, ...]]:
    bare = _bare(annotation)
    fields = {one.alias or name: one for name, one in getattr(bare, "model_fields", {}).items()}
    if part in fields:
        return Annotated[fields[part].annotation, fields[part]], tuple(fields)
    arguments = get_args(bare)
    return arguments[-1] if arguments and not fields else None, tuple(fields)


def _bare(annotation: Any) -> Any:
    """Return a type without what is annotated, and without None."""
    while True:
        arguments = [one for one in get_args(annotation) if one is not type(None)]
        if get_origin(annotation) is Annotated or (get_origin(annotation) in _UNIONS and len(arguments) == 1):
            annotation = arguments[0]
        else:
            return annotation


class _Choice(NamedTuple):
    """Models, of which the word under one key chooses one: pydantic's discriminated union."""

    key: str
    models: dict[str, Any]  # by that word
    or_key: str = ""  # under which the word may stand, too
    others: tuple[str, ...] = ()  # the words that stand under that one


def _choice(annotation: Any) -> _Choice:
    """Return what a type lets choose among; nothing where it is no such union."""
    first, *others = [one for one in get_args(annotation) if one is not type(None)] or [None]
    if get_origin(annotation) is Annotated:
        for key in (getattr(one, "discriminator", None) for one in others):
            if isinstance(key, str):
                models = get_args(_bare(first))
                return _Choice(
                    key, {word: one for one in models for word in get_args(one.model_fields[key].annotation)}
                )
            if isinstance(key, Word):
                either = [_bare(one) for one in get_args(_bare(first))]
                words = tuple(word_of(one, key.or_key) for one in either if key.or_key in one.model_fields)
                return _Choice(key.key, {word_of(one, key.key, key.or_key): one for one in either}, key.or_key, words)
        return _choice(first)
    if get_origin(annotation) in _UNIONS and not others:
        return _choice(first)
    return _Choice("", {})


def _description(annotation: Any) -> str:
    """Return what a value must be, in words, where its type says so."""
    if get_origin(annotation) is Annotated:
        inner, *others = get_args(annotation)
        own = [str(one.description) for one in others if getattr(one, "description", None)]
        return own[0] if own else _description(inner)
    bare = _bare(annotation)
    if bare is not annotation:
        return _description(bare)
    if get_origin(bare) is tuple:
        count = len(get_args(bare))
        return f"{count} numbers" if count else "left out"
    if get_origin(bare) is Literal:
        return f"one of {', '.join(map(repr, get_args(bare)))}"
    return ""


# ---- what


def _missing(places: list[_ErrorPlace]) -> ParameterProblem:
    location = places[0].location
    if len(places) == 1:
        return ParameterProblem(location, f"missing{_must(places[0], '; it must be')}", or_above=True)
    return ParameterProblem(location[:-1], f"{', '.join(str(place.location[-1]) for place in places)} are missing")


def _problems(error: Any, place: _ErrorPlace, model: type[BaseModel]) -> Sequence[ParameterProblem]:
    raised = error.get("ctx", {}).get("error")
    if isinstance(raised, ParameterError):  # of several keys at once
        return [one._replace(or_above=bool(one.location)) for one in raised.below(*place.location).problems]
    return [_problem(error, place, model)]


def _problem(error: Any, place: _ErrorPlace, model: type[BaseModel]) -> ParameterProblem:
    location, value = place.location, error["input"]
    if error["type"] in ("union_tag_invalid", "union_tag_not_found") and isinstance(value, Mapping):
        return _wrong_choice(_choice(place.annotation), location, value)
    if error["type"] == "missing":  # a number of a list
        location = location[:-1]
    if error["type"] == "extra_forbidden":
        key = str(location[-1])
        belongs = _below(model, key) if len(location) == 1 else ""
        known = belongs or (near_names(key[:80], place.known) if place.known else "")
        return ParameterProblem(location, "; ".join(filter(None, ("unknown key", known))))
    is_of_several = error["type"] == "value_error" and isinstance(value, Mapping)
    return ParameterProblem(location, _reason(error, place), "" if is_of_several else shown(value))


def _wrong_choice(choice: _Choice, location: Location, value: Mapping[str, Any]) -> ParameterProblem:
    """Return what is wrong where no model is chosen: no word, or a wrong one."""
    key = choice.or_key if choice.or_key in value else choice.key
    if key in value:
        return ParameterProblem((*location, key), _must_be_one_of(choice, key), shown(value[key]))
    meant = difflib.get_close_matches(key, map(str, value), 1)
    instead = f" (did you mean {key} instead of {shown(meant[0])}?)" if meant else ""
    return ParameterProblem((*location, key), f"missing{instead}; {_must_be_one_of(choice)}", or_above=True)


def _reason(error: Any, place: _ErrorPlace) -> str:
    kind, message = error["type"], error["msg"].replace("Value error, ", "")
    if (place.is_in_list and kind == "missing") or kind in ("tuple_type", "too_long"):
        return _must(place, "must be") or message
    fields = getattr(_bare(place.annotation), "model_fields", None) or {}
    choice = _choice(place.annotation)
    plain = {
        "model_type": f"must hold `key: value` lines with {', '.join(fields)}",
        "model_attributes_type": f"must have `key: value` lines, one of them `{choice.key}`",
        "union_tag_not_found": f"must have `key: value` lines, one of them `{choice.key}`",
        "bool_type": "must be true or false",
        "string_pattern_mismatch": PATTERNS.get(error.get("ctx", {}).get("pattern"), message),
    }
    return plain.get(kind) or f"{message[0].lower()}{message[1:]}"


def _must(place: _ErrorPlace, verb: str) -> str:
    what = _description(place.annotation)
    return f"{verb} {what}" if what else ""


def _must_be_one_of(choice: _Choice, key: str = "") -> str:
    if key and key == choice.or_key:
        return f"must be one of {', '.join(map(repr, choice.others))}"
    words = [word for word in choice.models if word not in choice.others]
    or_other = f"; or `{choice.or_key}`: one of {', '.join(map(repr, choice.others))}"
    return f"must be one of {', '.join(map(repr, words))}{or_other if choice.others and not key else ''}"


def _below(model: type[BaseModel], key: str) -> str:
    """Return 'there is a/key' where the key belongs into a mapping of the model, '' where into none."""
    for name, field in model.model_fields.items():
        if key in getattr(_bare(field.annotation), "model_fields", {}):
            return f"did you mean {field.alias or name}/{key}?"
    return ""
