#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# same_table.sh SOURCE_DIR SCRATCH_DIR PROGRAM OTHER: expects the same table from two small_sweep, of different compilers,
# and prints its checksums. Exit code 77 (skipped) if OTHER is not built, or is of another commit.
set -eu
source=$1 scratch=$2 program=$3 other=$4
if [ ! -x "$other" ]; then
  echo "skipped: $other is not built, so only one compiler has been compared"
  exit 77
fi
mkdir -p "$scratch"
cd "$source"
"$program" deploy/scenes/demo.toml >"$scratch/this.csv"
"$other" deploy/scenes/demo.toml >"$scratch/other.csv"
commit() { awk -F, 'END { print $(NF - 1) }' "$1"; }
if [ "$(commit "$scratch/this.csv")" != "$(commit "$scratch/other.csv")" ]; then
  echo "skipped: $other is of the commit $(commit "$scratch/other.csv")"
  exit 77
fi
sha256sum "$scratch/this.csv" "$scratch/other.csv"
diff "$scratch/this.csv" "$scratch/other.csv"
