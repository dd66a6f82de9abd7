"""Registers the Gymnasium ids once Gymnasium is imported, without importing it: checking a file does not need it.

Gymnasium 1.x has no entry point for plug-ins: without this hook the ids would depend on the order of the two imports.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType


def install() -> None:
    """Register now if Gymnasium is loaded, else right after it is."""
    if "gymnasium.envs.registration" in sys.modules:
        _register()
    elif not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


def _register() -> None:
    from socialai_dsl.envs.registration import register_all

    register_all()


class _Finder(MetaPathFinder):
    """Finds `gymnasium` as Python would, and lets its first import be followed by our registration.

    Libraries look for it without importing it, to know whether it is there: that changes nothing.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != "gymnasium":
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.loader is not None:
            spec.loader = _Then(spec.loader, self)
        return spec


class _Then(Loader):
    """Gymnasium's own loader, then the registration."""

    def __init__(self, loader: Loader, finder: _Finder) -> None:
        self.loader, self.finder = loader, finder

    def __getattr__(self, name: str) -> object:
        return getattr(self.loader, name)

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self.loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        if self.finder in sys.meta_path:
            sys.meta_path.remove(self.finder)
        self.loader.exec_module(module)
        # Python and its tools ask a module's loader for its source; give them the real one.
        if module.__spec__ is not None:
            module.__spec__.loader = self.loader
        module.__loader__ = self.loader
        _register()
