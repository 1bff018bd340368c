#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pack.sh TARGET FOLDER [ARCHIVE]: writes the files of FOLDER as the corpus of TARGET, corpus/TARGET.tar. The same files
# always give the same bytes, for any user and at any time. To add a finding:
#   mkdir inputs && tar -xf tests/fuzz/corpus/session.tar -C inputs && cp FIND inputs
#   tests/fuzz/pack.sh session inputs
set -euo pipefail
if [ $# -lt 2 ] || [ $# -gt 3 ] || [ ! -d "$2" ]; then
  sed -n '3,6s/^# //p' "$0" >&2
  exit 2
fi
archive=${3:-$(cd "$(dirname "$0")" && pwd)/corpus/$1.tar}
find "$2" -mindepth 1 -maxdepth 1 -type f -printf '%f\0' | LC_ALL=C sort -z |
  tar -C "$2" --null --verbatim-files-from -T - --format=ustar --mtime=@0 --owner=0 --group=0 --numeric-owner \
    --mode=0644 -cf "$archive"
