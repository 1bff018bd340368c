// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/runner.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <exception>
#include <fstream>
#include <iomanip>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "server/machine/regular_file.h"
#include "tests/support/json_line.h"
#include "tests/tools/worlds/explore.h"

namespace tendon::simulation {

namespace {

constexpr Duration kTellEvery = std::chrono::milliseconds(500);
/// Smaller samples may by chance lack a world with a felt force.
constexpr std::uint64_t kEnoughToJudge = 200;

struct Broken {
  std::uint64_t seed = 0;
  Breach breach;
};

struct Tally {
  std::uint64_t worlds = 0;
  std::uint64_t steps = 0;
  std::uint64_t datagrams = 0;
  std::uint64_t felt = 0;
  std::uint64_t limited = 0;
  std::uint64_t turned = 0;
  std::uint64_t gripped = 0;
  std::uint64_t presses = 0;
  std::uint64_t recovered = 0;
  double least_energy = std::numeric_limits<double>::infinity();

  void add(const Outcome& outcome) {
    ++worlds;
    steps += outcome.steps;
    datagrams += outcome.network.sent;
    felt += outcome.felt ? 1 : 0;
    limited += outcome.limited ? 1 : 0;
    turned += outcome.turned ? 1 : 0;
    gripped += outcome.gripped ? 1 : 0;
    presses += static_cast<std::uint64_t>(outcome.presses);
    recovered += outcome.recovered ? 1 : 0;
    least_energy = std::min(least_energy, outcome.least_energy);
  }
};

class Exploration {
 public:
  explicit Exploration(const RunOptions& options) : options_(options) {}

  void work(std::ostream& progress) {
    while (const auto seed = next()) {
      const Outcome outcome = run(draw_world(*seed));
      const std::scoped_lock lock(mutex_);
      tally_.add(outcome);
      if (outcome.breach) {
        broken_.push_back({*seed, *outcome.breach});
        stop_ = true;
      }
      tell(progress);
    }
  }

  const Tally& tally() const { return tally_; }
  std::vector<Broken> broken() {
    std::ranges::sort(broken_, {}, &Broken::seed);
    return broken_;
  }

 private:
  std::optional<std::uint64_t> next() {
    if (stop_) return std::nullopt;
    const std::uint64_t number = handed_out_++;
    if (number < options_.seeds.size()) return options_.seeds[number];
    const std::uint64_t drawn = number - options_.seeds.size();
    if (options_.budget ? options_.elapsed() >= *options_.budget : drawn >= options_.count) return std::nullopt;
    return options_.first_seed + drawn;
  }

  void tell(std::ostream& progress) {
    if (!options_.progress || options_.elapsed() - told_ < kTellEvery) return;
    told_ = options_.elapsed();
    progress << '\r' << tally_.worlds << " worlds, " << std::fixed << std::setprecision(0)
             << static_cast<double>(tally_.worlds) / seconds(told_) << " per second" << std::defaultfloat << std::flush;
  }

  const RunOptions& options_;
  std::atomic<std::uint64_t> handed_out_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  Tally tally_;
  std::vector<Broken> broken_;
  Duration told_{};
};

std::string reproduce(std::uint64_t seed) { return "tendon-worlds run --seed " + std::to_string(seed) + " --verbose"; }

void tell(const Broken& broken, bool json, std::ostream& out) {
  const OracleInfo& oracle = info(broken.breach.oracle);
  const double at = seconds(broken.breach.at.time_since_epoch());
  if (json) {
    out << JsonLine()
               .add("kind", "broken")
               .add("seed", broken.seed)
               .add("oracle", oracle.name)
               .add("at_s", at)
               .add("what", broken.breach.what)
               .add("reproduce", reproduce(broken.seed))
               .str()
        << '\n';
    return;
  }
  out << "seed " << broken.seed << " violates \"" << oracle.name << "\" at " << at << " s: " << broken.breach.what
      << "\n  expected: " << oracle.sentence << "\n  repeat with: " << reproduce(broken.seed) << '\n';
}

void write_events(const Tally& tally, std::ostream& out) {
  out << tally.steps << " haptic steps, " << tally.datagrams << " datagrams; forces rendered in " << tally.felt
      << " worlds, limited in " << tally.limited << ", torques in " << tally.turned << ", grips in " << tally.gripped
      << "; " << tally.presses << " button presses received; recovery checked in " << tally.recovered
      << "; least energy " << tally.least_energy << " J\n";
}

void tell(const Tally& tally, double elapsed, bool json, std::ostream& out) {
  const double simulated = static_cast<double>(tally.worlds) * seconds(DrawnWorld::kLength);
  const auto worlds = static_cast<double>(tally.worlds);
  if (json) {
    out << JsonLine()
               .add("kind", "end")
               .add("worlds", tally.worlds)
               .add("elapsed_s", elapsed)
               .add("worlds_per_s", worlds / elapsed)
               .add("virtual_to_real", simulated / elapsed)
               .add("haptic_steps", tally.steps)
               .add("datagrams", tally.datagrams)
               .add("felt", tally.felt)
               .add("limited", tally.limited)
               .add("turned", tally.turned)
               .add("gripped", tally.gripped)
               .add("presses", tally.presses)
               .add("recovered", tally.recovered)
               .add("least_energy_j", tally.least_energy)
               .str()
        << '\n';
    return;
  }
  out << tally.worlds << " worlds of " << seconds(DrawnWorld::kLength) << " s in " << std::fixed << std::setprecision(1)
      << elapsed << " s: " << worlds / elapsed << " per second, " << std::setprecision(0) << simulated / elapsed
      << " times real time\n"
      << std::defaultfloat << std::setprecision(6);
  write_events(tally, out);
}

std::string whole(const Outcome& outcome) {
  JsonLine line;
  if (outcome.breach) {
    line.add("oracle", info(outcome.breach->oracle).name)
        .add("at_s", seconds(outcome.breach->at.time_since_epoch()))
        .add("what", outcome.breach->what);
  }
  return line.add("felt", outcome.felt)
      .add("limited", outcome.limited)
      .add("turned", outcome.turned)
      .add("gripped", outcome.gripped)
      .add("presses", outcome.presses)
      .add("recovered", outcome.recovered)
      .add("least_energy_j", outcome.least_energy)
      .add("steps", outcome.steps)
      .add("sent", outcome.network.sent)
      .add("copies", outcome.network.copies)
      .add("delivered", outcome.network.delivered)
      .add("lost", outcome.network.lost)
      .add("nowhere", outcome.network.nowhere)
      .str();
}

ShardEnd end_of(const Units& seeds, const Tally& tally, std::uint64_t broken, const UnitDigest& digest) {
  return {.units = seeds,
          .totals = {{"worlds", tally.worlds},
                     {"broken", broken},
                     {"haptic_steps", tally.steps},
                     {"datagrams", tally.datagrams},
                     {"felt", tally.felt},
                     {"limited", tally.limited},
                     {"turned", tally.turned},
                     {"gripped", tally.gripped},
                     {"presses", tally.presses},
                     {"recovered", tally.recovered}},
          .least = {{"least_energy_j", tally.least_energy}},
          .digest = digest};
}

/// Throws std::runtime_error if too little happened in the worlds.
void expect_events(const Tally& tally) {
  if (tally.worlds >= kEnoughToJudge &&
      (tally.felt < tally.worlds * 8 / 10 || tally.limited < tally.worlds * 6 / 10 ||
       tally.turned < tally.worlds / 20 || tally.gripped < tally.worlds / 20 || tally.presses < tally.worlds / 20 ||
       tally.recovered < tally.worlds * 8 / 10)) {
    throw std::runtime_error("too few events in these worlds for a result");
  }
}

/// Rethrows an exception of any thread.
void on_threads(unsigned jobs, const std::function<void()>& work) {
  std::vector<std::exception_ptr> failures(jobs);
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < jobs; ++i) {
      threads.emplace_back([&work, &failure = failures[i]] {
        try {
          work();
        } catch (...) {
          failure = std::current_exception();
        }
      });
    }
  }
  for (const auto& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace

bool explore(const RunOptions& options, std::ostream& out, std::ostream& progress) {
  Exploration exploration(options);
  on_threads(options.jobs, [&] { exploration.work(progress); });
  if (options.progress) progress << "\r\x1b[K";
  const std::vector<Broken> broken = exploration.broken();
  const Tally& tally = exploration.tally();
  for (const Broken& one : broken) tell(one, options.json, out);
  tell(tally, seconds(options.elapsed()), options.json, out);
  if (broken.empty()) expect_events(tally);
  return broken.empty();
}

void explore_units(const Units& seeds, unsigned jobs, std::ostream& out) {
  std::atomic<std::uint64_t> next{0};
  std::mutex mutex;
  Tally tally;
  UnitDigest digest;
  std::vector<Broken> broken;
  on_threads(jobs, [&] {
    for (std::uint64_t i = next++; i < seeds.count; i = next++) {
      const std::uint64_t seed = seeds.first + i;
      const Outcome outcome = run(draw_world(seed));
      const std::scoped_lock lock(mutex);
      tally.add(outcome);
      digest.add(seed, whole(outcome));
      if (outcome.breach) broken.push_back({seed, *outcome.breach});
    }
  });
  std::ranges::sort(broken, {}, &Broken::seed);
  for (const Broken& one : broken) tell(one, true, out);
  out << end_of(seeds, tally, broken.size(), digest).line() << '\n';
}

bool judge(std::istream& lines, std::ostream& out) {
  const ShardEnd end = read_to_end(lines, [&out](const std::string& line) {
    if (!line.starts_with(R"({"kind":"broken",)"))
      throw std::invalid_argument("expected a world with a violation, or the end");
    out << line << '\n';
  });
  const Tally tally{.worlds = end.total("worlds"),
                    .steps = end.total("haptic_steps"),
                    .datagrams = end.total("datagrams"),
                    .felt = end.total("felt"),
                    .limited = end.total("limited"),
                    .turned = end.total("turned"),
                    .gripped = end.total("gripped"),
                    .presses = end.total("presses"),
                    .recovered = end.total("recovered"),
                    .least_energy = end.least_of("least_energy_j")};
  out << tally.worlds << " worlds of " << seconds(DrawnWorld::kLength) << " s, seeds " << end.units.first << " to "
      << end.units.first + end.units.count - 1 << "; digest " << end.digest.text() << '\n';
  write_events(tally, out);
  if (end.total("broken") > 0) {
    out << end.total("broken") << " violated a guarantee: tendon-worlds run --seed N --verbose\n";
    return false;
  }
  expect_events(tally);
  out << "no violation\n";
  return true;
}

bool run_one(std::uint64_t seed, bool verbose, std::ostream& out) {
  const DrawnWorld world = draw_world(seed);
  if (verbose) out << describe(world) << '\n';
  const Outcome outcome = run(world);
  if (verbose) {
    const Network::Counts& counts = outcome.network;
    out << "  " << outcome.steps << " haptic steps; network: " << counts.sent << " sent, " << counts.copies
        << " copies, " << counts.delivered << " delivered, " << counts.lost << " lost, " << counts.nowhere
        << " to unknown addresses; least energy " << outcome.least_energy << " J\n";
  }
  if (outcome.breach) {
    tell(Broken{seed, *outcome.breach}, false, out);
  } else {
    out << "seed " << seed << ": no violation\n";
  }
  return !outcome.breach;
}

std::vector<std::uint64_t> read_seeds(const std::filesystem::path& file) {
  std::ifstream in = open_regular_file(file, "seeds");
  std::vector<std::uint64_t> seeds;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    std::uint64_t seed = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), seed);
    if (error != std::errc() || (end != line.data() + line.size() && *end != ' ')) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) +
                               ": expected a seed and a reason, or a comment");
    }
    seeds.push_back(seed);
  }
  return seeds;
}

}  // namespace tendon::simulation
