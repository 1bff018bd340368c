// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/sweep/bisect.h"

#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/tools/sweep/results.h"
#include "tests/tools/sweep/shards.h"

namespace tendon::sweep {
namespace {

using Named = std::vector<std::uint64_t>;

constexpr int kAlone = 3;         // runs of each unit found
constexpr std::size_t kMost = 8;  // units that are run alone

/// nullopt if the outputs of two runs are equal, otherwise the units known to differ, if any.
std::optional<Named> run_twice(const Plan& plan, const Units& half) {
  const std::string once = output_of(plan, half);
  const std::string again = output_of(plan, half);
  if (once == again) return std::nullopt;
  return differing_units(once, again, half);
}

Named by_halves(const Plan& plan, Units part, std::ostream& out) {
  while (part.count > 1) {
    const Units left{.first = part.first, .count = part.count / 2};
    const Units right{.first = part.first + left.count, .count = part.count - left.count};
    std::optional<Named> differ = run_twice(plan, left);
    part = differ ? left : right;
    if (!differ) differ = run_twice(plan, right);
    if (!differ) break;
    out << "units " << text_of(part) << " give different results in each run";
    if (!differ->empty()) {
      out << "; they differ in unit " << differ->front() << "\n";
      return *differ;
    }
    out << "\n" << std::flush;
  }
  return {};
}

/// `here`: the unit's result when the shard was run on this node. Returns true if all are equal.
bool run_alone(const Plan& plan, std::uint64_t unit, const std::string& here, std::ostream& out) {
  std::set<std::string> ends;
  for (int i = 0; i < kAlone; ++i) ends.insert(output_of(plan, {.first = unit, .count = 1}));
  out << "unit " << unit << ", run " << kAlone << " times alone: ";
  if (ends.size() > 1) {
    out << ends.size() << " results\n" << std::flush;
    return false;
  }
  const std::string lines = lines_of(*ends.begin(), unit);
  out << "always the same result" << (lines == lines_of(here, unit) ? "" : ", which differs from that in its shard")
      << "\n"
      << std::flush;
  return true;
}

}  // namespace

bool bisect(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard, std::ostream& out) {
  const Units units = plan.shard(shard);
  const std::optional<std::string> first = result_of(folder, plan, shard);
  const std::optional<std::string> second = other_result_of(folder, plan, shard);
  if (!first || !second) {
    throw std::invalid_argument("shard " + std::to_string(shard) + ": expected two results that differ");
  }
  const std::filesystem::path file = result_file(folder, shard);
  Named named = differing_units(*first, *second, units);
  out << "shard " << shard << ", units " << text_of(units) << ": two results that differ in "
      << difference(*first, *second, units) << "\n";
  const std::string lines = named.empty() ? "" : lines_of(*first, named.front());
  if (!lines.empty()) out << "first:  " << lines << "second: " << lines_of(*second, named.front());
  out << std::flush;

  const std::string here = output_of(plan, units);
  const bool third = here != *first && here != *second;
  out << "on this node, the shard gives "
      << (third            ? "a third"
          : here == *first ? "the first, " + file.string()
                           : "the second, " + std::filesystem::path(file).replace_extension(".differs").string())
      << "\n"
      << std::flush;
  if (named.empty()) named = differing_units(*first, here, units);
  if (named.empty()) named = differing_units(*second, here, units);
  if (named.empty()) named = by_halves(plan, units, out);
  bool same = true;
  for (std::size_t i = 0; i < named.size() && i < kMost; ++i) same = run_alone(plan, named[i], here, out) && same;

  if (!same) {
    out << "The program gives different results in each run: it depends on more than its units.\n";
  } else if (third) {
    out << "There are three results. Run this command again: a fourth result is an error of the program, not of a "
           "node.\n";
  } else {
    out << "This node always gives the same result. The other result is from another node, or from an error.\n"
           "Run this command there, remove the wrong file, and give the right one the name "
        << file.string() << "\n";
  }
  if (named.empty()) out << "The differing units are unknown: several units without lines differ, or none.\n";
  return !named.empty();
}

}  // namespace tendon::sweep
