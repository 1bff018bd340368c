// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>

#include "clients/cpp/force_client.h"

// An engine's side of a conversation in a file: each state that its callback was given, and its answer. A bug that a
// hand has found can then be repeated without the hand, the device and the network. And a change of an engine that is
// meant to change no answer can be shown to change none, bit for bit.
//
// Text: a first line `tendon conversation 1`, then a line for each answer, of words with a space between: tick, sampled
// (ns, server clock), position, velocity, force_applied (three each), energy, permitted_force, reasons, force_sequence,
// force_age (ns), mode, device, channel (see DeviceState), then the force, and after it what the engine gave of these,
// in this order (see Touch):
//
//     stiffness    row by row, N/m        contact      the normal, the gap in m
//     radius       in m                   table        first and step in m, the number of entries, each in N
//     cut          the topology changed   error        in N
//
// Integers are decimal, the others hexadecimal (1.8p+1 = 3), which is exact.

namespace tendon {

/// Wraps `engine` and writes a line for each answer to `to`, which must outlive the result. An exception of `engine`
/// passes through and leaves no line. A stream that fails (a full disk) ends the recording, not the engine: check it.
Physics recorded(Physics engine, std::ostream& to);

/// Result of a replay.
struct Replay {
  struct Difference {
    std::uint64_t line = 0;  ///< of the file
    std::uint64_t tick = 0;
    Touch was;
    Touch is;
  };
  std::uint64_t answers = 0;
  std::uint64_t differing = 0;      ///< of these, not the same bits; a NaN is like any other NaN
  double largest_n = 0;             ///< N, of their forces' differences; 0 where there is none, or none is finite
  std::optional<Difference> first;  ///< of those that differ
  /// In a sentence: "1200 answers, all the same".
  std::string text() const;
};

/// Gives the recorded states to `engine` in order, and compares its answers with the recorded ones. Throws
/// std::runtime_error, "line 7: …", when the recording is damaged or incomplete; exceptions of `engine` pass through.
Replay replay(std::istream& from, const Physics& engine);

}  // namespace tendon
