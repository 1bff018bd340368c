#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# long.sh [RUNS [TARGET…]]: runs each fuzz target of the preset `asan` in turn, at the lowest priority, for RUNS
# executions (default: 10 000 000), which takes hours. Each target writes its findings to build/asan/long/TARGET/ and
# its log to TARGET.log there. TARGET/minimised then contains the inputs that reach the same coverage. If they reach
# more than the committed corpus, pack them with the command in the last line of the output, and commit the result with
# the figures for tests/tools/bench/RESULTS.md.
set -euo pipefail
cd "$(dirname "$0")/../.."
runs=${1:-10000000}
shift || true
targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=(header payload handshake session key scene trace recording falcon_reply falcon_loader falcon_device
  spacemouse_report woodenhaptics_report woodenhaptics_device)
declare -A longest=([header]=64 [payload]=400 [handshake]=24 [session]=24 [key]=160 [scene]=400 [trace]=600 [recording]=600
  [falcon_reply]=200 [falcon_loader]=60 [falcon_device]=200 [spacemouse_report]=64
  [woodenhaptics_report]=64 [woodenhaptics_device]=200)
cmake --preset asan && cmake --build --preset asan --target fuzzers
# Stack traces of allocations and entropic scheduling are omitted, because they are not worth their cost for these
# targets.
export ASAN_OPTIONS=malloc_context_size=0:quarantine_size_mb=1:thread_local_quarantine_size_kb=16
for target in "${targets[@]}"; do
  folder=build/asan/long/$target
  mkdir -p "$folder/corpus"
  cp -n build/asan/tests/fuzz/corpus/"$target"/* "$folder/corpus/"
  nice -n 19 "build/asan/bin/${target}_fuzz" -entropic=0 -runs="$runs" -seed="${SEED:-1}" -max_len="${longest[$target]}" \
    -timeout=60 -close_fd_mask=3 -print_final_stats=1 -artifact_prefix="$folder/" "$folder/corpus" 2>"$folder.log"
  grep -a 'number_of_executed_units\|DONE ' "$folder.log"
  rm -rf "$folder/minimised" && mkdir "$folder/minimised"
  "build/asan/bin/${target}_fuzz" -merge=1 "$folder/minimised" "$folder/corpus" 2>>"$folder.log"
  echo "tests/fuzz/pack.sh $target $folder/minimised"
done
