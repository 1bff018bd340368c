#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pack_test.sh: checks that unpacking and packing a committed corpus gives the same bytes, independent of the times,
# modes and order of the files.
set -euo pipefail
cd "$(dirname "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for archive in corpus/*.tar; do
  name=$(basename "$archive" .tar)
  mkdir "$work/$name"
  tar -xf "$archive" -C "$work/$name" --touch
  chmod 0600 "$work/$name"/*
  ./pack.sh "$name" "$work/$name" "$work/again.tar"
  cmp "$archive" "$work/again.tar" || { echo "$archive: pack it with tests/fuzz/pack.sh"; exit 1; }
  rm -rf "${work:?}/$name"
done
! ./pack.sh session "$work/nowhere" "$work/again.tar" 2>/dev/null
