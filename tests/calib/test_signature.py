"""What is signed here minisign takes for signed, and the other way round; nothing else passes."""

from __future__ import annotations

import base64
from pathlib import Path

import minisign
import pytest

from calib.errors import InputError
from calib.signature import (
    SecretKey,
    fault_of,
    new_key,
    public_key_text,
    read_public_key,
    read_secret_key,
    read_signature,
    secret_key_text,
    sign,
)

# Written by minisign 0.11 (Debian 0.11-1): `minisign -G -W`, and `minisign -S` of the letters hello, 2026-11-23.
GOLDEN = {
    "lab.key": (
        "untrusted comment: minisign encrypted secret key\n"
        "RWQAAEIyAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAkJjlz96WU9Be0C6lMeH3XZuJGGHv"
        "JdEKIPrXBdkknXvawMTn1A01pYRv8xB/ba0y6il4NUD3XKpimk/VFCrVpwJMHjdaFGjyAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=\n"
    ),
    "lab.pub": (
        "untrusted comment: minisign public key D05396DECFE59890\nRWSQmOXP3pZT0IRv8xB/ba0y6il4NUD3XKpimk/VFCrVpwJMHjdaFGjy\n"
    ),
    "hello.minisig": (
        "untrusted comment: signature from minisign secret key\n"
        "RUSQmOXP3pZT0HOef72R93Ox2tPKnbliIytJaSWtYAl0mO0w+u99RdGJOP6MhS1d26aUxqO7HYO3l3lGRwmTs89AD55Q8SUzZg8=\n"
        "trusted comment: timestamp:1795416012\tfile:h\thashed\n"
        "yFRQyOVb/Wqxo73SjutL+KAbnd06BHkbKwzWWLM2YF4itjwBCSJ7bWMIYeoLg3QB4PpPH/h9WXRF6VfRz/aTDg==\n"
    ),
}


@pytest.fixture(scope="module")
def key() -> SecretKey:
    return new_key()


def _written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_minisign_takes_what_is_signed_here(key: SecretKey, tmp_path: Path) -> None:
    theirs = minisign.PublicKey.from_bytes(public_key_text(key.public).encode())
    text = sign(b"hello", key, "timestamp:1 file:certificate.json")
    signature = minisign.Signature.from_bytes(text.encode())
    theirs.verify(b"hello", signature)
    assert signature.trusted_comment == "timestamp:1 file:certificate.json"
    with pytest.raises(minisign.VerifyError):
        theirs.verify(b"hellp", signature)


@pytest.fixture(scope="module")
def locked(key: SecretKey) -> str:
    """The file of that key under a password, which takes a while by purpose."""
    return secret_key_text(key, "pässword")


@pytest.mark.parametrize("password", ["", "pässword"])
def test_minisign_signs_with_a_key_from_here(key: SecretKey, locked: str, tmp_path: Path, password: str) -> None:
    path = _written(tmp_path, "lab.key", locked if password else secret_key_text(key))
    assert read_secret_key(path, lambda: password) == key
    theirs = minisign.SecretKey.from_file(path)
    if password:
        theirs.decrypt(password)
    signed = theirs.sign(b"hello", trusted_comment="theirs")
    found = read_signature(_written(tmp_path, "hello.minisig", bytes(signed).decode()))
    assert fault_of(found, b"hello", key.public) == ""
    assert found.comment == "theirs"
    assert fault_of(found, b"hellp", key.public) == f"the signature is not that of the key {key.public.name} for this file"


def test_keys_and_signature_of_the_program_minisign_are_read(tmp_path: Path) -> None:
    paths = {name: _written(tmp_path, name, text) for name, text in GOLDEN.items()}
    key = read_secret_key(paths["lab.key"], lambda: "")
    assert key.public == read_public_key(paths["lab.pub"])
    assert key.public.name == "D05396DECFE59890"
    found = read_signature(paths["hello.minisig"])
    assert fault_of(found, b"hello", key.public) == ""
    assert "hashed" in found.comment


def test_a_secret_is_not_printed(key: SecretKey) -> None:
    assert repr(key.seed) not in repr(key)
    assert "seed" not in repr(key)


def test_another_password_is_refused(locked: str, tmp_path: Path) -> None:
    path = _written(tmp_path, "lab.key", locked)
    with pytest.raises(InputError, match="the password is another"):
        read_secret_key(path, lambda: "wrong")


def test_every_changed_byte_of_a_signature_is_found(key: SecretKey, tmp_path: Path) -> None:
    text = sign(b"hello", key, "timestamp:1")
    for place in range(text.index("\n") + 1, len(text), 3):
        for new in {"A", "b", "\n"} - {text[place]}:
            path = _written(tmp_path, "hello.minisig", text[:place] + new + text[place + 1 :])
            try:
                fault = fault_of(read_signature(path), b"hello", key.public)
            except InputError as error:
                fault = str(error)
            assert fault, (place, new)


def test_a_key_of_the_same_number_is_another_key(key: SecretKey, tmp_path: Path) -> None:
    other = new_key()
    forged = SecretKey(key.number, other.seed, other.public)
    signature = read_signature(_written(tmp_path, "hello.minisig", sign(b"hello", forged, "timestamp:1")))
    assert signature.number == key.number
    assert "is not that of the key" in fault_of(signature, b"hello", key.public)
    assert "signed with the key" in fault_of(signature, b"hello", other.public)


def test_damaged_and_mistaken_files_are_refused_with_what_they_are(key: SecretKey, locked: str, tmp_path: Path) -> None:
    secret = secret_key_text(key)
    head, line = secret.split("\n")[:2]
    flipped = bytearray(base64.b64decode(line))
    flipped[80] ^= 1
    wrong = {
        "empty": "",
        "one line": head,
        "no base64": f"{head}\n***\n",
        "short": f"{head}\n{line[:40]}\n",
        "a number changed": f"{head}\n{base64.b64encode(flipped).decode()}\n",
        "an experiment": 'name = "x"\n',
    }
    for name, text in wrong.items():
        with pytest.raises(InputError, match=r"this is not a secret key|this key is damaged"):
            read_secret_key(_written(tmp_path, name, text), lambda: "")
    with pytest.raises(InputError, match=r"this is a secret key, and a public one is wanted. Give the file that ends in \.pub"):
        read_public_key(_written(tmp_path, "lab.key", secret))
    with pytest.raises(InputError, match="there is no such file"):
        read_public_key(tmp_path / "nowhere.pub")
    hungry = bytearray(base64.b64decode(locked.split("\n")[1]))
    hungry[46:54] = (1 << 45).to_bytes(8, "little")
    with pytest.raises(InputError, match="takes more memory"):
        read_secret_key(_written(tmp_path, "hungry", f"{head}\n{base64.b64encode(hungry).decode()}\n"), lambda: "x")


def test_a_comment_is_one_line_that_minisign_can_show(key: SecretKey) -> None:
    for comment in ("two\nlines", "Université", "x" * 2000):
        with pytest.raises(ValueError, match="letters of ASCII"):
            sign(b"hello", key, comment)
