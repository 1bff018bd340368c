// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/report.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <variant>

#include "server/recording/recording_reader.h"
#include "tests/tools/lab/pictures/plot.h"
#include "tests/tools/lab/pictures/table.h"
#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"

namespace tendon::lab {
namespace {

Run read_run(const std::filesystem::path& recording) {
  Run run;
  run.recording = recording.filename().string();
  RunObserver observer;
  RecordingReader reader(recording);
  while (const auto record = reader.next()) {
    if (const auto* step = std::get_if<StepRecord>(&*record)) observer.observe(*step);
    if (const auto* datagram = std::get_if<DatagramRecord>(&*record)) observer.observe(*datagram);
    if (const auto* loss = std::get_if<LossRecord>(&*record)) {
      run.lost_steps += loss->steps;
      run.lost_datagrams += loss->datagrams;
    }
  }
  run.truncated = reader.truncated();
  run.summary = observer.summary();
  if (run.summary.steps == 0) throw std::runtime_error(recording.string() + ": holds no haptic step");
  run.label = run.summary.limiter_on ? "limiter on" : "limiter off";
  return run;
}

/// A second look at the recording: what is drawn depends on what it comes down to.
Trace read_trace(const std::filesystem::path& recording, const RunSummary& summary, std::size_t columns) {
  Trace trace(
      {.start = summary.start, .span = std::max(summary.span, Duration(1)), .columns = columns, .axis = summary.axis});
  RecordingReader reader(recording);
  while (const auto record = reader.next()) {
    if (const auto* step = std::get_if<StepRecord>(&*record)) trace.observe(*step);
  }
  return trace;
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

  std::vector<Run> runs;
  for (std::size_t i = 0; i < options.recordings.size(); ++i) {
    runs.push_back(read_run(options.recordings[i]));
    if (!options.labels.empty()) runs.back().label = options.labels[i];
  }
  if (options.json) {
    for (const Run& run : runs) out << to_json(run) << "\n";
  } else {
    out << to_table(runs);
  }
  if (!out.flush()) throw std::runtime_error("cannot write the report: is the disk full?");

  if (options.picture) {
    std::vector<Drawing> drawings;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      drawings.push_back({runs[i].label, runs[i].summary,
                          read_trace(options.recordings[i], runs[i].summary, trace_columns(runs.size()))});
    }
    draw(*options.picture, drawings);
    if (!options.json) out << "\npicture: " << options.picture->string() << "\n";
  }
  if (!options.check) return;
  for (const Run& run : runs) {
    if (!run.summary.kept_its_promise()) throw broken_promise(run.recording, "the ledger", run.summary.least_energy);
  }
}

}  // namespace tendon::lab
