# SPDX-License-Identifier: Apache-2.0
# What deploy/demo and deploy/test share: steps that say what they do and how long it took. To be sourced.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
logs=$root/build/log
jobs=$(nproc)
# ccache recognises what another clone of this repository has compiled: paths below the root do not count, and a
# precompiled header is as good as what it was made from.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros
mkdir -p "$logs"
cd "$root"

say() { printf '[%4d s] %s\n' "$SECONDS" "$*"; }

# step NAME COMMAND…: one line on the terminal, all that COMMAND prints in build/log. When it fails, the end of that too.
# COMMAND stops at its first error: bash would overlook `set -e` in a condition, so it does not run in one.
step() {
  local name=$1 started=$SECONDS log status
  log=$logs/${name//[^a-zA-Z0-9]/-}.log
  shift
  printf '[%4d s] %-24s ' "$SECONDS" "$name"
  set +e
  (set -e; "$@") >"$log" 2>&1 </dev/null
  status=$?
  set -e
  if [ $status = 0 ]; then
    printf '%4d s\n' $((SECONDS - started))
  else
    printf 'FAILED after %d s\n' $((SECONDS - started))
    tail -n 60 "$log"
    echo "$name failed; all of its output is in ${log#"$root/"}"
    exit 1
  fi
}

# install_packages demo|test: also points this shell at build/sysroot, should the packages have had to go there.
install_packages() {
  say "packages"
  deploy/setup "$1"
  if [ -f build/sysroot/env ]; then
    . build/sysroot/env
  fi
}
