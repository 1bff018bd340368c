// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>

#include "core/base/motion.h"
#include "core/base/time.h"
#include "server/recording/records.h"

namespace tendon::lab {

/// Summary of the steps with a field (FieldStep), in SI units.
struct FieldSummary {
  std::uint64_t steps = 0;          ///< with a field
  std::uint64_t used = 0;           ///< number of fields that were used
  std::uint64_t swaps = 0;          ///< changes of the generation in a channel whose field was in use
  std::uint64_t contact_steps = 0;  ///< with a depth above 0
  std::uint64_t refused_steps = 0;  ///< in which the gates refused more than 1 nJ, the tolerance for rounding
  double refused = 0;               ///< J, sum over all steps; a field can request the same energy in several steps
  double credit = 0;                ///< J, sum of the energy credited by the tanks
  double largest_stored = 0;        ///< J, max H
  double least_account = std::numeric_limits<double>::infinity();  ///< J, min E
  /// N/s, max ‖F(n) − F(n−1)‖ / (t(n) − t(n−1)) of the applied force for 0 ≤ t(n) − t(swap) ≤ 200 ms, where t(swap) is
  /// the first step with the new field. Empty: no swap.
  std::optional<double> swap_slew;

  double share_in_contact() const noexcept { return share(contact_steps); }  ///< of `steps`, 0 to 1
  double share_refused() const noexcept { return share(refused_steps); }     ///< of `steps`, 0 to 1

 private:
  double share(std::uint64_t of) const noexcept {
    return static_cast<double>(of) / static_cast<double>(std::max<std::uint64_t>(steps, 1));
  }
};

/// Computes the summary in one pass. A step contains the generation of only one channel (FieldStep), so a swap in
/// another channel is seen when that channel has contact. Steps without a position contain no field. They do not end the
/// use of a field. Thread-safe: no. Realtime-safe: no.
class FieldObserver {
 public:
  /// Steps must come in order.
  void observe(const StepRecord& step);

  std::optional<FieldSummary> summary() const;  ///< empty if no step has a field

 private:
  void observe_use(const StepRecord& step);

  FieldSummary so_far_;
  std::map<std::uint8_t, std::uint32_t> generations_;  ///< in use, by channel
  std::optional<LocalTime> swapped_;
  std::optional<LocalTime> last_at_;
  Vec3 last_applied_ = Vec3::Zero();
};

}  // namespace tendon::lab
