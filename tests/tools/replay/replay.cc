// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/replay.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "core/control/limiter.h"
#include "server/recording/recording_reader.h"
#include "server/scene/scene.h"
#include "tests/support/files.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/pictures/plot.h"
#include "tests/tools/lab/pictures/table.h"
#include "tests/tools/lab/recordings/devices.h"
#include "tests/tools/lab/recordings/report.h"
#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"
#include "tests/tools/replay/field_rerun.h"
#include "tests/tools/replay/rerun.h"

namespace tendon::replay {

namespace {

constexpr std::size_t kMostDrawn = lab::kMostDrawings / 2;

struct Gaps {
  std::uint64_t lost_steps = 0;
  std::uint64_t lost_datagrams = 0;
  bool truncated = false;
  std::vector<std::string> damage = {};
  std::string without_steps = {};  ///< the error message if there are no steps
};

HapticController::Config control_of(const SceneRecord& scene, const Options& options) {
  const auto parse = [&](const std::vector<std::string>& settings) {
    return parse_scene(scene.text, "the recorded scene", options.files, settings).loop.control;
  };
  HapticController::Config recorded;
  try {
    recorded = parse({});
  } catch (const SceneError& error) {  // An error of the file, not of the command line.
    throw std::runtime_error(options.recording.string() + ": " + error.what());
  }
  std::vector<std::string> settings;
  if (options.law) settings = limiter_settings(*options.law, recorded);
  settings.insert(settings.end(), options.settings.begin(), options.settings.end());
  return settings.empty() ? recorded : parse(settings);
}

struct Chosen {
  std::vector<std::string> names;
  std::vector<bool> is_chosen;

  std::size_t count() const { return static_cast<std::size_t>(std::ranges::count(is_chosen, true)); }
  bool several() const { return names.size() > 1; }
  std::string list() const {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  }
};

Chosen choose(const Options& options) {
  Chosen chosen{.names = lab::device_names(options.recording), .is_chosen = {}};
  for (const std::string& name : chosen.names) chosen.is_chosen.push_back(!options.device || name == *options.device);
  if (chosen.count() == 0) {
    throw std::runtime_error(options.recording.string() + ": no device " + *options.device + "; expected one of " +
                             chosen.list());
  }
  const auto expect_at_most = [&chosen](std::size_t most, bool asked, const char* what) {
    if (asked && chosen.count() > most) {
      throw std::invalid_argument(std::string(what) + " can only contain " + std::to_string(most) +
                                  (most == 1 ? " device" : " devices") + ": select one with --device from " +
                                  chosen.list());
    }
  };
  expect_at_most(1, options.csv.has_value(), "--csv");
  expect_at_most(kMostDrawn, options.picture.has_value(), "--out");
  return chosen;
}

/// Reads the parts of the recording. Calls `visit` with the number of the device, the recorded step and the replayed
/// step for each selected device. The scenes are copied to the beginning of each part. Only the first copy is used.
template <class Visit, class VisitDatagram>
Gaps read_run(const Options& options, const Chosen& chosen, Rerun::Held held, const Visit& visit,
              const VisitDatagram& visit_datagram) {
  Gaps gaps;
  std::vector<std::optional<Rerun>> reruns(chosen.names.size());
  std::vector<std::optional<FieldRerun>> fields(chosen.names.size());
  const auto read_part = [&](const std::filesystem::path& file) {
    RecordingReader reader(file, RecordingReader::Devices::kAll);
    while (const auto record = reader.next()) {
      if (const auto* loss = std::get_if<LossRecord>(&*record)) {
        gaps.lost_steps += loss->steps;
        gaps.lost_datagrams += loss->datagrams;
      }
      if (const auto* datagram = std::get_if<DatagramRecord>(&*record)) visit_datagram(*datagram);
      const std::size_t device = reader.device();
      if (device >= reruns.size())
        throw std::runtime_error(file.string() + ": is not a part of " + options.recording.string());
      if (!chosen.is_chosen[device]) continue;
      std::optional<Rerun>& rerun = reruns[device];
      const auto* scene = std::get_if<SceneRecord>(&*record);
      const auto* port = std::get_if<PortRecord>(&*record);
      const auto* step = std::get_if<StepRecord>(&*record);
      if (scene != nullptr && !rerun) {
        const HapticController::Config control = control_of(*scene, options);
        rerun.emplace(control, held);
        if (options.fields) fields[device].emplace(control);
      }
      if ((port != nullptr || step != nullptr) && !rerun)
        throw std::runtime_error(file.string() + ": the scene is missing, so the law of the run is unknown");
      if (port != nullptr) rerun->settled(*port);
      if (fields[device]) {
        if (const auto* data = std::get_if<FieldData>(&*record)) fields[device]->take(*data);
        if (const auto* input = std::get_if<FieldInput>(&*record)) fields[device]->take(*input);
      }
      if (step == nullptr) continue;
      StepRecord again = rerun->step(*step);
      if (fields[device]) again.field = fields[device]->step(*step);
      visit(device, *step, again);
    }
    gaps.truncated = gaps.truncated || reader.truncated();
    if (gaps.without_steps.empty()) gaps.without_steps = reader.without_steps();
    for (std::string& sentence : reader.damage()) gaps.damage.push_back(std::move(sentence));
  };
  read_part(options.recording);
  for (const std::filesystem::path& part : options.more_parts) read_part(part);
  return gaps;
}

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
    std::string text = std::to_string(same) + " of " + std::to_string(steps) + " steps are identical";
    if (differs_at) text += "\nthe first difference is in step " + std::to_string(*differs_at) + ": " + how;
    if (gap_before) {
      text += "\ngap before step " + std::to_string(*gap_before) +
              ": the state of the law after it is unknown, so later steps were not compared";
    }
    return text + "\n";
  }
  std::string json(const std::optional<std::string>& device) const {
    JsonLine line;
    if (device) line.add("device", *device);
    return line.add("steps", steps)
        .add("same", same)
        .add("gap_before_step", gap_before)
        .add("differs_at_step", differs_at)
        .add("difference", how)
        .str();
  }
};

/// A row for each step. NaN becomes an empty field.
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

struct Both {
  explicit Both(bool of_several) : recorded(of_several), again(of_several) {}

  lab::RunObserver recorded;
  lab::RunObserver again;
  Comparison comparison;
  std::array<lab::Run, 2> runs;
};

lab::Run run_of(const std::string& label, const Options& options, const lab::RunObserver& observer, const Gaps& gaps) {
  return {.label = label,
          .recording = options.recording.filename().string(),
          .device = {},
          .summary = observer.summary(),
          .truncated = gaps.truncated,
          .lost_steps = gaps.lost_steps,
          .lost_datagrams = gaps.lost_datagrams,
          .damage = gaps.damage};
}

/// Reads the recording a second time, because the drawings depend on the summary.
void draw_all(const Options& options, const Chosen& chosen, Rerun::Held held, const std::deque<Both>& devices) {
  std::vector<lab::Drawing> drawings;
  std::vector<std::size_t> first(devices.size());
  for (std::size_t device = 0; device < devices.size(); ++device) {
    first[device] = drawings.size();
    if (!chosen.is_chosen[device]) continue;
    for (const lab::Run& run : devices[device].runs) {
      drawings.push_back({run.device.empty() ? run.label : run.label + ", " + run.device, run.summary,
                          lab::Trace({.start = run.summary.start,
                                      .span = std::max(run.summary.span, Duration(1)),
                                      .columns = lab::trace_columns(2 * chosen.count()),
                                      .axis = run.summary.axis})});
    }
  }
  read_run(
      options, chosen, held,
      [&](std::size_t device, const StepRecord& recorded, const StepRecord& again) {
        drawings[first[device]].trace.observe(recorded);
        drawings[first[device] + 1].trace.observe(again);
      },
      [](const DatagramRecord&) {});
  lab::draw(*options.picture, drawings);
}

/// Selects up to `most` devices in their order, preferring devices that differ.
std::vector<std::size_t> with_columns(const std::deque<Both>& devices, const std::vector<std::size_t>& examined) {
  std::vector<std::size_t> shown;
  for (const bool held : {false, true}) {
    for (const std::size_t device : examined) {
      if (devices[device].comparison.held() == held && shown.size() < lab::kMostColumns / 2) shown.push_back(device);
    }
  }
  std::ranges::sort(shown);
  return shown;
}

/// Describes each device if there are only a few. Otherwise describes the devices that differ and counts the others.
std::string comparisons(const std::deque<Both>& devices, const Chosen& chosen,
                        const std::vector<std::size_t>& examined) {
  const bool each = examined.size() <= lab::kMostColumns / 2;
  std::string text;
  std::size_t same_devices = 0;
  Comparison same;
  for (const std::size_t device : examined) {
    const Comparison& one = devices[device].comparison;
    if (each || !one.held() || one.gap_before) {
      text += (chosen.several() ? chosen.names[device] + ": " : "") + one.text();
    } else {
      ++same_devices;
      same.steps += one.steps;
      same.same += one.same;
    }
  }
  if (same_devices > 0) text = std::to_string(same_devices) + " devices: " + same.text() + text;
  return text;
}

}  // namespace

bool replay(const Options& options, std::ostream& out) {
  if (options.picture) lab::check_picture(*options.picture, 2);
  const Chosen chosen = choose(options);
  const bool same_law = !options.law && options.settings.empty();
  const auto held = same_law ? Rerun::Held::kRecorded : Rerun::Held::kOwn;

  std::deque<Both> devices;
  for (std::size_t device = 0; device < chosen.names.size(); ++device) devices.emplace_back(chosen.several());
  std::optional<Csv> csv;
  if (options.csv) csv.emplace(*options.csv);
  Gaps gaps;
  {
    Progress progress(options.progress);
    std::uint64_t steps = 0;
    const auto visit = [&](std::size_t device, const StepRecord& recorded, const StepRecord& again) {
      progress.observe(++steps);
      devices[device].recorded.observe(recorded);
      devices[device].again.observe(again);
      if (same_law) devices[device].comparison.observe(recorded, again);
      if (csv) csv->observe(recorded, again);
    };
    gaps = read_run(options, chosen, held, visit, [&](const DatagramRecord& datagram) {  // both had the same network
      for (Both& device : devices) {
        device.recorded.observe(datagram);
        device.again.observe(datagram);
      }
    });
  }
  if (csv) csv->close();

  std::vector<std::size_t> examined;
  std::string not_examined;
  for (std::size_t device = 0; device < devices.size(); ++device) {
    Both& both = devices[device];
    both.runs = {run_of("recorded", options, both.recorded, gaps),
                 run_of(same_law ? "again" : options.law.value_or("with settings"), options, both.again, gaps)};
    if (chosen.several()) both.runs[0].device = both.runs[1].device = chosen.names[device];
    if (both.runs[0].summary.steps > 0) {
      examined.push_back(device);
    } else if (chosen.several()) {
      not_examined += chosen.names[device] + (chosen.is_chosen[device] ? ": no haptic steps" : ": not selected") +
                      ", not examined\n";
    }
  }
  if (examined.empty()) throw std::runtime_error(gaps.without_steps);
  if (options.json) {
    for (const std::size_t device : examined) {
      const Both& both = devices[device];
      const std::string& name = both.runs[0].device;
      if (same_law) out << both.comparison.json(name.empty() ? std::nullopt : std::optional(name)) << "\n";
      for (const lab::Run& run : both.runs) out << lab::to_json(run) << "\n";
    }
  } else {
    std::vector<lab::Run> columns;
    const std::vector<std::size_t> shown = with_columns(devices, examined);
    for (const std::size_t device : shown)
      columns.insert(columns.end(), devices[device].runs.begin(), devices[device].runs.end());
    out << lab::to_table(columns) << "\n";
    if (shown.size() < examined.size())
      out << "columns for " << shown.size() << " of " << examined.size()
          << " devices (use --device NAME for another)\n";
    out << (same_law ? comparisons(devices, chosen, examined)
                     : "note: the motion of the hand is as recorded, although it would differ with other forces\n")
        << not_examined;
  }
  if (!out.flush()) throw std::runtime_error("cannot write the report: is the disk full?");

  if (options.picture) {
    draw_all(options, chosen, held, devices);
    if (!options.json) out << "\npicture: " << options.picture->string() << "\n";
  }
  return !same_law ||
         std::ranges::all_of(examined, [&](std::size_t device) { return devices[device].comparison.held(); });
}

}  // namespace tendon::replay
