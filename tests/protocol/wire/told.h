// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <variant>

#include "protocol/wire/codec.h"

namespace tendon {

/// Describes the content bit by bit, including absent fields.
inline std::string told(const DataContent* content) {
  if (content == nullptr) return "malformed";
  std::string text = std::to_string(content->sent.time_since_epoch().count()) + " invalid " +
                     std::to_string(content->invalid) + " " + std::to_string(content->forces_not_finite) + " " +
                     std::to_string(content->forces_out_of_bounds);
  if (const auto& echo = content->echo) {
    text += " echo " + std::to_string(echo->sent.time_since_epoch().count()) + " " +
            std::to_string(echo->received.time_since_epoch().count()) + " " + std::to_string(echo->packet_number) +
            " " + std::to_string(echo->received_mask);
  }
  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  for (const Frame& frame : content->frames) {
    text += " frame " + std::to_string(frame.index()) + " ";
    writer.begin(buffer, {}, LocalTime{}, {});
    std::visit([&](const auto& value) { writer.add(value); }, frame);
    if (const auto* control = std::get_if<Control>(&frame)) text += control->invalid;
    text.append(reinterpret_cast<const char*>(buffer.data()) + kHeaderSize, writer.size() - kHeaderSize);
  }
  return text;
}

}  // namespace tendon
