// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/selftest.h"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "tests/support/json_line.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/selftest/evidence.h"
#include "tests/tools/injector/selftest/groups.h"
#include "tests/tools/injector/selftest/traffic.h"

namespace tendon::injector {
namespace {

constexpr std::size_t kFewest = 1000;  // datagrams; the checks need at least this number

struct Histogram {
  std::filesystem::path file;
  Cdf law;
};

std::vector<Histogram> histograms_in(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) throw std::runtime_error(folder.string() + ": expected a folder");
  std::vector<Histogram> found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".csv") continue;
    if (auto law = histogram_law(entry.path())) found.push_back({entry.path(), std::move(*law)});
  }
  if (found.empty()) throw std::runtime_error("no histogram in " + folder.string());
  std::ranges::sort(found, {}, &Histogram::file);
  return found;
}

Check measured(const Histogram& histogram, const SelftestOptions& options) {
  const Profile profile = parse_profile("order=free delay=histogram(" + histogram.file.string() + ")");
  return kolmogorov("delay=histogram(" + histogram.file.filename().string() + ")", "Kolmogorov",
                    delays(profile, {}, options), histogram.law);
}

std::string json_line(const Check& check) {
  return JsonLine()
             .add("model", check.model)
             .add("statistic", check.statistic)
             .add("value", check.value)
             .add("bound", check.bound)
             .add("passed", check.passed())
             .str() +
         "\n";
}

std::string text_line(const Check& check, bool same_model) {
  std::ostringstream out;
  if (!same_model) out << check.model << "\n";
  out << "  " << std::left << std::setw(50) << check.statistic << std::right << std::setprecision(4) << std::setw(12)
      << check.value << " <= " << std::left << std::setw(12) << check.bound << (check.passed() ? "PASS" : "FAIL")
      << "\n";
  return out.str();
}

}  // namespace

std::optional<Cdf> histogram_law(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<double> edges;
  std::vector<double> below = {0};
  for (std::string line; std::getline(file, line);) {
    line = line.substr(0, line.find('#'));
    std::ranges::replace_if(
        line, [](char c) { return c == ',' || c == ';' || c == '\t' || c == '\r'; }, ' ');
    if (line.find_first_not_of(' ') == std::string::npos) continue;
    std::istringstream fields(line);
    double edge = 0;
    double weight = 0;
    std::string more;
    if (!(fields >> edge >> weight) || fields >> more) return std::nullopt;
    if (weight < 0 || (!edges.empty() && edge * kMs <= edges.back())) return std::nullopt;
    edges.push_back(edge * kMs);
    below.push_back(below.back() + weight);
  }
  if (edges.size() < 2 || below.back() <= 0) return std::nullopt;
  edges.push_back(2 * edges.back() - edges[edges.size() - 2]);
  for (auto& share : below) share /= below.back();
  return [edges, below](double x) {
    const auto above = std::ranges::upper_bound(edges, x);
    if (above == edges.begin()) return 0.0;
    if (above == edges.end()) return 1.0;
    const auto i = static_cast<std::size_t>(above - edges.begin() - 1);
    return below[i] + (below[i + 1] - below[i]) * (x - edges[i]) / (edges[i + 1] - edges[i]);
  };
}

bool selftest(const SelftestOptions& options, std::ostream& out) {
  if (options.count < kFewest) {
    throw std::invalid_argument("--count is " + std::to_string(options.count) + ", expected at least " +
                                std::to_string(kFewest));
  }
  const auto measured_histograms = options.data ? histograms_in(*options.data) : std::vector<Histogram>{};
  std::size_t failed = 0;
  std::size_t made = 0;
  std::string model;
  const auto write = [&](const std::vector<Check>& checks) {
    for (const Check& check : checks) {
      out << (options.json ? json_line(check) : text_line(check, check.model == model)) << std::flush;
      model = check.model;
      ++made;
      failed += check.passed() ? 0U : 1U;
    }
  };
  for (const auto group : {all_delays, memory, first_datagrams, independence, all_losses, separation, regimes, order,
                           copies_and_damage, bottleneck, events}) {
    write(group(options));
  }
  for (const Histogram& histogram : measured_histograms) write({measured(histogram, options)});
  if (options.json) {
    out << JsonLine()
               .add("checks", made)
               .add("failed", failed)
               .add("count", options.count)
               .add("seed", options.seed)
               .str()
        << "\n";
  } else {
    out << made << " checks of " << options.count << " datagrams each, seed " << options.seed << ": "
        << (failed == 0 ? "all passed" : std::to_string(failed) + " FAILED") << "\n";
  }
  return failed == 0;
}

}  // namespace tendon::injector
