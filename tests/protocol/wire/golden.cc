// SPDX-License-Identifier: Apache-2.0
#include "tests/protocol/wire/golden.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/base/bytes.h"
#include "tendon.pb.h"
#include "tests/protocol/examples.h"

namespace tendon::golden {
namespace {

namespace pb = tendon::v1;
using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using Bytes = std::span<const std::byte>;

constexpr std::string_view kOpening = "```golden ";
constexpr std::string_view kClosing = "```";
constexpr std::size_t kAcross = 16;  ///< bytes per line

std::string hex(Bytes bytes) { return examples::hex(bytes, " "); }

std::string hex_number(std::uint32_t value) {
  std::array<char, 8> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, 16).ptr;
  const std::string text(digits.data(), end);
  return "0x" + std::string(8 - text.size(), '0') + text;
}

/// Inserts spaces between groups of three digits if the value is at least 10 000.
std::string grouped(std::int64_t value) {
  std::string text = std::to_string(value);
  const std::size_t sign = value < 0 ? 1 : 0;
  if (text.size() - sign < 5) return text;
  for (std::size_t at = text.size(); at > sign + 3;) text.insert(at -= 3, " ");
  return text;
}

std::string shortest(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

bool all_zero(Bytes bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0}; });
}

class Writer {
 public:
  explicit Writer(Bytes datagram) : rest_(datagram) {}

  std::string take_text() { return std::move(text_); }
  std::size_t left() const { return rest_.size(); }

  Bytes take(std::size_t size) {
    if (size > rest_.size()) throw std::invalid_argument("a datagram ends too early");
    const Bytes taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }

  void line(const std::string& bytes, int depth, std::string_view words) {
    text_ += bytes;
    text_.append(bytes.size() < 3 * kAcross ? 3 * kAcross - bytes.size() : 1, ' ');
    text_ += "; ";
    text_.append(2 * static_cast<std::size_t>(depth), ' ');
    text_ += words;
    text_ += '\n';
  }

  void lines(Bytes bytes, int depth, std::string_view words) {
    line(hex(bytes.first(std::min(kAcross, bytes.size()))), depth, words);
    for (std::size_t at = kAcross; at < bytes.size(); at += kAcross) {
      text_ += hex(bytes.subspan(at, std::min(kAcross, bytes.size() - at))) + '\n';
    }
  }

  void message(const Descriptor& type, std::size_t size, int depth) {
    const std::size_t end = rest_.size() - size;
    while (rest_.size() > end) field(type, depth);
    if (rest_.size() != end) throw std::invalid_argument("a field goes beyond its message");
  }

 private:
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0;; shift += 7) {
      const auto byte = std::to_integer<std::uint64_t>(take(1)[0]);
      value |= (byte & 0x7FU) << shift;
      if (byte < 0x80) return value;
    }
  }

  void field(const Descriptor& type, int depth) {
    const Bytes begin = rest_;
    const auto head = [&] { return begin.first(begin.size() - rest_.size()); };
    const std::uint64_t tag = varint();
    const FieldDescriptor* const about = type.FindFieldByNumber(static_cast<int>(tag >> 3U));
    if (about == nullptr) throw std::invalid_argument(type.name() + " has no field " + std::to_string(tag >> 3U));
    const std::string& name = about->name();
    if ((tag & 7U) != 2) {
      const std::string value = single(*about);
      line(hex(head()), depth, value.empty() ? name : name + ' ' + value);
      return;
    }
    const std::size_t size = varint();
    const std::string bytes = ", " + std::to_string(size) + " bytes";
    if (about->type() == FieldDescriptor::TYPE_MESSAGE) {
      line(hex(head()), depth, name + ": " + about->message_type()->name() + bytes);
      message(*about->message_type(), size, depth + 1);
    } else if (about->type() == FieldDescriptor::TYPE_BYTES) {
      line(hex(head()), depth, name + bytes);
      const Bytes content = take(size);
      const bool same = std::ranges::all_of(content, [&](std::byte b) { return b == content.front(); });
      if (same && size > kAcross) return line(hex(content.first(1)) + " x" + std::to_string(size), depth + 1, "");
      for (std::size_t at = 0; at < size; at += kAcross) {
        text_ += hex(content.subspan(at, std::min(kAcross, size - at))) + '\n';
      }
    } else if (about->type() == FieldDescriptor::TYPE_STRING) {
      const Bytes before = head();
      const Bytes text = take(size);
      const std::string quoted = '"' + std::string(reinterpret_cast<const char*>(text.data()), size) + '"';
      if (head().size() <= kAcross) return line(hex(head()), depth, name + ' ' + quoted);
      line(hex(before), depth, name + bytes + ": " + quoted);
      for (std::size_t at = 0; at < size; at += kAcross) {
        text_ += hex(text.subspan(at, std::min(kAcross, size - at))) + '\n';
      }
    } else {
      packed(*about, size, depth, name + bytes, hex(head()));
    }
  }

  /// Each floating-point number is on its own line. Other numbers share a line.
  void packed(const FieldDescriptor& about, std::size_t size, int depth, const std::string& words,
              const std::string& head) {
    const Bytes all = rest_.first(std::min(size, rest_.size()));
    const std::size_t end = rest_.size() - size;
    std::vector<std::pair<Bytes, std::string>> entries;
    while (rest_.size() > end) {
      const Bytes from = rest_;
      std::string value = single(about);
      entries.emplace_back(from.first(from.size() - rest_.size()), std::move(value));
    }
    line(head, depth, words + ": " + std::to_string(entries.size()) + " entries");
    if (about.type() == FieldDescriptor::TYPE_DOUBLE || about.type() == FieldDescriptor::TYPE_FLOAT) {
      for (const auto& [bytes, value] : entries) line(hex(bytes), depth + 1, value);
      return;
    }
    std::string values;
    for (const auto& entry : entries) values += (values.empty() ? "" : ", ") + entry.second;
    lines(all, depth + 1, values);
  }

  /// Returns the value of a scalar field as text, empty for `true`.
  std::string single(const FieldDescriptor& about) {
    switch (about.type()) {
      case FieldDescriptor::TYPE_DOUBLE:
        return shortest(std::bit_cast<double>(get_little_endian<std::uint64_t>(take(8).data())));
      case FieldDescriptor::TYPE_FLOAT:
        return shortest(std::bit_cast<float>(get_little_endian<std::uint32_t>(take(4).data())));
      case FieldDescriptor::TYPE_SFIXED64:
        return grouped(std::bit_cast<std::int64_t>(get_little_endian<std::uint64_t>(take(8).data())));
      case FieldDescriptor::TYPE_FIXED32:
        return hex_number(get_little_endian<std::uint32_t>(take(4).data()));
      case FieldDescriptor::TYPE_SINT64: {
        const std::uint64_t zigzag = varint();
        return grouped(std::bit_cast<std::int64_t>(zigzag >> 1U ^ (~(zigzag & 1U) + 1U)));
      }
      case FieldDescriptor::TYPE_UINT32:
      case FieldDescriptor::TYPE_UINT64:
        return grouped(static_cast<std::int64_t>(varint()));
      case FieldDescriptor::TYPE_ENUM: {
        const auto number = static_cast<int>(varint());
        const auto* const value = about.enum_type()->FindValueByNumber(number);
        return value != nullptr ? value->name() : std::to_string(number);
      }
      case FieldDescriptor::TYPE_BOOL:
        return varint() != 0 ? "" : "false";
      default:
        throw std::invalid_argument(about.full_name() + ": golden.cc does not show its type yet");
    }
  }

  Bytes rest_;
  std::string text_;
};

}  // namespace

std::string block(Bytes datagram) {
  const auto header = decode_header(datagram);
  if (!header) throw std::invalid_argument("no datagram of ours");
  constexpr std::array<std::string_view, 5> kTypes = {"", "Hello", "Retry", "Data", "Answer"};
  const auto type = static_cast<std::size_t>(header->type);
  const auto suite = static_cast<unsigned>(header->suite);
  Writer out(datagram);
  out.line(hex(out.take(1)), 0, "magic 'T'");
  out.line(hex(out.take(1)), 0,
           "version " + std::to_string(kProtocolVersion) + ", type " + std::to_string(type) + ' ' +
               std::string(kTypes[type]));
  out.line(hex(out.take(2)), 0,
           "key epoch " + std::to_string(header->epoch) + ", suite " + std::to_string(suite) +
               (header->suite == Suite::kPlain ? " plain" : " noise"));
  out.line(hex(out.take(4)), 0,
           header->connection_id == 0 ? "connection id: none" : "connection id " + hex_number(header->connection_id));
  out.line(hex(out.take(8)), 0, "packet number " + grouped(static_cast<std::int64_t>(header->packet_number)));
  if (header->type == DatagramType::kData) {
    out.message(*pb::Datagram::descriptor(), out.left(), 0);
    return out.take_text();
  }
  out.line(hex(out.take(sizeof(ClientRandom))), 0, "client random");
  if (header->type == DatagramType::kAnswer) {
    out.message(*pb::Answer::descriptor(), out.left(), 0);
    return out.take_text();
  }
  const Bytes cookie = out.take(sizeof(Cookie));
  if (all_zero(cookie)) {
    out.line("00 x16", 0, "cookie: none yet");
  } else {
    out.line(hex(cookie), 0, "cookie");
  }
  if (header->type == DatagramType::kHello) {
    const Bytes length = out.take(2);
    const std::size_t size = get_little_endian<std::uint16_t>(length.data());
    out.line(hex(length), 0, std::to_string(size) + " bytes of protobuf follow: Hello");
    out.message(*pb::Hello::descriptor(), size, 1);
    out.line("00 x" + std::to_string(out.left()), 0, "padding to " + std::to_string(datagram.size()) + " bytes");
  }
  return out.take_text();
}

std::map<std::string, std::string> blocks(std::string_view page) {
  std::map<std::string, std::string> out;
  for (std::size_t at = page.find(kOpening); at != std::string_view::npos; at = page.find(kOpening, at)) {
    const std::size_t name = at + kOpening.size();
    const std::size_t begin = page.find('\n', name) + 1;
    at = page.find(kClosing, begin);
    if (begin == 0 || at == std::string_view::npos) throw std::invalid_argument("a golden block has no end");
    out[std::string(page.substr(name, begin - 1 - name))] = page.substr(begin, at - begin);
  }
  return out;
}

std::string rewritten(std::string_view page) {
  std::string out(page);
  auto unseen = blocks(page);
  for (const auto& [name, datagram] : examples::datagrams()) {
    if (unseen.erase(name) == 0)
      throw std::invalid_argument("golden.md has no block \"" + std::string(kOpening) + name + '"');
    const std::size_t begin = out.find(std::string(kOpening) + name + '\n') + kOpening.size() + name.size() + 1;
    out.replace(begin, out.find(kClosing, begin) - begin, block(datagram));
  }
  if (!unseen.empty()) throw std::invalid_argument("examples.h has no \"" + unseen.begin()->first + '"');
  return out;
}

}  // namespace tendon::golden
