// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>

#include "clients/cpp/force_client.h"

// Records the states that an engine receives and its answers, to reproduce a bug without the device and the network,
// and to check a refactoring for bit-identical answers. The format is text. The first line is `tendon conversation 1`;
// each further line is one answer, separated by spaces: tick, sampled (ns, server clock), position, velocity,
// force_applied (three values each), energy, permitted_force, reasons, force_sequence, force_age (ns), mode, device,
// channel (see DeviceState), then the force and these optional fields of Touch in this order:
//
//     stiffness    row-major, N/m       contact      normal, gap in m
//     radius       in m                 table        start and step in m, number of entries, entries in N
//     cut          topology changed     error        in N
//
// Integers are decimal. Other numbers are hexadecimal floating point (1.8p+1 = 3), which is exact.

namespace tendon {

/// Wraps `engine`: writes each answer to `to`, which must outlive the result. Exceptions of `engine` propagate and
/// write no line. If the stream fails (disk full), recording stops and the engine continues; check the stream.
Physics recorded(Physics engine, std::ostream& to);

struct Replay {
  struct Difference {
    std::uint64_t line = 0;
    std::uint64_t tick = 0;
    Touch was;
    Touch is;
  };
  std::uint64_t answers = 0;
  std::uint64_t differing = 0;  ///< answers whose bits differ; all NaNs are equal
  double largest_n = 0;         ///< N, largest norm of a force difference; 0 if there is none or none is finite
  std::optional<Difference> first;
  std::string text() const;  ///< summary: "1200 answers, all the same"
};

/// Passes the recorded states to `engine` in order and compares the answers. Throws std::runtime_error "line 7: …" if
/// the recording is damaged or incomplete. Exceptions of `engine` propagate.
Replay replay(std::istream& from, const Physics& engine);

}  // namespace tendon
