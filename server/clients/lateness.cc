// SPDX-License-Identifier: Apache-2.0
#include "server/clients/lateness.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace tendon {
namespace {

/// Moves an estimate of the median towards each sample by at most 1/16 of its value, which limits the effect of
/// outliers. It converges after about 100 forces.
void track_median(Duration& median, Duration sample) noexcept {
  const Duration step = std::max<Duration>(median / 16, std::chrono::microseconds(20));
  if (sample > median) median += std::min(step, sample - median);
  if (sample < median) median -= std::min(step, median - sample);
}

std::string milliseconds_text(Duration d) {
  const std::int64_t tenths = d.count() / 100'000;
  if (tenths >= 100) return std::to_string(tenths / 10) + " ms";
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " ms";
}

struct CauseRow {
  Lateness::Part part;
  const char* words;  ///< may be continued by durations
};

/// In the order of Lateness::Cause.
constexpr std::array kCauses = {
    CauseRow{Lateness::Part::kNone, "the cause is unknown"},
    CauseRow{Lateness::Part::kOurs, "the server's threads (a state waited "},
    CauseRow{Lateness::Part::kOurs, "the server (its threads were stopped for "},
    CauseRow{Lateness::Part::kNetwork, "the network (round trip "},
    CauseRow{Lateness::Part::kNetwork, "the network (datagrams were lost)"},
    CauseRow{Lateness::Part::kUnknown, "the engine has stopped, or the network is down (no datagrams arrive)"},
    CauseRow{Lateness::Part::kEngine, "the engine (it took "},
    CauseRow{Lateness::Part::kEngine, "the engine (its datagrams arrive, but without a usable force)"},
    CauseRow{Lateness::Part::kEngine, "the engine (its program was stopped for "},
    CauseRow{Lateness::Part::kEngine, "the engine (no datagrams arrive from its program on this machine)"},
    CauseRow{Lateness::Part::kEngine, "the engine (its forces are not finite)"},
    CauseRow{Lateness::Part::kEngine, "the engine (its forces exceed the bounds in WIRE.md)"},
    CauseRow{Lateness::Part::kEngine, "the engine (its forces answer unknown or old ticks)"},
    CauseRow{Lateness::Part::kEngine, "the engine (its sequence numbers do not increase)"},
};
static_assert(kCauses.size() == static_cast<std::size_t>(Lateness::Cause::kOldSequence) + 1);

const CauseRow& cause_row(Lateness::Cause cause) noexcept { return kCauses[static_cast<std::size_t>(cause)]; }

std::string times(std::uint64_t count) { return count == 1 ? "once" : std::to_string(count) + " times"; }

std::string describe(const Lateness::Report& report) {
  if (report.late() == 0) {
    if (report.refused == 0) return {};
    return "forces were refused " + times(report.refused) + ": " + cause_row(report.refused_for).words;
  }
  const std::string text = "forces were late " + times(report.late()) + ", by up to " +
                           milliseconds_text(report.worst) + ": " + cause_row(report.cause).words;
  const auto part = [](Duration now, Duration usual) {
    return milliseconds_text(now) + ", usually " + milliseconds_text(usual) + ")";
  };
  switch (report.cause) {
    case Lateness::Cause::kStateWaited:
      return text + part(report.ours, report.usual_ours);
    case Lateness::Cause::kRoundTrip:
      return text + part(report.network, report.usual_network);
    case Lateness::Cause::kEngineTook:
      return text + part(report.engine, report.usual_engine);
    case Lateness::Cause::kServerStood:
    case Lateness::Cause::kEngineStood:
      return text + milliseconds_text(report.stood_still) + ")";
    default:
      return text;
  }
}

std::string advise(const Lateness::Report& report) {
  if (report.cut == 0) return report.text;
  const std::string forces = report.cut == 1 ? "1 force was" : std::to_string(report.cut) + " forces were";
  return report.text + (report.text.empty() ? "" : "; ") + forces + " above the device's bound and reduced to it";
}

}  // namespace

void Lateness::begin(LocalTime now, bool same_machine) noexcept {
  attending_ = true;
  same_machine_ = same_machine;
  usual_known_ = false;
  heard_ = now;
  sent_.reset();
  lost_ = 0;
  valid_until_ = LocalTime::max();  // the first force cannot be late
  took_state_.reset();
  stood_still_ = {};
  paused_ = {};
  refused_for_ = Cause::kNone;
}

Lateness::Part Lateness::part(Cause cause) noexcept { return cause_row(cause).part; }

void Lateness::heard(LocalTime now, std::optional<PeerTime> sent, std::uint64_t lost) noexcept {
  heard_ = now;
  const bool all_came = std::exchange(lost_, lost) >= lost;
  if (!sent) return;
  if (sent_ && all_came && *sent - *sent_ > kStandsStill) stood_still_ = std::max(stood_still_, *sent - *sent_);
  sent_ = sent;
}

void Lateness::took_state(LocalTime now) noexcept {
  paused_ = paused(now);
  took_state_ = now;
}

Duration Lateness::paused(LocalTime now) const noexcept {
  return took_state_ ? std::max(paused_, now - *took_state_) : paused_;
}

bool Lateness::is_our_pause(LocalTime now, Duration late_by) const noexcept {
  return paused(now) > kPause && 2 * paused(now) >= late_by;
}

void Lateness::refused(Cause cause, std::uint64_t count) noexcept {
  report_.refused += count;
  report_.refused_for = refused_for_ = cause;
}

void Lateness::blame(Duration late_by, Cause cause, const Parts& parts) noexcept {
  report_.late_ours += part(cause) == Part::kOurs ? 1 : 0;
  report_.late_network += part(cause) == Part::kNetwork ? 1 : 0;
  report_.late_engine += part(cause) == Part::kEngine ? 1 : 0;
  report_.late_unknown += part(cause) == Part::kUnknown ? 1 : 0;
  if (late_by <= report_.worst) return;
  report_.worst = late_by;
  report_.cause = cause;
  report_.ours = parts.ours;
  report_.network = parts.network;
  report_.engine = parts.engine;
  report_.stood_still = cause == Cause::kServerStood ? paused_ : stood_still_;
}

Lateness::Cause Lateness::cause_of(const RoundTrip& trip, const Parts& parts, Duration late_by) const noexcept {
  if (is_our_pause(trip.received, late_by)) return Cause::kServerStood;
  if (refused_for_ != Cause::kNone) return refused_for_;
  if (2 * stood_still_ >= late_by && stood_still_ > kStandsStill) return Cause::kEngineStood;
  const Duration ours = parts.ours - usual_.ours;
  const Duration network = parts.network - usual_.network;
  const Duration engine = parts.engine - usual_.engine;
  if (2 * std::max({ours, network, engine}) < late_by) return trip.lost ? Cause::kLost : Cause::kEngineMissing;
  if (ours >= network && ours >= engine) return Cause::kStateWaited;
  return network >= engine ? Cause::kRoundTrip : Cause::kEngineTook;
}

void Lateness::observe(const RoundTrip& trip) noexcept {
  ++report_.forces;
  paused_ = paused(trip.received);
  Parts parts;
  parts.ours = std::max(trip.sent - trip.sampled, Duration::zero());
  parts.network = std::max(trip.round_trip, Duration::zero());
  parts.engine = std::max(trip.received - trip.sent - parts.network, Duration::zero());

  if (trip.received > valid_until_ && usual_known_) {
    const Duration late_by = trip.received - valid_until_;
    blame(late_by, cause_of(trip, parts, late_by), parts);
  } else if (!usual_known_) {
    usual_ = parts;
    usual_known_ = true;
  } else {
    track_median(usual_.ours, parts.ours);
    track_median(usual_.network, parts.network);
    track_median(usual_.engine, parts.engine);
  }
  heard_ = std::max(heard_, trip.received);
  valid_until_ = trip.received + trip.valid_for;
  stood_still_ = {};
  paused_ = {};
  refused_for_ = Cause::kNone;
}

void Lateness::Report::add(const Report& other) {
  Report sum = other.worst > worst ? other : *this;
  sum.forces = forces + other.forces;
  sum.late_ours = late_ours + other.late_ours;
  sum.late_network = late_network + other.late_network;
  sum.late_engine = late_engine + other.late_engine;
  sum.late_unknown = late_unknown + other.late_unknown;
  sum.refused = refused + other.refused;
  sum.refused_for = other.refused_for != Cause::kNone ? other.refused_for : refused_for;
  sum.cut = cut + other.cut;
  sum.text = describe(sum);
  sum.advice = advise(sum);
  *this = std::move(sum);
}

Lateness::Report Lateness::report(LocalTime now) {
  if (attending_ && now > valid_until_) {
    const bool silent = now - heard_ > kSilent;
    const Cause unheard = same_machine_ ? Cause::kEngineSilent : Cause::kUnheard;
    const Cause heard = refused_for_ != Cause::kNone ? refused_for_ : Cause::kEngineMissing;
    paused_ = paused(now);
    const bool ours = is_our_pause(now, now - valid_until_);
    blame(now - valid_until_, ours ? Cause::kServerStood : silent ? unheard : heard, {});
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
