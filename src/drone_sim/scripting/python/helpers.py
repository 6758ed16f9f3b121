"""Import of helper modules in the folder of a Python child script.

They belong to the script that imports them: they are read again with it, no other script sees them, and no __pycache__
is written. Python's standard library takes precedence over a file with the same name, and a file over an installed
package. Built-in scripts come last: `import tutorial` finds the tutorial's controller from any folder.
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

_LOG = logging.getLogger(__name__)  # for messages about scripts, not from scripts
BUILT_IN = Path(__file__).resolve().parents[2] / "child_scripts"
_FIRST = frozenset((*sys.stdlib_module_names, "drone_sim"))
_numbers = itertools.count(1)


class Helpers:
    """Finder and loader of one script's helper modules; in sys.modules, they are in a package of their own."""

    def __init__(self, script: str, names: Mapping[str, Any], compiled: Callable[[bytes, str], CodeType]):
        """`script` is its path; `names` are added to the modules' builtins; `compiled` compiles a file."""
        self.files = {script}
        self.builtins: dict[str, Any] = {**vars(builtins), **names, "__import__": self._import}
        self._folder = Path(script).parent
        self.package = f"_script{next(_numbers)}"
        above = ModuleType(self.package)
        above.__path__ = [str(self._folder), str(BUILT_IN)]
        sys.modules[self.package] = above  # dataclasses, for example, look up the module of a class
        self._compiled = compiled
        self._known: dict[str, bool] = {}  # results of _is_helper

    def close(self) -> None:
        """Remove the modules from sys.modules; a second call does nothing."""
        if self in sys.meta_path:
            sys.meta_path.remove(self)
        if self.package not in sys.modules:  # closed before
            return
        for name in [*self.modules(), self.package]:
            sys.modules.pop(name, None)

    def modules(self) -> dict[str, ModuleType]:
        """Return the imported modules by their names in sys.modules."""
        own = [name for name in list(sys.modules) if name.startswith(f"{self.package}.")]
        return {name: module for name in own if isinstance(module := sys.modules.get(name), ModuleType)}

    def forget(self, name: str) -> None:
        """Remove a module, so that the next import reads it again."""
        parent, _, last = name.rpartition(".")
        sys.modules.pop(name, None)
        vars(sys.modules.get(parent, self)).pop(last, None)

    def shown(self, error: ImportError) -> str:
        """Return the message of a failed import, with similar names."""
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
        if level or not self._is_helper(top):
            return builtins.__import__(name, globals, locals, fromlist, level)
        if self not in sys.meta_path:
            sys.meta_path.insert(0, cast(Any, self))
        module = builtins.__import__(f"{self.package}.{name}", globals, locals, fromlist, 0)
        return module if fromlist else getattr(module, top)

    def _is_helper(self, top: str) -> bool:
        if top not in self._known:
            self._known[top] = self._find_helper(top)
        return self._known[top]

    def _find_helper(self, top: str) -> bool:
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

    # ---- the interface of importlib's finders and loaders

    def find_spec(self, name: str, path: Sequence[str] | None, _target: Any = None) -> ModuleSpec | None:
        """Return the spec of a module in the script's package; None for any other."""
        if not name.startswith(self.package + ".") or path is None:
            return None
        finders = (FileFinder(folder, (SourceFileLoader, [".py"])) for folder in path)  # new, so that nothing is cached
        spec = next(filter(None, (finder.find_spec(name) for finder in finders)), None)
        if spec is not None and spec.loader is not None:
            spec.loader = cast(Any, self)
        return spec

    def create_module(self, _spec: ModuleSpec) -> None:
        """Return None, so that Python creates an empty module."""

    def exec_module(self, module: ModuleType) -> None:
        """Read and run a module's file. Raises ImportError, and any exception of the file."""
        path = str(module.__file__)
        self.files.add(path)
        namespace = vars(module)
        namespace["__builtins__"] = self.builtins
        try:
            source = read_source(path)
        except ValueError as error:
            raise ImportError(f"{path}: {error}") from None
        exec(self._compiled(source, path), namespace)
