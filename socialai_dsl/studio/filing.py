"""What a window asks about files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from socialai_dsl.authoring.templates import TEMPLATES, template_files
from socialai_dsl.errors import UsageError
from socialai_dsl.loader.pages import page_of
from socialai_dsl.studio import messages
from socialai_dsl.studio.drafts import Draft
from socialai_dsl.studio.files import FileError, Folder
from socialai_dsl.studio.starts import copied, offered


class Filing:
    """The folder, as one window uses it.

    Args:
        folder: the folder.
        window: which window it is.
        live: the windows that are open.
    """

    def __init__(self, folder: Folder, window: str, live: frozenset[str]) -> None:
        self._folder, self._window, self._live = folder, window, live

    def answer(self, asked: Any) -> dict[str, Any]:
        """The answer to a message about files.

        Raises:
            FileError: it cannot be done.
        """
        return _ANSWERS[type(asked)](self, asked)

    def _list(self, asked: messages.List) -> dict[str, Any]:
        del asked
        return {
            "files": self._folder.scenarios(),
            "agents": [
                {"name": name, "scenario": self._folder.trained_on(name)} for name in self._folder.players()
            ],
            "starts": [{"heading": heading, "names": names} for heading, names in offered()],
        }

    def _read(self, asked: messages.Read) -> dict[str, Any]:
        found = self._folder.open(asked.name, self._window, self._live, asked.adopt)
        return {
            "text": found.text,
            "digest": found.digest,
            "draft": found.draft.text if found.draft else None,
            "base": found.draft.base if found.draft else None,
            "others": [{"draft": one.window, "time": one.time, "lines": _lines(one)} for one in found.others],
            "elsewhere": found.elsewhere,
        }

    def _save(self, asked: messages.Save) -> dict[str, Any]:
        known = self._folder.write(asked.name, asked.text, asked.digest, self._window, asked.over)
        return {"digest": known}

    def _keep_draft(self, asked: messages.KeepDraft) -> dict[str, Any]:
        if asked.text is None:
            self._folder.forget_draft(asked.name, self._window)
        else:
            self._folder.keep_draft(asked.name, asked.text, asked.base, self._window)
        return {}

    def _take_draft(self, asked: messages.TakeDraft) -> dict[str, Any]:
        taken = self._folder.take_draft(asked.name, asked.draft, self._window, self._live)
        return {"text": taken.text, "base": taken.base}

    def _discard_draft(self, asked: messages.DiscardDraft) -> dict[str, Any]:
        self._folder.discard_draft(asked.name, asked.draft, self._live)
        return {}

    def _copy(self, asked: messages.Copy) -> dict[str, Any]:
        try:
            texts = copied(asked.shipped, self._folder.is_taken)
        except KeyError:
            raise FileError(f"{asked.shipped[:80]!a}: there is no such scenario to copy") from None
        new = {name: text for name, text in texts.items() if not self._folder.holds(name, text)}
        taken = next((name for name in new if self._folder.is_taken(name)), None)
        if taken is not None:
            raise FileError(f"{taken} exists already, and the copy needs one that is different")
        for name, text in new.items():
            self._folder.write(name, text, None, self._window)
        return {"name": next(iter(texts))}

    def _create(self, asked: messages.Create) -> dict[str, Any]:
        template, called = asked.template, asked.called
        if template not in TEMPLATES or not (called.isascii() and called.isidentifier()):
            known = ", ".join(TEMPLATES)
            raise FileError(f"{called[:80]!a}: expected a word of letters, digits and _, and one of {known}")
        files = template_files(template, called)
        taken = [path.name for path in files if self._folder.is_taken(path.name)]
        if taken:
            raise FileError(f"{taken[0]} exists already")
        names = [self._create_file(path.name, text) for path, text in files.items()]
        return {"name": names[0]}

    def _add(self, asked: messages.Add) -> dict[str, Any]:
        return {"name": self._create_file(asked.name, asked.text)}

    def _explain(self, asked: messages.Explain) -> dict[str, Any]:
        try:
            return {"page": page_of(asked.code)}
        except UsageError as error:
            raise FileError(str(error)) from None

    def _create_file(self, name: str, text: str) -> str:
        return self._folder.create(name, text, self._window)


def _lines(draft: Draft) -> int:
    return len(draft.text.splitlines())


_ANSWERS: Final[Mapping[type, Callable[[Filing, Any], dict[str, Any]]]] = {
    messages.List: Filing._list,
    messages.Read: Filing._read,
    messages.Save: Filing._save,
    messages.KeepDraft: Filing._keep_draft,
    messages.TakeDraft: Filing._take_draft,
    messages.DiscardDraft: Filing._discard_draft,
    messages.Copy: Filing._copy,
    messages.Create: Filing._create,
    messages.Add: Filing._add,
    messages.Explain: Filing._explain,
}
