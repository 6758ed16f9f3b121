"""What can be told of a Lua script before it runs."""

from __future__ import annotations

import re

_COMMENT = re.compile(rb"--(?:\[(=*)\[)?")
_PER_PHASE = re.compile(rb"\bsim_call_type\b")
# Functions that can loop in C for good, where no hook ends them. Whoever names none of them gets none of them.
_LOOP_IN_C = (
    *("find", "match", "gmatch", "gfind", "gsub", "sort", "move", "load", "loadstring", "collectgarbage"),
    *("date", "utf8"),
)
_LOOPS_IN_C = re.compile(rb"\b(?:" + "|".join(_LOOP_IN_C).encode() + rb")\b")
_REQUIRE = re.compile(rb"\brequire\b")  # a helper may name what it likes; these cannot
_REQUIRE_OWN = re.compile(rb"\brequire[ \t]{0,9}\(?[ \t]{0,9}['\"](?:sim|simROS|math|string|table|coroutine|os)['\"]")
_CALL_TYPE = re.compile(rb"\bsim[._](childscriptcall_\w{0,60})")
_FLAT_CALL = re.compile(rb"(?<![.:\w])sim[A-Z]\w{0,200}[ \t\r\n]{0,200}\(")


class LuaSource:
    """A script's text; `per_phase` if it looks at sim_call_type, `flat` if it calls V-REP 3.x's functions.

    `loops_in_c` if it names a function of Lua's that may not come back, or requires a file.
    `call_types` are the constants that it compares sim_call_type with, without `sim_`.
    """

    def __init__(self, text: bytes):
        """Take the file's contents, which may begin with a #! line."""
        self.text = b"--" + text if text.startswith(b"#") else text
        bare = _without_comments(self.text)
        self.per_phase = _PER_PHASE.search(bare) is not None
        self.call_types = sorted({name.decode() for name in _CALL_TYPE.findall(bare)})
        self.flat = _FLAT_CALL.search(bare) is not None
        helpers = len(_REQUIRE.findall(bare)) > len(_REQUIRE_OWN.findall(bare))
        self.loops_in_c = helpers or _LOOPS_IN_C.search(bare) is not None

    def line(self, word: str) -> int:
        """Return the first line with a word in it."""
        return self.text.count(b"\n", 0, self.text.find(word.encode())) + 1


def _without_comments(text: bytes) -> bytes:
    kept: list[bytes] = []
    here = 0
    while True:
        comment = _COMMENT.search(text, here)
        if comment is None:
            return b" ".join([*kept, text[here:]])
        kept.append(text[here : comment.start()])
        level = comment.group(1)
        end = b"\n" if level is None else b"]" + level + b"]"
        found = text.find(end, comment.end())
        if found < 0:
            return b" ".join(kept)
        here = found if level is None else found + len(end)
