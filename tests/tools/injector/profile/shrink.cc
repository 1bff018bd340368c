// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/shrink.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/tools/injector/traces/trace_player.h"

namespace tendon::injector {
namespace {

using Part = std::vector<TraceRecord>;

bool is_benign(const TraceRecord& record, Duration benign, std::uint32_t rebinds_before) {
  return record.verdict == Verdict::kPass && record.release == record.arrival + benign && !record.stale &&
         !record.flipped_bit && !record.truncated_to && record.rebinds == rebinds_before;
}

/// [from, to) of `whole`, and its complement.
Part stretch(const Part& whole, std::size_t from, std::size_t to) {
  const auto at = [&whole](std::size_t i) { return whole.begin() + static_cast<std::ptrdiff_t>(i); };
  return {at(from), at(to)};
}
Part without(const Part& whole, std::size_t from, std::size_t to) {
  Part rest = stretch(whole, 0, from);
  const Part end = stretch(whole, to, whole.size());
  rest.insert(rest.end(), end.begin(), end.end());
  return rest;
}

class Shrinking {
 public:
  Shrinking(const Trace& failing, const std::function<bool(const Trace&)>& fails, std::size_t max_runs)
      : fails_(fails), max_runs_(max_runs) {
    static_cast<TraceHeader&>(sparse_) = failing;
    for (const Direction direction : {Direction::kUp, Direction::kDown}) {
      auto& benign = sparse_.benign[static_cast<std::size_t>(direction)];
      if (!failing.sparse()) benign = median_delay(failing, direction);
    }
    std::vector<TraceRecord> records = failing.records;
    std::ranges::sort(records, {}, [](const TraceRecord& r) { return std::tuple(r.direction, r.link, r.index); });
    std::uint32_t rebinds = 0;
    for (std::size_t i = 0; i < records.size(); ++i) {
      const TraceRecord& record = records[i];
      const bool first = i == 0 || records[i - 1].direction != record.direction || records[i - 1].link != record.link;
      const Duration benign = sparse_.benign[static_cast<std::size_t>(record.direction)].value_or(Duration::zero());
      if (!is_benign(record, benign, first ? 0 : rebinds)) part_.push_back(record);
      rebinds = record.rebinds;
    }
    // The records are sorted by time so that simultaneous records are removed together.
    std::ranges::stable_sort(part_, {}, &TraceRecord::arrival);
  }

  Shrunk result() {
    const std::size_t from = part_.size();
    if (!still_fails(part_)) {
      throw std::invalid_argument("the trace no longer fails if its nearly benign datagrams become benign");
    }
    if (!part_.empty() && still_fails({})) part_.clear();
    const bool minimal = part_.size() < 2 || minimize();
    sparse_.records = std::move(part_);
    return {std::move(sparse_), from, runs_, minimal};
  }

 private:
  bool still_fails(const Part& part) {
    if (runs_ == max_runs_) return false;
    ++runs_;
    sparse_.records = part;
    return fails_(sparse_);
  }

  /// ddmin. `part_` fails and has at least two datagrams. Returns true if each of the remaining ones is necessary.
  bool minimize() {
    std::size_t pieces = 2;
    while (part_.size() >= 2 && runs_ < max_runs_) {
      if (reduce_to_piece(pieces)) {
        pieces = 2;
      } else if (reduce_by_piece(pieces)) {
        pieces = std::max<std::size_t>(pieces - 1, 2);
      } else if (pieces == part_.size()) {
        return runs_ < max_runs_;
      } else {
        pieces = std::min(pieces * 2, part_.size());
      }
      pieces = std::min(pieces, part_.size());
    }
    return part_.size() < 2;
  }

  std::size_t cut(std::size_t piece, std::size_t pieces) const { return part_.size() * piece / pieces; }

  bool reduce_to_piece(std::size_t pieces) {
    for (std::size_t i = 0; i < pieces; ++i) {
      Part piece = stretch(part_, cut(i, pieces), cut(i + 1, pieces));
      if (!still_fails(piece)) continue;
      part_ = std::move(piece);
      return true;
    }
    return false;
  }

  /// With two pieces, the complement of one is the other, which has already been tested.
  bool reduce_by_piece(std::size_t pieces) {
    for (std::size_t i = 0; pieces > 2 && i < pieces; ++i) {
      Part rest = without(part_, cut(i, pieces), cut(i + 1, pieces));
      if (!still_fails(rest)) continue;
      part_ = std::move(rest);
      return true;
    }
    return false;
  }

  const std::function<bool(const Trace&)>& fails_;
  std::size_t max_runs_;
  std::size_t runs_ = 0;
  Trace sparse_;
  Part part_;
};

}  // namespace

Shrunk shrink(const Trace& failing, const std::function<bool(const Trace&)>& fails, std::size_t max_runs) {
  return Shrinking(failing, fails, max_runs).result();
}

}  // namespace tendon::injector
