// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/replay.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <utility>
#include <variant>

#include "core/control/limiter.h"
#include "server/recording/recording_reader.h"
#include "server/scene/scene.h"
#include "tests/support/files.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/pictures/plot.h"
#include "tests/tools/lab/pictures/table.h"
#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"
#include "tests/tools/replay/rerun.h"

namespace tendon::replay {

namespace {

/// What may stand in the way of reading a recording as one run.
struct Gaps {
  std::uint64_t lost_steps = 0;
  std::uint64_t lost_datagrams = 0;
  bool truncated = false;
};

HapticController::Config control_of(const SceneRecord& scene, const Options& options) {
  const auto parse = [&](const std::vector<std::string>& settings) {
    return parse_scene(scene.text, "the recorded scene", options.files, settings).loop.control;
  };
  const HapticController::Config recorded = parse({});
  std::vector<std::string> settings;
  if (options.law) settings = limiter_settings(*options.law, recorded);
  settings.insert(settings.end(), options.settings.begin(), options.settings.end());
  return settings.empty() ? recorded : parse(settings);
}

/// Reads the parts of the recording once; `visit` has every step, as it was and as it is again. The first record of
/// each part is the scene; that of the first part is run.
template <class Visit, class VisitDatagram>
Gaps read_run(const Options& options, Rerun::Held held, const Visit& visit, const VisitDatagram& visit_datagram) {
  Gaps gaps;
  std::optional<Rerun> rerun;
  const auto read_part = [&](const std::filesystem::path& file) {
    RecordingReader reader(file);
    while (const auto record = reader.next()) {
      const auto* scene = std::get_if<SceneRecord>(&*record);
      if (scene != nullptr && !rerun) rerun.emplace(control_of(*scene, options), held);
      if (const auto* loss = std::get_if<LossRecord>(&*record)) {
        gaps.lost_steps += loss->steps;
        gaps.lost_datagrams += loss->datagrams;
      }
      if (const auto* datagram = std::get_if<DatagramRecord>(&*record)) visit_datagram(*datagram);
      if (const auto* port = std::get_if<PortRecord>(&*record)) rerun->settled(*port);
      if (const auto* step = std::get_if<StepRecord>(&*record)) visit(*step, rerun->step(*step));
    }
    gaps.truncated = gaps.truncated || reader.truncated();
  };
  read_part(options.recording);
  for (const std::filesystem::path& part : options.more_parts) read_part(part);
  return gaps;
}

/// Bit for bit, as far as that can be said.
struct Comparison {
  std::uint64_t steps = 0;
  std::uint64_t same = 0;
  std::uint64_t next_tick = 1;  ///< the server's first step has the number 1
  std::optional<std::uint64_t> gap_before = {};
  std::optional<std::uint64_t> differs_at = {};
  std::string how = {};

  void observe(const StepRecord& recorded, const StepRecord& again) {
    ++steps;
    if (recorded.tick != next_tick && !gap_before) gap_before = recorded.tick;
    next_tick = recorded.tick + 1;
    if (gap_before || differs_at) return;
    how = difference(recorded, again);
    if (how.empty()) {
      ++same;
    } else {
      differs_at = recorded.tick;
    }
  }
  bool held() const { return same > 0 && !differs_at; }

  std::string text() const {
    std::string text = std::to_string(same) + " of " + std::to_string(steps) + " steps are the same bit for bit";
    if (differs_at) text += "\nthe first that differs is step " + std::to_string(*differs_at) + ": " + how;
    if (gap_before) {
      text += "\nthere is a gap before step " + std::to_string(*gap_before) +
              ": what the law had learned in it is not known, so nothing after it was compared";
    }
    return text + "\n";
  }
  std::string json() const {
    return JsonLine()
        .add("steps", steps)
        .add("same", same)
        .add("gap_before_step", gap_before)
        .add("differs_at_step", differs_at)
        .add("difference", how)
        .str();
  }
};

/// A row for each step; what is not a number is left empty.
class Csv {
 public:
  explicit Csv(const std::filesystem::path& path) : path_(path) {
    expect_replaceable(path, {"t_s,step,"});
    file_.open(path);
    line_ =
        "t_s,step,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s,wanted_x_n,wanted_y_n,wanted_z_n,"
        "recorded_applied_x_n,recorded_applied_y_n,recorded_applied_z_n,recorded_permitted_n,recorded_energy_j,"
        "recorded_reasons,again_force_x_n,again_force_y_n,again_force_z_n,again_permitted_n,again_energy_j,again_"
        "reasons";
    end_row();
  }

  void observe(const StepRecord& recorded, const StepRecord& again) {
    if (!std::exchange(started_, true)) start_ = recorded.hand.at;
    put(seconds(recorded.hand.at - start_));
    line_ += ',' + std::to_string(recorded.tick);
    for (const Vec3& vector : {recorded.hand.position, recorded.hand.velocity, recorded.wanted, recorded.applied}) {
      for (const double component : vector) put(component);
    }
    put(recorded.permitted);
    put(recorded.energy);
    line_ += ",\"" + to_string(recorded.reasons) + '"';
    for (const double component : again.force) put(component);
    put(again.permitted);
    put(again.energy);
    line_ += ",\"" + to_string(again.reasons) + '"';
    end_row();
  }

  void close() {
    file_.close();
    check();
  }

 private:
  void put(double value) {
    if (!line_.empty()) line_ += ',';
    if (!std::isfinite(value)) return;
    std::array<char, 32> text{};
    line_.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
  }
  void end_row() {
    file_ << line_ << '\n';
    check();
    line_.clear();
  }
  void check() const {
    if (!file_) throw std::runtime_error("cannot write " + path_.string());
  }

  std::filesystem::path path_;
  std::ofstream file_;
  std::string line_;
  LocalTime start_{};
  bool started_ = false;
};

/// A line on a terminal that is written over, and gone at the end.
class Progress {
 public:
  explicit Progress(bool on) : on_(on) {}
  ~Progress() {
    if (shown_) std::cerr << "\r\033[K";
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void observe(std::uint64_t steps) {
    if (!on_ || steps % 65'536 != 0) return;
    std::cerr << "\r\033[K" << steps << " steps replayed" << std::flush;
    shown_ = true;
  }

 private:
  bool on_;
  bool shown_ = false;
};

lab::Run run_of(const std::string& label, const Options& options, const lab::RunObserver& observer, const Gaps& gaps) {
  return {.label = label,
          .recording = options.recording.filename().string(),
          .summary = observer.summary(),
          .truncated = gaps.truncated,
          .lost_steps = gaps.lost_steps,
          .lost_datagrams = gaps.lost_datagrams};
}

/// A second look at the recording: what is drawn depends on what it comes down to.
void draw_both(const Options& options, Rerun::Held held, const std::array<lab::Run, 2>& runs) {
  std::vector<lab::Drawing> drawings;
  for (const lab::Run& run : runs) {
    drawings.push_back({run.label, run.summary,
                        lab::Trace({.start = run.summary.start,
                                    .span = std::max(run.summary.span, Duration(1)),
                                    .columns = lab::trace_columns(runs.size()),
                                    .axis = run.summary.axis})});
  }
  read_run(
      options, held,
      [&](const StepRecord& recorded, const StepRecord& again) {
        drawings[0].trace.observe(recorded);
        drawings[1].trace.observe(again);
      },
      [](const DatagramRecord&) {});
  lab::draw(*options.picture, drawings);
}

}  // namespace

bool replay(const Options& options, std::ostream& out) {
  if (options.picture) lab::check_picture(*options.picture, 2);
  const bool same_law = !options.law && options.settings.empty();
  const auto held = same_law ? Rerun::Held::kRecorded : Rerun::Held::kOwn;

  Comparison comparison;
  lab::RunObserver recorded_run;
  lab::RunObserver again_run;
  std::optional<Csv> csv;
  if (options.csv) csv.emplace(*options.csv);
  Gaps gaps;
  {
    Progress progress(options.progress);
    std::uint64_t steps = 0;
    const auto visit = [&](const StepRecord& recorded, const StepRecord& again) {
      progress.observe(++steps);
      recorded_run.observe(recorded);
      again_run.observe(again);
      if (same_law) comparison.observe(recorded, again);
      if (csv) csv->observe(recorded, again);
    };
    gaps = read_run(options, held, visit, [&](const DatagramRecord& datagram) {  // both had the same network
      recorded_run.observe(datagram);
      again_run.observe(datagram);
    });
  }
  if (csv) csv->close();

  const std::array<lab::Run, 2> runs = {
      run_of("recorded", options, recorded_run, gaps),
      run_of(same_law ? "again" : options.law.value_or("with settings"), options, again_run, gaps)};
  if (runs[0].summary.steps == 0) throw std::runtime_error(options.recording.string() + ": holds no haptic step");
  if (options.json) {
    if (same_law) out << comparison.json() << "\n";
    for (const lab::Run& run : runs) out << lab::to_json(run) << "\n";
  } else {
    out << lab::to_table(runs);
    out << "\n"
        << (same_law ? comparison.text()
                     : "the hand moved as it was recorded; with other forces it would have moved otherwise\n");
  }
  if (!out.flush()) throw std::runtime_error("cannot write the report: is the disk full?");

  if (options.picture) {
    draw_both(options, held, runs);
    if (!options.json) out << "\npicture: " << options.picture->string() << "\n";
  }
  return !same_law || comparison.held();
}

}  // namespace tendon::replay
