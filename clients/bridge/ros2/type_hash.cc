// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/type_hash.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "protocol/secrets/crypto.h"

namespace tendon::bridge {
namespace {

/// Numbers of type_description_interfaces/FieldType. IDL has no name for `char` and `wstring` of ROS.
constexpr int kNested = 1;
constexpr int kUnboundedSequence = 144;  ///< added to the number of the element
constexpr std::array<std::pair<std::string_view, int>, 11> kNumbers = {{{"short", 4},
                                                                        {"unsigned short", 5},
                                                                        {"long", 6},
                                                                        {"unsigned long", 7},
                                                                        {"long long", 8},
                                                                        {"unsigned long long", 9},
                                                                        {"float", 10},
                                                                        {"double", 11},
                                                                        {"boolean", 15},
                                                                        {"octet", 16},
                                                                        {"string", 17}}};

struct Field {
  std::string name;
  int number = 0;
  std::string nested;  ///< name of the type in ROS, if `number` is that of a nested type
};
using Types = std::map<std::string, std::vector<Field>>;  ///< by name in ROS

[[noreturn]] void refuse(std::string_view word, std::string_view expected) {
  throw std::invalid_argument("IDL: expected " + std::string(expected) + ", got \"" + std::string(word) + "\"");
}

bool is_punctuation(char c) { return c == '{' || c == '}' || c == ';' || c == '<' || c == '>'; }

std::vector<std::string> words_of(std::string_view idl) {
  std::vector<std::string> words;
  bool inside = false;  // of a word
  for (std::size_t i = 0; i < idl.size(); ++i) {
    if (idl.substr(i, 2) == "//") i = idl.find('\n', i);
    if (i == std::string_view::npos) break;
    if (idl[i] == ' ' || idl[i] == '\n') {
      inside = false;
    } else if (is_punctuation(idl[i])) {
      words.emplace_back(1, idl[i]);
      inside = false;
    } else {
      if (!std::exchange(inside, true)) words.emplace_back();
      words.back() += idl[i];
    }
  }
  return words;
}

/// "geometry_msgs::msg::dds_::Pose_" is geometry_msgs/msg/Pose.
std::string ros_type(std::string_view dds) {
  constexpr std::string_view kBetween = "::msg::dds_::";
  const auto at = dds.find(kBetween);
  if (at == std::string_view::npos || !dds.ends_with('_')) refuse(dds, "the name of a message, PKG::msg::dds_::NAME_");
  const std::string_view name = dds.substr(at + kBetween.size());
  return std::string(dds.substr(0, at)) + "/msg/" + std::string(name.substr(0, name.size() - 1));
}

class Parser {
 public:
  explicit Parser(std::string_view idl) : words_(words_of(idl)) {}

  Types types() {
    while (next_ < words_.size()) definition("");
    return std::move(types_);
  }

 private:
  std::string take(std::string_view expected) {
    if (next_ == words_.size()) refuse("the end", expected);
    return words_[next_++];
  }
  void expect(std::string_view word) {
    if (const std::string got = take(word); got != word) refuse(got, word);
  }
  bool skip(std::string_view word) {
    const bool found = next_ < words_.size() && words_[next_] == word;
    if (found) ++next_;
    return found;
  }

  void definition(const std::string& scope) {
    const std::string kind = take("module or struct");
    if (kind != "module" && kind != "struct") refuse(kind, "module or struct");
    const std::string name = scope + take("a name");
    expect("{");
    std::vector<Field> fields;
    while (!skip("}")) {
      if (kind == "module") {
        definition(name + "::");
      } else {
        fields.push_back(field(scope));
      }
    }
    expect(";");
    if (kind == "struct") types_.emplace(ros_type(name), std::move(fields));
  }

  Field field(const std::string& scope) {
    Field field;
    if (skip("sequence")) {
      expect("<");
      field.number = kUnboundedSequence;
    }
    std::vector<std::string> words;
    while (!skip(";") && !skip(">")) words.push_back(take("; or >"));
    if (field.number != 0) {
      words.push_back(take("a name"));
      expect(";");
    }
    if (words.size() < 2) refuse(words.empty() ? ";" : words.front(), "a type and a name");
    field.name = std::move(words.back());
    if (field.name.front() == '_') field.name.erase(0, 1);  // escapes a word that IDL reserves
    words.pop_back();
    std::string type = words.front();
    for (std::size_t i = 1; i < words.size(); ++i) type += " " + words[i];
    const auto known = std::ranges::find(kNumbers, type, &std::pair<std::string_view, int>::first);
    if (known == kNumbers.end()) field.nested = ros_type(type.find(':') == std::string::npos ? scope + type : type);
    field.number += known == kNumbers.end() ? kNested : known->second;
    return field;
  }

  std::vector<std::string> words_;
  std::size_t next_ = 0;
  Types types_;
};

const std::vector<Field>& fields_of(const Types& types, const std::string& name) {
  const auto found = types.find(name);
  if (found == types.end()) refuse(name, "a type that is defined");
  return found->second;
}

void add_referenced(const Types& types, const std::string& name, std::set<std::string>& all) {
  for (const Field& field : fields_of(types, name)) {
    if (!field.nested.empty() && all.insert(field.nested).second) add_referenced(types, field.nested, all);
  }
}

std::string description(const Types& types, const std::string& name) {
  std::string text = "{\"type_name\": \"" + name + "\", \"fields\": [";
  std::string_view between;
  for (const Field& field : fields_of(types, name)) {
    text += between;
    text += "{\"name\": \"" + field.name + "\", \"type\": {\"type_id\": " + std::to_string(field.number) +
            ", \"capacity\": 0, \"string_capacity\": 0, \"nested_type_name\": \"" + field.nested + "\"}}";
    between = ", ";
  }
  return text + "]}";
}

}  // namespace

std::string type_hash(std::string_view idl, std::string_view type) {
  const Types types = Parser(idl).types();
  const std::string name = ros_type(type);
  std::set<std::string> referenced;
  add_referenced(types, name, referenced);
  std::string text = "{\"type_description\": " + description(types, name) + ", \"referenced_type_descriptions\": [";
  std::string_view between;
  for (const std::string& one : referenced) {
    text += between;
    text += description(types, one);
    between = ", ";
  }
  text += "]}";
  const Bytes32 digest = crypto::sha256({std::as_bytes(std::span(text))});
  std::string hash = "RIHS01_";
  for (const std::byte byte : digest) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    hash += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    hash += kDigits[std::to_integer<std::size_t>(byte & std::byte{15})];
  }
  return hash;
}

}  // namespace tendon::bridge
