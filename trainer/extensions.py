"""Loads the user's own classes: `mine:Net` is class `Net` of `mine.py`."""

from __future__ import annotations

import hashlib
import importlib
import sys
from collections.abc import Sequence
from inspect import isfunction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.trainer.config import code_file


def load_class(name: str, option: str, shipped: Sequence[str], needed: type, folder: Path) -> Any:
    """Find the class that `module:Class` names.

    The module is `module.py` in `folder`, or one that Python finds by itself.

    Args:
        name: what the user typed.
        option: the option it was typed for, to begin messages with.
        shipped: the names that need no module.
        needed: a class whose public methods it must have.
        folder: where its file is looked for first, the scenario's own.

    Raises:
        ValueError: there is no such module or class, or it lacks a method; the message names file and method.
    """
    module_name, colon, class_name = name.partition(":")
    if not (colon and module_name and class_name):
        raise ValueError(
            f"{option}: got {name!r}, expected one of {', '.join(shipped)}, or mine:{option.title()}"
        )
    module = _load_module(module_name, option, folder)
    file = getattr(module, "__file__", None) or module_name
    found = getattr(module, class_name, None)
    if not isinstance(found, type):
        raise ValueError(f"{option}: {file} has no class {class_name!r}")
    methods = [
        name
        for name, method in vars(needed).items()
        if name[0] != "_" and (isfunction(method) or isinstance(method, staticmethod))
    ]
    lacking = [method for method in methods if not callable(getattr(found, method, None))]
    lacking += sorted(getattr(found, "__abstractmethods__", ()))
    if lacking:
        raise ValueError(f"{option}: {file}: {class_name} lacks the method {lacking[0]!r}")
    return found


def require_shape(what: str, array: Any, shape: tuple[int, ...]) -> None:
    """Refuse, with a ValueError, an array or tensor of the user's code that would be stretched or stumbled over."""
    if tuple(array.shape) != shape:
        raise ValueError(f"{what}: got the shape {tuple(array.shape)}, expected {shape}")


def require_array(what: str, given: Any, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
    """An array of the user's code in the type that is needed.

    Raises:
        ValueError: NumPy would stretch it, cut its numbers off or stumble over it.
    """
    try:
        array = np.asarray(given)
    except (ValueError, TypeError, RuntimeError) as error:
        raise ValueError(f"{what}: got what is no array ({error}), expected the shape {shape}") from error
    require_shape(what, array, shape)
    if not np.can_cast(array.dtype, dtype, "same_kind"):
        raise ValueError(f"{what}: got the type {array.dtype}, expected {np.dtype(dtype)}")
    return array.astype(dtype)


def _load_module(name: str, option: str, folder: Path) -> ModuleType:
    file = code_file(name, folder)
    try:
        return _load_file(file) if file.is_file() else importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name == name.partition(".")[0]:
            raise ValueError(
                f"{option}: there is no module {name!r}: looked for {file}, then for an installed module"
            ) from error
        raise ValueError(f"{option}: {file}: {error}") from error
    except Exception as error:  # whatever the user's module does while it is imported
        raise ValueError(f"{option}: {file} cannot be imported: {type(error).__name__}: {error}") from error


_beside: dict[Path, dict[str, ModuleType]] = {}
"""What the files of a folder imported from it, by folder: modules that other folders may have under the same names."""


def _load_file(file: Path) -> ModuleType:
    """Import a file, once for each content, so that equally named files of two folders do not meet."""
    source = file.read_bytes()
    digest = hashlib.sha256(f"{file}\0".encode() + source).hexdigest()
    unique = f"{file.stem}_{digest[:12]}"
    if unique in sys.modules:
        return sys.modules[unique]
    module = sys.modules[unique] = ModuleType(unique)
    module.__file__ = str(file)
    known = set(sys.modules)
    beside = _beside.setdefault(file.parent, {})
    sys.modules.update(beside)
    sys.path.insert(0, str(file.parent))
    try:
        # Python's loader would take old bytecode for a file that was changed within a second and kept its length.
        exec(compile(source, file, "exec"), module.__dict__)
    except BaseException:
        del sys.modules[unique]
        raise
    finally:
        sys.path.remove(str(file.parent))
        found = [name for name in sys.modules.keys() - known if _lies_in(file.parent, name)]
        beside.update({name: sys.modules.pop(name) for name in found})
    return module


def _lies_in(folder: Path, name: str) -> bool:
    """Whether an imported module is a file of the folder, or in a package there."""
    top = name.partition(".")[0]
    places = (folder / f"{top}.py", folder / top / "__init__.py")
    return top in sys.modules and Path(getattr(sys.modules[top], "__file__", None) or "") in places
