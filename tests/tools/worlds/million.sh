#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# million.sh: 1 000 000 worlds of 10 s, with tendon-worlds of the release build, at the lowest priority. Takes hours. The
# shards that are done stay in build/million, so the same command goes on where it was stopped. The last line it prints,
# with the digest, belongs into README.md. An argument is another number of worlds.
set -eu
cd "$(dirname "$0")/../../.."
programs=$PWD/build/release/bin
sweep=build/million
if [ ! -e $sweep/plan.json ]; then
  "$programs/tendon-sweep" plan $sweep --units "1:${1:-1000000}" --per-shard 2500 -- "$programs/tendon-worlds" run
fi
nice -n 19 "$programs/tendon-sweep" here $sweep
exec "$programs/tendon-sweep" merge $sweep
