#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# million.sh: 1 000 000 worlds of 10 s, with tendon-worlds of the release build, at the lowest priority. Takes hours; the
# result belongs into README.md. An argument is another number of worlds.
set -eu
cd "$(dirname "$0")/../../.."
exec nice -n 19 build/release/bin/tendon-worlds run --count "${1:-1000000}" --seeds tests/tools/worlds/seeds.txt
