#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# sweep.sh [SEEDS]: runs the loop's hard cases with 200 seeds each, with hard_test of the release build at the lowest
# priority, which takes some minutes. A failure prints its seed. Put failures into README.md.
set -eu
cd "$(dirname "$0")/../.."
TENDON_HARD_SEEDS="${1:-200}" exec nice -n 19 build/release/tests/hard_test --gtest_filter='HardLoop.*'
