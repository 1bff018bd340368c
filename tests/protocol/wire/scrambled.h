// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/dice.h"

namespace tendon {

/// Protobuf allows the following, although no encoder does it: shuffles fields, repeats some, splits messages and lists
/// into pieces, and adds unknown fields.
class Scrambled {
 public:
  explicit Scrambled(Dice& dice) : dice_(dice) {}
  std::string operator()(const google::protobuf::Message& message) {
    std::vector<std::vector<std::string>> pieces = {strange(), strange()};
    std::vector<const google::protobuf::FieldDescriptor*> fields;
    message.GetReflection()->ListFields(message, &fields);
    for (const auto* field : fields) pieces.push_back(pieces_of(message, *field));
    std::string out;
    while (!pieces.empty()) {
      auto& next = pieces[dice_.bits() % pieces.size()];
      if (!next.empty()) out += next.front(), next.erase(next.begin());
      std::erase_if(pieces, [](const auto& left) { return left.empty(); });
    }
    return out;
  }

 private:
  using Field = google::protobuf::FieldDescriptor;

  std::string varint(std::uint64_t value) {
    std::string out;
    for (; value >= 0x80; value >>= 7U) out += static_cast<char>(value | 0x80U);
    out += static_cast<char>(value);
    if (dice_.chance(0.05) && out.size() < 4) {  // longer than necessary
      out.back() = static_cast<char>(out.back() | '\x80');
      out += '\0';
    }
    return out;
  }
  std::string in(std::uint32_t number, const std::string& inside) {
    return varint(number << 3U | 2U) + varint(inside.size()) + inside;
  }
  std::vector<std::string> strange() {
    const std::uint32_t number =
        dice_.chance(0.5) ? 100 + static_cast<std::uint32_t>(dice_.bits() % 100) : (1U << 29U) - 1;
    switch (dice_.bits() % 6) {
      case 0:
        return {varint(number << 3U) + varint(dice_.bits())};
      case 1:
        return {varint(number << 3U | 1U) + "12345678"};
      case 2:
        return {in(number, "\xff strange")};
      case 3: {
        const auto inside = strange();
        return {varint(number << 3U | 3U) + (inside.empty() ? "" : inside[0]) + varint(number << 3U | 4U)};
      }
      case 4:
        return {varint(number << 3U | 5U) + "1234"};
      default:
        return {};
    }
  }
  std::string one(const google::protobuf::Message& message, const Field& field, int index, bool tag) {
    const auto alone = std::unique_ptr<google::protobuf::Message>(message.New());
    alone->CopyFrom(message);
    std::vector<const Field*> fields;
    message.GetReflection()->ListFields(message, &fields);
    for (const Field* other : fields) {
      if (other != &field) alone->GetReflection()->ClearField(alone.get(), other);
    }
    if (field.is_repeated()) {
      const auto* reflection = alone->GetReflection();
      reflection->SwapElements(alone.get(), &field, 0, index);
      while (reflection->FieldSize(*alone, &field) > 1) reflection->RemoveLast(alone.get(), &field);
    }
    const std::string bytes = alone->SerializeAsString();
    const std::string front = field.number() < 16 ? bytes.substr(1) : bytes.substr(2);
    if (!field.is_packed()) return tag ? bytes : front;
    const std::string element = front.substr(1);  // after its length
    const unsigned type = field.cpp_type() == Field::CPPTYPE_DOUBLE  ? 1
                          : field.cpp_type() == Field::CPPTYPE_FLOAT ? 5
                                                                     : 0;
    return tag ? varint(static_cast<std::uint64_t>(field.number()) << 3U | type) + element : element;
  }
  std::vector<std::string> pieces_of(const google::protobuf::Message& message, const Field& field) {
    const auto* reflection = message.GetReflection();
    const auto number = static_cast<std::uint32_t>(field.number());
    std::vector<std::string> out;
    const auto add = [&](const google::protobuf::Message& sub) {
      const std::string whole = (*this)(sub);
      if (field.is_repeated() || dice_.chance(0.7)) return out.push_back(in(number, whole));
      // The message is written twice. The first copy has no lists, because the receiver would join them.
      const auto first = std::unique_ptr<google::protobuf::Message>(sub.New());
      first->CopyFrom(sub);
      drop_lists(*first);
      out.push_back(in(number, (*this)(*first)));
      out.push_back(in(number, whole));
    };
    if (field.cpp_type() == Field::CPPTYPE_MESSAGE) {
      for (int i = 0; field.is_repeated() && i < reflection->FieldSize(message, &field); ++i) {
        add(reflection->GetRepeatedMessage(message, &field, i));
      }
      if (!field.is_repeated()) add(reflection->GetMessage(message, &field));
      return out;
    }
    if (!field.is_repeated()) {
      for (int i = dice_.chance(0.2) ? 2 : 1; i > 0; --i) out.push_back(one(message, field, 0, true));
      return out;
    }
    std::string packed;
    for (int i = 0; i < reflection->FieldSize(message, &field); ++i) {
      if (!field.is_packed() || dice_.chance(0.3)) {
        if (!packed.empty()) out.push_back(in(number, packed));
        packed.clear();
        out.push_back(one(message, field, i, true));
      } else {
        packed += one(message, field, i, false);
      }
    }
    if (!packed.empty()) out.push_back(in(number, packed));
    return out;
  }
  static void drop_lists(google::protobuf::Message& message) {
    std::vector<const Field*> fields;
    message.GetReflection()->ListFields(message, &fields);
    for (const Field* field : fields) {
      if (field->is_repeated()) {
        message.GetReflection()->ClearField(&message, field);
      } else if (field->cpp_type() == Field::CPPTYPE_MESSAGE) {
        drop_lists(*message.GetReflection()->MutableMessage(&message, field));
      }
    }
  }

  Dice& dice_;
};

}  // namespace tendon
