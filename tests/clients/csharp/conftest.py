# SPDX-License-Identifier: Apache-2.0
"""Uses the helpers of the tests of clients/python, and its client as an observer."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
for folder in ("clients/python", "tests/clients/python"):
    sys.path.insert(0, str(ROOT / folder))
