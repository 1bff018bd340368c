// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/inverse/inverse_json.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace tendon::bridge {
namespace {

using nlohmann::json;

constexpr std::string_view kLetters = "XYZ";
constexpr std::string_view kDigits = "0123456789ABCDEF";
constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

const json* member(const json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

const json* member(const json& object, const char* name, const char* below) {
  const json* const outer = member(object, name);
  return outer != nullptr ? member(*outer, below) : nullptr;
}

std::optional<double> number(const json* value) {
  if (value == nullptr || !value->is_number()) return {};
  return value->get<double>();
}

std::optional<Vec3> vector(const json* value) {
  if (value == nullptr) return {};
  Vec3 v;
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    const auto component = number(member(*value, kAxes[i]));
    if (!component) return {};
    v(static_cast<Eigen::Index>(i)) = *component;
  }
  return v;
}

void refuse(Wish& wish, std::string sentence) {
  if (wish.refused.size() < kMostRefusals) wish.refused.push_back(std::move(sentence));
}

std::optional<std::string> permutation_in(const json& holder, Wish& wish) {
  const json* const configure = member(holder, "configure");
  if (configure == nullptr) return {};
  const json* const text = member(*configure, "basis", "permutation");
  if (text == nullptr) {
    ++wish.ignored;
    return {};
  }
  if (text->is_string() && basis_of(text->get_ref<const std::string&>())) return text->get<std::string>();
  refuse(wish, "basis.permutation: expected X, Y and Z once each, with optional signs, like \"XZY\" or \"X-YZ\"");
  return {};
}

void read_commands(const json& commands, DeviceWish& device, Wish& wish) {
  for (const auto& [name, value] : commands.items()) {
    if (name == "set_cursor_force") {
      const json* const newer = member(value, "vector");
      device.force = vector(newer != nullptr ? newer : member(value, "values"));
      if (!device.force) {
        refuse(wish,
               "set_cursor_force: expected \"vector\" or \"values\" with the numbers x, y and z, in N on the hand");
      }
    } else if (name == "tendon") {
      device.torque = vector(member(value, "torque_nm"));
      device.grip_force = number(member(value, "grip_force_n"));
      if (!device.torque && !device.grip_force) {
        refuse(wish, "tendon: expected \"torque_nm\" with the numbers x, y and z, or the number \"grip_force_n\"");
      }
    } else if (name == "set_cursor_position") {
      refuse(wish,
             "set_cursor_position: not supported, because the network is too slow for a position servo; use "
             "set_cursor_force");
    } else if (name != "probe_position") {
      ++wish.ignored;
    }
  }
}

void read_device(const json& entry, Wish& wish) {
  const json* const id = member(entry, "device_id");
  if (id == nullptr || !id->is_string()) return refuse(wish, "inverse3: expected a \"device_id\" with a string");
  DeviceWish& device = wish.devices.emplace_back();
  device.device_id = id->get<std::string>();
  device.permutation = permutation_in(entry, wish);
  if (const json* const commands = member(entry, "commands"); commands != nullptr && commands->is_object()) {
    read_commands(*commands, device, wish);
  }
}

// Replies are written directly to a string. Building a JSON tree would take most of the time of a reply.

void add(std::string& out, double value) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  std::array<char, 32> digits;
  out.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

void add(std::string& out, std::string_view text) {
  const auto plain = [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\'; };
  if (std::ranges::all_of(text, plain)) {
    out.append("\"").append(text).append("\"");
  } else {
    out += json(text).dump(-1, ' ', false, json::error_handler_t::replace);
  }
}

void add(std::string& out, bool value) { out += value ? "true" : "false"; }

void add(std::string& out, const char* text) = delete;  // prevents the conversion to bool

void add(std::string& out, const Vec3& v) {
  add(out += "{\"x\":", v.x());
  add(out += ",\"y\":", v.y());
  add(out += ",\"z\":", v.z());
  out += '}';
}

void add_arm(std::string& out, const DeviceNews& news, bool whole) {
  add(out += "{\"device_id\":", news.device_id);
  if (whole) {
    out += R"(,"config":{"type":"inverse3","handedness":)";
    add(out, std::string_view(news.left_handed ? "left" : "right"));
    add(out += R"(,"preset":"defaults","basis":{"permutation":)", news.permutation);
    out += "}}";
  }
  if (news.state) {
    add(out += R"(,"state":{"cursor_position":)", news.state->position);
    add(out += R"(,"cursor_velocity":)", news.state->velocity);
    add(out += R"(,"current_cursor_force":)", news.state->force);
    out += R"(,"control_domain":"cartesian","control_mode":)";
    out += news.in_use ? R"("force_control"})" : R"("idle"})";
  }
  add(out += R"(,"status":{"ready":)", news.state.has_value());
  add(out += R"(,"in_use":)", news.in_use);
  out += "}}";
}

void add_grip(std::string& out, const DeviceNews& news, bool whole) {
  add(out += "{\"device_id\":", news.grip_id);
  if (whole) out += R"(,"config":{"type":"wireless_verse_grip"})";
  if (news.state) {
    const Quat& q = news.state->orientation;
    add(out += R"(,"state":{"orientation":{"w":)", q.w);
    add(out += ",\"x\":", q.x);
    add(out += ",\"y\":", q.y);
    add(out += ",\"z\":", q.z);
    const auto held = [&](unsigned i) { return (news.state->buttons >> i & 1U) != 0; };
    add(out += R"(},"buttons":{"a":)", held(0));
    add(out += R"(,"b":)", held(1));
    add(out += R"(,"c":)", held(2));
    add(out += R"(,"button_0":)", held(0));
    add(out += R"(,"button_1":)", held(1));
    add(out += R"(,"button_2":)", held(2));
    add(out += R"(,"button_3":)", held(3));
    out += "}}";
  }
  add(out += R"(,"status":{"ready":)", news.state.has_value());
  out += "}}";
}

void add_ours(std::string& out, const DeviceNews& news) {
  add(out += "{\"device_id\":", news.device_id);
  add(out += R"(,"name":)", news.name);
  add(out += R"(,"connected":)", news.state.has_value());
  if (news.state) {
    const DeviceNews::State& state = *news.state;
    out += R"(,"tick":)" + std::to_string(state.tick);
    add(out += R"(,"state_age_ms":)", state.age_ms);
    add(out += R"(,"reasons":)", std::string_view(state.reasons));
    add(out += R"(,"energy_j":)", state.energy_j);
    add(out += R"(,"permitted_force_n":)", state.permitted_force_n);
    add(out += R"(,"force_age_ms":)", state.force_age_ms);
    if (state.angular_velocity) add(out += R"(,"angular_velocity_radps":)", *state.angular_velocity);
    if (state.torque) add(out += R"(,"torque_nm":)", *state.torque);
    if (state.grip_rad) add(out += R"(,"grip_rad":)", *state.grip_rad);
    if (state.grip_force_n) add(out += R"(,"grip_force_n":)", *state.grip_force_n);
  }
  out += '}';
}

template <class Things, class AddOne>
void add_array(std::string& out, const Things& things, AddOne add_one) {
  out += '[';
  bool first = true;
  for (const auto& thing : things) {
    if (!std::exchange(first, false)) out += ',';
    add_one(thing);
  }
  out += ']';
}

}  // namespace

std::optional<Mat3> basis_of(std::string_view permutation) {
  Mat3 basis = Mat3::Zero();
  for (Eigen::Index row = 0; row < 3; ++row) {
    const bool back = permutation.starts_with('-');
    if (back || permutation.starts_with('+')) permutation.remove_prefix(1);
    if (permutation.empty()) return {};
    const std::size_t axis = kLetters.find(permutation.front());
    if (axis == kLetters.npos) return {};
    const auto column = static_cast<Eigen::Index>(axis);
    if (!basis.col(column).isZero()) return {};
    basis(row, column) = back ? -1 : 1;
    permutation.remove_prefix(1);
  }
  if (!permutation.empty()) return {};
  return basis;
}

Frame inverse_frame(const Mat3& basis) {
  Frame frame = *find_frame("inverse");
  frame.from_operator = basis * frame.from_operator;
  return frame;
}

Wish read_wish(std::string_view text) {
  Wish wish;
  const auto unread = [&](std::string why) {
    refuse(wish, "not read: " + std::move(why));
    return wish;
  };
  if (text.size() > kLongestMessage) return unread("longer than " + std::to_string(kLongestMessage) + " bytes");
  bool deep = false;
  const auto see_depth = [&](int depth, json::parse_event_t event, const json&) {
    const bool opens = event == json::parse_event_t::object_start || event == json::parse_event_t::array_start;
    deep = deep || (opens && depth >= kDeepest);
    return !deep;
  };
  const json message = json::parse(text, see_depth, false);
  if (deep) return unread("nested deeper than " + std::to_string(kDeepest) + " objects");
  if (message.is_discarded()) return unread("not JSON, or a number out of range");
  if (!message.is_object()) return unread("expected an object");
  wish.read = true;
  for (const auto& [name, value] : message.items()) {
    if (name == "session") {
      wish.permutation = permutation_in(value, wish);
      wish.full_state = member(value, "force_render_full_state") != nullptr;
    } else if (name == "inverse3") {
      if (!value.is_array()) {
        refuse(wish, "inverse3: expected an array");
        continue;
      }
      for (const json& entry : value) read_device(entry, wish);
    } else if (name != "wireless_verse_grip" && name != "verse_grip") {  // their only command is a query
      ++wish.ignored;
    }
  }
  return wish;
}

std::string to_json(const News& news) {
  const bool whole = news.session_id.has_value();
  std::string out = "{";
  if (whole) out += "\"session_id\":" + std::to_string(*news.session_id) + ",";
  out += "\"inverse3\":";
  add_array(out, news.devices, [&](const DeviceNews& device) { add_arm(out, device, whole); });
  out += ",\"wireless_verse_grip\":";
  add_array(out, news.devices, [&](const DeviceNews& device) { add_grip(out, device, whole); });
  out += ",\"tendon\":{\"refused\":";
  add_array(out, news.refused, [&](const std::string& sentence) { add(out, std::string_view(sentence)); });
  out += ",\"devices\":";
  add_array(out, news.devices, [&](const DeviceNews& device) { add_ours(out, device); });
  return out += "}}";
}

std::string id_of(std::string_view name) {
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  std::string id;
  for (int shift = 28; shift >= 0; shift -= 4) id += kDigits[hash >> shift & 15U];
  return id;
}

}  // namespace tendon::bridge
