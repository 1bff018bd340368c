// SPDX-License-Identifier: Apache-2.0
// Prints the position of the hand, the force on it, and the round-trip time of the network. This is an observer.
import { commandLine, run, type Vec3 } from "tendon-client/node";

const { options } = commandLine("Print the motion of the hand, the force on it, and the round-trip time of the network.", {
  name: "echo_motion",
  rateHz: 10,
});

const row = ({ x, y, z }: Vec3, digits: number): string[] => [x, y, z].map((value) => value.toFixed(digits));

process.exitCode = await run(options, {
  watch({ tick, position, forceApplied }, link) {
    const [x, f, rtt] = [row(position, 6), row(forceApplied, 4), link.smoothedRoundTripMs.toFixed(3)];
    console.log(
      options.json
        ? `{"tick":${tick},"position_m":[${x}],"force_n":[${f}],"round_trip_ms":${rtt}}`
        : `tick ${tick}   position ${x.join(" ")} m   force ${f.join(" ")} N   round trip ${rtt} ms`,
    );
  },
});
