"""Finding and applying the variants of a scenario's name: `+VARIANT`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.loader.build import ANY, Ancestor, Build, Builder
from socialai_dsl.loader.files import display_name, is_file
from socialai_dsl.loader.library import yaml_files
from socialai_dsl.loader.names import Part
from socialai_dsl.loader.tree import Node

_OF_ANY: Final = re.compile(r"^of: *any\b", re.MULTILINE)


def vary(builder: Builder, build: Build, variant: Part) -> None:
    """Apply a variant to what is built: the nearest file of that name, else one for any scenario.

    `<X>_V.yaml` comes first, then `<R>_V.yaml` of each scenario R that X is a variant of, then `V.yaml` with
    `of: any`; each beside the scenario, then among the shipped ones. A suite is changed only by a variant of its own,
    and passes every variant on. What has the variant already stays as it is.

    Raises:
        ScenarioError: S503 if there is no such variant; what is wrong with its file.
    """
    if variant.text in build.name.split("+")[1:]:
        return
    direct = _direct(builder, build, variant)
    if direct is not None:
        build.own_variants.append(variant.text)
        patches = _down_to(builder, build, direct, variant)
        if not patches and build.kind != "suite":
            return
        for patch in patches:
            builder.patch(build, patch)
    if build.kind == "suite":
        build.passed_on.append(variant)
    elif direct is None:
        builder.patch(build, _of_any(builder, build, variant))
    _name(build, variant.text, direct)


def _name(build: Build, variant: str, file: Path | None) -> None:
    """Let what is built be known as a variant, for the variants that follow."""
    nearest = build.lineage[0]
    stem = f"{nearest.stem}_{variant}"
    if file is not None and file.stem != stem:
        build.lineage.insert(0, Ancestor(file.parent, file.stem, file))
    build.lineage.insert(0, Ancestor(nearest.folder, stem, file))
    build.name = f"{build.name}+{variant}"


def _direct(builder: Builder, build: Build, variant: Part) -> Path | None:
    library = builder.library
    for ancestor in build.lineage:
        for folder in dict.fromkeys((ancestor.folder, library.shipped)):
            path = library.resolved(folder / f"{ancestor.stem}_{variant.text}.yaml", variant.span)
            if is_file(path):
                return path
    return None


def _down_to(builder: Builder, build: Build, path: Path, variant: Part) -> list[Node]:
    """The patches that lead from what is built to the variant in a file, in the order to apply them."""
    known = {ancestor.path for ancestor in build.lineage}
    patches: list[Node] = []
    seen: tuple[Path, ...] = ()
    asked = variant.span
    while path not in known:
        builder.check_chain(path, seen, asked)
        seen = (*seen, path)
        patch = _variant_file(builder, build, path, variant)
        patches.insert(0, patch)
        base = patch.text("of")
        if base is None or base == ANY:
            break
        asked = patch.document.value_span(("of",))
        path = builder.library.find(base, path.parent, asked)
    return patches


def _of_any(builder: Builder, build: Build, variant: Part) -> Node:
    for folder in _folders(builder, build):
        path = builder.library.resolved(folder / f"{variant.text}.yaml", variant.span)
        if _is_of_any(path):
            return _variant_file(builder, build, path, variant)
    known = _known(builder, build)
    near = did_you_mean(variant.text, known)
    listed = "it has " + ", ".join(f"`{name}`" for name in known) if known else "it has none"
    message = f"`{build.name}` has no variant `{variant.text}`"
    raise builder.library.error("S503", message, variant.span, None if near else listed, near)


def _variant_file(builder: Builder, build: Build, path: Path, variant: Part) -> Node:
    root, kind = builder.read(path, variant.span)
    if kind != "variant":
        message = f"`{variant.text}` is no variant of `{build.name}`: {display_name(path)} is a {kind}"
        raise builder.library.error("S503", message, variant.span)
    return root


def _folders(builder: Builder, build: Build) -> list[Path]:
    return list(dict.fromkeys([*(ancestor.folder for ancestor in build.lineage), builder.library.shipped]))


def _known(builder: Builder, build: Build) -> list[str]:
    """The variants that what is built has, sorted."""
    names: set[str] = set()
    for folder in _folders(builder, build):
        stems = [name.removesuffix(".yaml") for name in yaml_files(folder) if name.endswith(".yaml")]
        names.update(stem for stem in stems if _is_of_any(folder / f"{stem}.yaml"))
        for ancestor in build.lineage:
            prefix = ancestor.stem + "_"
            names.update(stem.removeprefix(prefix) for stem in stems if stem.startswith(prefix))
    return sorted(names)


def _is_of_any(path: Path) -> bool:
    """Whether a file looks like a variant of any scenario; links are not followed."""
    try:
        if path.is_symlink() or not path.is_file():
            return False
        with path.open(encoding="utf-8", errors="replace") as file:
            return _OF_ANY.search(file.read(4096)) is not None
    except OSError:
        return False


def names_in(folder: Path) -> list[str]:
    """The names of the files in a folder that can stand for themselves, variants of any scenario left out."""
    return [name.rsplit(".", 1)[0] for name in yaml_files(folder) if not _is_of_any(folder / name)]
