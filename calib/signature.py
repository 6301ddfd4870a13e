"""Keys of a laboratory and the bytes of a file in, a signature in minisign's format out, and back: whether it holds.

The formats are those of minisign (https://jedisct1.github.io/minisign/), so that its program checks what is signed here, and
its keys sign here. Ed25519 (RFC 8032) comes from the package cryptography, the extra `sign`; all else from Python.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import re
import secrets
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from calib.errors import Fault, InputError
from calib.regular import bytes_of

#: How every file of a key or a signature begins: in front of its first comment.
BEGIN = "untrusted comment: "
#: Where the password of a key may stand for programs that nobody sits at.
PASSWORD = "CALIB_KEY_PASSWORD"

# What stands in front of the other comment, and the longest one that minisign reads.
_TRUSTED, _LONGEST = "trusted comment: ", 1024
# Ed25519 of a key, and of a signature of the bytes themselves; of their BLAKE2b; scrypt, or nothing; BLAKE2b as checksum.
_PURE, _HASHED, _SCRYPT, _OPEN, _CHECKSUM = b"Ed", b"ED", b"Sc", bytes(2), b"B2"
_NUMBER, _KEY, _SEED, _SALT, _SIGNATURE = 8, 32, 32, 32, 64
# What a password costs whoever guesses it: N = 2^17, r = 8, p = 1, half a second and 128 MiB.
_OPERATIONS, _MEMORY, _MOST_MEMORY = 1 << 22, 1 << 27, 1 << 30
# Bytes of the largest file that can be a key or a signature.
_LARGEST = 10_000

_INSTALL = 'Install it with: pip install "dielectric-elastomer-calibration[sign]"'


@dataclass(frozen=True)
class PublicKey:
    """What tells whether a signature is of a laboratory: its number, by which it is found, and the key."""

    number: bytes
    key: bytes

    @property
    def name(self) -> str:
        """Its number as minisign shows it, sixteen hexadecimal digits."""
        return _shown(self.number)


@dataclass(frozen=True)
class SecretKey:
    """What a laboratory signs with: the number of the key, and its secret, which is never printed."""

    number: bytes
    seed: bytes = field(repr=False)
    public: PublicKey = field(repr=False)


@dataclass(frozen=True)
class Signature:
    """A signature as it stands in its file.

    Attributes
    ----------
    number : of the key that made it, as it says.
    hashed : whether it is of the BLAKE2b of the bytes, or of the bytes themselves.
    signature : of the bytes.
    comment : text that is signed with it.
    whole : signature of `signature` and `comment`.
    """

    number: bytes
    hashed: bool
    signature: bytes
    comment: str
    whole: bytes

    @property
    def name(self) -> str:
        """The number of the key that made it, as it says."""
        return _shown(self.number)


def new_key() -> SecretKey:
    """Make a key from the randomness of the system.

    Raises
    ------
    InputError
        If the package cryptography is not installed.
    """
    return _secret(secrets.token_bytes(_NUMBER), secrets.token_bytes(_SEED))


def secret_key_text(key: SecretKey, password: str = "") -> str:
    """Write the file of a secret key.

    Parameters
    ----------
    key : to be kept.
    password : that is asked for whenever it is used; "" for none.
    """
    plain = key.number + key.seed + key.public.key
    plain += _blake(_PURE + plain, 32)
    salt, kind, operations, memory = bytes(_SALT), _OPEN, 0, 0
    if password:
        salt, kind, operations, memory = secrets.token_bytes(_SALT), _SCRYPT, _OPERATIONS, _MEMORY
        plain = _xor(plain, _stretched(password, salt, operations, memory, len(plain)))
    content = _PURE + kind + _CHECKSUM + salt + operations.to_bytes(8, "little") + memory.to_bytes(8, "little") + plain
    return f"{BEGIN}{'minisign encrypted secret key' if password else 'minisign secret key'}\n{_encoded(content)}\n"


def read_secret_key(path: Path | str, ask: Callable[[], str]) -> SecretKey:
    """Read the file of a secret key, from here or from minisign.

    Parameters
    ----------
    path : of the file.
    ask : gives the password, if the key has one.

    Raises
    ------
    InputError
        If it is no such file, is damaged, or the password is another.
    """
    path = Path(path)
    content = _decoded(_lines(path, 2, "a secret key")[1], path, "a secret key")
    head, salt, rest = content[:6], content[6 : 6 + _SALT], content[6 + _SALT :]
    operations, memory, kept = int.from_bytes(rest[:8], "little"), int.from_bytes(rest[8:16], "little"), rest[16:]
    if len(kept) != _NUMBER + _SEED + _KEY + 32 or head[:2] != _PURE or head[4:6] != _CHECKSUM:
        raise _no(path, "a secret key")
    locked = head[2:4] == _SCRYPT
    if not locked and head[2:4] != _OPEN:
        raise _no(path, "a secret key")
    if locked:
        if memory > _MOST_MEMORY or operations > _MOST_MEMORY:
            raise InputError(Fault("the password of this key takes more memory to try than a key may ask for", path))
        kept = _xor(kept, _stretched(ask(), salt, operations, memory, len(kept)))
    plain, checksum = kept[:-32], kept[-32:]
    # Of a key without a password minisign leaves the checksum zero.
    if checksum != _blake(_PURE + plain, 32) and (locked or any(checksum)):
        raise InputError(Fault("the password is another, or the key is damaged" if locked else "this key is damaged", path))
    key = _secret(plain[:_NUMBER], plain[_NUMBER : _NUMBER + _SEED])
    if key.public.key != plain[_NUMBER + _SEED :]:
        raise InputError(Fault("the two halves of this key do not belong together", path))
    return key


def public_key_text(key: PublicKey) -> str:
    """Write the file of a public key."""
    return f"{BEGIN}minisign public key {key.name}\n{_encoded(_PURE + key.number + key.key)}\n"


def read_public_key(path: Path | str) -> PublicKey:
    """Read the file of a public key, from here or from minisign: of the laboratory whose certificates are to be checked.

    Raises
    ------
    InputError
        If it is no such file; of a secret key it says so.
    """
    path = Path(path)
    content = _decoded(_lines(path, 2, "a public key")[1], path, "a public key")
    if content[:2] == _PURE and content[4:6] == _CHECKSUM and len(content) > 100:
        advice = "Give the file that ends in .pub, and keep this one to yourself"
        raise InputError(Fault("this is a secret key, and a public one is wanted", path, advice=advice))
    if len(content) != 2 + _NUMBER + _KEY or content[:2] != _PURE:
        raise _no(path, "a public key")
    return PublicKey(content[2 : 2 + _NUMBER], content[2 + _NUMBER :])


def sign(content: bytes, key: SecretKey, comment: str) -> str:
    """Sign the bytes of a file.

    Parameters
    ----------
    content : of the file.
    key : of the laboratory.
    comment : one line of letters of ASCII that is signed, too.

    Returns
    -------
    The text of the file of the signature.

    Raises
    ------
    ValueError
        If the comment is no such line.
    """
    if len(comment) > _LONGEST or not re.fullmatch(r"[\x20-\x7e]*", comment):
        raise ValueError(f"the comment of a signature is a line of at most {_LONGEST} letters of ASCII, got {comment!r}")
    private = _ed25519().Ed25519PrivateKey.from_private_bytes(key.seed)
    signature = private.sign(_blake(content, 64))
    whole = private.sign(signature + comment.encode())
    first = f"{BEGIN}signature from minisign secret key\n{_encoded(_HASHED + key.number + signature)}"
    return f"{first}\n{_TRUSTED}{comment}\n{_encoded(whole)}\n"


def read_signature(path: Path) -> Signature:
    """Read the file of a signature, from here or from minisign.

    Raises
    ------
    InputError
        If it is no such file.
    """
    lines = _lines(path, 4, "a signature")
    content, whole = (_decoded(line, path, "a signature") for line in (lines[1], lines[3]))
    right = len(content) == 2 + _NUMBER + _SIGNATURE and len(whole) == _SIGNATURE and lines[2].startswith(_TRUSTED)
    if not right or content[:2] not in (_PURE, _HASHED):
        raise _no(path, "a signature")
    number, signature = content[2 : 2 + _NUMBER], content[2 + _NUMBER :]
    return Signature(number, content[:2] == _HASHED, signature, lines[2].removeprefix(_TRUSTED), whole)


def fault_of(signature: Signature, content: bytes, key: PublicKey) -> str:
    """Why a signature does not hold for the bytes of a file under a key, as a sentence without a full stop; "" if it holds.

    Parameters
    ----------
    signature : as read.
    content : of the file.
    key : of the laboratory that is thought to have signed.

    Raises
    ------
    InputError
        If the package cryptography is not installed.
    """
    if signature.number != key.number:
        return f"signed with the key {signature.name}, not with {key.name}"
    ed25519, wrong = _ed25519(), import_module("cryptography.exceptions").InvalidSignature
    try:
        public = ed25519.Ed25519PublicKey.from_public_bytes(key.key)
        public.verify(signature.signature, _blake(content, 64) if signature.hashed else content)
    except wrong:
        return f"the signature is not that of the key {key.name} for this file"
    try:
        public.verify(signature.whole, signature.signature + signature.comment.encode())
    except wrong:
        return "the comment of the signature has been changed"
    return ""


def _secret(number: bytes, seed: bytes) -> SecretKey:
    private = _ed25519().Ed25519PrivateKey.from_private_bytes(seed)
    return SecretKey(number, seed, PublicKey(number, private.public_key().public_bytes_raw()))


def _ed25519() -> Any:
    try:
        return import_module("cryptography.hazmat.primitives.asymmetric.ed25519")
    except ImportError:
        raise InputError(Fault("signatures need the package cryptography, which is not installed", advice=_INSTALL)) from None


def _shown(number: bytes) -> str:
    return number[::-1].hex().upper()


def _blake(content: bytes, size: int) -> bytes:
    return hashlib.blake2b(content, digest_size=size).digest()


def _xor(one: bytes, other: bytes) -> bytes:
    return bytes(a ^ b for a, b in zip(one, other, strict=True))


def _stretched(password: str, salt: bytes, operations: int, memory: int, size: int) -> bytes:
    """The stream that hides a key: scrypt with N, r and p of the limits that its file says, as libsodium chooses them."""
    operations = max(operations, 1 << 15)
    most = operations // 32 if operations < memory // 32 else memory // 1024
    exponent = next((k for k in range(1, 63) if 1 << k > most // 2), 62)
    p = 1 if operations < memory // 32 else max(1, (operations // 4 >> exponent) // 8)
    n = 1 << exponent
    return hashlib.scrypt(password.encode(), salt=salt, n=n, r=8, p=p, maxmem=128 * 8 * (n + p + 2) + (1 << 20), dklen=size)


def _encoded(content: bytes) -> str:
    return base64.b64encode(content).decode()


def _decoded(line: str, path: Path, what: str) -> bytes:
    """Bytes of a line of base64 that is as it is written: of several spellings of the same bytes one alone is right."""
    try:
        content = base64.b64decode(line, validate=True)
    except (binascii.Error, ValueError):
        raise _no(path, what) from None
    if _encoded(content) != line:
        raise _no(path, what)
    return content


def _lines(path: Path, number: int, what: str) -> list[str]:
    """The lines of a file of a key or a signature."""
    try:
        text = bytes_of(path, _LARGEST, what).decode("utf-8")
    except FileNotFoundError:
        raise InputError(Fault("there is no such file", path, advice="Look at the name")) from None
    except UnicodeDecodeError:
        raise _no(path, what) from None
    lines = text.replace("\r\n", "\n").removesuffix("\n").split("\n")
    if len(lines) != number or not lines[0].startswith(BEGIN):
        raise _no(path, what)
    return lines


def _no(path: Path, what: str) -> InputError:
    return InputError(Fault(f"this is not {what} of minisign's format, or it is damaged", path))
