"""The address of a folder's studio, remembered so that a page that is open finds it again after a new start."""

from __future__ import annotations

import errno
import hashlib
import os
import secrets
import socket
import stat
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from socialai_dsl.atomic import write_text
from socialai_dsl.errors import OptionError
from socialai_dsl.studio import FIRST_PORT

_TRIED: Final = 20


class Address(BaseModel):
    """What a page has to know: the token, and the port that was listened at."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    token: Annotated[str, Field(pattern="^[A-Za-z0-9_-]{32}$")]
    port: Annotated[int, Field(ge=1, lt=1 << 16)]


class Place(NamedTuple):
    """Where a studio listens: the socket, and what a page has to know."""

    listening: socket.socket
    token: str

    def url(self, host: str) -> str:
        """The page, as a browser on this machine finds it."""
        shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host
        port = self.listening.getsockname()[1]
        return f"http://{f'[{shown}]' if ':' in shown else shown}:{port}/?token={self.token}"


def taken(root: Path, host: str, port: int | None) -> Place:
    """Listen for a folder's studio, at the address that it had before where nothing else is asked for.

    Raises:
        OptionError: see `listen`.
    """
    former = remembered(root, host)
    listening = listen(host, port, former.port if former else None)
    token = former.token if former else secrets.token_urlsafe(24)
    remember(root, host, Address(token=token, port=listening.getsockname()[1]))
    return Place(listening, token)


def remembered(root: Path, host: str) -> Address | None:
    """The former address of a folder's studio; None without one that nobody else could read."""
    file = _file(root, host)
    try:
        descriptor = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(descriptor, "rb") as stream:
            found = os.fstat(descriptor)
            private = stat.S_ISREG(found.st_mode) and not found.st_mode & 0o077
            if not private or found.st_uid != os.geteuid():
                return None
            return Address.model_validate_json(stream.read(1000))
    except (OSError, ValidationError):
        return None


def remember(root: Path, host: str, address: Address) -> None:
    """Remember an address for this user alone; where that cannot be done the next start has a new one."""
    file = _file(root, host)
    with suppress(OSError):
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        os.fchmod(descriptor, 0o600)
        os.close(descriptor)
        write_text(file, address.model_dump_json())  # which keeps these permissions


def _file(root: Path, host: str) -> Path:
    """Where an address is kept: with the state of this user's programs, not in the folder, which may be given away."""
    state = os.environ.get("XDG_STATE_HOME") or ""
    home = Path(state) if os.path.isabs(state) else Path(os.path.expanduser("~")) / ".local" / "state"
    name = hashlib.sha256(f"{host} {root}".encode(errors="surrogateescape")).hexdigest()[:32]
    return home / "socialai" / "studio" / f"{name}.json"


def listen(host: str, port: int | None, former: int | None) -> socket.socket:
    """A socket at the port, or where none is asked for at the former one, or at the next free one.

    Raises:
        OptionError: the port is in use, or the address is not this machine's.
    """
    if port is not None and not 0 <= port < 1 << 16:
        raise OptionError("port", f"got {port}, expected 0 to 65535")
    usual = range(FIRST_PORT, FIRST_PORT + _TRIED)
    tried = [port] if port is not None else [*([former] if former else []), *usual]
    for one in tried:
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            return socket.create_server((host, one), family=family)
        except OSError as error:
            if error.errno != errno.EADDRINUSE and (port is not None or one != former):
                raise OptionError("host", f"{host}: {error.strerror or error}") from None
    if port is not None:
        raise OptionError("port", f"{port} is in use; leave it out to take a free one")
    raise OptionError("port", f"{usual[0]} to {usual[-1]} are in use; name another")
