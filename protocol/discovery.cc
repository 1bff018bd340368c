// SPDX-License-Identifier: Apache-2.0
#include "protocol/discovery.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <stdexcept>

#include "protocol/limits.h"
#include "protocol/wire/text.h"

namespace tendon::dns_sd {
namespace {

constexpr std::size_t kMaxDomain = 253;
constexpr std::size_t kMaxDomainLabel = 63;

bool is_alnum(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

/// For names of devices and channels, as in scene files.
bool is_label(std::string_view text) {
  return !text.empty() && text.size() <= limits::kMaxLabel &&
         std::all_of(text.begin(), text.end(), [](char c) { return is_alnum(c) || c == '-' || c == '_'; });
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

/// Removes "\X" or "\DDD" from the front of `text`, and returns the character.
char take_escaped(std::string_view& text) {
  text.remove_prefix(1);
  if (text.empty()) throw std::invalid_argument("a backslash must not be the last character");
  if (std::isdigit(static_cast<unsigned char>(text.front())) == 0) {
    const char c = text.front();
    text.remove_prefix(1);
    return c;
  }
  unsigned value = 0;
  const char* const end = text.data() + std::min<std::size_t>(text.size(), 3);
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != text.data() + 3 || value > 255) {
    throw std::invalid_argument("a backslash must be followed by three digits up to 255, or by one other character");
  }
  text.remove_prefix(3);
  return static_cast<char>(static_cast<unsigned char>(value));
}

Instance parse(std::string_view text) {
  Instance instance;
  while (!text.empty() && text.front() != '.') {
    if (text.front() == '\\') {
      instance.name += take_escaped(text);
    } else {
      instance.name += text.front();
      text.remove_prefix(1);
    }
  }
  if (!instance.name.empty() && !is_instance_name(instance.name)) {
    throw std::invalid_argument("a name must have at most 63 bytes of UTF-8 without control characters");
  }
  if (text.empty()) return instance;
  text.remove_prefix(1);
  if (text.ends_with('.')) text.remove_suffix(1);
  if (!is_domain(text)) {
    throw std::invalid_argument(
        "the part after the first dot must be a domain like example.org; write a dot in a name as \\.");
  }
  instance.domain = lower(text);
  return instance;
}

std::string escaped(std::string_view name) {
  std::string text;
  for (const char c : name) {
    if (c == '.' || c == '\\') text += '\\';
    text += c;
  }
  return text;
}

/// Returns 0 if `text` is not a number up to `most`.
std::uint32_t number(std::string_view text, std::uint32_t most) {
  std::uint32_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && stop == end && value <= most ? value : 0;
}

std::vector<std::string> channels_in(std::string_view list) {
  std::vector<std::string> channels;
  while (channels.size() < limits::kMaxChannels) {
    const std::size_t comma = std::min(list.find(','), list.size());
    if (!is_label(list.substr(0, comma))) return {};
    channels.emplace_back(list.substr(0, comma));
    if (comma == list.size()) return channels;
    list.remove_prefix(comma + 1);
  }
  return {};
}

}  // namespace

bool is_instance_name(std::string_view name) noexcept {
  if (name.empty() || name.size() > kMaxName) return false;
  while (!name.empty()) {
    const std::size_t size = utf8_character(name);
    const auto at = [&name](std::size_t i) { return static_cast<unsigned char>(name[i]); };
    const bool control = at(0) < 0x20 || at(0) == 0x7F || (size == 2 && at(0) == 0xC2 && at(1) < 0xA0);
    if (size == 0 || control) return false;
    name.remove_prefix(size);
  }
  return true;
}

bool is_domain(std::string_view name) noexcept {
  std::size_t label = 0;
  for (const char c : name) {
    if (c == '.' ? label == 0 : (!is_alnum(c) && c != '-' && c != '_') || label == kMaxDomainLabel) return false;
    label = c == '.' ? 0 : label + 1;
  }
  return label > 0 && name.size() <= kMaxDomain;
}

std::string another_name(const std::string& name, int attempt) {
  const std::string ending = " #" + std::to_string(attempt);
  return clip(name, kMaxName - ending.size()) + ending;
}

Instance parse_instance(std::string_view text) {
  try {
    return parse(text);
  } catch (const std::invalid_argument& why) {
    throw std::invalid_argument("expected NAME or NAME.DOMAIN like \"falcon at bench 3\", got \"" + std::string(text) +
                                "\": " + why.what());
  }
}

std::string to_string(const Instance& instance) {
  return escaped(instance.name) + (instance.domain == kLocal ? "" : "." + instance.domain);
}

std::string full_name(const Instance& instance) {
  return (instance.name.empty() ? "" : escaped(instance.name) + ".") + kService + "." + instance.domain;
}

std::vector<std::string> to_txt(const About& about) {
  std::string channels;
  for (const std::string& channel : about.channels) channels += (channels.empty() ? "" : ",") + channel;
  return {"v=" + std::to_string(about.version), "device=" + about.device, "hz=" + std::to_string(about.hz),
          "suite=" + std::to_string(about.suite), "channels=" + channels};
}

About read_txt(std::span<const std::string> strings) {
  About about;
  std::vector<std::string> seen;
  for (const std::string& text : strings) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) continue;
    const std::string key = lower(std::string_view(text).substr(0, equals));
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) continue;
    const std::string_view value = std::string_view(text).substr(equals + 1);
    if (key == "v") {
      about.version = number(value, 255);
    } else if (key == "device") {
      if (is_label(value)) about.device = value;
    } else if (key == "hz") {
      about.hz = number(value, limits::kMaxLoopHz);
    } else if (key == "suite") {
      about.suite = number(value, 255);
    } else if (key == "channels") {
      about.channels = channels_in(value);
    } else {
      continue;
    }
    seen.push_back(key);
  }
  return about;
}

std::vector<std::string> split_txt(std::span<const std::byte> data) {
  std::vector<std::string> strings;
  while (!data.empty()) {
    const auto size = std::to_integer<std::size_t>(data.front());
    if (size >= data.size()) break;
    strings.emplace_back(reinterpret_cast<const char*>(data.data()) + 1, size);
    data = data.subspan(size + 1);
  }
  return strings;
}

}  // namespace tendon::dns_sd
