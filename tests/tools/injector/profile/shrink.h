// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {

struct Shrunk {
  Trace trace;           ///< sparse: for TracePlayer by index, or as a file for a test
  std::size_t from = 0;  ///< datagrams of the given trace that were not benign
  std::size_t runs = 0;  ///< of the predicate
  /// False if the runs were used up before no datagram was shown to be superfluous.
  bool minimal = false;
};

/// Reduces a trace that makes a test fail to the few relevant datagrams, by delta debugging (ddmin: Zeller and
/// Hildebrandt, "Simplifying and isolating failure-inducing input", IEEE Transactions on Software Engineering 28(2),
/// 2002). The others become benign: they pass once, undamaged, after the median delay of their direction. No datagram
/// of the result can be removed. Needs about |remaining| · log |given| runs in good cases and |given|² in the worst
/// case, which `max_runs` limits.
///
/// `fails` must play its trace by index and be deterministic. It is called first with the whole trace made sparse. If
/// that passes, throws std::invalid_argument, because the failure depends on nearly benign delays. It is called next
/// without any listed datagram. If that fails, the network is not the cause, and the result is empty.
Shrunk shrink(const Trace& failing, const std::function<bool(const Trace&)>& fails, std::size_t max_runs = 5000);

}  // namespace tendon::injector
