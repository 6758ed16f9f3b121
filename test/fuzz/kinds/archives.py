"""Zips of a class: a good student's script between members with hostile names, kinds, methods and contents."""

import io
import stat
import warnings
import zipfile

from case import Case
from hypothesis import strategies as st

from kinds.values import LONG, mutated

GOOD = "Good_1_assignsubmission_file_"
SCRIPT = b"def sysCall_init():\n    pass\n"
_STUDENTS = [f"{name}_{number}_assignsubmission_file_" for number, name in enumerate(("Ada", "Bo\n\x1b[31m", "é"), 2)]
_PIECES = (
    *("..", ".", "", "/", "a", "b", "A", "my.py", "a.zip", "C:", "a\\b", "..\\..", "\\", "my.py\0.txt", "\0", " ", "~"),
    *("home", "etc", "store", "all", "canary", "submission_1", "__MACOSX", LONG, "é" * 130),
    *(*_STUDENTS, *(f"{one}my.py" for one in _STUDENTS), f"{_STUDENTS[0]}..", f"Bo_9_assignsubmission_file_{GOOD}x.py"),
)
_LETTERS = st.characters(blacklist_categories=["Cs"])  # a zip cannot store surrogates in a name
_PIECE = st.one_of(st.sampled_from(_PIECES), st.sampled_from(_PIECES), st.text(_LETTERS, max_size=6))
_NAME = st.one_of(
    st.lists(_PIECE, min_size=1, max_size=5).map("/".join),
    st.builds(lambda piece, depth: f"{piece}/" * depth + "my.py", _PIECE, st.sampled_from([10, 70, 1200])),
).map(lambda name: name[:10_000])
_KIND = st.sampled_from([0] * 6 + [stat.S_IFREG, stat.S_IFLNK, stat.S_IFDIR, stat.S_IFIFO, stat.S_IFCHR, stat.S_IFSOCK])
_METHOD = st.sampled_from([zipfile.ZIP_STORED] * 3 + [zipfile.ZIP_DEFLATED] * 3 + [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
_TEXT = st.sampled_from([SCRIPT] * 4 + [b"", b"../../canary", b"/etc/passwd", bytes(2**20)])
_MEMBER = st.tuples(_NAME, _KIND, _METHOD)


def _zip(members: list) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # duplicate names
        for (name, kind, method), content in members:
            info = zipfile.ZipInfo("x")
            info.filename = name  # set here, since the constructor would change it
            info.external_attr, info.compress_type = (kind | 0o777) << 16 if kind else 0, method
            archive.writestr(info, content)
    return buffer.getvalue()


_INNER = st.lists(st.tuples(_MEMBER, _TEXT), max_size=4).map(_zip)
_CONTENT = st.one_of(_TEXT, _TEXT, _INNER, st.one_of(_INNER, st.just(_zip([]))).flatmap(mutated))
_HOSTILE = st.lists(st.tuples(_MEMBER, _CONTENT), min_size=1, max_size=8)
_ENTRY = (f"{GOOD}/my.py", 0, zipfile.ZIP_DEFLATED), SCRIPT
_MEMBERS = st.builds(
    lambda hostile, place, around: [
        ((f"{around}{name}", *more), content) for (name, *more), content in [*hostile[:place], _ENTRY, *hostile[place:]]
    ],
    _HOSTILE,
    st.integers(0, 8),
    st.sampled_from(["", "", "export/"]),
)
# In an intact zip the good student's script must be found; a damaged zip may be refused as a whole.
CASES = st.one_of(
    _MEMBERS.map(_zip).map(lambda content: Case("archives", {"class.zip": content}, "whole")),
    _MEMBERS.map(_zip).map(lambda content: Case("archives", {"class.zip": content}, "whole")),
    _MEMBERS.map(_zip).flatmap(mutated).map(lambda content: Case("archives", {"class.zip": content}, "damaged")),
)
