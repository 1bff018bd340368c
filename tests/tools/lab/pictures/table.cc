// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/reason.h"
#include "tests/support/json_line.h"

namespace tendon::lab {
namespace {

double ms(Duration d) { return seconds(d) * 1e3; }

struct ReasonName {
  Reason reason;
  const char* key;
  const char* meaning;
};
constexpr std::array kReasonNames = {
    ReasonName{Reason::kEnergy, "energy", "limiter: not enough energy"},
    ReasonName{Reason::kMaxForce, "max_force", "limit of the force"},
    ReasonName{Reason::kSlew, "slew", "limit of the force rate"},
    ReasonName{Reason::kRampIn, "ramp_in", "forces ramp in at the start"},
    ReasonName{Reason::kHeld, "held", "late: last force is held"},
    ReasonName{Reason::kDecaying, "decaying", "later: last force decays"},
    ReasonName{Reason::kSafeStop, "safe_stop", "too late: safe stop"},
    ReasonName{Reason::kNotFinite, "not_finite", "not a number"},
    ReasonName{Reason::kFault, "fault", "fault"},
    ReasonName{Reason::kDeviceClamp, "device_clamp", "limit of the device"},
    ReasonName{Reason::kUnseen, "unseen", "device provided no position"},
    ReasonName{Reason::kDisarmed, "disarmed", "operator disarmed"},
    ReasonName{Reason::kDamped, "damped", "limiter: a vibration is damped"},
    ReasonName{Reason::kAcceleration, "acceleration", "no limit: acceleration of the hand was too large"},
};

std::string digits(double value, const char* format) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string count(std::uint64_t n) {
  std::string text = std::to_string(n);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, " ");
  return text;
}

std::string percent(double share) {
  if (share == 0) return "0 %";
  if (share < 0.001) return "< 0.1 %";
  return digits(share * 100, share < 0.9995 ? "%.1f %%" : "%.0f %%");
}

std::string spread(const std::optional<Spread>& times) {
  if (!times) return "none";
  return digits(ms(times->p50), "%.1f") + " / " + digits(ms(times->p99), "%.1f ms");
}

std::string kept(const Run& run) {
  if (run.summary.passive()) return "yes";
  return run.summary.kept_its_promise() ? "yes, except in these holds" : "NO";
}

std::string felt(const RunSummary& run) {
  if (!run.stable) return "not stable";
  if (!run.pushed) return run.fields && run.fields->contact_steps > 0 ? "only fields" : "no contact";
  if (!run.operational_stiffness) return "not measurable";
  return digits(*run.operational_stiffness, "%.0f N/m");
}

std::string apart(const RunSummary& run) {
  if (!run.difference) return "0 N";
  return digits(run.difference->p50, "%.2f") + " / " + digits(run.difference->p95, "%.2f N");
}

std::string limited(const RunSummary& run) {
  return run.served_steps == 0 ? "no forces" : percent(run.share_limited());
}

/// Width on a terminal, for text without combining or wide characters.
std::size_t width(std::string_view text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string padded_left(const std::string& text, std::size_t to) {
  return std::string(to - std::min(to, width(text)), ' ') + text;
}

using Cell = std::function<std::string(const Run&)>;
struct Row {
  std::string name;
  Cell cell;  ///< empty for a heading
};

std::vector<Row> field_rows() {
  const auto row = [](std::string name, std::string (*cell)(const FieldSummary&)) {
    return Row{"  " + std::move(name),
               [cell](const Run& run) { return run.summary.fields ? cell(*run.summary.fields) : "no fields"; }};
  };
  return {
      {"Fields", {}},
      row("fields used", [](const FieldSummary& fields) { return count(fields.used); }),
      row("swaps while a field is in use", [](const FieldSummary& fields) { return count(fields.swaps); }),
      row("fastest force change after a swap",
          [](const FieldSummary& fields) {
            return fields.swap_slew ? digits(*fields.swap_slew * 1e-3, "%.3f N/ms") : "no swap";
          }),
      row("steps in contact", [](const FieldSummary& fields) { return percent(fields.share_in_contact()); }),
      row("steps with energy refused by the gate",
          [](const FieldSummary& fields) { return percent(fields.share_refused()); }),
      row("refused energy, sum over the steps",
          [](const FieldSummary& fields) { return with_unit(fields.refused, "J"); }),
      row("energy credited by the tank", [](const FieldSummary& fields) { return with_unit(fields.credit, "J"); }),
      row("largest stored energy H", [](const FieldSummary& fields) { return with_unit(fields.largest_stored, "J"); }),
      row("least account E with a field",
          [](const FieldSummary& fields) { return with_unit(fields.least_account, "J"); }),
  };
}

std::vector<Row> rows(std::span<const Run> runs) {
  std::vector<Row> rows = {
      {"recording", [](const Run& run) { return run.recording; }},
      {"Energy", {}},
      {"  energy given out but never put in",
       [](const Run& run) { return with_unit(run.summary.energy_given_out, "J"); }},
      {"  holds longer than the limiter's bound", [](const Run& run) { return count(run.summary.holds_beyond_bound); }},
      {"  least energy, without these holds", [](const Run& run) { return with_unit(run.summary.least_energy, "J"); }},
      {"  promise kept: never below −1 nJ", kept},
      {"Touch", {}},
      {"  felt stiffness", [](const Run& run) { return felt(run.summary); }},
      {"  peak speed", [](const Run& run) { return digits(run.summary.peak_speed, "%.2f m/s"); }},
      {"  peak force", [](const Run& run) { return digits(run.summary.peak_force, "%.2f N"); }},
      {"Force differs from the requested one in", [](const Run& run) { return limited(run.summary); }},
      {"  difference, p50 / p95", [](const Run& run) { return apart(run.summary); }},
  };
  if (std::ranges::any_of(runs, [](const Run& run) { return run.summary.torque_work.has_value(); })) {
    const auto work = [](const Run& run) {
      return run.summary.torque_work ? with_unit(*run.summary.torque_work, "J") : "no rotation";
    };
    rows.insert(rows.begin() + 3, {"  work of torques on the hand, maximum", work});
  }
  if (std::ranges::any_of(runs, [](const Run& run) { return run.summary.grip_energy_given_out.has_value(); })) {
    const auto given_out = [](const Run& run) {
      return run.summary.grip_energy_given_out ? with_unit(*run.summary.grip_energy_given_out, "J") : "no gripper";
    };
    rows.insert(rows.begin() + 3, {"  energy given out by the gripper", given_out});
  }
  if (std::ranges::any_of(runs, [](const Run& run) { return run.summary.share_careful > 0; })) {
    rows.insert(rows.begin() + 1, {"limiter more careful after overruns, for",
                                   [](const Run& run) { return percent(run.summary.share_careful); }});
  }
  if (std::ranges::any_of(runs, [](const Run& run) { return !run.device.empty(); })) {
    rows.insert(rows.begin() + 1, {"device", [](const Run& run) { return run.device.empty() ? "-" : run.device; }});
  }
  for (const ReasonName& name : kReasonNames) {
    const auto occurs = [&](const Run& run) { return run.summary.share_limited(name.reason) > 0; };
    if (std::ranges::none_of(runs, occurs)) continue;
    rows.push_back({std::string("  ") + name.meaning,
                    [&name](const Run& run) { return percent(run.summary.share_limited(name.reason)); }});
  }
  if (std::ranges::any_of(runs, [](const Run& run) { return run.summary.fields.has_value(); })) {
    std::ranges::move(field_rows(), std::back_inserter(rows));
  }
  rows.insert(
      rows.end(),
      {
          {"Network", {}},
          {"  hand to force, p50 / p99", [](const Run& run) { return spread(run.summary.loop_age); }},
          {"  round trip, p50 / p99",
           [](const Run& run) {
             return run.summary.sealed && !run.summary.round_trip ? "sealed" : spread(run.summary.round_trip);
           }},
          {"  forces used per second",
           [](const Run& run) {
             return run.summary.forces_per_s ? digits(*run.summary.forces_per_s, "%.1f") : "none";
           }},
          {"Haptic loop", {}},
          {"  time recorded", [](const Run& run) { return digits(seconds(run.summary.span), "%.2f s"); }},
          {"  steps", [](const Run& run) { return count(run.summary.steps); }},
          {"  overruns", [](const Run& run) { return count(run.summary.overruns); }},
          {"  longest interval", [](const Run& run) { return digits(ms(run.summary.longest_interval), "%.2f ms"); }},
      });
  return rows;
}

std::string notes(std::span<const Run> runs) {
  std::string text;
  const auto note = [&text](const std::string& line) { text += line + "\n"; };
  const auto some = [&runs](auto&& holds) { return std::ranges::any_of(runs, holds); };
  if (some([](const Run& run) { return !run.summary.stable; })) {
    note("not stable: the device gave out energy and shook the hand (most of its motion was faster than 3 Hz),");
    note("            so a stiffness is meaningless.");
  }
  if (some([](const Run& run) {
        return run.summary.stable && run.summary.pushed && !run.summary.operational_stiffness;
      })) {
    note(
        "not measurable: the forces do not only depend on the position, or the start of contact is not known well "
        "enough");
    note("            for a stiffness within 5 %.");
  }
  if (some([](const Run& run) { return run.summary.overruns > 0; })) {
    note("overrun: the computer paused the haptic loop for longer than the scene's longest_hold.");
  }
  if (some([](const Run& run) { return run.summary.share_careful > 0; })) {
    note("more careful: after an overrun, the limiter expects another one of the same length, and permits less force.");
    note("            To compare the felt stiffness, repeat the run on a less busy machine.");
  }
  if (some([](const Run& run) { return run.summary.holds_beyond_bound > 0; })) {
    note("holds longer than the bound: the limiter guarantees E ≥ −1 nJ if no force is held longer than the bound.");
    note(
        "         A longer hold can give out (T_act − T)(‖F‖ − f_c)²/(4b), which is included in the energy given out.");
  }
  if (some([](const Run& run) { return run.summary.fields.has_value(); })) {
    note("fields: percentages are of the steps with a field, and after a swap means within 200 ms.");
  }
  if (some([](const Run& run) { return run.summary.fields && run.summary.fields->refused_steps > 0; })) {
    note("refused energy: a field can request it again in the next step, so the sum can count it several times.");
  }
  if (some([](const Run& run) { return felt(run.summary) == "only fields"; })) {
    note("only fields: a felt stiffness is only computed from the forces of an engine.");
  }
  for (const Run& run : runs) {
    if (&run != &*std::ranges::find(runs, run.recording, &Run::recording)) continue;  // once per recording
    if (run.truncated)
      note(run.recording +
           ": has no end mark (the server was killed, or the disk was full). All existing data was read.");
    if (run.lost_steps + run.lost_datagrams > 0)
      note(run.recording + ": lacks " + count(run.lost_steps) + " steps and " + count(run.lost_datagrams) +
           " datagrams, which were not written in time or are damaged.");
    constexpr std::size_t kMostSentences = 5;
    for (std::size_t i = 0; i < std::min(run.damage.size(), kMostSentences); ++i) note(run.damage[i]);
    if (run.damage.size() > kMostSentences)
      note(run.recording + ": " + count(run.damage.size() - kMostSentences) + " more damaged places (see --json)");
  }
  return text;
}

std::optional<double> p50_ms(const std::optional<Spread>& times) {
  return times ? std::optional(ms(times->p50)) : std::nullopt;
}
std::optional<double> p99_ms(const std::optional<Spread>& times) {
  return times ? std::optional(ms(times->p99)) : std::nullopt;
}

JsonLine field_json(const FieldSummary& fields) {
  JsonLine json;
  json.add("steps", fields.steps)
      .add("used", fields.used)
      .add("swaps", fields.swaps)
      .add("swap_force_change_n_per_ms", fields.swap_slew ? std::optional(*fields.swap_slew * 1e-3) : std::nullopt)
      .add("contact_percent", fields.share_in_contact() * 100)
      .add("refused_steps", fields.refused_steps)
      .add("refused_j", fields.refused)
      .add("tank_j", fields.credit)
      .add("largest_stored_j", fields.largest_stored)
      .add("least_account_j", fields.least_account);
  return json;
}

}  // namespace

std::string padded(const std::string& text, std::size_t to) {
  return text + std::string(to - std::min(to, width(text)), ' ');
}

std::string with_unit(double value, std::string_view unit) {
  const std::string symbol = " " + std::string(unit);
  if (std::isnan(value)) return "?" + symbol;
  if (std::abs(value) < 0.005e-12) return "0" + symbol;  // would be printed as 0.00 pJ
  const std::string sign = value < 0 ? "−" : "";
  double size = std::abs(value);
  if (std::isinf(size)) return sign + "∞" + symbol;
  static constexpr std::array kPrefixes = {"p", "n", "µ", "m", "", "k", "M", "G"};
  std::size_t prefix = 4;
  while (size < 0.9995 && prefix > 0) size *= 1e3, --prefix;
  while (size >= 999.5 && prefix + 1 < kPrefixes.size()) size /= 1e3, ++prefix;
  const char* format = size < 9.995 ? "%.2f" : size < 99.95 ? "%.1f" : "%.0f";
  return sign + digits(size, format) + " " + kPrefixes[prefix] + std::string(unit);
}

std::string to_table(std::span<const Run> runs) {
  constexpr std::size_t kGap = 3;
  const std::vector<Row> all = rows(runs);
  std::size_t names = 0;
  for (const Row& row : all) names = std::max(names, width(row.name));
  std::vector<std::size_t> widths;
  std::string text(names, ' ');
  for (const Run& run : runs) {
    std::size_t needed = width(run.label);
    for (const Row& row : all) needed = std::max(needed, row.cell ? width(row.cell(run)) : 0);
    widths.push_back(needed + kGap);
    text += padded_left(run.label, widths.back());
  }
  text += "\n";
  for (const Row& row : all) {
    if (!row.cell) {
      text += row.name + "\n";
      continue;
    }
    text += padded(row.name, names);
    for (std::size_t i = 0; i < runs.size(); ++i) text += padded_left(row.cell(runs[i]), widths[i]);
    text += "\n";
  }
  const std::string explained = notes(runs);
  return explained.empty() ? text : text + "\n" + explained;
}

std::string to_json(const Run& run) {
  const RunSummary& s = run.summary;
  JsonLine reasons;
  for (const ReasonName& name : kReasonNames) reasons.add(name.key, s.share_limited(name.reason) * 100);
  JsonLine json;
  json.add("recording", run.recording)
      .add("label", run.label)
      .add("device", run.device.empty() ? std::nullopt : std::optional(run.device))
      .add("truncated", run.truncated)
      .add("lost_steps", run.lost_steps)
      .add("lost_datagrams", run.lost_datagrams)
      .add("damage", run.damage)
      .add("limiter_on", s.limiter_on)
      .add("energy_given_out_j", s.energy_given_out)
      .add("least_energy_j", s.least_energy)
      .add("grip_energy_given_out_j", s.grip_energy_given_out)
      .add("torque_work_j", s.torque_work)
      .add("passive", s.passive())
      .add("kept_its_promise", s.kept_its_promise())
      .add("holds_beyond_bound", s.holds_beyond_bound)
      .add("peak_speed_m_per_s", s.peak_speed)
      .add("peak_force_n", s.peak_force)
      .add("limited_percent", s.share_limited() * 100)
      .add("limited_percent_by_reason", reasons)
      .add("served_steps", s.served_steps)
      .add("differs_p50_n", s.difference ? std::optional(s.difference->p50) : std::nullopt)
      .add("differs_p95_n", s.difference ? std::optional(s.difference->p95) : std::nullopt)
      .add("careful_percent", s.share_careful * 100)
      .add("stable", s.stable)
      .add("operational_stiffness_n_per_m", s.stable ? s.operational_stiffness : std::nullopt)
      .add("loop_age_p50_ms", p50_ms(s.loop_age))
      .add("loop_age_p99_ms", p99_ms(s.loop_age))
      .add("round_trip_p50_ms", p50_ms(s.round_trip))
      .add("round_trip_p99_ms", p99_ms(s.round_trip))
      .add("forces_per_s", s.forces_per_s)
      .add("span_s", seconds(s.span))
      .add("steps", s.steps)
      .add("overruns", s.overruns)
      .add("watchdogs", s.watchdogs)
      .add("longest_interval_ms", ms(s.longest_interval));
  if (s.fields) json.add("fields", field_json(*s.fields));
  return json.str();
}

}  // namespace tendon::lab
