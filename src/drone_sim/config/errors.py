"""Validation of values from outside: one message that names every wrong key, with its line."""

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
        if detail["type"] == "missing" and not place.is_in_list:
            missing.setdefault(place.location[:-1], []).append(place)
        else:
            unique.update(dict.fromkeys(_problems(detail, place, model)))
    return [*unique, *map(_missing, missing.values())]


def line_of(lines: YamlLines, problem: ParameterProblem) -> int | None:
    """Return the line of a wrong key, or of the mapping that lacks it; None if it is not in the file."""
    depth, line = lines.find(problem.location)
    return line if depth >= max(1, len(problem.location) - problem.or_above) else None


# ---- location of an error


class _ErrorPlace(NamedTuple):
    location: Location  # without the tags that pydantic adds
    annotation: Any  # type of the value there, or of the list that contains it
    is_in_list: bool
    known: tuple[str, ...]  # all keys allowed at that level


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
    fields = {field.alias or name: field for name, field in getattr(bare, "model_fields", {}).items()}
    if part in fields:
        return Annotated[fields[part].annotation, fields[part]], tuple(fields)
    arguments = get_args(bare)
    return arguments[-1] if arguments and not fields else None, tuple(fields)


def _bare(annotation: Any) -> Any:
    """Return a type without Annotated and without `| None`."""
    while True:
        arguments = [inner for inner in get_args(annotation) if inner is not type(None)]
        if get_origin(annotation) is Annotated or (get_origin(annotation) in _UNIONS and len(arguments) == 1):
            annotation = arguments[0]
        else:
            return annotation


class _Choice(NamedTuple):
    """Discriminated union of pydantic: the word under a key chooses one of the models."""

    key: str
    models: dict[str, Any]  # by that word
    or_key: str = ""  # alternative key for the word
    others: tuple[str, ...] = ()  # the words for the alternative key


def _choice(annotation: Any) -> _Choice:
    """Return the choice that a type offers; an empty one if it is no discriminated union."""
    first, *others = [inner for inner in get_args(annotation) if inner is not type(None)] or [None]
    if get_origin(annotation) is Annotated:
        for key in (getattr(mark, "discriminator", None) for mark in others):
            if isinstance(key, str):
                models = get_args(_bare(first))
                return _Choice(
                    key, {word: model for model in models for word in get_args(model.model_fields[key].annotation)}
                )
            if isinstance(key, Word):
                types = [_bare(tagged) for tagged in get_args(_bare(first))]
                words = tuple(word_of(kind, key.or_key) for kind in types if key.or_key in kind.model_fields)
                return _Choice(key.key, {word_of(kind, key.key, key.or_key): kind for kind in types}, key.or_key, words)
        return _choice(first)
    if get_origin(annotation) in _UNIONS and not others:
        return _choice(first)
    return _Choice("", {})


def _description(annotation: Any) -> str:
    """Return a description of a type for messages, '' if it has none."""
    if get_origin(annotation) is Annotated:
        inner, *others = get_args(annotation)
        texts = [str(mark.description) for mark in others if getattr(mark, "description", None)]
        return texts[0] if texts else _description(inner)
    bare = _bare(annotation)
    if bare is not annotation:
        return _description(bare)
    if get_origin(bare) is tuple:
        count = len(get_args(bare))
        return f"{count} numbers" if count else "left out"
    if get_origin(bare) is Literal:
        return f"one of {', '.join(map(repr, get_args(bare)))}"
    return ""


# ---- text of a problem


def _missing(places: list[_ErrorPlace]) -> ParameterProblem:
    location = places[0].location
    if len(places) == 1:
        return ParameterProblem(location, f"missing{_with_description(places[0], '; it must be')}", or_above=True)
    return ParameterProblem(location[:-1], f"{', '.join(str(place.location[-1]) for place in places)} are missing")


def _problems(error: Any, place: _ErrorPlace, model: type[BaseModel]) -> Sequence[ParameterProblem]:
    raised = error.get("ctx", {}).get("error")
    if isinstance(raised, ParameterError):  # from a check of several keys
        return [each._replace(or_above=bool(each.location)) for each in raised.below(*place.location).problems]
    return [_problem(error, place, model)]


def _problem(error: Any, place: _ErrorPlace, model: type[BaseModel]) -> ParameterProblem:
    location, value = place.location, error["input"]
    if error["type"] in ("union_tag_invalid", "union_tag_not_found") and isinstance(value, Mapping):
        return _wrong_choice(_choice(place.annotation), location, value)
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


def _with_description(place: _ErrorPlace, verb: str) -> str:
    description = _description(place.annotation)
    return f"{verb} {description}" if description else ""


def _must_be_one_of(choice: _Choice, key: str = "") -> str:
    if key and key == choice.or_key:
        return f"must be one of {', '.join(map(repr, choice.others))}"
    words = [word for word in choice.models if word not in choice.others]
    or_other = f"; or `{choice.or_key}`: one of {', '.join(map(repr, choice.others))}"
    return f"must be one of {', '.join(map(repr, words))}{or_other if choice.others and not key else ''}"


def _suggested_path(model: type[BaseModel], key: str) -> str:
    """Return 'did you mean a/key?' if the key belongs in a nested mapping of the model, else ''."""
    for name, field in model.model_fields.items():
        if key in getattr(_bare(field.annotation), "model_fields", {}):
            return f"did you mean {field.alias or name}/{key}?"
    return ""
