# SPDX-License-Identifier: Apache-2.0
"""The package as it is in this tree, whether or not one is installed."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "clients" / "python"))
