// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/pair_report.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>

#include "server/machine/regular_file.h"
#include "server/recording/mcap_reader.h"
#include "server/recording/recording_codec.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"
#include "tests/tools/lab/pictures/table.h"
#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"

namespace tendon::lab {
namespace {

constexpr std::size_t kMostPairs = 2;
constexpr const char* kTime = "time, s";

/// Returns the axis of the base frame with the widest range of motion.
template <class Steps>
Eigen::Index main_axis(const Steps& steps) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Vec3 least = Vec3::Constant(kFar);
  Vec3 most = Vec3::Constant(-kFar);
  for (const auto& step : steps) {
    if (!step.seen) continue;
    least = least.cwiseMin(step.position);
    most = most.cwiseMax(step.position);
  }
  Eigen::Index axis = 0;
  (most - least).maxCoeff(&axis);
  return axis;
}

template <class Steps, class Ports>
std::vector<double> ledger(const Steps& steps, const Ports& ports) {
  std::vector<double> values;
  double settled = 0;
  auto next = ports.begin();
  for (const auto& step : steps) {
    for (; next != ports.end() && next->tick < step.tick; ++next) settled += next->net;
    values.push_back(step.account - settled);
  }
  return values;
}

PairRun read_pair(const std::filesystem::path& path) {
  McapReader reader(std::make_unique<std::ifstream>(open_regular_file(path, "recording")), path.string());
  PairObserver observer;
  SolverPaths ways;
  bool merged = false;
  while (const auto message = reader.next()) {
    std::string topic = message->channel.topic;
    const LocalTime at{Duration(static_cast<Duration::rep>(message->log_time))};
    const bool leads = topic.starts_with("/leader/");
    const auto which = leads ? PairObserver::Which::kLeader : PairObserver::Which::kFollower;
    try {
      if (topic == recording::kClock.topic) {
        merged = true;
      } else if (leads || topic.starts_with("/follower/")) {
        topic.erase(0, topic.find('/', 1));
        if (topic == recording::kStep.topic) observer.observe(which, recording::decode_step(message->data, at, ways));
        if (topic == recording::kPort.topic) observer.observe(which, recording::decode_port(message->data, at));
      }
    } catch (const std::invalid_argument& error) {
      reader.corrupt(message->offset, error.what());
    }
  }
  if (const auto damage = reader.damage(); !damage.empty()) {
    throw std::runtime_error(damage.front() + "; the ledger of a pair requires all records");
  }
  if (!merged) {
    throw std::runtime_error(path.string() + ": expected a file from `tendon-replay --merge`");
  }
  PairRun run = observer.run();
  run.recording = path.filename().string();
  return run;
}

std::string sentence(const PairRun& run) {
  if (run.least_pair < -kPromise) {
    return run.label + ": the pair gave out " + with_unit(-run.least_pair, "J") + " that was never put in.";
  }
  return run.label + ": the pair gave out no energy that was never put in; its least value is " +
         with_unit(std::max(run.least_pair, 0.0), "J") + ".";
}

constexpr std::size_t kName = 46;
constexpr std::size_t kCell = 26;

double largest(const PairRun::Line& line) {
  double most = 0;
  for (const auto& [time, value] : line) most = std::max(most, std::abs(value));
  return most;
}

void write_table(const std::vector<PairRun>& runs, std::ostream& out) {
  const auto row = [&](const std::string& name, auto cell) {
    out << padded(name, kName);
    for (const PairRun& run : runs) out << padded(cell(run), kCell);
    out << "\n";
  };
  row("", [](const PairRun& run) { return run.label; });
  row("both ends, merged", [](const PairRun& run) { return run.recording; });
  row("least value of the pair (sum of both ledgers)",
      [](const PairRun& run) { return with_unit(run.least_pair, "J"); });
  row("least account, leader and follower", [](const PairRun& run) {
    return with_unit(run.leader.least_account, "J") + ", " + with_unit(run.follower.least_account, "J");
  });
  row("largest force, leader and follower", [](const PairRun& run) {
    return with_unit(run.leader.largest_force, "N") + ", " + with_unit(run.follower.largest_force, "N");
  });
  row("largest contact of the follower", [](const PairRun& run) {
    return run.contact.empty() ? std::string("not measured") : with_unit(largest(run.contact), "N");
  });
  out << "\n";
  for (const PairRun& run : runs) out << sentence(run) << "\n";
}

std::string to_json(const PairRun& run) {
  return JsonLine()
      .add("label", run.label)
      .add("recording", run.recording)
      .add("least_pair_j", run.least_pair)
      .add("least_account_leader_j", run.leader.least_account)
      .add("least_account_follower_j", run.follower.least_account)
      .add("largest_force_leader_n", run.leader.largest_force)
      .add("largest_force_follower_n", run.follower.largest_force)
      .str();
}

Curve curve(const std::string& name, const char* colour, const PairRun::Line& line, double per_si,
            Curve::Style style = Curve::Style::kLine) {
  Curve made{.name = name, .colour = colour, .style = style};
  made.points.reserve(line.size());
  for (const auto& [time, value] : line) made.points.emplace_back(time, value * per_si);
  return made;
}

/// Sets the same range for all panels of a row. If one would be illegible, each panel has its own range and a note.
void share_range(std::span<Panel> row) {
  constexpr double kOwnScaleBeyond = 8;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<Extremes> ranges(row.size());
  Extremes all;
  for (std::size_t i = 0; i < row.size(); ++i) {
    for (const Curve& one : row[i].curves) {
      for (const auto& [time, value] : one.points) ranges[i].observe(value);
    }
    all.observe(ranges[i]);
  }
  double smallest = kFar;
  for (const Extremes& range : ranges) smallest = std::min(smallest, range.most - range.least);
  const double size = all.most - all.least;
  if (!(size > 0)) return;
  for (Panel& panel : row) {
    if (size > kOwnScaleBeyond * smallest) {
      panel.title += " (separate scale)";
    } else {
      panel.y_range = {all.least - 0.05 * size, all.most + 0.05 * size};
    }
  }
}

std::vector<Panel> panels_of(const std::vector<PairRun>& runs) {
  std::vector<Panel> panels;
  const auto row = [&](auto make) {
    for (const PairRun& run : runs) {
      Panel panel = make(run);
      panel.title = run.label + ": " + panel.title;
      const double end = run.pair.back().first;
      panel.x_range = {0, std::ceil(end * 100) / 100};
      panel.curves.insert(panel.curves.begin(), {.name = "", .colour = kPale, .points = {{0, 0}, {end, 0}}});
      panels.push_back(std::move(panel));
    }
  };
  row([](const PairRun& run) {
    return Panel{.title = "where both ends are, mm",
                 .x_label = kTime,
                 .curves = {curve("leader", kBlue, run.leader.position, 1e3),
                            curve("follower", kOrange, run.follower.position, 1e3)}};
  });
  row([](const PairRun& run) {
    return Panel{.title = "force along that axis, N",
                 .x_label = kTime,
                 .curves = {curve("felt at the leader", kBlue, run.felt, 1),
                            curve("contact of the follower", kOrange, run.contact, 1)}};
  });
  row([](const PairRun& run) {
    const bool large = std::max({largest(run.pair), largest(run.leader.account), largest(run.follower.account)}) >= 1;
    const double per_si = large ? 1 : 1e3;
    return Panel{.title = std::string("put in and not given back, ") + (large ? "J" : "mJ"),
                 .x_label = kTime,
                 .curves = {curve("account of the leader", kBlue, run.leader.account, per_si),
                            curve("of the follower", kOrange, run.follower.account, per_si),
                            curve("the pair", run.least_pair < -kPromise ? kVermilion : kGreen, run.pair, per_si,
                                  Curve::Style::kBold)}};
  });
  for (const std::size_t shared : {0U, 1U}) share_range(std::span(panels).subspan(shared * runs.size(), runs.size()));
  return panels;
}

}  // namespace

void PairObserver::observe(Which which, const StepRecord& step) {
  ends_[static_cast<std::size_t>(which)].steps.push_back({.at = step.hand.at,
                                                          .tick = step.tick,
                                                          .position = step.hand.position,
                                                          .force = step.applied,
                                                          .account = step.energy,
                                                          .seen = !step.reasons.has(Reason::kUnseen)});
}

void PairObserver::observe(Which which, const PortRecord& port) {
  ends_[static_cast<std::size_t>(which)].ports.push_back({.tick = port.tick,
                                                          .net = port.settled.credit - port.settled.withdraw,
                                                          .at = port.at,
                                                          .contact = port.sent.contact_force});
}

PairRun PairObserver::run() const {
  PairRun run;
  LocalTime start = LocalTime::max();
  for (const Seen& end : ends_) {
    if (end.steps.empty()) throw std::runtime_error("one of the two ends has no haptic steps");
    start = std::min(start, end.steps.front().at);
  }
  const auto time = [&](LocalTime at) { return seconds(at - start); };
  std::array<std::vector<double>, 2> ledgers;
  for (const Which which : {Which::kLeader, Which::kFollower}) {
    const Seen& seen = of(which);
    PairRun::End& end = which == Which::kLeader ? run.leader : run.follower;
    const Eigen::Index axis = main_axis(seen.steps);
    for (const Step& step : seen.steps) {
      if (step.seen) end.position.emplace_back(time(step.at), step.position[axis]);
      end.account.emplace_back(time(step.at), step.account);
      end.least_account = std::min(end.least_account, step.account);
      end.largest_force = std::max(end.largest_force, step.force.norm());
      if (which == Which::kLeader) run.felt.emplace_back(time(step.at), step.force[axis]);
    }
    if (which == Which::kFollower) {
      for (const Port& port : seen.ports) {
        if (port.contact) run.contact.emplace_back(time(port.at), (*port.contact)[axis]);
      }
    }
    ledgers[static_cast<std::size_t>(which)] = ledger(seen.steps, seen.ports);
  }
  // The values are computed at each step of either end, with the newest value of the other end.
  const auto& [leader, follower] = ends_;
  double of_leader = 0;
  double of_follower = 0;
  for (std::size_t i = 0, j = 0; i < leader.steps.size() || j < follower.steps.size();) {
    const bool first =
        j == follower.steps.size() || (i < leader.steps.size() && leader.steps[i].at <= follower.steps[j].at);
    const LocalTime at = first ? leader.steps[i].at : follower.steps[j].at;
    if (first) {
      of_leader = ledgers[0][i++];
    } else {
      of_follower = ledgers[1][j++];
    }
    run.pair.emplace_back(time(at), of_leader + of_follower);
    run.least_pair = std::min(run.least_pair, of_leader + of_follower);
  }
  return run;
}

void report_pairs(const ReportOptions& options, std::ostream& out) {
  check(options);
  if (options.picture && options.recordings.size() > kMostPairs) {
    throw std::invalid_argument("a picture has 1 to 2 pairs, got " + std::to_string(options.recordings.size()));
  }
  if (options.picture) check_picture_name(*options.picture);
  std::vector<PairRun> runs;
  for (std::size_t i = 0; i < options.recordings.size(); ++i) {
    runs.push_back(read_pair(options.recordings[i]));
    runs.back().label = options.labels.empty() ? runs.back().recording : options.labels[i];
  }
  if (options.json) {
    for (const PairRun& run : runs) out << to_json(run) << "\n";
  } else {
    write_table(runs, out);
  }
  if (!out.flush()) throw std::runtime_error("cannot write the report: is the disk full?");
  if (options.picture) {
    std::string figures;
    for (const PairRun& run : runs) figures += (figures.empty() ? "" : "  ") + sentence(run);
    run_gnuplot(panels_script(*options.picture, "Two coupled ends in one clock", figures, panels_of(runs)),
                *options.picture);
    if (!options.json) out << "\npicture: " << options.picture->string() << "\n";
  }
  if (!options.check) return;
  for (const PairRun& run : runs) {
    if (run.least_pair < -kPromise) throw broken_promise(run.recording, "the pair", run.least_pair);
  }
}

}  // namespace tendon::lab
