#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# day.sh [SEEDS [JOBS]]: so many days (25 h at 1 kHz) of tendon-worlds of the release build, at the lowest priority; a JSON
# object for each, exit 1 when one has broken a promise. Some ten minutes of a processor each. The result belongs into
# tests/tools/bench/RESULTS.md.
set -euo pipefail
cd "$(dirname "$0")/../../.."
seq 1 "${1:-2}" | nice -n 19 xargs -P "${2:-$(nproc)}" -L 1 build/release/bin/tendon-worlds day --json --seed
