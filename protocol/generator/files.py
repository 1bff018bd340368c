# SPDX-License-Identifier: Apache-2.0
"""The files that are written by the generator."""

import cpp
import csharp
import page
import python
import typescript
from model import Wire

BACKENDS = (cpp, csharp, python, typescript, page)


def made(wire: Wire) -> dict[str, str]:
    """Returns the text of each file, by its path in the repository."""
    return {path: text for backend in BACKENDS for path, text in backend.files(wire).items()}
