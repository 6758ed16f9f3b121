"""Validation of values from outside: one message that names every wrong key, with its line."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from drone_sim.config.fields import ValueType, field_type, value_type
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

_Model = TypeVar("_Model", bound=Checked)


def changed(model: _Model, changes: Mapping[str, Any]) -> _Model:
    """Return a copy of a model with changed values. Raises ParameterError."""
    return checked(type(model), merged(model.model_dump(), changes))


def checked(model: type[_Model], values: Any, lines: YamlLines | None = None, file: str = "") -> _Model:
    """Return a model of `values`. Raises ParameterError, with line numbers if `lines` of a `file` are given."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        wrong = problems(error, model)
        placed = [(line_of(lines, problem) if lines else None, problem.sentence) for problem in wrong]
        in_file = any(line for line, _ in placed)  # without a line the caller names the source
        raise ParameterError.of(wrong, one_line(placed, file) if in_file else "") from None


def problems(error: ValidationError, model: type[BaseModel]) -> list[ParameterProblem]:
    """Return the problems of a pydantic error. All keys missing in one mapping are one problem."""
    unique: dict[ParameterProblem, None] = {}  # pydantic repeats a problem for each missing number of a list
    missing: dict[Location, list[_ErrorPlace]] = {}
    for detail in error.errors():
        place = _place(model, detail["loc"])
        raised = detail.get("ctx", {}).get("error")
        if detail["type"] == "missing" and not place.is_in_list:
            missing.setdefault(place.location[:-1], []).append(place)
        elif isinstance(raised, ParameterError):  # from a check of several keys
            several = raised.below(*place.location).problems
            unique.update((each._replace(or_above=bool(each.location)), None) for each in several)
        else:
            unique[_problem(detail, place, model)] = None
    return [*unique, *map(_missing, missing.values())]


def line_of(lines: YamlLines, problem: ParameterProblem) -> int | None:
    """Return the line of a wrong key, or of the mapping that lacks it; None if it is not in the file."""
    depth, line = lines.find(problem.location)
    return line if depth >= max(1, len(problem.location) - problem.or_above) else None


# ---- location of an error


class _ErrorPlace(NamedTuple):
    location: Location  # without the tags that pydantic adds
    type: ValueType  # of the value there, or of the list that contains it
    is_in_list: bool
    known: tuple[str, ...]  # all keys allowed at that level


def _place(model: Any, loc: Location) -> _ErrorPlace:
    location: list[Key] = []
    here = value_type(model)
    known: tuple[str, ...] = ()
    for part in loc:
        if part == "[key]":
            break
        choice = _choice(here)
        if part in choice.models:
            here = value_type(choice.models[str(part)])
            continue
        location.append(part)
        if get_origin(here.kind) is tuple:
            return _ErrorPlace(tuple(location), here, True, ())
        known = tuple(here.fields)
        here = _inside(here, part)
    return _ErrorPlace(tuple(location), here, False, known)


def _inside(value: ValueType, part: Key) -> ValueType:
    if part in value.fields:
        return field_type(value.fields[str(part)])
    arguments = get_args(value.kind)
    return value_type(arguments[-1]) if arguments and not value.fields else ValueType(None)


class _Choice(NamedTuple):
    """Discriminated union of pydantic: the word under a key chooses one of the models."""

    key: str
    models: dict[str, Any]  # by that word
    or_key: str = ""  # alternative key for the word
    others: tuple[str, ...] = ()  # the words for the alternative key


def _choice(value: ValueType) -> _Choice:
    """Return the choice that a type offers; an empty one if it is no discriminated union."""
    for key in (getattr(mark, "discriminator", None) for mark in value.marks):
        models = [value_type(model).kind for model in get_args(value.kind)]
        if isinstance(key, str):
            words = {word: model for model in models for word in get_args(model.model_fields[key].annotation)}
            return _Choice(key, words)
        if isinstance(key, Word):
            others = tuple(word_of(model, key.or_key) for model in models if key.or_key in model.model_fields)
            return _Choice(key.key, {word_of(it, key.key, key.or_key): it for it in models}, key.or_key, others)
    return _Choice("", {})


# ---- text of a problem


def _missing(places: list[_ErrorPlace]) -> ParameterProblem:
    location = places[0].location
    if len(places) == 1:
        return ParameterProblem(location, f"missing{_with_description(places[0], '; it must be')}", or_above=True)
    return ParameterProblem(location[:-1], f"{', '.join(str(place.location[-1]) for place in places)} are missing")


def _problem(error: Any, place: _ErrorPlace, model: type[BaseModel]) -> ParameterProblem:
    location, value = place.location, error["input"]
    if error["type"] in ("union_tag_invalid", "union_tag_not_found") and isinstance(value, Mapping):
        return _wrong_choice(_choice(place.type), location, value)
    if error["type"] == "missing":  # an element of a list
        location = location[:-1]
    if error["type"] == "extra_forbidden":
        key = str(location[-1])
        suggestion = _suggested_path(model, key) if len(location) == 1 else ""
        known = suggestion or (near_names(key[:80], place.known) if place.known else "")
        return ParameterProblem(location, "; ".join(filter(None, ("unknown key", known))))
    is_mapping_check = error["type"] == "value_error" and isinstance(value, Mapping)
    return ParameterProblem(location, _reason(error, place), "" if is_mapping_check else shown(value))


def _wrong_choice(choice: _Choice, location: Location, value: Mapping[str, Any]) -> ParameterProblem:
    """Return the problem of a discriminated union with a missing or unknown word."""
    key = choice.or_key if choice.or_key in value else choice.key
    if key in value:
        return ParameterProblem((*location, key), _must_be_one_of(choice, key), shown(value[key]))
    close = difflib.get_close_matches(key, map(str, value), 1)
    hint = f" (did you mean {key} instead of {shown(close[0])}?)" if close else ""
    return ParameterProblem((*location, key), f"missing{hint}; {_must_be_one_of(choice)}", or_above=True)


def _reason(error: Any, place: _ErrorPlace) -> str:
    kind, message = error["type"], error["msg"].replace("Value error, ", "")
    if (place.is_in_list and kind == "missing") or kind in ("tuple_type", "too_long"):
        return _with_description(place, "must be") or message
    choice = _choice(place.type)
    plain = {
        "model_type": f"must hold `key: value` lines with {', '.join(place.type.fields)}",
        "model_attributes_type": f"must have `key: value` lines, one of them `{choice.key}`",
        "union_tag_not_found": f"must have `key: value` lines, one of them `{choice.key}`",
        "bool_type": "must be true or false",
        "string_pattern_mismatch": PATTERNS.get(error.get("ctx", {}).get("pattern"), message),
    }
    return plain.get(kind) or f"{message[0].lower()}{message[1:]}"


def _with_description(place: _ErrorPlace, verb: str) -> str:
    """Return the verb with a description of the type of the value; '' if the type has none."""
    value = place.type
    text = f"one of {', '.join(map(repr, value.words))}" if value.words else ""
    if get_origin(value.kind) is tuple:
        text = f"{len(value.elements)} numbers" if value.elements else "left out"
    text = value.description or text
    return f"{verb} {text}" if text else ""


def _must_be_one_of(choice: _Choice, key: str = "") -> str:
    if key and key == choice.or_key:
        return f"must be one of {', '.join(map(repr, choice.others))}"
    words = [word for word in choice.models if word not in choice.others]
    or_other = f"; or `{choice.or_key}`: one of {', '.join(map(repr, choice.others))}"
    return f"must be one of {', '.join(map(repr, words))}{or_other if choice.others and not key else ''}"


def _suggested_path(model: type[BaseModel], key: str) -> str:
    """Return 'did you mean a/key?' if the key belongs in a nested mapping of the model, else ''."""
    for name, field in ValueType(model).fields.items():
        if key in field_type(field).fields:
            return f"did you mean {name}/{key}?"
    return ""
