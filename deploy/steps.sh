# SPDX-License-Identifier: Apache-2.0
# Functions for scripts that consist of several steps. Each step prints its number, its duration and an estimate of the
# remaining time. This file must be sourced.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
logs=$root/build/log
jobs=$(nproc)
mkdir -p "$logs"
cd "$root"

say() { printf '[%4d s] %s\n' "$SECONDS" "$*"; }

log_of() { echo "$logs/${1//[^a-zA-Z0-9]/-}.log"; }

# skip REASON: ends the current step as skipped.
skip() {
  echo "skipped: $*"
  exit 77
}

# configure PRESET [-B FOLDER] OPTION…: runs CMake. If the compiler of the preset has changed, this uses --fresh,
# because CMake would otherwise discard the options.
configure() {
  local folder=build/$1 wanted had fresh=()
  if [ "${2-}" = -B ]; then folder=$3; fi
  wanted=$(cmake -N --preset "$1" | sed -nE 's/^ *CMAKE_CXX_COMPILER="(.*)"/\1/p')
  had=$(sed -nE 's/^CMAKE_CXX_COMPILER:[^=]*=(.*\/)?//p' "$folder/CMakeCache.txt" 2>/dev/null || true)
  if [ "$had" != "$wanted" ]; then fresh=(--fresh); fi
  cmake "${fresh[@]}" --preset "$@"
}

# The plan. Step I has the name names[I] and runs commands[I], which contains quoted words. It is expected to take
# lengths[I] seconds and has taken lasted[I] seconds. The table shows results[I].
names=() commands=() lengths=() lasted=() results=()
plan_file=/dev/null current=

# plan NAME: starts a plan, to which `add` adds steps. If build/log contains the duration of a step in the previous run,
# it is used instead of the estimate that is passed to `add`.
plan() { plan_file=$logs/lengths-$1; }

# add [--loud] SECONDS STEP COMMAND…: adds a step to the plan. SECONDS is the estimated duration on two processors if
# nothing is built yet. With --loud, the output is printed.
add() {
  local run=step seconds
  if [ "$1" = --loud ]; then run=loud_step && shift; fi
  seconds=$(awk -F '\t' -v name="$2" '$2 == name { print $1 }' "$plan_file" 2>/dev/null || true)
  lengths+=("${seconds:-$1}")
  names+=("$2")
  commands+=("$(printf '%q ' $run "${@:2}")")
}

# add_packages SECONDS LIST…: adds the first step, which installs packages.
add_packages() {
  add "$1" packages
  commands=("install_packages ${*:2}")
}

# on_this_machine SECONDS: prints how long work that is planned to take SECONDS takes on this machine, given the steps so
# far. Slow steps lengthen the estimate. Fast ones change nothing, because they may have had little to do.
on_this_machine() {
  local i planned=60 took=60
  for i in "${!lasted[@]}"; do
    if [[ ${names[i]} != packages ]]; then planned=$((planned + lengths[i])) took=$((took + lasted[i])); fi
  done
  if [ $took -lt $planned ]; then took=$planned; fi
  echo $(($1 * took / planned))
}

# too_late: succeeds if the current step would end after TENDON_SECONDS on this machine. It then succeeds for all later
# steps too, because they may need the result of this one.
late=false
too_late() {
  [ -n "${TENDON_SECONDS-}" ] || return 1
  if ! $late && [ $((SECONDS + $(on_this_machine "${lengths[current]}"))) -le "$TENDON_SECONDS" ]; then return 1; fi
  late=true
}

# run_steps: runs all steps of the plan, until one of them fails. Then `finish` is called with 0 if all steps succeeded,
# and otherwise with 1.
run_steps() {
  for current in "${!names[@]}"; do
    if too_late; then
      begin "${names[current]}"
      end "${names[current]}" 0 "skipped: this machine needs more than TENDON_SECONDS=$TENDON_SECONDS"
    else
      eval "${commands[current]}"
    fi
  done
  current=
  finish 0
}
finish() { return "$1"; }

# seconds_left [RUNNING [DONE TOTAL]]: estimates the remaining time. The current step has run for RUNNING seconds, and
# ninja or ctest has finished DONE of TOTAL items.
seconds_left() {
  local i running=${1-0} counted=${2-0} total=${3-0} step=0 others=0
  for i in "${!names[@]}"; do
    if [ -n "${lasted[i]-}" ]; then
      continue
    elif [ "$i" = "$current" ]; then
      step=${lengths[i]}
    else
      others=$((others + lengths[i]))
    fi
  done
  step=$(($(on_this_machine "$step") - running))
  if [ $step -lt 0 ]; then step=0; fi
  # The weight of the plan decreases as more items are finished.
  if [ "$counted" -gt 0 ]; then
    step=$(((step * (total - counted) + running * (total - counted) / counted * counted) / total))
  fi
  echo $((step + $(on_this_machine "$others")))
}

# time_left …: prints the result of seconds_left in words, or nothing if there is no plan.
time_left() {
  local seconds word=about
  seconds=$(seconds_left "$@")
  if [ -n "$current" ] && [ $# = 1 ] && [ "$1" -gt "${lengths[current]}" ]; then word="at least"; fi
  if [ "$seconds" -ge 100 ]; then
    echo "$word $(((seconds + 59) / 60)) min left"
  elif [ "$seconds" -gt 0 ]; then
    echo "$word $seconds s left"
  elif [ "$word" != about ]; then
    echo "longer than usual"
  fi
}

# begin STEP: prints the time, the number of the step and its name, without a newline.
begin() {
  local place=
  if [ -n "$current" ]; then place=$(printf '%2d/%d ' $((current + 1)) ${#names[@]}); fi
  printf '[%4d s] %s%-24s ' "$SECONDS" "$place" "$1"
}

# end STEP SECONDS RESULT: prints the rest of the line, and stores the result for the table and for later estimates.
end() {
  local i text
  if [ -z "$current" ]; then
    printf '%4d s  %s\n' "$2" "$3"
    return
  fi
  results[current]=$3
  lasted[current]=$2
  if [[ $3 = FAILED ]]; then
    printf '%4d s  FAILED\n' "$2"
    return
  elif [[ $3 = skipped:* ]]; then
    lengths[current]=0
  else
    for i in "${!names[@]}"; do
      printf '%d\t%s\n' "${lasted[i]-${lengths[i]}}" "${names[i]}"
    done >"$plan_file.new"
    mv "$plan_file.new" "$plan_file"
  fi
  text=$(time_left)
  printf '%4d s  %s%s\n' "$2" "$3" "${text:+; $text}"
}

# follow STEP LOG: updates the line of a step on the terminal every second until it is killed. The line shows the
# progress of ninja or ctest and the remaining time.
follow() {
  local started=$SECONDS counted columns line
  { columns=$(stty size <&3 2>/dev/null | cut -d ' ' -f 2); } 3>&1
  while sleep 1 && kill -0 $$ 2>/dev/null; do
    counted=$(tail -c 2000 "$2" 2>/dev/null |
      sed -nE 's/^\[([0-9]+)\/([0-9]+)\].*/\1 \2/p; s/^ *([0-9]+)\/([0-9]+) Test .*/\1 \2/p' | tail -n 1)
    # shellcheck disable=SC2086
    line=$(SECONDS=$started begin "$1")$(printf '%4d s  %s%s' $((SECONDS - started)) "${counted:+${counted/ / of }  }" \
      "$(time_left $((SECONDS - started)) $counted)")
    printf '\r\033[K%s' "${line:0:$((${columns:-80} - 1))}"
  done
}

# step NAME COMMAND…: prints one line and writes the output of COMMAND to build/log. If the command fails, the end of
# the output is also printed. COMMAND stops at the first error. It does not run in a condition, because bash ignores
# `set -e` there.
step() {
  local name=$1 started=$SECONDS log status follower=
  log=$(log_of "$name")
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
  case $status in
    0) end "$name" $((SECONDS - started)) "$(result_of "$log")" ;;
    77) end "$name" $((SECONDS - started)) "$(grep '^skipped: ' "$log" | tail -n 1)" ;;
    *)
      end "$name" $((SECONDS - started)) FAILED
      sed -E '/^ +Start +[0-9]+: |^ *[0-9]+\/[0-9]+ Test .*( Passed|\*\*\*Skipped) /d' "$log" | tail -n 100
      echo "$name failed; all of its output is in ${log#"$root/"}"
      finish 1 || true
      exit 1
      ;;
  esac
}

# loud_step NAME COMMAND…: does the same, but prints the output of COMMAND.
loud_step() {
  local name=$1 started=$SECONDS
  shift
  begin "$name"
  time_left
  "$@"
  if [ -n "$current" ]; then lasted[current]=$((SECONDS - started)); fi
}

# result_of LOG: prints the result of a successful step, with the number of tests if the step has run ctest. The skipped
# tests are saved in LOG.skipped, because the next run overwrites the log of ctest.
result_of() {
  local skipped=
  skipped_tests "$1" >"$1.skipped"
  if [ -s "$1.skipped" ]; then skipped=$(awk '{ n += $1 } END { print ", " n " of them skipped" }' "$1.skipped"); fi
  awk -v skipped="$skipped" '
    !result && /^[0-9]+% tests passed, .* out of [0-9]+$/ { result = ": " $NF " tests" skipped }
    /^The following tests FAILED:/ { failed = 1; next }
    failed && $2 == "-" { alone = alone " " $3; next }
    { failed = 0 }
    END { print "passed" result (alone ? "; only alone:" alone : "") }' "$1"
}

# skipped_tests LOG: prints "number reason" for the tests that ctest has skipped. The reasons are in the log of ctest.
skipped_tests() {
  local folder last
  folder=$(sed -n 's/^Test project //p' "$1" | tail -n 1)
  [ -n "$folder" ] || return 0
  last=$folder/Testing/Temporary/LastTest.first
  [ -f "$last" ] || last=${last%first}log
  awk '
    FNR == 1 { file++ }
    file == 1 && /^The following tests did not run:/ { inside = 1; next }
    file == 1 && inside && match($0, /^[ \t]*[0-9]+ - /) {
      why = / \(Disabled\)$/ ? "disabled: another test runs it, or a person" : "without a reason"
      name = substr($0, RLENGTH + 1); sub(/ \([A-Za-z ]+\)$/, "", name); reason[name] = why; next
    }
    file == 1 { inside = 0; next }
    match($0, /^[0-9]+\/[0-9]+ Testing: /) { name = substr($0, RLENGTH + 1); next }
    !(name in reason) { next }
    sub(/^skipped: /, "") { reason[name] = $0 }
    after_skipped { reason[name] = $0; after_skipped = 0 }
    /: Skipped$/ { after_skipped = 1 }
    END { for (name in reason) number[reason[name]]++; for (r in number) print number[r], r }
  ' "$1" "$last" | sort -rn
}

# table: prints the duration and the result of each step, and the reasons why parts, drills and tests were skipped.
table() {
  local i name log line shown=
  printf '\n%-24s %7s  %s\n' step seconds result
  for i in "${!names[@]}"; do
    name=${names[i]}
    printf '%-24s %7s  %s\n' "$name" "${lasted[i]--}" "${results[i]-not run}"
    if [[ ${results[i]-skipped} = skipped* ]]; then continue; fi
    log=$(log_of "$name")
    while read -r line; do
      if [[ $shown != *"|$line|"* ]]; then printf '%35s%s\n' '' "$line"; fi
      shown+="|$line|"
    done < <(sed -nE 's/^.*[Ll]eft out: (.*)/left out: \1/p' "$log")
    if [[ ${results[i]} = *,* ]]; then sed -E "s/^([0-9]+) /$(printf '%35s' '')\\1 × /" "$log.skipped"; fi
  done
  printf '%-24s %7d\n' total "$SECONDS"
}

# ctest_summaries: prints the summary of ctest for each test step, without the names of skipped tests. If the failed
# tests were run again, only the summary of the second run is printed.
ctest_summaries() {
  local i
  for i in "${!names[@]}"; do
    if [[ ${names[i]} != test\ * || ${results[i]-skipped} = skipped* ]]; then continue; fi
    printf '\n%s:\n' "${names[i]}"
    awk '/^once more, alone:/ { inside = 0; text = "" }
      /^[0-9]+% tests passed/ { inside = 1 } /^The following tests did not run:/ { inside = 0 }
      /^The following tests FAILED:/ { inside = 1 } inside { text = text $0 "\n" }
      END { printf "%s", text }' "$(log_of "${names[i]}")"
  done
}

# install_packages LIST…: installs packages. If they are unpacked into build/sysroot, this also sets up the shell to use
# them. sudo asks for the password before the line of the step is printed.
install_packages() {
  if [ "$(id -u)" != 0 ] && [ -t 0 ] && command -v sudo >/dev/null && ! deploy/setup --check "$@" >/dev/null; then
    sudo -v || true
  fi
  step "packages" deploy/setup "$@"
  if [ -f build/sysroot/env ]; then . build/sysroot/env; fi
}
