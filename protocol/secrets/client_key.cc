// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/client_key.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "protocol/byte_order_mark.h"

namespace tendon {
namespace {

constexpr std::string_view kLabel = "tendon-key-id";

/// 32 random bytes contain about 30 different values. Only one random key in 10¹¹ contains fewer than 18.
constexpr std::size_t kFewestDifferent = 18;

constexpr std::string_view kExpected = "expected one line, `controller` or `observer` and 64 hexadecimal digits";

std::optional<unsigned> digit(char c) noexcept {
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a' + 10);
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A' + 10);
  return std::nullopt;
}

std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r";
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(kBlank);
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

/// Returns the two words of the line that is not empty or a comment. Throws unless there is exactly one.
std::vector<std::string_view> only_line(std::string_view text) {
  std::vector<std::string_view> found;
  text = without_byte_order_mark(text);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::vector<std::string_view> words = words_of(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty() || words.front().starts_with('#')) continue;
    if (!found.empty()) throw std::invalid_argument(std::string(kExpected) + ", got several lines");
    found = std::move(words);
  }
  if (found.size() != 2) {
    throw std::invalid_argument(std::string(kExpected) + ", got " + std::to_string(found.size()) + " words");
  }
  return found;
}

Key parse_key(std::string_view digits) {
  if (digits.size() < 2 * sizeof(Bytes32)) {
    throw std::invalid_argument("the key is too short: expected 64 hexadecimal digits, got " +
                                std::to_string(digits.size()));
  }
  if (digits.size() > 2 * sizeof(Bytes32)) {
    throw std::invalid_argument("the key is too long: expected 64 hexadecimal digits, got " +
                                std::to_string(digits.size()));
  }
  Key key;
  for (std::size_t i = 0; i < key.bytes().size(); ++i) {
    const auto high = digit(digits[2 * i]);
    const auto low = digit(digits[2 * i + 1]);
    if (!high || !low) throw std::invalid_argument("the key contains characters that are not hexadecimal digits");
    key.bytes()[i] = static_cast<std::byte>(*high << 4U | *low);
  }
  return key;
}

}  // namespace

KeyId key_id(const Key& key) noexcept {
  const Bytes32 hash = crypto::sha256({std::as_bytes(std::span(kLabel)), key.bytes()});
  KeyId id;
  std::copy_n(hash.begin(), id.size(), id.begin());
  return id;
}

std::string key_file_text(const ClientKey& key) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "# Tendon key of " + key.name + ". Server and client have a copy each; nobody else may read it.\n";
  text += key.role == Role::kController ? "controller " : "observer ";
  for (const std::byte b : key.key.bytes()) {
    text += kDigits[std::to_integer<unsigned>(b) >> 4U];
    text += kDigits[std::to_integer<unsigned>(b) & 15U];
  }
  return text += '\n';
}

ClientKey read_key_file(std::string_view text, unsigned mode, std::string name) {
  constexpr unsigned kOthers = 077;
  if ((mode & kOthers) != 0) {
    throw std::invalid_argument(
        "other users can read or write this key; run `chmod 600` on it, and create a new key if others may have read "
        "it");
  }
  const std::vector<std::string_view> words = only_line(text);
  ClientKey key;
  key.name = std::move(name);
  if (words[0] == "controller") {
    key.role = Role::kController;
  } else if (words[0] == "observer") {
    key.role = Role::kObserver;
  } else {
    throw std::invalid_argument(std::string(kExpected) + ", got a line that begins with neither");
  }
  key.key = parse_key(words[1]);
  if (const auto weak = weakness(key.key)) {
    throw std::invalid_argument("the key is weak: " + *weak + "; create one with `tendond keygen NAME`");
  }
  return key;
}

std::optional<std::string> weakness(const Key& key) {
  const Bytes32& bytes = key.bytes();
  std::set<unsigned> values;
  std::set<unsigned> steps;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    values.insert(std::to_integer<unsigned>(bytes[i]));
    if (i > 0) steps.insert((std::to_integer<unsigned>(bytes[i]) - std::to_integer<unsigned>(bytes[i - 1])) & 0xFFU);
  }
  if (values.size() < kFewestDifferent) return "it repeats the same few bytes";
  if (steps.size() < kFewestDifferent) return "its bytes follow a pattern";
  const auto printable = [](std::byte b) { return b >= std::byte{0x20} && b < std::byte{0x7F}; };
  if (std::all_of(bytes.begin(), bytes.end(), printable)) return "it is typed text";
  return std::nullopt;
}

}  // namespace tendon
