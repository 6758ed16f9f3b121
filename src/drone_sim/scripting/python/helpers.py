"""Helper modules beside a Python child script, which it imports as any other.

They belong to the script that imports them: read anew with it, seen by no other script, and without __pycache__.
Python's own modules come before a file of the same name, and a file comes before an installed package. Last come
the built-in scripts: `import tutorial` finds the tutorial's controller, wherever a script lies.
"""

from __future__ import annotations

import builtins
import difflib
import itertools
import logging
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import FileFinder, ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, cast

from drone_sim.scripting.errors import read_source

_LOG = logging.getLogger(__name__)  # not the script's own words
BUILT_IN = Path(__file__).resolve().parents[2] / "child_scripts"
_FIRST = frozenset((*sys.stdlib_module_names, "drone_sim"))
_numbers = itertools.count(1)


class Helpers:
    """Finds, reads and keeps the modules of one script; inside Python they stand below a package of its own."""

    def __init__(self, script: str, names: Mapping[str, Any], compiled: Callable[[bytes, str], CodeType]):
        """`script`: its path; `names`: what its modules find as they find `len`; `compiled` compiles a file."""
        self.files = {script}
        self.builtins: dict[str, Any] = {**vars(builtins), **names, "__import__": self._import}
        self._folder = Path(script).parent
        self.package = f"_script{next(_numbers)}"
        above = ModuleType(self.package)
        above.__path__ = [str(self._folder), str(BUILT_IN)]
        sys.modules[self.package] = above  # dataclasses and the like look up the module of a class
        self._compiled = compiled
        self._is_beside: dict[str, bool] = {}

    def close(self) -> None:
        """Forget the modules; may be called twice."""
        if self in sys.meta_path:
            sys.meta_path.remove(self)
        if self.package not in sys.modules:  # closed before
            return
        for name in [*self.modules(), self.package]:
            sys.modules.pop(name, None)

    def modules(self) -> dict[str, ModuleType]:
        """Return the modules that were imported, by their names in sys.modules."""
        own = [name for name in list(sys.modules) if name.startswith(f"{self.package}.")]
        return {name: one for name in own if isinstance(one := sys.modules.get(name), ModuleType)}

    def forget(self, name: str) -> None:
        """Let a module be read anew by the next import."""
        parent, _, last = name.rpartition(".")
        sys.modules.pop(name, None)
        vars(sys.modules.get(parent, self)).pop(last, None)

    def shown(self, error: ImportError) -> str:
        """Return what an import that failed says, with near names."""
        text = str(error).replace(self.package + ".", "")
        missing = (error.name or "").replace(self.package + ".", "").partition(".")[0]
        beside = [path.stem for path in self._folder.glob("*.py") if str(path) not in self.files]
        near = difflib.get_close_matches(missing, beside) if isinstance(error, ModuleNotFoundError) else []
        return f"{text}; near names are {', '.join(near)}" if near else text

    # ---- import

    def _import(
        self,
        name: str,
        globals: Mapping[str, Any] | None = None,
        locals: Mapping[str, Any] | None = None,
        fromlist: Sequence[str] = (),
        level: int = 0,
    ) -> Any:
        top = name.partition(".")[0]
        if level or not self._found(top):
            return builtins.__import__(name, globals, locals, fromlist, level)
        if self not in sys.meta_path:
            sys.meta_path.insert(0, cast(Any, self))
        module = builtins.__import__(f"{self.package}.{name}", globals, locals, fromlist, 0)
        return module if fromlist else getattr(module, top)

    def _found(self, top: str) -> bool:
        if top not in self._is_beside:
            self._is_beside[top] = self._look(top)
        return self._is_beside[top]

    def _look(self, top: str) -> bool:
        place = self._folder / top
        is_there = place.with_suffix(".py").is_file() or (place / "__init__.py").is_file()
        if top not in _FIRST:
            is_known = is_there or place.is_dir() or (BUILT_IN / top).with_suffix(".py").is_file()
            return is_there or (is_known and getattr(PathFinder.find_spec(top), "origin", None) is None)
        if is_there:
            _LOG.warning(
                "%s: %s is not used, because Python has a module with the same name; rename it", self._folder, top
            )
        return False

    # ---- what Python's import asks

    def find_spec(self, name: str, path: Sequence[str] | None, _target: Any = None) -> ModuleSpec | None:
        """Return how to load a module below the script's package."""
        if not name.startswith(self.package + ".") or path is None:
            return None
        finders = (FileFinder(folder, (SourceFileLoader, [".py"])) for folder in path)  # new ones, which keep nothing
        spec = next(filter(None, (one.find_spec(name) for one in finders)), None)
        if spec is not None and spec.loader is not None:
            spec.loader = cast(Any, self)
        return spec

    def create_module(self, _spec: ModuleSpec) -> None:
        """Let Python make an empty module."""

    def exec_module(self, module: ModuleType) -> None:
        """Read and run a module's file. Raises ImportError, and what the file raises."""
        path = str(module.__file__)
        self.files.add(path)
        namespace = vars(module)
        namespace["__builtins__"] = self.builtins
        try:
            source = read_source(path)
        except ValueError as error:
            raise ImportError(f"{path}: {error}") from None
        exec(self._compiled(source, path), namespace)
