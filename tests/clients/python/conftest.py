# SPDX-License-Identifier: Apache-2.0
"""Uses the package in this tree even if another one is installed."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "clients" / "python"))
