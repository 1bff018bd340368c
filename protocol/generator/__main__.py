# SPDX-License-Identifier: Apache-2.0
"""python3 protocol/generator: writes the files of all languages."""

from files import made
from model import ROOT, load

for path, text in made(load()).items():
    (ROOT / path).write_text(text, encoding="utf-8")
