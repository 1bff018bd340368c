# SPDX-License-Identifier: Apache-2.0
# What deploy's scripts share: steps that say what they do, their place, how long they took and what is left. To be
# sourced.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
logs=$root/build/log
jobs=$(nproc)
# ccache recognises what another clone of this repository has compiled: paths below the root do not count, and a
# precompiled header is as good as what it was made from.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros
mkdir -p "$logs"
cd "$root"

say() { printf '[%4d s] %s\n' "$SECONDS" "$*"; }

# plan NAME, with a line "seconds step" for each step on standard input: the steps in their order, and how long each
# usually takes. The lengths of the last run that ended, which build/log remembers, are better: they are this
# machine's. Without a plan a step does not know its place.
plan_names=() plan_lengths=() plan_lasted=() plan_file=
plan() {
  local seconds name usual
  plan_file=$logs/lengths-$1
  while read -r usual name; do
    seconds=$(awk -F '\t' -v name="$name" '$2 == name { print $1 }' "$plan_file" 2>/dev/null || true)
    plan_names+=("$name")
    plan_lengths+=("${seconds:-$usual}")
  done
}

# place_of STEP: its index in the plan, and nothing where there is none.
place_of() {
  local i
  for i in "${!plan_names[@]}"; do
    if [ "${plan_names[i]}" = "$1" ]; then echo "$i"; fi
  done
}

# seconds_left [INDEX [RUNNING]]: an estimate for the steps of the plan that have not ended, of which INDEX has run
# for RUNNING seconds. The planned lengths, scaled by what the steps before took; one minute as planned is assumed
# beside them, so that a short first step decides nothing.
seconds_left() {
  local i planned=60 lasted=60 current=0 others=0
  for i in "${!plan_names[@]}"; do
    if [ -n "${plan_lasted[i]-}" ]; then
      planned=$((planned + plan_lengths[i]))
      lasted=$((lasted + plan_lasted[i]))
    elif [ "$i" = "${1-}" ]; then
      current=${plan_lengths[i]}
    else
      others=$((others + plan_lengths[i]))
    fi
  done
  current=$((current * lasted / planned - ${2-0}))
  if [ $current -lt 0 ]; then current=0; fi
  echo $((current + others * lasted / planned))
}

# time_left [INDEX [RUNNING]]: the same in words.
time_left() {
  local seconds
  seconds=$(seconds_left "$@")
  if [ "$seconds" -ge 100 ]; then
    echo "about $(((seconds + 59) / 60)) min left"
  elif [ "$seconds" -gt 0 ]; then
    echo "about $seconds s left"
  fi
}

# begin STEP: prints the time, its place and its name, without an end of line.
begin() {
  local place
  place=$(place_of "$1")
  if [ -n "$place" ]; then
    printf '[%4d s] %2d of %d  %-24s ' "$SECONDS" $((place + 1)) ${#plan_names[@]} "$1"
  else
    printf '[%4d s] %-24s ' "$SECONDS" "$1"
  fi
}

# ended STEP SECONDS: for the estimate of this run and, after the plan's last step, of the next.
ended() {
  local place i
  place=$(place_of "$1")
  if [ -z "$place" ]; then return; fi
  plan_lasted[place]=$2
  if [ $((place + 1)) = ${#plan_names[@]} ]; then
    for i in "${!plan_names[@]}"; do printf '%d\t%s\n' "${plan_lasted[i]-${plan_lengths[i]}}" "${plan_names[i]}"; done >"$plan_file"
  fi
}

# follow STEP LOG: on a terminal, until it is killed: each second the step's line with what ninja or ctest has
# counted, and the time left.
follow() {
  local started=$SECONDS place counted
  place=$(place_of "$1")
  while sleep 1; do
    counted=$(tail -c 2000 "$2" 2>/dev/null |
      sed -nE 's/^\[([0-9]+)\/([0-9]+)\].*/\1 of \2/p; s/^ *([0-9]+)\/([0-9]+) Test .*/\1 of \2/p' | tail -n 1)
    printf '\r\033[K%s%4d s  %s  %s' "$(SECONDS=$started begin "$1")" $((SECONDS - started)) "$counted" \
      "$(time_left "$place" $((SECONDS - started)))"
  done
}

# step NAME COMMAND…: one line on the terminal, all that COMMAND prints in build/log. When it fails, the end of that
# too. COMMAND stops at its first error: bash would overlook `set -e` in a condition, so it does not run in one.
step() {
  local name=$1 started=$SECONDS log status follower=
  log=$logs/${name//[^a-zA-Z0-9]/-}.log
  shift
  begin "$name"
  if [ -t 1 ]; then
    : >"$log"
    follow "$name" "$log" &
    follower=$!
  fi
  set +e
  (set -e; "$@") >"$log" 2>&1 </dev/null
  status=$?
  set -e
  if [ -n "$follower" ]; then
    kill $follower
    wait $follower 2>/dev/null || true
    printf '\r\033[K%s' "$(SECONDS=$started begin "$name")"
  fi
  if [ $status = 0 ]; then
    ended "$name" $((SECONDS - started))
    printf '%4d s  %s\n' $((SECONDS - started)) "$(time_left)"
  else
    printf 'FAILED after %d s\n' $((SECONDS - started))
    tail -n 60 "$log"
    echo "$name failed; all of its output is in ${log#"$root/"}"
    exit 1
  fi
}

# loud_step NAME COMMAND…: the same for one that prints for itself.
loud_step() {
  local name=$1 started=$SECONDS
  shift
  begin "$name"
  time_left
  "$@"
  ended "$name" $((SECONDS - started))
}

# install_packages demo|test: also points this shell at build/sysroot, should the packages have had to go there.
install_packages() {
  loud_step "packages" deploy/setup "$1"
  if [ -f build/sysroot/env ]; then
    . build/sysroot/env
  fi
}
