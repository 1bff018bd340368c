#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# golden_decisions.sh SOURCE_DIR SCRATCH_DIR PROGRAM: compares the decisions of PROGRAM (this build's golden_decisions)
# with the checksums in tests/golden/injector.sha256.
#
# golden_decisions.sh SOURCE_DIR SCRATCH_DIR --with COMPILER: compiles the same sources with COMPILER and compares its
# decisions. Exit code 77 (skipped) if the compiler is not installed.
#
# To update after an intended change: golden_decisions DIR && (cd DIR && sha256sum *.txt) > tests/golden/injector.sha256
set -eu
source=$1 scratch=$2 program=$3
mkdir -p "$scratch"
if [ "$program" = --with ]; then
  compiler=$4
  if ! command -v "$compiler" >/dev/null; then
    echo "skipped: $compiler is not installed, so only one compiler has been compared"
    exit 77
  fi
  program=$scratch/golden_decisions
  cd "$source"
  tool=tests/tools/injector
  for file in core/base/nearest_word core/base/portable_math server/machine/regular_file server/tables/table_reader \
    $tool/models/bottleneck $tool/models/delay_model $tool/models/draws $tool/models/exact_math \
    $tool/models/loss_model $tool/models/quantile_table $tool/golden_decisions_main $tool/injector \
    $tool/profile/limits $tool/profile/named_profiles $tool/profile/profile $tool/profile/profile_text \
    $tool/profile/tables $tool/profile/timeline $tool/profile/units $tool/profile/words; do
    object=$scratch/$(basename "$file").o
    "$compiler" -std=c++20 -O2 -ffp-contract=off -DTENDON_VERSION='"of another compiler"' -I. -c "$file.cc" -o "$object"
    set -- "$@" "$object"
  done
  shift 4
  "$compiler" "$@" -o "$program"
fi
rm -rf "$scratch/decisions"
"$program" "$scratch/decisions"
cd "$scratch/decisions"
sha256sum --check --strict --quiet "$source/tests/golden/injector.sha256"
[ "$(ls | wc -l)" = "$(wc -l <"$source/tests/golden/injector.sha256")" ] || {
  echo "there are other profiles than in tests/golden/injector.sha256"
  exit 1
}
