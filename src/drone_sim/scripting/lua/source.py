"""Analysis of a Lua script's text before it runs."""

from __future__ import annotations

import codecs
import re

_COMMENT = re.compile(rb"--(?:\[(=*)\[)?")
_PER_PHASE = re.compile(rb"\bsim_call_type\b")
# Functions that can loop in C forever, where no hook can stop them. A script that names none of them does not get them.
_LOOPS_IN_C = re.compile(rb"\b(?:find|g?match|gfind|gsub|sort|move|load|loadstring|collectgarbage|date|utf8)\b")
_REQUIRE = re.compile(rb"\b(?:require|loadfile|dofile)\b")  # helpers are not searched, so they may name any function
_REQUIRE_BUILT_IN = re.compile(
    rb"\brequire[ \t]{0,9}\(?[ \t]{0,9}['\"](?:sim|simROS|simVision|math|string|table|coroutine|os)['\"]"
)
_PHASE_FUNCTION = re.compile(rb"\bsysCall_(?:init|actuation|sensing|cleanup|vision|thread|threadmain|\w+Simulation)\b")
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
    """A script's text, and properties that follow from it.

    `form`: `functions` for the phases; or the whole text is run: in all `phases` if it uses sim_call_type, in the
    `steps` if it counts them (3.0), or as a `thread` (3.x).
    `flat_names`: functions that it calls by their V-REP 3.x names. `threads`: whether it may have threads or
    coroutines; `coroutines`: whether it creates coroutines itself.
    `loops_in_c`: whether it names a C function of Lua that may not return, or loads a file.
    `call_types`: the constants that it compares with sim_call_type, without `sim_`.
    `mixed`: the lines of the first phase function and of sim_call_type, if it contains both, because nothing would
    call the function; None if it does not, or calls such a function itself.
    """

    def __init__(self, text: bytes):
        """`text`: the file's contents, which may begin with a UTF-8 byte order mark and a #! line."""
        text = text.removeprefix(codecs.BOM_UTF8)
        self.text = b"--" + text if text.startswith(b"#") else text
        bare = _without_comments(self.text)
        self.form = _form(bare)
        self.mixed = _mixed(bare)
        helpers = len(_REQUIRE.findall(bare)) > len(_REQUIRE_BUILT_IN.findall(bare))
        self.coroutines = _COROUTINES.search(bare) is not None
        self.threads = helpers or self.coroutines or "thread" in self.form or _THREADS.search(bare) is not None
        self.call_types = sorted({name.decode() for name in _CALL_TYPE.findall(bare)})
        self.flat_names = frozenset(name.decode() for name in _FLAT_CALL.findall(bare))
        self.loops_in_c = helpers or _LOOPS_IN_C.search(bare) is not None

    def line(self, word: str) -> int:
        """Return the number of the first line that contains a word."""
        return self.text.count(b"\n", 0, self.text.find(word.encode())) + 1


def mixed_forms(function: int, call_type: int) -> str:
    """Return the message for a script with a phase function and sim_call_type, in these lines."""
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
    call_type = _PER_PHASE.search(bare)
    defined = [*_DEFINED_PHASE.finditer(bare)]
    if call_type is None or not defined or len(defined) < len(_PHASE_FUNCTION.findall(bare)):
        return None
    first, second = (bare.count(b"\n", 0, match.start()) + 1 for match in (defined[0], call_type))
    return first, second


def _without_comments(text: bytes) -> bytes:
    """Return the text without its comments, with the same number of lines."""
    kept: list[bytes] = []
    start = 0
    while True:
        comment = _COMMENT.search(text, start)
        if comment is None:
            return b" ".join([*kept, text[start:]])
        kept.append(text[start : comment.start()])
        level = comment.group(1)
        end = b"\n" if level is None else b"]" + level + b"]"
        close = text.find(end, comment.end())
        if close < 0:
            return b" ".join(kept)
        start = close if level is None else close + len(end)
        kept.append(b"\n" * text.count(b"\n", comment.start(), start))
