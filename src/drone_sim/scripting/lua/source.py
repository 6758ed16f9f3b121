"""What can be told of a Lua script before it runs."""

from __future__ import annotations

import codecs
import re

_COMMENT = re.compile(rb"--(?:\[(=*)\[)?")
_PER_PHASE = re.compile(rb"\bsim_call_type\b")
# Functions that can loop in C for good, where no hook ends them. Whoever names none of them gets none of them.
_LOOPS_IN_C = re.compile(rb"\b(?:find|g?match|gfind|gsub|sort|move|load|loadstring|collectgarbage|date|utf8)\b")
_REQUIRE = re.compile(rb"\b(?:require|loadfile|dofile)\b")  # a helper may name what it likes; these cannot
_REQUIRE_OWN = re.compile(
    rb"\brequire[ \t]{0,9}\(?[ \t]{0,9}['\"](?:sim|simROS|simVision|math|string|table|coroutine|os)['\"]"
)
_PHASE_FUNCTION = re.compile(rb"\bsysCall_(?:init|actuation|sensing|cleanup|vision|thread|threadmain)\b")
_DEFINED_PHASE = re.compile(rb"\bfunction[ \t]{1,9}(?=sysCall_)" + _PHASE_FUNCTION.pattern)
_THREAD_TYPE = re.compile(rb"\b(?:syscb_thread(?:main)?|childscriptcall_threaded)\b")
_IN_THREAD = re.compile(
    rb"\bsim\.?(?:[sS]etThread(?:SwitchTiming|AutomaticSwitch|IsFree|ResumeLocation)|[sS]witchThread|"
    rb"[gG]etThread(?:Id|Exis?tRequest)|[wW]ait(?:ForSignal)?|[dD]elegateChildScriptExecution|"
    rb"(?:[mM]oveTo|RMLMoveTo|rmlMoveTo)\w+|[fF]ollowPath)\b"
    rb"|\bsim[._]simulation_advancing_abouttostop\b|\bthreadFunction\b"
)
_COROUTINES = re.compile(rb"\bcoroutine\b")
_THREADS = re.compile(rb"\bsysCall_thread")
_STEPS = re.compile(
    rb"\bsim(?:GetScriptExecutionCount|\.getScriptExecutionCount|HandleChildScripts?|\.handleChildScripts?)\b"
)
_CALL_TYPE = re.compile(rb"\bsim[._](childscriptcall_\w{0,60})")
_FLAT_CALL = re.compile(rb"(?<![.:\w])(sim[A-Z]\w{0,200})[ \t\r\n]{0,200}\(")


class LuaSource:
    """A script's text; `flat_names` are the functions of V-REP 3.x that it calls, `threads` if it may be left before
    it has ended, `coroutines` if it makes some.

    `form` is how it is run: `functions` of its own for the phases; as a whole, in all `phases` if it looks at
    sim_call_type, in the `steps` if it counts them (3.0), as a `thread` (3.x).
    `loops_in_c` if it names a function of Lua's that may not come back, or requires a file.
    `call_types` are the constants that it compares sim_call_type with, without `sim_`.
    `mixed` are the lines where it defines a phase's function and where it looks at sim_call_type: nothing would call
    the function. None if it does not do both, or calls such a function itself.
    """

    def __init__(self, text: bytes):
        """`text`: the file's contents, which may begin with UTF-8's byte order mark and a #! line."""
        text = text.removeprefix(codecs.BOM_UTF8)
        self.text = b"--" + text if text.startswith(b"#") else text
        bare = _without_comments(self.text)
        self.form = _form(bare)
        self.mixed = _mixed(bare)
        helpers = len(_REQUIRE.findall(bare)) > len(_REQUIRE_OWN.findall(bare))
        self.coroutines = _COROUTINES.search(bare) is not None
        self.threads = helpers or self.coroutines or "thread" in self.form or _THREADS.search(bare) is not None
        self.call_types = sorted({name.decode() for name in _CALL_TYPE.findall(bare)})
        self.flat_names = frozenset(name.decode() for name in _FLAT_CALL.findall(bare))
        self.loops_in_c = helpers or _LOOPS_IN_C.search(bare) is not None

    def line(self, word: str) -> int:
        """Return the first line with a word in it."""
        return self.text.count(b"\n", 0, self.text.find(word.encode())) + 1


def mixed_forms(function: int, call_type: int) -> str:
    """Return the message on a script that defines a phase's function and compares sim_call_type in these lines."""
    return (
        f"line {function} defines a function sysCall_... (V-REP 3.6 and newer), line {call_type} compares sim_call_type"
        " (V-REP 3.0 to 3.5): the functions would never be called. Move the blocks into the functions, or the lines of"
        " the functions into blocks; the built-in scripts template_v4 and template_v3 show both forms"
    )


def _form(bare: bytes) -> str:
    if _PER_PHASE.search(bare):
        return "phases_and_thread" if _THREAD_TYPE.search(bare) else "phases"
    if _PHASE_FUNCTION.search(bare):
        return "functions"
    if _IN_THREAD.search(bare):
        return "thread"
    return "steps" if _STEPS.search(bare) else "functions"


def _mixed(bare: bytes) -> tuple[int, int] | None:
    asks = _PER_PHASE.search(bare)
    defined = [*_DEFINED_PHASE.finditer(bare)]
    if asks is None or not defined or len(defined) < len(_PHASE_FUNCTION.findall(bare)):
        return None
    first, second = (bare.count(b"\n", 0, one.start()) + 1 for one in (defined[0], asks))
    return first, second


def _without_comments(text: bytes) -> bytes:
    """Return a text of as many lines."""
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
        kept.append(b"\n" * text.count(b"\n", comment.start(), here))
