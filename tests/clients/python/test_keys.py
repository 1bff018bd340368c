# SPDX-License-Identifier: Apache-2.0
"""Tests the reading of key files. test_vectors.py tests their contents."""

import os
from hashlib import sha256

import pytest

from tendon import read_key

KEY = sha256(b"any").digest()
DIGITS = KEY.hex()


def key_file(folder, text, mode=0o600):
    file = folder / "wall.key"
    file.write_text(text, encoding="utf-8")
    file.chmod(mode)
    return file


def test_a_key_file_is_read(tmp_path):
    assert read_key(key_file(tmp_path, f"# made today\n\ncontroller {DIGITS}\n")) == KEY


def test_a_byte_order_mark_is_no_part_of_a_key(tmp_path):
    assert read_key(key_file(tmp_path, f"\ufeffcontroller {DIGITS}\r\n")) == KEY


def test_a_refused_key_is_not_repeated_in_the_sentence(tmp_path):
    with pytest.raises(ValueError, match="expected one line") as told:
        read_key(key_file(tmp_path, f"king {DIGITS}"))
    assert DIGITS[:8] not in str(told.value)


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620])
def test_a_key_that_others_may_read_is_refused(tmp_path, mode):
    with pytest.raises(PermissionError, match="chmod 600"):
        read_key(key_file(tmp_path, f"controller {DIGITS}", mode))


def test_a_pipe_or_a_folder_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe", 0o600)
    for file in (tmp_path / "pipe", tmp_path):
        with pytest.raises(OSError, match="it is not a regular file"):
            read_key(file)
