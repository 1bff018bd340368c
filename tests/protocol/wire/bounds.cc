// SPDX-License-Identifier: Apache-2.0
#include "tests/protocol/wire/bounds.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "tendon.pb.h"
#include "tests/protocol/examples.h"

namespace tendon::bounds {
namespace {

namespace pb = tendon::v1;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

struct Range {
  std::string least;      ///< as written
  std::string most;       ///< empty: none
  bool beyond = false;    ///< the value `least` itself is out of bounds
  bool infinity = false;  ///< +infinity is within bounds
  bool zero = false;      ///< 0 is within bounds
};

struct Bound {
  std::optional<Range> value;
  std::optional<Range> bytes;
  std::set<int> entries;  ///< allowed numbers near the bounds
  std::set<int> too_few_or_many;
};

/// Parses the entries "[0, 16]" or "{1, 3, 9}": the numbers at the bounds and their neighbors.
void take_entries(const std::string& text, Bound& to) {
  static const std::regex kInterval(R"(\[(\d+), (\d+)\])");
  std::smatch found;
  if (std::regex_match(text, found, kInterval)) {
    to.entries = {std::stoi(found[1]), std::stoi(found[2])};
  } else {
    static const std::regex kNumber(R"(\d+)");
    for (std::sregex_iterator at(text.begin(), text.end(), kNumber), end; at != end; ++at) {
      to.entries.insert(std::stoi(at->str()));
    }
  }
  for (const int entries : to.entries) {
    const bool inner = text.front() == '[';
    if (!inner || entries == *to.entries.begin()) to.too_few_or_many.insert(entries - 1);
    if (!inner || entries == *to.entries.rbegin()) to.too_few_or_many.insert(entries + 1);
  }
  for (const int entries : to.entries) to.too_few_or_many.erase(entries);
  to.too_few_or_many.erase(-1);
}

Range range(const std::string& open, const std::string& least, const std::string& most, std::string_view beside) {
  return {.least = least,
          .most = most == "…" ? "" : most,
          .beyond = open == "(",
          .infinity = beside == " or +infinity",
          .zero = beside == " or 0"};
}

/// Returns the bound at the start of a comment, if any.
std::optional<Bound> bound_of(const std::string& comment) {
  if (comment.empty() || std::string("[({").find(comment.front()) == std::string::npos) return {};
  static const std::string kRange = R"(([\[(])([^,\]]+), ([^\]]+)\])";
  static const std::string kEntries = R"((\[\d+, \d+\]|\{\d+(?:, \d+)*\}) entries)";
  static const std::regex kForms("(?:" + kRange + "( bytes| or \\+infinity| or 0)?(?:, " + kEntries + ")?|" + kEntries +
                                 "(?: of " + kRange + " bytes)?)(?::.*)?");
  std::smatch found;
  if (!std::regex_match(comment, found, kForms)) throw std::invalid_argument("no bound: " + comment);
  Bound out;
  if (found[1].matched && !(found[4] == "" && found[6].matched)) {
    const Range read = range(found[1], found[2], found[3], found[4].str());
    (found[4] == " bytes" ? out.bytes : out.value) = read;
  }
  if (found[5].matched) take_entries(found[5], out);
  if (found[6].matched) take_entries(found[6], out);
  if (found[7].matched) out.bytes = range(found[7], found[8], found[9], {});
  return out;
}

std::map<std::string, Bound> bounds_of(std::string_view proto) {
  static const std::regex kMessage(R"(message (\w+) \{)");
  static const std::regex kField(R"(\s+(?:optional |repeated )?[\w.]+ (\w+) = \d+(?: \[packed = true\])?;\s*// (.*))");
  std::map<std::string, Bound> out;
  std::string message;
  std::istringstream lines{std::string(proto)};
  std::smatch found;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, found, kMessage)) {
      message = found[1];
    } else if (std::regex_match(line, found, kField)) {
      const std::string name = message + '.' + found[1].str();
      if (auto bound = bound_of(found[2])) out[name] = *std::move(bound);
    }
  }
  return out;
}

double number(const std::string& text) { return text.find('^') == std::string::npos ? std::stod(text) : std::exp2(60); }

std::int64_t whole(const std::string& text) {
  if (text == "2^60") return std::int64_t{1} << 60;
  if (text == "-2^60") return -(std::int64_t{1} << 60);
  return std::stoll(text);
}

/// These fields also depend on another field. Even if a value is within its own bound, it may be refused.
bool is_bound_to_others(const std::string& path) {
  static const std::regex kOthers(R"(.*\.(normal|workspace_min_m|workspace_max_m|operator_from_device|orientation|)"
                                  R"(at_orientation|rotation|turn\.turn)\..*)");
  return std::regex_match(path, kOthers);
}

class Maker {
 public:
  Maker(const std::map<std::string, Bound>& bounds, std::vector<Case>& out) : bounds_(bounds), out_(out) {}

  /// With `fill`, also of the lists that are empty in all examples.
  void make(Message& root, bool fill) {
    root_ = &root;
    fill_ = fill;
    visit(root, "");
  }

  const std::set<std::string>& seen() const { return seen_; }

 private:
  void visit(Message& message, const std::string& path) {
    const auto& type = *message.GetDescriptor();
    const auto& reflection = *message.GetReflection();
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      const std::string name = (path.empty() ? type.name() : path) + '.' + field.name();
      if (field.is_repeated() && reflection.FieldSize(message, &field) == 0) {
        const auto bound = bounds_.find(type.name() + '.' + field.name());
        if (!fill_ || bound == bounds_.end() || seen_.contains(bound->first)) continue;
        resize(message, field, std::max(1, *bound->second.entries.begin()));
        mutate(message, field, name);
        reflection.ClearField(&message, &field);
        continue;
      }
      if (fresh(name)) mutate(message, field, name);
      lengthen(message, field, name);
      if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
      const std::string& inner_type = field.message_type()->name();
      const bool is_choice = type.name() == "Frame" || type.name() == "Answer" || type.name() == "Control";
      const bool once = is_choice || field.is_repeated() || inner_type == "LinkReport" || inner_type == "Delays";
      const std::string inner = once ? inner_type : name;
      if (field.is_repeated()) {
        const int size = reflection.FieldSize(message, &field);
        for (int k = 0; k < size; ++k) visit(*reflection.MutableRepeatedMessage(&message, &field, k), inner);
      } else if (reflection.HasField(message, &field)) {
        visit(*reflection.MutableMessage(&message, &field), inner);
      }
    }
  }

  /// Lengths of rotations and normals on both sides of 1 ± 0.001.
  void lengthen(Message& message, const FieldDescriptor& field, const std::string& path) {
    const bool turns = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && field.message_type()->name() == "Quat";
    if (!turns && field.name() != "normal") return;
    const auto& reflection = *message.GetReflection();
    if (!reflection.HasField(message, &field) || !fresh(path + " length")) return;
    const std::string original = message.SerializeAsString();
    for (const auto& [length, accepted] :
         {std::pair{"0.99899", false}, {"0.99901", true}, {"1.00099", true}, {"1.00101", false}}) {
      Message& vector = *reflection.MutableMessage(&message, &field);
      const auto& type = *vector.GetDescriptor();
      const auto& parts = *vector.GetReflection();
      for (int i = 0; i < type.field_count(); ++i) {
        const double part = parts.GetDouble(vector, type.field(i));
        if (part != 0) parts.SetDouble(&vector, type.field(i), part * std::stod(length));
      }
      add(path, std::string("length ") + length, accepted);
      message.ParseFromString(original);
    }
  }

  void add(const std::string& path, const std::string& value, bool accepted) {
    const std::string bytes = root_->SerializeAsString();
    const auto* const begin = reinterpret_cast<const std::byte*>(bytes.data());
    out_.push_back({root_->GetDescriptor()->name(), path, value, accepted, {begin, begin + bytes.size()}});
  }

  bool fresh(const std::string& path) { return paths_.insert(path).second; }

  void mutate(Message& message, const FieldDescriptor& field, const std::string& path) {
    const auto found = bounds_.find(field.containing_type()->name() + '.' + field.name());
    const bool is_enum = field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM;
    if (found == bounds_.end() && !is_enum) return;
    const std::string original = message.SerializeAsString();
    const auto& reflection = *message.GetReflection();
    const auto changed = [&](const std::string& value, bool accepted, const std::function<void()>& change) {
      if (accepted && is_bound_to_others(path)) return;
      change();
      add(path, value, accepted);
      message.ParseFromString(original);
    };
    if (is_enum) {
      const auto& type = *field.enum_type();
      const int last = type.value(type.value_count() - 1)->number();
      const int least = type.value(0)->name().ends_with("_UNSPECIFIED") ? 1 : 0;
      for (const int value : {0, 1, last, last + 1}) {
        changed(std::to_string(value), value >= least && value <= last, [&] {
          if (field.is_repeated()) return reflection.SetRepeatedEnumValue(&message, &field, 0, value);
          reflection.SetEnumValue(&message, &field, value);
        });
      }
      return;
    }
    seen_.insert(found->first);
    const Bound& bound = found->second;
    const bool is_single = field.cpp_type() == FieldDescriptor::CPPTYPE_FLOAT;
    if (bound.value && (is_single || field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE)) {
      const auto set = [&](double value, bool accepted) {
        std::ostringstream words;
        words.precision(17);
        words << value;
        changed(words.str(), accepted, [&] {
          if (is_single) return reflection.SetRepeatedFloat(&message, &field, 0, static_cast<float>(value));
          if (field.is_repeated()) return reflection.SetRepeatedDouble(&message, &field, 0, value);
          reflection.SetDouble(&message, &field, value);
        });
      };
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      // Rounds a value into its bounds, which may have no exact single-precision representation.
      const auto held = [&](double value) {
        const auto single = static_cast<float>(value);
        if (!is_single) return value;
        return static_cast<double>(std::abs(single) > std::abs(value) ? std::nextafter(single, 0.0F) : single);
      };
      const auto next = [&](double from, double to) {
        if (!is_single) return std::nextafter(from, to);
        return static_cast<double>(std::nextafter(static_cast<float>(from), static_cast<float>(to)));
      };
      const double least = held(number(bound.value->least));
      const double most = held(number(bound.value->most));
      set(least, !bound.value->beyond);
      set(next(least, bound.value->beyond ? kInfinity : -kInfinity), bound.value->beyond);
      set(most, true);
      set(next(most, kInfinity), false);
      if (bound.value->zero) {
        set(0, true);
        set(std::nextafter(0, kInfinity), false);
      }
      set(kInfinity, bound.value->infinity);
      set(-kInfinity, false);
      set(std::numeric_limits<double>::quiet_NaN(), false);
    } else if (bound.value) {
      const auto set = [&](std::int64_t value, bool accepted) {
        changed(std::to_string(value), accepted, [&] {
          switch (field.cpp_type()) {
            case FieldDescriptor::CPPTYPE_INT64:
              return reflection.SetInt64(&message, &field, value);
            case FieldDescriptor::CPPTYPE_UINT64:
              if (field.is_repeated()) {
                return reflection.SetRepeatedUInt64(&message, &field, 0, static_cast<std::uint64_t>(value));
              }
              return reflection.SetUInt64(&message, &field, static_cast<std::uint64_t>(value));
            case FieldDescriptor::CPPTYPE_UINT32:
              if (field.is_repeated()) {
                return reflection.SetRepeatedUInt32(&message, &field, 0, static_cast<std::uint32_t>(value));
              }
              return reflection.SetUInt32(&message, &field, static_cast<std::uint32_t>(value));
            default:
              throw std::invalid_argument(path + ": bounds.cc does not set its type yet");
          }
        });
      };
      const std::int64_t least = whole(bound.value->least);
      set(least, true);
      if (least > 0 || field.cpp_type() == FieldDescriptor::CPPTYPE_INT64) set(least - 1, false);
      if (!bound.value->most.empty()) {
        set(whole(bound.value->most), true);
        set(whole(bound.value->most) + 1, false);
      }
    }
    if (bound.bytes) {
      const std::int64_t least = whole(bound.bytes->least);
      const std::int64_t most = whole(bound.bytes->most);
      std::set<std::int64_t> sizes = {most, most + 1};
      if (least > 0) sizes.insert({least - 1, least});
      for (const std::int64_t size : sizes) {
        changed(std::to_string(size) + " bytes", size >= least && size <= most, [&] {
          const std::string text(static_cast<std::size_t>(size), 'x');
          if (field.is_repeated()) return reflection.SetRepeatedString(&message, &field, 0, text);
          reflection.SetString(&message, &field, text);
        });
      }
    }
    const auto resized = [&](int size, bool accepted) {
      changed(std::to_string(size) + " entries", accepted, [&] { resize(message, field, size); });
    };
    for (const int size : bound.entries) resized(size, true);
    for (const int size : bound.too_few_or_many) resized(size, false);
  }

  /// The new entries are zeros, letters or copies of the last entry. The devices in claims and grants must be
  /// different. A new frame is empty, like a frame from a newer peer.
  static void resize(Message& message, const FieldDescriptor& field, int size) {
    const auto& reflection = *message.GetReflection();
    while (reflection.FieldSize(message, &field) > size) reflection.RemoveLast(&message, &field);
    while (reflection.FieldSize(message, &field) < size) {
      const int last = reflection.FieldSize(message, &field) - 1;
      switch (field.cpp_type()) {
        case FieldDescriptor::CPPTYPE_DOUBLE:
          reflection.AddDouble(&message, &field, 0);
          break;
        case FieldDescriptor::CPPTYPE_UINT64:
          reflection.AddUInt64(&message, &field, 0);
          break;
        case FieldDescriptor::CPPTYPE_STRING:
          reflection.AddString(&message, &field, "x");
          break;
        default: {
          Message& entry = *reflection.AddMessage(&message, &field);
          if (last >= 0 && field.name() != "frames") {
            entry.CopyFrom(reflection.GetRepeatedMessage(message, &field, last));
          }
          if (auto* const claim = dynamic_cast<pb::Claim*>(&entry)) claim->set_device("d" + std::to_string(last));
          if (auto* const grant = dynamic_cast<pb::Grant*>(&entry)) {  // two per device, none twice
            grant->set_device(static_cast<std::uint32_t>(last / 2));
            grant->set_channel(static_cast<std::uint32_t>(2 + last % 2));
          }
        }
      }
    }
  }

  const std::map<std::string, Bound>& bounds_;
  std::vector<Case>& out_;
  Message* root_ = nullptr;
  bool fill_ = false;
  std::set<std::string> paths_;
  std::set<std::string> seen_;
};

bool needs_a_bound(const FieldDescriptor& field) {
  switch (field.type()) {
    case FieldDescriptor::TYPE_DOUBLE:
    case FieldDescriptor::TYPE_SFIXED64:
    case FieldDescriptor::TYPE_SINT64:
    case FieldDescriptor::TYPE_FLOAT:
    case FieldDescriptor::TYPE_STRING:
    case FieldDescriptor::TYPE_BYTES:
      return true;
    case FieldDescriptor::TYPE_ENUM:  // its named values
      return false;
    default:
      return field.is_repeated();
  }
}

}  // namespace

std::vector<Case> cases(std::string_view proto) {
  const auto bounds = bounds_of(proto);
  const auto& file = *pb::Datagram::descriptor()->file();
  for (int i = 0; i < file.message_type_count(); ++i) {
    for (int k = 0; k < file.message_type(i)->field_count(); ++k) {
      const FieldDescriptor& field = *file.message_type(i)->field(k);
      const std::string name = file.message_type(i)->name() + '.' + field.name();
      if (needs_a_bound(field) && !bounds.contains(name)) throw std::invalid_argument(name + " has no bound");
    }
  }
  std::vector<Case> out;
  Maker maker(bounds, out);
  for (const bool fill : {false, true}) {
    for (const auto& example : examples::datagrams()) {
      const auto& datagram = example.bytes;  // clang 14 cannot capture structured bindings
      const auto body = [&](std::size_t at) { return std::span(datagram).subspan(at); };
      const auto parse = [](Message& message, std::span<const std::byte> bytes) {
        if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
          throw std::invalid_argument("an example");
      };
      if (const auto hello = decode_hello(datagram)) {
        pb::Hello message;
        parse(message, hello->body);
        maker.make(message, fill);
      } else if (const auto answer = decode_answer(datagram)) {
        pb::Answer message;
        parse(message, answer->body);
        maker.make(message, fill);
      } else if (!decode_retry(datagram)) {
        pb::Datagram message;
        parse(message, body(kHeaderSize));
        maker.make(message, fill);
      }
    }
  }
  for (const auto& [name, bound] : bounds) {
    if (!maker.seen().contains(name)) throw std::invalid_argument("no example holds " + name);
  }
  return out;
}

}  // namespace tendon::bounds
