#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tests/tools/injector/cross_check.sh [BUILD]: compares the proxy with the kernel's own packet loss and rate limits.
# irtt (a UDP round-trip tester) talks to its server through a pair of network namespaces, 1000 times a second:
#   loss   nft's `numgen random mod 100 < 10 drop` against `loss=10%`
#   rate   tc's token bucket, 4 Mbit/s and a 50 kB queue, against `rate=4Mbit/s queue=50kB`, at twice the rate
#   floor  a direct path, and the proxy without impairments
# Prints a table. Fails if proxy and kernel differ by more than five standard deviations (loss) or 3 % (rate).
# Prints a message and does nothing without root, irtt, nft or tc.
#
# Example: sudo tests/tools/injector/cross_check.sh build/release
set -euo pipefail
build=${1:-$(dirname "$0")/../../../build/release}
inject=$build/bin/tendon-inject
seconds=10
bytes=1000 # of payload; 42 more on the wire: Ethernet, IPv4 and UDP headers

skip() { echo "skipped: $*"; exit 0; }
[ "$(id -u)" = 0 ] || skip "network namespaces need root"
for tool in irtt nft tc ip; do
  command -v "$tool" >/dev/null || skip "$tool is not installed (Debian: irtt nftables iproute2)"
done
[ -x "$inject" ] || { echo "cross_check.sh: no $inject; build it first" >&2; exit 2; }

here=tendon-a-$$
there=tendon-b-$$
work=$(mktemp -d)
cleanup() {
  for side in "$here" "$there"; do
    ip netns pids "$side" 2>/dev/null | xargs -r kill 2>/dev/null || true
    ip netns del "$side" 2>/dev/null || true
  done
  rm -rf "$work"
}
trap cleanup EXIT
ip netns add "$here" 2>/dev/null || skip "network namespaces cannot be made here"
ip netns add "$there"
ip -n "$here" link add tendon0 type veth peer name tendon0 netns "$there"
ip -n "$here" addr add 10.98.0.1/24 dev tendon0
ip -n "$there" addr add 10.98.0.2/24 dev tendon0
for side in "$here" "$there"; do
  ip -n "$side" link set lo up
  ip -n "$side" link set tendon0 up
done
ip netns exec "$there" irtt server -i 0 -b 10.98.0.2:2112 >"$work/server.log" 2>&1 &
sleep 0.5

# measure NAME ADDRESS: runs irtt once, prints a line of the table and appends its numbers to $work/results.
measure() {
  local name=$1 address=$2
  ip netns exec "$here" irtt client -q -i 1ms -d "${seconds}s" -l $bytes --wait=1s "$address" >"$work/out" 2>&1 ||
    { cat "$work/out"; exit 1; }
  awk -v name="$name" -v bytes=$bytes -v results="$work/results" '
    function bps(value, unit) { return value * (unit ~ /^M/ ? 1e6 : unit ~ /^K/ ? 1e3 : 1) * (bytes + 42) / bytes }
    $1 == "RTT" { least = $2; median = $4 }
    /send\/receive rate/ { sent = bps($3, $4); got = bps($6, $7) }
    /server packets received/ { split($4, n, "/") }
    END {
      lost = 100 * (1 - n[1] / n[2])
      printf "%-34s %7d %8.2f %9.3f %9.3f %10s %10s\n", name, n[2], lost, sent / 1e6, got / 1e6, least, median
      print name "\t" lost "\t" n[2] "\t" got >>results
    }' "$work/out"
}

# through OPTIONS…: starts a proxy in front of the server and stops the previous one.
proxy=
through() {
  [ -z "$proxy" ] || { kill "$proxy"; wait "$proxy" 2>/dev/null || true; }
  ip netns exec "$here" "$inject" --listen 127.0.0.1:47101 --to 10.98.0.2:2112 --seed 7 --json "$@" >"$work/proxy.log" 2>&1 &
  proxy=$!
  sleep 0.5
}

printf '%-34s %7s %8s %9s %9s %10s %10s\n' "${seconds} s, $bytes bytes of payload" packets 'lost %' 'sent Mb/s' 'back Mb/s' 'RTT least' median
measure 'direct' 10.98.0.2:2112
through
measure 'tendon-inject' 127.0.0.1:47101

ip netns exec "$there" nft 'add table ip drops; add chain ip drops in { type filter hook input priority 0; }; add rule ip drops in udp dport 2112 numgen random mod 100 < 10 drop'
measure 'nft, loss 10 %' 10.98.0.2:2112
ip netns exec "$there" nft delete table ip drops
through --up 'loss=10%'
measure 'tendon-inject, loss 10 %' 127.0.0.1:47101

tc -n "$here" qdisc add dev tendon0 root tbf rate 4mbit burst 2kb limit 50kb
measure 'tbf, 4 Mbit/s' 10.98.0.2:2112
tc -n "$here" qdisc del dev tendon0 root
through --up 'rate=4Mbit/s queue=50kB overhead=42'
measure 'tendon-inject, 4 Mbit/s' 127.0.0.1:47101

awk -F '\t' '
  function check(what, ok) { print (ok ? "PASS  " : "FAIL  ") what; if (!ok) failed = 1 }
  / 10 %/ { check($1 " is within five standard deviations of 10 %", ($2 - 10) ^ 2 < 25 * 900 / $3) }
  /Mbit/ { rate[++rates] = $4 }
  END {
    check("both rates are within 3 % of each other", rate[1] / rate[2] < 1.03 && rate[2] / rate[1] < 1.03)
    exit failed
  }' "$work/results"
