"""A folder and the keys that its page was begun with in, by name what the page may sign and check with out.

A secret is read where it is used, and never leaves this process; a password is asked for in the terminal, or stands in the
environment. The page knows keys by the names of their files.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from calib.errors import Fault, InputError, in_shell_path
from calib.files import write_text
from calib.serve.workspace import Workspace, require_plain
from calib.signature import (
    PASSWORD,
    PublicKey,
    SecretKey,
    new_key,
    public_key_text,
    read_public_key,
    read_secret_key,
    secret_key_text,
)
from calib.visible import character_fault, shortened, visible

_SECRET, _PUBLIC = ".key", ".pub"


@dataclass(frozen=True)
class Keys:
    """The keys of a laboratory that a page has.

    Attributes
    ----------
    space : its folder, in which keys may lie.
    given : path of a file -> its key: those that the page was begun with, wherever they lie.
    """

    space: Workspace
    given: Mapping[Path, SecretKey] = field(default_factory=dict, repr=False)

    def names(self) -> list[str]:
        """Names of the secret keys, those first that the page was begun with."""
        return [self._shown(path) for path in self._secrets()]

    def note(self, name: str) -> str:
        """What is to be said of a secret key: why it cannot be used here, or who can read it; "" for nothing."""
        path = self._secret(name)
        try:
            self._read(path)
        except InputError as error:
            return " ".join(fault.sentences for fault in error.faults)
        if os.name == "posix" and path.stat().st_mode & (stat.S_IRGRP | stat.S_IROTH):
            return f"Others can read it: chmod 600 {in_shell_path(Path(name))}"
        return ""

    def secret(self, name: str) -> SecretKey:
        """A secret key by its name.

        Raises
        ------
        InputError
            If there is none of this name, or its password cannot be had here.
        """
        path = self._secret(name)
        return self._read(path)

    def publics(self) -> dict[str, PublicKey]:
        """Public keys by name: of files in the folder, those that can be read, and of what the page was begun with."""
        found = {self._shown(path): key.public for path, key in self.given.items()}
        for path in self._files(_PUBLIC):
            try:
                found[path.name] = read_public_key(path)
            except InputError:
                continue
        return found

    def make(self, name: str) -> str:
        """Make a key pair in the folder, NAME.key for its owner alone and NAME.pub, as `calib key new` does.

        Parameters
        ----------
        name : without an ending.

        Returns
        -------
        The name of the secret key.

        Raises
        ------
        InputError
            If the name is none, or taken, or the package that signs is not installed.
        """
        require_plain(name)
        secret, public = (self.space.folder / f"{name}{ending}" for ending in (_SECRET, _PUBLIC))
        for path in (secret, public):
            if os.path.lexists(path):
                raise InputError(Fault(f'there is a "{path.name}" in this folder already', advice="Choose another name"))
        key = new_key()
        write_text(secret, secret_key_text(key), mode=0o600)
        write_text(public, public_key_text(key.public))
        return secret.name

    def _secrets(self) -> list[Path]:
        given = list(self.given)
        return [*given, *(path for path in self._files(_SECRET) if path not in given)]

    def _files(self, ending: str) -> list[Path]:
        """Files in the folder that end so; behind a link lies none, and none has a name that cannot be shown."""
        found = [path for path in sorted(self.space.folder.glob(f"*{ending}")) if path.is_file() and not path.is_symlink()]
        return [path for path in found if not path.name.startswith((".", "-")) and not character_fault(path.name)]

    def _shown(self, path: Path) -> str:
        return path.name if path.parent == self.space.folder else str(path)

    def _secret(self, name: str) -> Path:
        for path in self._secrets():
            if self._shown(path) == name:
                return path
        raise InputError(Fault(f'the page has no key "{shortened(name)}"', advice="Choose one of the list"))

    def _read(self, path: Path) -> SecretKey:
        return self.given[path] if path in self.given else read_secret_key(path, lambda: _in_environment(path))


def _in_environment(path: Path) -> str:
    if given := os.environ.get(PASSWORD, ""):
        return given
    again = f"calib serve --key {in_shell_path(Path(path.name))}"
    advice = f"Begin the page with `{visible(again)}`, which asks for it in the terminal: it is never typed into a page"
    raise InputError(Fault(f"{path.name} has a password", advice=advice))
