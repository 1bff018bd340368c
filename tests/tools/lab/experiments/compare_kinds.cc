// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/compare_kinds.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <exception>
#include <iostream>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "core/base/nearest_word.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/situations.h"
#include "tests/tools/lab/pictures/csv.h"

namespace tendon::lab {
namespace {

struct Result {
  std::uint64_t seed = 0;
  std::string drawn;
  std::vector<Outcome> outcomes;  ///< in the order of the contenders
};

double error_of(const Outcome& outcome) {
  return outcome.true_force > 0 ? 100 * outcome.force_error / outcome.true_force : 0;
}
bool passive(const Outcome& outcome) { return outcome.least_energy >= -1e-9; }

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Line {
  std::size_t cells = 0;
  double passive = 0, within8 = 0, within3 = 0, within1_5 = 0;  ///< shares
  double error = 0, vibration = 0, sensation = 0, noticed = 0;  ///< medians: %, mm/s, dB, share
  std::size_t beaten = 0;                                       ///< by more than 3 percentage points
  /// Percentage points behind the best other law that guarantees passivity and was passive.
  double worst = 0;
  std::uint64_t worst_seed = 0;
};

Line line_of(const std::vector<Result>& results, const std::vector<Contender>& all, std::size_t of) {
  constexpr double kClearly = 3;  // percentage points
  Line line{.cells = results.size()};
  std::vector<double> errors;
  std::vector<double> vibrations;
  std::vector<double> sensations;
  std::vector<double> noticed;
  for (const Result& result : results) {
    const Outcome& own = result.outcomes[of];
    const double vibration = own.late_vibration * 1e3;
    line.passive += passive(own);
    line.within8 += vibration <= 8;
    line.within3 += vibration <= 3;
    line.within1_5 += vibration <= 1.5;
    errors.push_back(error_of(own));
    vibrations.push_back(vibration);
    sensations.push_back(own.sensation);
    noticed.push_back(own.noticed_share);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i == of || !all[i].promises || all[i].preset || !passive(result.outcomes[i])) continue;
      const double above = error_of(own) - error_of(result.outcomes[i]);
      if (above <= line.worst) continue;
      line.worst = above;
      line.worst_seed = result.seed;
    }
    const bool clearly = [&] {
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (i == of || !all[i].promises || all[i].preset || !passive(result.outcomes[i])) continue;
        if (error_of(own) - error_of(result.outcomes[i]) > kClearly) return true;
      }
      return false;
    }();
    line.beaten += clearly;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(results.size(), 1));
  for (double* share : {&line.passive, &line.within8, &line.within3, &line.within1_5}) *share /= n;
  line.error = median_of(errors);
  line.vibration = median_of(vibrations);
  line.sensation = median_of(sensations);
  line.noticed = median_of(noticed);
  return line;
}

std::vector<Contender> chosen(const std::vector<std::string>& names) {
  const std::vector<Contender> all = contenders();
  std::vector<Contender> some;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(all, name, &Contender::name);
    if (found == all.end()) {
      std::string known;
      for (const Contender& one : all) known += (known.empty() ? "" : ", ") + std::string(one.name);
      throw std::invalid_argument("law \"" + name + "\": expected one of " + known + did_you_mean(name, known));
    }
    some.push_back(*found);
  }
  if (names.empty()) {
    std::ranges::copy_if(all, std::back_inserter(some), [](const Contender& one) { return one.promises; });
  }
  return some;
}

/// Runs all situations of the given kind on all processors. The results are sorted by seed.
std::vector<Result> results_of(const std::string& kind, std::uint64_t first, std::size_t count,
                               const std::vector<Contender>& all, bool progress) {
  std::vector<Result> results(count);
  std::atomic<std::size_t> next{0};
  std::exception_ptr failed;
  std::mutex failing;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) {
        const std::optional<Trial> trial = draw_situation(kind, first + i);
        if (!trial) continue;
        results[i].seed = first + i;
        results[i].drawn = trial->drawn;
        for (const Contender& contender : all) results[i].outcomes.push_back(outcome_of(contender, *trial));
        if (progress) std::cerr << "\r" << kind << ": " << i + 1 << " of " << count << "   " << std::flush;
      }
    } catch (...) {
      const std::scoped_lock lock(failing);
      failed = std::current_exception();
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::max(1U, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
  work();
  threads.clear();
  if (failed) std::rethrow_exception(failed);
  if (progress) std::cerr << "\r";
  return results;
}

}  // namespace

void compare_kinds(const CompareKindsOptions& options, std::ostream& out) {
  if (options.count == 0) throw std::invalid_argument("--count = 0: expected 1 or more");
  std::vector<std::string> kinds = options.kinds;
  if (std::ranges::find(kinds, "all") != kinds.end()) {
    kinds.clear();
    for (const SituationKind& kind : situation_kinds()) kinds.emplace_back(kind.name);
  }
  const std::vector<Contender> all = chosen(options.laws);
  const std::uint64_t first = options.seed + (options.held_out ? kHeldOutSeeds : 0);
  for (const std::string& kind : kinds) draw_situation(kind, first);  // rejects an unknown kind before any work

  CsvTable table(options.command);
  for (const std::string& kind : kinds) {
    if (!draw_situation(kind, first)) {
      if (!options.json) out << kind << ": omitted, because TENDON_DATA is not set\n\n";
      continue;
    }
    const std::vector<Result> results = results_of(kind, first, options.count, all, options.progress);
    for (const Result& result : results) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        const Outcome& o = result.outcomes[i];
        table.add(JsonLine()
                      .add("kind", kind)
                      .add("seed", result.seed)
                      .add("drawn", result.drawn)
                      .add("law", all[i].name)
                      .add("passive", passive(o))
                      .add("energy_given_out_j", std::max(0.0, -o.least_energy))
                      .add("force_error_percent", error_of(o))
                      .add("true_force_n", o.true_force)
                      .add("vibration_mm_s", o.late_vibration * 1e3)
                      .add("sensation_db", o.sensation)
                      .add("noticed_share", o.noticed_share)
                      .add("commit", kCommit));
      }
    }
    if (!options.json) {
      const auto info = std::ranges::find(situation_kinds(), kind, &SituationKind::name);
      out << kind << ": " << info->what << "; n = " << results.size() << ", seeds " << first << " to "
          << first + options.count - 1 << ", commit " << kCommit << "\n"
          << "law                         passive  <= 8  <= 3  <= 1.5 mm/s  error  vibration   felt  noticed  "
             "beaten  worst at seed\n";
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Line line = line_of(results, all, i);
      if (options.json) {
        out << JsonLine()
                   .add("kind", kind)
                   .add("law", all[i].name)
                   .add("situations", line.cells)
                   .add("passive_share", line.passive)
                   .add("within_8_mm_s_share", line.within8)
                   .add("within_3_mm_s_share", line.within3)
                   .add("within_1_5_mm_s_share", line.within1_5)
                   .add("error_percent", line.error)
                   .add("vibration_mm_s", line.vibration)
                   .add("sensation_db", line.sensation)
                   .add("noticed_share", line.noticed)
                   .add("beaten_by_3_points", line.beaten)
                   .add("worst_points", line.worst)
                   .add("worst_seed", line.worst_seed)
                   .add("first_seed", first)
                   .add("commit", kCommit)
                   .str()
            << "\n";
        continue;
      }
      std::array<char, 200> text{};
      std::snprintf(text.data(), text.size(),
                    "%-26s %6.1f %% %5.1f %5.1f %7.1f %% %7.1f %% %6.2f mm/s %3.0f dB %6.1f %% %6zu %6.1f %7llu\n",
                    std::string(all[i].name).c_str(), line.passive * 100, line.within8 * 100, line.within3 * 100,
                    line.within1_5 * 100, line.error, line.vibration, line.sensation, line.noticed * 100, line.beaten,
                    line.worst, static_cast<unsigned long long>(line.worst_seed));
      out << text.data();
    }
    if (!options.json) out << "\n";
  }
  if (!options.json) {
    out << "passive: the true ledger is never below -1 nJ. Medians: error (rms, relative to the true force); vibration "
           "(last second);\n"
           "felt: the same in dB above the threshold of a hand; noticed: share of the time in which the error of the "
           "force is above\n"
           "the threshold of a hand. beaten: situations in which another law that guarantees passivity and was passive "
           "has an error\n"
           "more than 3 points smaller; worst: points above the best of them.\n";
  }
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    table.write(*options.out / "compare_kinds.csv");
  }
  if (!out.flush()) throw std::runtime_error("cannot write: is the disk full?");
}

}  // namespace tendon::lab
