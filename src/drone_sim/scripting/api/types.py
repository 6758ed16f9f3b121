"""What the API's functions take, by the names that messages call it: 'expected (handle: Handle, position: ...)'."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

Handle = int
Name = str
Text = str
Number = float
Numbers = Sequence[float]
ThreeNumbers = Sequence[float]
FourNumbers = Sequence[float]
SevenNumbers = Sequence[float]
TwelveNumbers = Sequence[float]
Callback = str | Callable[[Any], Any]
