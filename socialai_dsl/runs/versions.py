"""The versions that decide a run's results."""

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Final

_REPORTED_PACKAGES: Final = ("socialai-dsl", "numpy", "numba", "gymnasium", "torch")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that decide a run's results; those not installed are left out."""
    found = {"python": platform.python_version()}
    for package in _REPORTED_PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
