"""What is wrong with values that were read from a YAML file: every wrong key, in plain words, with its line."""

from __future__ import annotations

import difflib
import itertools
from collections.abc import Mapping, Sequence
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from drone_sim.config.types import PATTERNS, Key, Location, ParameterError, Word, readable_key, word_of
from drone_sim.files.yaml_files import Lines
from drone_sim.wording import shown

MOST = 8  # problems that are told
_UNIONS = (Union, UnionType)  # Union[A, B] and A | B
LONG = 900  # characters after which no other is


class Problem(NamedTuple):
    """One wrong key: where it stands among the parameters, and what to say."""

    location: Location
    text: str
    is_missing: bool = False


def problems(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Return what is wrong; the keys that one mapping lacks are one problem."""
    found: dict[Problem, None] = {}  # a list that is too short is reported once for each number that it lacks
    missing: dict[Location, list[_Place]] = {}
    for one in error.errors():
        place = _place(model, one["loc"])
        if one["type"] == "missing" and not place.is_in_list:
            missing.setdefault(place.location[:-1], []).append(place)
        else:
            found[_problem(one, place)] = None
    return [*found, *map(_missing, missing.values())]


def told(placed: Sequence[tuple[int | None, str]], file: str = "") -> str:
    """Return problems in one line: those with a line of a file by it, then the others."""
    inside = sorted(((line, text) for line, text in placed if line is not None), key=lambda one: one[0])
    words = [f"line {line}: {text}" for line, text in inside]
    words += [text for line, text in placed if line is None]
    lengths = itertools.accumulate(map(len, words), initial=0)  # of all that comes before
    first = [word for word, before in zip(words, lengths) if before < LONG][:MOST]
    more = f"; and {len(words) - len(first)} more" if len(first) < len(words) else ""
    return (f"{file}: " if file else "") + "; ".join(first) + more


def line_of(lines: Lines, problem: Problem) -> int | None:
    """Return the line of a wrong key, that of the mapping for a missing one; None for what the file does not have."""
    sought = problem.location[:-1] if problem.is_missing else problem.location
    depth, line = lines.find(sought)
    return line if sought and depth == len(sought) else None


# ---- where


class _Place(NamedTuple):
    location: Location  # without pydantic's own additions
    annotation: Any  # of the value that stands there, or of the list that it stands in
    is_in_list: bool
    known: tuple[str, ...]  # the keys beside it


def _place(model: Any, loc: Location) -> _Place:
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
            return _Place(tuple(location), annotation, True, ())
        annotation, known = _inside(annotation, part)
    return _Place(tuple(location), annotation, False, known)


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
                return _Choice(key, {word: one for one in models for word in _words(one, key)})
            if isinstance(key, Word):
                return _choice_of_either(key, [_bare(one) for one in get_args(_bare(first))])
        return _choice(first)
    if get_origin(annotation) in _UNIONS and not others:
        return _choice(first)
    return _Choice("", {})


def _choice_of_either(word: Word, models: Sequence[Any]) -> _Choice:
    others = tuple(word_of(one, word.or_key) for one in models if word.or_key in one.model_fields)
    return _Choice(word.key, {word_of(one, word.key, word.or_key): one for one in models}, word.or_key, others)


def _words(model: Any, key: str) -> tuple[str, ...]:
    return get_args(model.model_fields[key].annotation)


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


def _missing(places: list[_Place]) -> Problem:
    *above, _ = location = places[0].location
    if len(places) == 1:
        return Problem(location, f"parameter {readable_key(location)}: missing{_must(places[0], '; it must be')}", True)
    keys = ", ".join(str(place.location[-1]) for place in places)
    return Problem(location, f"parameter {readable_key(tuple(above))}: {keys} are missing", True)


def _problem(error: Any, place: _Place) -> Problem:
    raised = error.get("ctx", {}).get("error")
    if isinstance(raised, ParameterError):  # of several keys at once: it names them itself
        if raised.location:
            return Problem(raised.location, str(raised))
        return Problem(place.location, f"parameter {readable_key((*place.location, str(raised)))}")
    location, value = place.location, error["input"]
    if error["type"] in ("union_tag_invalid", "union_tag_not_found") and isinstance(value, Mapping):
        return _wrong_choice(_choice(place.annotation), location, value)
    if error["type"] == "missing":  # a number of a list
        location = location[:-1]
    key = f"parameter {readable_key(location)}"
    if error["type"] == "extra_forbidden":
        return Problem(location, f"{key}: unknown key{_near(str(location[-1]), place.known)}")
    return Problem(location, f"{key} = {shown(value)}: {_reason(error, place)}")


def _wrong_choice(choice: _Choice, location: Location, value: Mapping[str, Any]) -> Problem:
    """Return what is wrong where no model is chosen: no word, or a wrong one."""
    key = choice.or_key if choice.or_key in value else choice.key
    said = f"parameter {readable_key((*location, key))}"
    if key in value:
        return Problem((*location, key), f"{said} = {shown(value[key])}: {_must_be_one_of(choice, key)}")
    return Problem((*location, key), f"{said}: missing; {_must_be_one_of(choice)}", True)


def _reason(error: Any, place: _Place) -> str:
    kind, message = error["type"], error["msg"].replace("Value error, ", "")
    if (place.is_in_list and kind == "missing") or kind in ("tuple_type", "too_long"):
        return _must(place, "must be") or message
    fields = getattr(_bare(place.annotation), "model_fields", None) or {}
    choice = _choice(place.annotation)
    plain = {
        "model_type": f"must hold `key: value` lines with {', '.join(fields)}",
        "model_attributes_type": f"must hold `key: value` lines, of which one is `{choice.key}`",
        "union_tag_not_found": f"must hold `key: value` lines, of which one is `{choice.key}`",
        "bool_type": "must be true or false",
        "string_pattern_mismatch": PATTERNS.get(error.get("ctx", {}).get("pattern"), message),
    }
    return plain.get(kind) or f"{message[0].lower()}{message[1:]}"


def _must(place: _Place, verb: str) -> str:
    what = _description(place.annotation)
    return f"{verb} {what}" if what else ""


def _must_be_one_of(choice: _Choice, key: str = "") -> str:
    if key and key == choice.or_key:
        return f"must be one of {', '.join(map(repr, choice.others))}"
    words = [word for word in choice.models if word not in choice.others]
    or_other = f"; or `{choice.or_key}`: one of {', '.join(map(repr, choice.others))}"
    return f"must be one of {', '.join(map(repr, words))}{or_other if choice.others and not key else ''}"


def _near(key: str, known: Sequence[str]) -> str:
    near = difflib.get_close_matches(key[:80], known, n=3) or known
    return f"; known are {', '.join(near)}" if near else ""
