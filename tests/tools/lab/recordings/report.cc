// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/report.h"

#include <algorithm>
#include <cstddef>
#include <deque>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/recording/recording_reader.h"
#include "tests/tools/lab/pictures/plot.h"
#include "tests/tools/lab/pictures/table.h"
#include "tests/tools/lab/recordings/devices.h"
#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"

namespace tendon::lab {
namespace {

struct Source {
  Run run;
  std::filesystem::path recording;
  std::size_t device = 0;
};

std::vector<Source> read_runs(const std::filesystem::path& recording, std::string& not_examined) {
  const std::vector<std::string> names = device_names(recording);
  const bool several = names.size() > 1;
  std::deque<RunObserver> observers;
  for (std::size_t device = 0; device < names.size(); ++device) observers.emplace_back(several);
  Run common;
  common.recording = recording.filename().string();
  RecordingReader reader(recording, RecordingReader::Devices::kAll);
  while (const auto record = reader.next()) {
    if (const auto* step = std::get_if<StepRecord>(&*record)) observers.at(reader.device()).observe(*step);
    if (const auto* datagram = std::get_if<DatagramRecord>(&*record)) {
      for (RunObserver& observer : observers) observer.observe(*datagram);
    }
    if (const auto* loss = std::get_if<LossRecord>(&*record)) {
      common.lost_steps += loss->steps;
      common.lost_datagrams += loss->datagrams;
    }
  }
  common.truncated = reader.truncated();
  common.damage = reader.damage();
  std::vector<Source> sources;
  for (std::size_t device = 0; device < names.size(); ++device) {
    Run run = common;
    run.summary = observers[device].summary();
    if (several) run.device = names[device];
    if (run.summary.steps == 0) {
      if (several) not_examined += run.recording + ": device " + names[device] + " has no haptic steps: not examined\n";
      continue;
    }
    run.label = run.summary.limiter_on ? "limiter on" : "limiter off";
    sources.push_back({std::move(run), recording, device});
  }
  if (sources.empty()) throw std::runtime_error(reader.without_steps());
  return sources;
}

/// A second pass, because the plot depends on the summary.
Trace read_trace(const Source& source, std::size_t columns) {
  const RunSummary& summary = source.run.summary;
  Trace trace(
      {.start = summary.start, .span = std::max(summary.span, Duration(1)), .columns = columns, .axis = summary.axis});
  RecordingReader reader(source.recording, RecordingReader::Devices::kAll);
  while (const auto record = reader.next()) {
    const auto* step = std::get_if<StepRecord>(&*record);
    if (step != nullptr && reader.device() == source.device) trace.observe(*step);
  }
  return trace;
}

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// Throws if a requested device is in none of the recordings.
void check_devices(const ReportOptions& options) {
  std::vector<std::string> known;
  if (options.devices.empty()) return;
  for (const auto& recording : options.recordings) {
    for (const std::string& name : device_names(recording)) {
      if (std::ranges::find(known, name) == known.end()) known.push_back(name);
    }
  }
  for (const std::string& name : options.devices) {
    if (std::ranges::find(known, name) == known.end())
      throw std::runtime_error("no device has the name " + name + "; expected one of " + list(known));
  }
}

/// Selects up to `most` runs, in order; runs that violated the guarantee take precedence.
std::vector<const Source*> choose(const std::vector<Source>& sources, const ReportOptions& options, std::size_t most) {
  std::vector<const Source*> chosen;
  for (const bool kept : {false, true}) {
    for (const Source& source : sources) {
      const bool asked = options.devices.empty() || source.run.device.empty() ||
                         std::ranges::find(options.devices, source.run.device) != options.devices.end();
      if (asked && source.run.summary.kept_its_promise() == kept && chosen.size() < most) chosen.push_back(&source);
    }
  }
  std::ranges::sort(chosen);
  return chosen;
}

std::string name_of(const Run& run) { return run.recording + (run.device.empty() ? "" : " " + run.device); }

/// Names the omitted runs that violated the guarantee and counts the others.
std::string others(const std::vector<Source>& sources, const std::vector<const Source*>& shown) {
  std::string text;
  std::size_t kept = 0;
  for (const Source& source : sources) {
    if (std::ranges::find(shown, &source) != shown.end()) continue;
    const RunSummary& summary = source.run.summary;
    if (summary.kept_its_promise()) {
      ++kept;
    } else {
      text += name_of(source.run) + ": promise NOT kept, least energy " + with_unit(summary.least_energy, "J") + "\n";
    }
  }
  if (shown.size() == sources.size()) return text;
  return "Columns for " + std::to_string(shown.size()) + " of " + std::to_string(sources.size()) +
         " devices (use --device NAME for another, --json for all). " + std::to_string(kept) +
         " of the others kept the " + "promise.\n" + text;
}

}  // namespace

void check(const ReportOptions& options) {
  if (options.recordings.empty()) throw std::invalid_argument("expected one recording or more");
  if (!options.labels.empty() && options.labels.size() != options.recordings.size())
    throw std::invalid_argument("expected one label for each recording, got " + std::to_string(options.labels.size()) +
                                " for " + std::to_string(options.recordings.size()));
}

std::runtime_error broken_promise(const std::string& recording, const std::string& account, double least) {
  return std::runtime_error(recording + ": " + account + " fell to " + with_unit(least, "J") + ", expected " +
                            with_unit(-kPromise, "J") + " or more");
}

void report(const ReportOptions& options, std::ostream& out) {
  check(options);
  if (options.picture) check_picture(*options.picture, options.recordings.size());
  check_devices(options);

  std::vector<Source> sources;
  std::string not_examined;
  for (std::size_t i = 0; i < options.recordings.size(); ++i) {
    for (Source& source : read_runs(options.recordings[i], not_examined)) {
      if (!options.labels.empty()) source.run.label = options.labels[i];
      sources.push_back(std::move(source));
    }
  }
  if (options.json) {
    for (const Source* source : choose(sources, options, sources.size())) out << to_json(source->run) << "\n";
  } else {
    const std::vector<const Source*> shown = choose(sources, options, kMostColumns);
    std::vector<Run> runs;
    for (const Source* source : shown) runs.push_back(source->run);
    out << to_table(runs);
    if (const std::string more = others(sources, shown) + not_examined; !more.empty()) out << "\n" << more;
  }
  if (!out.flush()) throw std::runtime_error("cannot write the report: is the disk full?");

  if (options.picture) {
    const std::vector<const Source*> shown = choose(sources, options, kMostDrawings);
    std::vector<Drawing> drawings;
    for (const Source* source : shown) {
      const Run& run = source->run;
      drawings.push_back({run.device.empty() ? run.label : run.label + ", " + run.device, run.summary,
                          read_trace(*source, trace_columns(shown.size()))});
    }
    draw(*options.picture, drawings);
    if (!options.json) {
      out << "\npicture: " << options.picture->string();
      if (shown.size() < sources.size())
        out << ", of " << shown.size() << " of " << sources.size() << " devices (--device NAME for others)";
      out << "\n";
    }
  }
  if (!options.check) return;
  for (const Source& source : sources) {
    const Run& run = source.run;
    if (run.summary.kept_its_promise()) continue;
    throw broken_promise(run.recording, run.device.empty() ? "the ledger" : "the ledger of " + run.device,
                         run.summary.least_energy);
  }
}

}  // namespace tendon::lab
