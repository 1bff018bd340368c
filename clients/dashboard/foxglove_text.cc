// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_text.h"

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

namespace tendon::dash {
namespace {

using Object = nlohmann::ordered_json;

std::string base64(std::string_view bytes) {  // RFC 4648, with padding
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::string_view three = bytes.substr(i, 3);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (k < three.size() ? static_cast<unsigned char>(three[k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= three.size() ? kDigits[bits >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

/// Replaces invalid UTF-8.
std::string dumped(const Object& object) { return object.dump(-1, ' ', false, Object::error_handler_t::replace); }

template <class Integer>
void append_little_endian(std::string& bytes, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
}

std::optional<std::uint32_t> id_of(const nlohmann::json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

FoxgloveOrder subscribe_of(const nlohmann::json& message) {
  const NotUnderstood expected{"Expected “subscribe” with a list “subscriptions” of {“id”: N, “channelId”: N}."};
  const auto list = message.find("subscriptions");
  if (list == message.end() || !list->is_array()) return expected;
  Subscribe order;
  for (const auto& one : *list) {
    if (!one.is_object() || !one.contains("id") || !one.contains("channelId")) return expected;
    const auto subscription = id_of(one["id"]);
    const auto channel = id_of(one["channelId"]);
    if (!subscription || !channel) return expected;
    order.all.push_back({*subscription, *channel});
  }
  return order;
}

FoxgloveOrder unsubscribe_of(const nlohmann::json& message) {
  const NotUnderstood expected{"Expected “unsubscribe” with a list “subscriptionIds” of numbers."};
  const auto list = message.find("subscriptionIds");
  if (list == message.end() || !list->is_array()) return expected;
  Unsubscribe order;
  for (const auto& one : *list) {
    const auto subscription = id_of(one);
    if (!subscription) return expected;
    order.subscriptions.push_back(*subscription);
  }
  return order;
}

}  // namespace

std::string server_info_text(std::string_view name, std::string_view session) {
  return dumped({{"op", "serverInfo"},
                 {"name", name},
                 {"capabilities", Object::array()},
                 {"supportedEncodings", Object::array()},
                 {"metadata", Object::object()},
                 {"sessionId", session}});
}

std::string advertise_text(std::span<const FoxgloveChannel> channels) {
  Object list = Object::array();
  for (const FoxgloveChannel& channel : channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", "protobuf"},
                    {"schemaName", foxglove_schema_name(channel.kind)},
                    {"schema", base64(foxglove_schema(channel.kind))},
                    {"schemaEncoding", "protobuf"}});
  }
  return dumped({{"op", "advertise"}, {"channels", list}});
}

std::string unadvertise_text(std::span<const std::uint32_t> channels) {
  Object list = Object::array();
  for (const std::uint32_t channel : channels) list.push_back(channel);
  return dumped({{"op", "unadvertise"}, {"channelIds", list}});
}

std::string status_text(StatusLevel level, std::string_view id, std::string_view sentence) {
  return dumped({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", sentence}, {"id", id}});
}

std::string message_data(std::uint32_t subscription, UnixTime at, std::string_view payload) {
  std::string bytes;
  bytes.reserve(kMessageDataHead + payload.size());
  bytes += '\x01';
  append_little_endian(bytes, subscription);
  append_little_endian(bytes, static_cast<std::uint64_t>(at));
  bytes += payload;
  return bytes;
}

FoxgloveOrder parse_foxglove_order(std::string_view text) {
  const auto message = nlohmann::json::parse(text, nullptr, false);
  if (!message.is_object() || !message.contains("op") || !message["op"].is_string()) {
    return NotUnderstood{"Expected a JSON object with “op”."};
  }
  const std::string op = message["op"];
  if (op == "subscribe") return subscribe_of(message);
  if (op == "unsubscribe") return unsubscribe_of(message);
  constexpr std::size_t kMostEchoed = 40;
  return NotUnderstood{"Expected “subscribe” or “unsubscribe”, got “" + op.substr(0, kMostEchoed) + "”."};
}

}  // namespace tendon::dash
