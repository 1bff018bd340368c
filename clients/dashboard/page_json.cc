// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/page_json.h"

#include <array>
#include <limits>

#include "clients/dashboard/json.h"

namespace tendon::dash {
namespace {

double milliseconds(Duration d) { return 1e3 * seconds(d); }
double nanoseconds(PeerTime t) { return static_cast<double>(t.time_since_epoch().count()); }

void write(JsonWriter& json, const Vec3& v) { json.begin_array().value(v.x()).value(v.y()).value(v.z()).end_array(); }

void write(JsonWriter& json, std::string_view name, const std::optional<Delays>& delays) {
  json.key(name);
  if (!delays) {
    json.null();
    return;
  }
  json.begin_object().key("median").value(milliseconds(delays->median));
  json.key("p99").value(milliseconds(delays->p99)).end_object();
}

std::string_view state_name(Press::State state) noexcept {
  switch (state) {
    case Press::State::kUnderWay:
      return "under_way";
    case Press::State::kDone:
      return "done";
    case Press::State::kFailed:
      return "failed";
  }
  return "unknown";
}

void write(JsonWriter& json, const std::optional<Press>& press) {
  json.key("press");
  if (!press) {
    json.null();
    return;
  }
  json.begin_object().key("device").value(press->device).key("order").value(press->arm ? "arm" : "disarm");
  json.key("state").value(state_name(press->state)).key("words").value(press->words).end_object();
}

void write(JsonWriter& json, const DeviceDescription& about, const std::string& arming_objection) {
  json.begin_object().key("number").value(about.device).key("name").value(about.name).key("model").value(about.model);
  json.key("loop_hz").value(about.loop_hz).key("max_force_n").value(about.max_force);
  json.key("workspace_m");
  if (about.workspace) {
    json.begin_array();
    write(json, about.workspace->min);
    write(json, about.workspace->max);
    json.end_array();
  } else {
    json.null();
  }
  json.key("channels").begin_array();
  for (const ChannelDescription& channel : about.channels) {
    json.begin_object().key("name").value(channel.name);
    json.key("rule").value(channel.rule == ChannelRule::kSum ? "sum" : "priority");
    json.key("lease_ms").value(milliseconds(channel.lease)).key("holder").value(channel.holder).end_object();
  }
  json.end_array().key("arming_objection").value(arming_objection).end_object();
}

void write(JsonWriter& json, const Board::Device& device) {
  const DeviceReport& report = *device.report;
  json.begin_object().key("span_s").value(seconds(report.span));
  json.key("steps").value(report.steps).key("missed").value(report.missed);
  json.key("overruns").value(report.overruns).key("unseen").value(report.unseen);
  json.key("safety").value(name(report.safety));
  json.key("fault").value(report.fault).key("degraded").value(report.degraded);
  json.key("lateness_us_log2").begin_array();
  for (const std::uint64_t count : report.lateness) json.value(count);
  json.end_array().key("lateness_us_log2_total").begin_array();
  for (const std::uint64_t count : device.lateness) json.value(count);
  json.end_array().key("steps_total").value(device.steps).key("missed_total").value(device.missed).end_object();
}

void write(JsonWriter& json, std::string_view channel, const PeerReport& peer) {
  const LinkReport& link = peer.link;
  json.begin_object().key("channel").value(channel).key("name").value(peer.name).key("span_s").value(
      seconds(link.span));
  json.key("forces").value(link.forces).key("late_server").value(link.late_server);
  json.key("late_network").value(link.late_network).key("late_engine").value(link.late_engine);
  json.key("worst_late_ms").value(milliseconds(link.worst_late));
  json.key("longest_gap_ms").value(milliseconds(link.longest_gap));
  write(json, "round_trip_ms", link.round_trip);
  write(json, "to_server_ms", link.to_server);
  write(json, "to_client_ms", link.to_client);
  json.key("clock_error_ms").value(milliseconds(link.clock_error));
  json.key("received").value(link.received).key("lost").value(link.lost);
  json.key("reordered").value(link.reordered).key("duplicated").value(link.duplicated);
  json.key("state_one_in").value(peer.state_one_in).key("forces_refused").value(peer.forces_refused);
  json.key("words").value(link.words).end_object();
}

/// One number of each state.
template <class Of>
void column(JsonWriter& json, std::string_view name, std::span<const DeviceState> states, Of of) {
  json.key(name).begin_array();
  for (const DeviceState& state : states) json.value(of(state));
  json.end_array();
}

template <class Of>
void columns(JsonWriter& json, std::string_view name, std::span<const DeviceState> states, Of of) {
  json.key(name).begin_array();
  for (int axis = 0; axis < 3; ++axis) {
    json.begin_array();
    for (const DeviceState& state : states) json.value(static_cast<float>(of(state)[axis]));
    json.end_array();
  }
  json.end_array();
}

}  // namespace

std::string_view name(Mode mode) noexcept {
  switch (mode) {
    case Mode::kIdle:
      return "idle";
    case Mode::kActive:
      return "active";
    case Mode::kHolding:
      return "holding";
    case Mode::kDecaying:
      return "decaying";
    case Mode::kSafeStop:
      return "safe_stop";
    case Mode::kFault:
      return "fault";
  }
  return "unknown";
}

std::string_view name(Safety safety) noexcept {
  switch (safety) {
    case Safety::kAbsent:
      return "absent";
    case Safety::kOpening:
      return "opening";
    case Safety::kFirmware:
      return "firmware";
    case Safety::kUnhomed:
      return "unhomed";
    case Safety::kHomed:
      return "homed";
    case Safety::kArmed:
      return "armed";
    case Safety::kFault:
      return "fault";
    case Safety::kUnguarded:
      return "unguarded";
  }
  return "unknown";
}

std::string_view name(Contact contact) noexcept {
  switch (contact) {
    case Contact::kGreeting:
      return "greeting";
    case Contact::kOpen:
      return "open";
    case Contact::kUnanswered:
      return "unanswered";
    case Contact::kRefused:
      return "refused";
    case Contact::kLost:
      return "lost";
  }
  return "unknown";
}

std::string reason_name(std::size_t bit) {
  static constexpr std::array<std::string_view, 14> kNames = {
      "energy",     "max_force", "slew",         "ramp_in", "held",     "decaying", "safe_stop",
      "not_finite", "fault",     "device_clamp", "overrun", "watchdog", "unseen",   "disarmed"};
  return bit < kNames.size() ? std::string(kNames[bit]) : "bit_" + std::to_string(bit);
}

std::string server_json(const Board& board, const Abilities& abilities) {
  JsonWriter json;
  json.begin_object().key("type").value("server").key("address").value(abilities.server);
  json.key("contact").value(name(board.contact())).key("words").value(board.words());
  json.key("version").value(board.welcome() ? board.welcome()->server : "");
  json.key("recordings").value(abilities.recordings);
  json.key("arms").value(abilities.arms);
  write(json, board.press());
  json.key("devices").begin_array();
  for (const auto& [number, device] : board.devices()) {
    if (device.about) write(json, *device.about, abilities.arming_objection(number));
  }
  json.end_array().end_object();
  return json.take();
}

std::string states_json(std::uint32_t device, std::span<const DeviceState> states) {
  JsonWriter json;
  json.begin_object().key("type").value("states").key("device").value(device);
  column(json, "tick", states, [](const DeviceState& s) { return s.tick; });
  // µs on the server's clock: a double holds them exactly for as long as a machine runs.
  column(json, "sampled_us", states, [](const DeviceState& s) { return nanoseconds(s.sampled) / 1e3; });
  columns(json, "position_m", states, [](const DeviceState& s) { return s.position; });
  columns(json, "wanted_n", states, [](const DeviceState& s) {
    const double untold = std::numeric_limits<double>::quiet_NaN();
    return s.force_wanted.value_or(Vec3(untold, untold, untold));
  });
  columns(json, "applied_n", states, [](const DeviceState& s) { return s.force_applied; });
  column(json, "permitted_n", states, [](const DeviceState& s) { return static_cast<float>(s.permitted_force); });
  column(json, "energy_j", states, [](const DeviceState& s) { return static_cast<float>(s.energy); });
  column(json, "reasons", states, [](const DeviceState& s) { return s.reasons; });
  column(json, "mode", states, [](const DeviceState& s) { return static_cast<unsigned>(s.mode); });
  column(json, "force_age_ms", states,
         [](const DeviceState& s) { return static_cast<float>(milliseconds(s.force_age)); });
  json.end_object();
  return json.take();
}

std::string reports_json(std::uint32_t number, const Board& board) {
  JsonWriter json;
  const LinkStats& link = board.link();
  json.begin_object().key("type").value("reports").key("device").value(number);
  json.key("link").begin_object();
  json.key("round_trip_ms").value(milliseconds(link.smoothed_round_trip));
  json.key("received").value(link.datagrams_received).key("lost").value(link.lost).end_object();
  const auto found = board.devices().find(number);
  const Board::Device* const device = found != board.devices().end() ? &found->second : nullptr;
  json.key("loop");
  if (device != nullptr && device->report) {
    write(json, *device);
  } else {
    json.null();
  }
  json.key("engines").begin_array();
  if (device != nullptr) {
    for (const auto& [channel, engine] : device->engines) {
      const bool named = device->about && channel < device->about->channels.size();
      write(json, named ? device->about->channels[channel].name : std::to_string(channel), engine.newest);
    }
  }
  json.end_array().end_object();
  return json.take();
}

std::string recordings_json(std::span<const Recordings::Entry> entries) {
  JsonWriter json;
  json.begin_array();
  for (const Recordings::Entry& entry : entries) {
    json.begin_object().key("name").value(entry.name).key("size_bytes").value(entry.size);
    json.key("modified_unix_s").value(entry.modified_unix_s).end_object();
  }
  json.end_array();
  return json.take();
}

}  // namespace tendon::dash
