// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/page_json.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace tendon::dash {
namespace {

using Json = nlohmann::ordered_json;  // preserves the order of the members

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }
double nanoseconds(PeerTime t) { return static_cast<double>(t.time_since_epoch().count()); }

constexpr double kUntold = std::numeric_limits<double>::quiet_NaN();  ///< written as null

Json vector(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Json delays(const std::optional<Delays>& delays) {
  if (!delays) return nullptr;
  return {{"median", milliseconds(delays->median)}, {"p99", milliseconds(delays->p99)}};
}

/// `names` are those of the enumerators 0, 1, 2 …
template <class Enum>
std::string one_of(std::initializer_list<const char*> names, Enum value) {
  const auto number = static_cast<std::size_t>(value);
  return number < names.size() ? names.begin()[number] : "unknown";
}

Json in_json(const std::optional<Press>& press) {
  if (!press) return nullptr;
  return {{"device", press->device},
          {"order", name(press->order)},
          {"state", one_of({"under_way", "done", "failed"}, press->state)},
          {"words", press->words}};
}

Json in_json(const std::optional<HandleDescription>& handle) {
  if (!handle) return nullptr;
  Json turned;
  if (const auto& q = handle->operator_from_device) turned = {q->w, q->x, q->y, q->z};
  return {{"operator_from_device", std::move(turned)},
          {"buttons", handle->buttons},
          {"orientation_measured", handle->orientation_measured},
          {"max_torque_nm", handle->max_torque},
          {"gripper_open_rad", handle->gripper_open ? Json(*handle->gripper_open) : Json()},
          {"max_gripper_force_n", handle->max_gripper_force},
          {"group", handle->group},
          {"hand", one_of({"any", "left", "right"}, handle->hand)}};
}

Json in_json(const DeviceDescription& about, const std::optional<HandleDescription>& handle,
             const std::string& arming_objection) {
  Json channels = Json::array();
  for (const ChannelDescription& channel : about.channels) {
    channels.push_back({{"name", channel.name},
                        {"rule", channel.rule == ChannelRule::kSum ? "sum" : "priority"},
                        {"lease_ms", milliseconds(channel.lease)},
                        {"holder", channel.holder}});
  }
  Json workspace;
  if (about.workspace) workspace = {vector(about.workspace->min), vector(about.workspace->max)};
  return {{"number", about.device},
          {"name", about.name},
          {"model", about.model},
          {"loop_hz", about.loop_hz},
          {"max_force_n", about.max_force},
          {"workspace_m", std::move(workspace)},
          {"channels", std::move(channels)},
          {"handle", in_json(handle)},
          {"arming_objection", arming_objection}};
}

Json loop_json(const Board::Device& device) {
  const DeviceReport& report = *device.report;
  return {{"span_s", seconds(report.span)},
          {"steps", report.steps},
          {"missed", report.missed},
          {"overruns", report.overruns},
          {"unseen", report.unseen},
          {"safety", name(report.safety)},
          {"fault", report.fault},
          {"degraded", report.degraded},
          {"lateness_us_log2", report.lateness},
          {"lateness_us_log2_total", device.lateness},
          {"steps_total", device.steps},
          {"missed_total", device.missed}};
}

Json engine_json(const std::string& channel, const PeerReport& peer) {
  const LinkReport& link = peer.link;
  return {{"channel", channel},
          {"name", peer.name},
          {"span_s", seconds(link.span)},
          {"forces", link.forces},
          {"late_server", link.late_server},
          {"late_network", link.late_network},
          {"late_engine", link.late_engine},
          {"late_unknown", link.late_unknown},
          {"refused",
           {{"not_finite", link.refused.not_finite},
            {"out_of_bounds", link.refused.out_of_bounds},
            {"unknown_tick", link.refused.unknown_tick},
            {"old_sequence", link.refused.old_sequence}}},
          {"worst_late_ms", milliseconds(link.worst_late)},
          {"longest_gap_ms", milliseconds(link.longest_gap)},
          {"round_trip_ms", delays(link.round_trip)},
          {"to_server_ms", delays(link.to_server)},
          {"to_client_ms", delays(link.to_client)},
          {"clock_error_ms", milliseconds(link.clock_error)},
          {"received", link.received},
          {"lost", link.lost},
          {"reordered", link.reordered},
          {"duplicated", link.duplicated},
          {"state_one_in", peer.state_one_in},
          {"forces_refused", peer.forces_refused},
          {"error_n", peer.error ? Json(*peer.error) : Json()},
          {"way", peer.way},
          {"words", link.words}};
}

double plotted(double number) {  // rounds to seven digits, enough for plots
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), static_cast<float>(number)).ptr;
  double shown = 0;
  std::from_chars(digits.data(), end, shown);
  return shown;
}

template <class Of>
Json column(std::span<const DeviceState> states, Of of) {
  Json numbers = Json::array();
  for (const DeviceState& state : states) numbers.push_back(of(state));
  return numbers;
}

template <int kAxes = 3, class Of>
Json columns(std::span<const DeviceState> states, Of of) {
  Json axes = Json::array();
  for (int axis = 0; axis < kAxes; ++axis) {
    axes.push_back(column(states, [&](const DeviceState& state) { return plotted(of(state)[axis]); }));
  }
  return axes;
}

/// Adds the stiffness of the engines' models, row-major, if any state has one.
void add_stiffness(Json& json, std::span<const DeviceState> states) {
  if (std::ranges::none_of(states, [](const DeviceState& s) { return s.stiffness_wanted.has_value(); })) return;
  json["stiffness_n_per_m"] = columns<9>(states, [](const DeviceState& s) {
    const Mat3 stiffness = s.stiffness_wanted.value_or(Mat3::Constant(kUntold));
    return Eigen::Vector<double, 9>(stiffness.transpose().reshaped());
  });
}

/// Adds the additional quantities of the handle. Quantities that no state has are omitted.
void add_handle(Json& json, std::span<const DeviceState> states) {
  const auto any = [&](auto has) { return std::ranges::any_of(states, has); };
  const auto vectors = [&](const char* name, std::optional<Vec3> DeviceState::*value) {
    if (!any([&](const DeviceState& s) { return (s.*value).has_value(); })) return;
    json[name] = columns(states, [&](const DeviceState& s) { return (s.*value).value_or(Vec3::Constant(kUntold)); });
  };
  if (any([](const DeviceState& s) { return s.turning.has_value(); })) {
    json["orientation"] = columns<4>(states, [](const DeviceState& s) {
      if (!s.turning) return Eigen::Vector4d(kUntold, kUntold, kUntold, kUntold);
      const Quat& q = s.turning->orientation;
      return Eigen::Vector4d(q.w, q.x, q.y, q.z);
    });
  }
  vectors("torque_nm", &DeviceState::torque_applied);
  vectors("hand_force_n", &DeviceState::hand_force);
  if (any([](const DeviceState& s) { return s.grip.has_value(); })) {
    json["grip_rad"] = column(states, [](const DeviceState& s) { return plotted(s.grip ? s.grip->opening : kUntold); });
  }
  if (any([](const DeviceState& s) { return s.grip_applied.has_value(); })) {
    json["grip_n"] = column(states, [](const DeviceState& s) { return plotted(s.grip_applied.value_or(kUntold)); });
  }
  if (any([](const DeviceState& s) { return s.buttons != 0; })) {
    json["buttons"] = column(states, [](const DeviceState& s) { return s.buttons; });
  }
}

/// Adds the rendered field, if any state has one.
void add_field(Json& json, std::span<const DeviceState> states) {
  if (std::ranges::none_of(states, [](const DeviceState& s) { return s.field.has_value(); })) return;
  json["field"] = column(states, [](const DeviceState& s) { return s.field ? Json(s.field->generation) : Json(); });
  json["field_depth_m"] =
      column(states, [](const DeviceState& s) { return plotted(s.field ? s.field->depth : kUntold); });
  json["field_proxy_m"] =
      columns(states, [](const DeviceState& s) { return s.field ? s.field->proxy : Vec3::Constant(kUntold).eval(); });
}

Json in_json(const PortFrame& port) {
  const auto plain = [](const Vec3& v) -> Json { return {plotted(v.x()), plotted(v.y()), plotted(v.z())}; };
  const bool has_tank = port.need > 0;
  return {{"phase", name(port.phase)},
          {"position_m", plain(port.position)},
          {"force_n", plain(port.force)},
          {"contact_n", port.contact_force ? plain(*port.contact_force) : Json()},
          {"account_j", has_tank ? Json(plotted(port.account)) : Json()},
          {"round_trip_ms", port.round_trip > Duration::zero() ? Json(milliseconds(port.round_trip)) : Json()},
          {"stiffness_n_per_m", port.surface ? Json(plotted(port.surface->stiffness)) : Json()},
          {"share", port.share ? Json(*port.share) : Json()}};
}

/// Replaces invalid UTF-8 by U+FFFD; writes NaN and infinities as null.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

std::string name(Mode mode) {
  return one_of({"unknown", "idle", "active", "holding", "decaying", "safe_stop", "fault"}, mode);
}
std::string name(Safety safety) {
  return one_of({"unknown", "absent", "opening", "firmware", "unhomed", "homed", "armed", "fault", "unguarded"},
                safety);
}
std::string name(PortPhase phase) {
  return one_of({"unknown", "alone", "coupled", "aligning", "engaged", "clutched", "lost", "fault"}, phase);
}
std::string name(Order order) { return one_of({"arm", "disarm", "engage", "disengage"}, order); }
std::string name(Contact contact) { return one_of({"greeting", "open", "unanswered", "refused", "lost"}, contact); }

std::string reason_name(std::size_t bit) {
  std::string name = to_string(Reasons::from_bits(1U << bit));
  std::ranges::replace_if(
      name, [](char c) { return c == ' ' || c == '-'; }, '_');
  return name.empty() ? "bit_" + std::to_string(bit) : name;
}

std::string server_json(const Board& board, const Abilities& abilities) {
  Json devices = Json::array();
  for (const auto& [number, device] : board.devices()) {
    if (device.about) devices.push_back(in_json(*device.about, device.handle, abilities.arming_objection(number)));
  }
  return text_of({{"type", "server"},
                  {"address", abilities.server},
                  {"contact", name(board.contact())},
                  {"words", board.words()},
                  {"version", board.welcome() ? board.welcome()->server : ""},
                  {"recordings", abilities.recordings},
                  {"arms", abilities.arms},
                  {"press", in_json(board.press())},
                  {"devices", std::move(devices)}});
}

std::string states_json(std::uint32_t device, std::span<const DeviceState> states) {
  const auto wanted = [](const DeviceState& s) { return s.force_wanted.value_or(Vec3(kUntold, kUntold, kUntold)); };
  Json json = {
      {"type", "states"},
      {"device", device},
      {"tick", column(states, [](const DeviceState& s) { return s.tick; })},
      // µs in the server's clock; exact in a double for any realistic uptime.
      {"sampled_us", column(states, [](const DeviceState& s) { return nanoseconds(s.sampled) / 1e3; })},
      {"position_m", columns(states, [](const DeviceState& s) { return s.position; })},
      {"wanted_n", columns(states, wanted)},
      {"applied_n", columns(states, [](const DeviceState& s) { return s.force_applied; })},
      {"permitted_n", column(states, [](const DeviceState& s) { return plotted(s.permitted_force); })},
      {"energy_j", column(states, [](const DeviceState& s) { return plotted(s.energy); })},
      {"reasons", column(states, [](const DeviceState& s) { return s.reasons; })},
      {"mode", column(states, [](const DeviceState& s) { return static_cast<unsigned>(s.mode); })},
      {"force_age_ms", column(states, [](const DeviceState& s) { return plotted(milliseconds(s.force_age)); })}};
  add_stiffness(json, states);
  add_handle(json, states);
  add_field(json, states);
  return text_of(json);
}

std::string ports_json(std::uint32_t device, std::span<const Board::Ports> ports) {
  Json rows = Json::array();
  for (const Board::Ports& both : ports) {
    const auto role = role_of(both);
    const PortFrame* const leader = !role ? nullptr : *role == PortRole::kLeader ? &both.own : &*both.peer;
    const auto pair = pair_account(both);
    rows.push_back({{"at_us", nanoseconds(both.at) / 1e3},
                    {"role", role ? Json(*role == PortRole::kLeader ? "leader" : "follower") : Json()},
                    {"own", in_json(both.own)},
                    {"peer", both.peer ? in_json(*both.peer) : Json()},
                    {"position_scale", leader != nullptr ? Json(leader->position_scale) : Json()},
                    {"force_scale", leader != nullptr ? Json(leader->force_scale) : Json()},
                    {"pair_j", pair ? Json(plotted(*pair)) : Json()}});
  }
  return text_of({{"type", "ports"}, {"device", device}, {"rows", std::move(rows)}});
}

std::string reports_json(std::uint32_t number, const Board& board) {
  const LinkStats& link = board.link();
  const auto found = board.devices().find(number);
  const Board::Device* const device = found != board.devices().end() ? &found->second : nullptr;
  Json engines = Json::array();
  if (device != nullptr) {
    for (const auto& [channel, engine] : device->engines) {
      const bool named = device->about && channel < device->about->channels.size();
      engines.push_back(
          engine_json(named ? device->about->channels[channel].name : std::to_string(channel), engine.newest));
    }
  }
  return text_of({{"type", "reports"},
                  {"device", number},
                  {"link",
                   {{"round_trip_ms", milliseconds(link.smoothed_round_trip)},
                    {"received", link.datagrams_received},
                    {"lost", link.lost}}},
                  {"loop", device != nullptr && device->report ? loop_json(*device) : Json()},
                  {"engines", std::move(engines)}});
}

std::string recordings_json(std::span<const Recordings::Entry> entries) {
  Json list = Json::array();
  for (const Recordings::Entry& entry : entries) {
    list.push_back({{"name", entry.name}, {"size_bytes", entry.size}, {"modified_unix_s", entry.modified_unix_s}});
  }
  return text_of(list);
}

}  // namespace tendon::dash
