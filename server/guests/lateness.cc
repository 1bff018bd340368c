// SPDX-License-Identifier: Apache-2.0
#include "server/guests/lateness.h"

#include <algorithm>
#include <utility>

namespace tendon {
namespace {

/// Moves the median by at most 1/16 of itself towards each sample: it settles in about a hundred forces and, unlike a
/// mean, is not dragged by one outlier.
void track_median(Duration& median, Duration sample) noexcept {
  const Duration step = std::max<Duration>(median / 16, std::chrono::microseconds(20));
  if (sample > median) median += std::min(step, sample - median);
  if (sample < median) median -= std::min(step, median - sample);
}

std::string milliseconds_text(Duration d) {
  const std::int64_t tenths = d.count() / 100'000;
  // Above 10 ms nobody reads the tenth.
  if (tenths >= 100) return std::to_string(tenths / 10) + " ms";
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " ms";
}

std::string times(std::uint64_t n) { return n == 1 ? "once" : std::to_string(n) + " times"; }
std::string forces(std::uint64_t n) { return n == 1 ? "1 force was" : std::to_string(n) + " forces were"; }

std::string to_blame(const Lateness::Report& report) {
  const auto part = [](Duration now, Duration usual) {
    return milliseconds_text(now) + ", usually " + milliseconds_text(usual) + ")";
  };
  switch (report.cause) {
    case Lateness::Cause::kStateWaited:
      return "the server's threads (a state waited " + part(report.ours, report.usual_ours);
    case Lateness::Cause::kRoundTrip:
      return "the network (round trip " + part(report.network, report.usual_network);
    case Lateness::Cause::kLost:
      return "the network (datagrams were lost)";
    case Lateness::Cause::kUnheard:
      return "the network (nothing is heard of the engine's machine)";
    case Lateness::Cause::kEngineTook:
      return "the engine (it took " + part(report.engine, report.usual_engine);
    case Lateness::Cause::kEngineMissing:
      return "the engine (it is heard, but sends no force)";
    case Lateness::Cause::kEngineSilent:
      return "the engine (it is on this machine and sends nothing: it blocks, sleeps or has died)";
    case Lateness::Cause::kEngineRefused:
      return "the engine (its forces are refused)";
    case Lateness::Cause::kNone:
      break;
  }
  return "not known why";
}

std::string describe(const Lateness::Report& report) {
  std::string text;
  const auto add = [&](const std::string& sentence) { text += (text.empty() ? "" : "; ") + sentence; };
  if (report.late() > 0) {
    add("forces were late " + times(report.late()) + ", by up to " + milliseconds_text(report.worst) + ": " +
        to_blame(report));
  }
  if (report.refused_values > 0) {
    add(forces(report.refused_values) + " refused: not finite, or out of bounds");
  }
  if (report.refused_ticks > 0) {
    add(forces(report.refused_ticks) + " refused: the tick answered never was, or is too old");
  }
  return text;
}

std::string advise(const Lateness::Report& report) {
  if (report.cut == 0) return report.text;
  return report.text + (report.text.empty() ? "" : "; ") + forces(report.cut) +
         " above the device's bound, and cut to it";
}

}  // namespace

void Lateness::begin(LocalTime now) noexcept {
  attending_ = true;
  usual_known_ = false;
  heard_ = now;
  valid_until_ = LocalTime::max();  // before the first force nothing is late
}

Lateness::Part Lateness::part(Cause cause) noexcept {
  switch (cause) {
    case Cause::kStateWaited:
      return Part::kOurs;
    case Cause::kRoundTrip:
    case Cause::kLost:
    case Cause::kUnheard:
      return Part::kNetwork;
    case Cause::kEngineTook:
    case Cause::kEngineMissing:
    case Cause::kEngineSilent:
    case Cause::kEngineRefused:
      return Part::kEngine;
    case Cause::kNone:
      break;
  }
  return Part::kNone;
}

void Lateness::blame(Duration late_by, Cause cause, const Parts& parts) noexcept {
  report_.late_ours += part(cause) == Part::kOurs ? 1 : 0;
  report_.late_network += part(cause) == Part::kNetwork ? 1 : 0;
  report_.late_engine += part(cause) == Part::kEngine ? 1 : 0;
  if (late_by <= report_.worst) return;
  report_.worst = late_by;
  report_.cause = cause;
  report_.ours = parts.ours;
  report_.network = parts.network;
  report_.engine = parts.engine;
}

void Lateness::observe(const Way& way) noexcept {
  ++report_.forces;
  Parts parts;
  parts.ours = std::max(way.sent - way.sampled, Duration::zero());
  parts.network = std::max(way.round_trip, Duration::zero());
  parts.engine = std::max(way.received - way.sent - parts.network, Duration::zero());

  if (way.received > valid_until_ && usual_known_) {
    const Duration ours = parts.ours - usual_.ours;
    const Duration network = parts.network - usual_.network;
    const Duration engine = parts.engine - usual_.engine;
    const Duration late_by = way.received - valid_until_;
    const Cause cause = 2 * std::max({ours, network, engine}) < late_by
                            ? (way.lost ? Cause::kLost : Cause::kEngineMissing)
                        : ours >= network && ours >= engine ? Cause::kStateWaited
                        : network >= engine                 ? Cause::kRoundTrip
                                                            : Cause::kEngineTook;
    blame(late_by, cause, parts);
  } else if (!usual_known_) {
    usual_ = parts;
    usual_known_ = true;
  } else {
    track_median(usual_.ours, parts.ours);
    track_median(usual_.network, parts.network);
    track_median(usual_.engine, parts.engine);
  }
  heard_ = std::max(heard_, way.received);
  valid_until_ = way.received + way.valid_for;
}

void Lateness::refuse(Refused why, std::uint64_t forces) noexcept {
  (why == Refused::kValue ? report_.refused_values : report_.refused_ticks) += forces;
}

void Lateness::Report::add(const Report& other) {
  Report sum = other.worst > worst ? other : *this;
  sum.forces = forces + other.forces;
  sum.late_ours = late_ours + other.late_ours;
  sum.late_network = late_network + other.late_network;
  sum.late_engine = late_engine + other.late_engine;
  sum.refused_values = refused_values + other.refused_values;
  sum.refused_ticks = refused_ticks + other.refused_ticks;
  sum.cut = cut + other.cut;
  sum.text = describe(sum);
  sum.advice = advise(sum);
  *this = std::move(sum);
}

Lateness::Report Lateness::report(LocalTime now, bool same_machine) {
  if (attending_ && now > valid_until_) {
    // Five keep-alives have not come: see SESSION.md.
    const bool silent = now - heard_ > std::chrono::milliseconds(250);
    const bool refused = report_.refused_values + report_.refused_ticks > 0;
    blame(now - valid_until_,
          refused                  ? Cause::kEngineRefused
          : silent && same_machine ? Cause::kEngineSilent
          : silent                 ? Cause::kUnheard
                                   : Cause::kEngineMissing,
          {});
  }
  Report report = std::exchange(report_, {});
  report.usual_ours = usual_.ours;
  report.usual_network = usual_.network;
  report.usual_engine = usual_.engine;
  report.text = describe(report);
  report.advice = advise(report);
  return report;
}

}  // namespace tendon
