#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# sweep.sh [SEEDS]: runs the hard cases of the loop with 200 seeds each, or with SEEDS. It uses hard_test of the release
# build at the lowest priority. If a case fails, its seed is printed. Add the failure to README.md.
set -eu
cd "$(dirname "$0")/../.."
TENDON_HARD_SEEDS="${1:-200}" exec nice -n 19 build/release/tests/hard_test --gtest_filter='HardLoop.*'
