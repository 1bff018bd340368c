// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {

/// A trace that still fails, with as few datagrams as were found.
struct Shrunk {
  Trace trace;           ///< sparse: for TracePlayer by index, or as a file for a test to load
  std::size_t from = 0;  ///< datagrams that were not benign in the trace that was given
  std::size_t runs = 0;  ///< of the predicate
  /// Leaving out any one of its datagrams makes it pass; false when the runs were used up before that was shown.
  bool minimal = false;
};

/// Which datagrams make it fail? Reduces a trace that makes a test fail to the few datagrams that matter, by delta
/// debugging (ddmin: Zeller and Hildebrandt, "Simplifying and isolating failure-inducing input", IEEE Transactions on
/// Software Engineering 28(2), 2002).
///
/// A datagram that matters keeps its fate; every other one is benign: it passes after the median delay of its
/// direction, undamaged and once. Whole stretches are made benign first, then ever smaller ones; what remains is not
/// the least there could be, but none of it can be left out. Needs some |remaining| · log |given| runs when it goes
/// well, and in the worst case the square of |given|, which is why `max_runs` ends it.
///
/// `fails` must play its trace by index and answer the same whenever it is asked the same. It is called first with the
/// whole trace made sparse, where it must be true, else std::invalid_argument is thrown: with benign delays for what
/// was nearly benign the failure is gone; and then with no datagram listed at all: when that fails too, the network is
/// not to blame, and the result is empty. Deterministic: the same trace and predicate give the same result and number
/// of runs.
Shrunk shrink(const Trace& failing, const std::function<bool(const Trace&)>& fails, std::size_t max_runs = 5000);

}  // namespace tendon::injector
