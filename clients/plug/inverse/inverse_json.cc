// SPDX-License-Identifier: Apache-2.0
#include "clients/plug/inverse/inverse_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace tendon::plug {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::string_view kLetters = "XYZ";
constexpr std::string_view kDigits = "0123456789ABCDEF";
constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

/// Objects and arrays within each other, counted before anything is built.
int depth_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '\\') ++i;
      quoted = c != '"';
    } else if (c == '"') {
      quoted = true;
    } else if (c == '{' || c == '[') {
      deepest = std::max(deepest, ++depth);
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return deepest;
}

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
  refuse(wish, "basis.permutation: expected X, Y and Z once each, with signs or without: \"XZY\", \"X-YZ\"");
  return {};
}

void read_commands(const json& commands, DeviceWish& device, Wish& wish) {
  for (const auto& [name, value] : commands.items()) {
    if (name == "set_cursor_force") {
      const json* const newer = member(value, "vector");
      device.force = vector(newer != nullptr ? newer : member(value, "values"));
      if (!device.force) {
        refuse(wish, "set_cursor_force: expected \"vector\" or \"values\" with the numbers x, y and z, N on the hand");
      }
    } else if (name == "tendon") {
      device.torque = vector(member(value, "torque_nm"));
      device.grip_force = number(member(value, "grip_force_n"));
      if (!device.torque && !device.grip_force) {
        refuse(wish, "tendon: expected \"torque_nm\" with the numbers x, y and z, or the number \"grip_force_n\"");
      }
    } else if (name == "set_cursor_position") {
      refuse(wish,
             "set_cursor_position: no position servo over a late link; send set_cursor_force, which the limiter "
             "bounds");
    } else if (name != "probe_position") {
      ++wish.ignored;
    }
  }
}

void read_device(const json& entry, Wish& wish) {
  const json* const id = member(entry, "device_id");
  if (id == nullptr || !id->is_string()) return refuse(wish, "inverse3: expected a \"device_id\", a text");
  DeviceWish& device = wish.devices.emplace_back();
  device.device_id = id->get<std::string>();
  device.permutation = permutation_in(entry, wish);
  if (const json* const commands = member(entry, "commands"); commands != nullptr && commands->is_object()) {
    read_commands(*commands, device, wish);
  }
}

ordered_json xyz(const Vec3& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

ordered_json arm(const DeviceNews& news, bool whole) {
  ordered_json entry = {{"device_id", news.device_id}};
  if (whole) {
    entry["config"] = {{"type", "inverse3"},
                       {"handedness", news.left_handed ? "left" : "right"},
                       {"preset", "defaults"},
                       {"basis", {{"permutation", news.permutation}}}};
  }
  if (news.state) {
    entry["state"] = {{"cursor_position", xyz(news.state->position)},
                      {"cursor_velocity", xyz(news.state->velocity)},
                      {"current_cursor_force", xyz(news.state->force)},
                      {"control_domain", "cartesian"},
                      {"control_mode", news.in_use ? "force_control" : "idle"}};
  }
  entry["status"] = {{"ready", news.state.has_value()}, {"in_use", news.in_use}};
  return entry;
}

ordered_json grip(const DeviceNews& news, bool whole) {
  ordered_json entry = {{"device_id", news.grip_id}};
  if (whole) entry["config"] = {{"type", "wireless_verse_grip"}};
  if (news.state) {
    const Quat& q = news.state->orientation;
    const auto held = [&](unsigned i) { return (news.state->buttons >> i & 1U) != 0; };
    entry["state"] = {{"orientation", {{"w", q.w}, {"x", q.x}, {"y", q.y}, {"z", q.z}}},
                      {"buttons",
                       {{"a", held(0)},
                        {"b", held(1)},
                        {"c", held(2)},
                        {"button_0", held(0)},
                        {"button_1", held(1)},
                        {"button_2", held(2)},
                        {"button_3", held(3)}}}};
  }
  entry["status"] = {{"ready", news.state.has_value()}};
  return entry;
}

ordered_json ours(const DeviceNews& news) {
  ordered_json entry = {{"device_id", news.device_id}, {"name", news.name}, {"connected", news.state.has_value()}};
  if (!news.state) return entry;
  const DeviceNews::State& state = *news.state;
  entry["tick"] = state.tick;
  entry["state_age_ms"] = state.age_ms;
  entry["reasons"] = state.reasons;
  entry["energy_j"] = state.energy_j;
  entry["permitted_force_n"] = std::isfinite(state.permitted_force_n) ? ordered_json(state.permitted_force_n) : nullptr;
  entry["force_age_ms"] = state.force_age_ms;
  if (state.angular_velocity) entry["angular_velocity_radps"] = xyz(*state.angular_velocity);
  if (state.torque) entry["torque_nm"] = xyz(*state.torque);
  if (state.grip_rad) entry["grip_rad"] = *state.grip_rad;
  if (state.grip_force_n) entry["grip_force_n"] = *state.grip_force_n;
  return entry;
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
  if (depth_of(text) > kDeepest) return unread("deeper than " + std::to_string(kDeepest) + " objects");
  const json message = json::parse(text, nullptr, false);
  if (message.is_discarded()) return unread("no JSON, or a number that no double holds");
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
    } else if (name != "wireless_verse_grip" && name != "verse_grip") {  // whose only command is to ask
      ++wish.ignored;
    }
  }
  return wish;
}

std::string to_json(const News& news) {
  const bool whole = news.session_id.has_value();
  ordered_json message = ordered_json::object();
  if (whole) message["session_id"] = *news.session_id;
  ordered_json arms = ordered_json::array();
  ordered_json grips = ordered_json::array();
  ordered_json own = ordered_json::array();
  for (const DeviceNews& device : news.devices) {
    arms.push_back(arm(device, whole));
    grips.push_back(grip(device, whole));
    own.push_back(ours(device));
  }
  message["inverse3"] = std::move(arms);
  message["wireless_verse_grip"] = std::move(grips);
  message["tendon"] = {{"refused", news.refused}, {"devices", std::move(own)}};
  return message.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

std::string id_of(std::string_view name) {
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  std::string id;
  for (int shift = 28; shift >= 0; shift -= 4) id += kDigits[hash >> shift & 15U];
  return id;
}

}  // namespace tendon::plug
