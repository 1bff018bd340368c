// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <stdexcept>
#include <variant>

#include "protocol/wire/codec.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/raw_protobuf.h"

namespace tendon {

inline constexpr double kInf = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

inline std::span<const std::byte> body(const examples::Bytes& datagram) {
  return std::span(datagram).subspan(kHeaderSize);
}

inline const DataContent* read(DataReader& reader, const examples::Bytes& datagram) {
  return reader.read(body(datagram));
}

/// Returns a tx_time and one frame from the raw content of message Frame.
inline examples::Bytes datagram_with(const RawProtobuf& frame) {
  return RawProtobuf().fixed64(1, 1).message(3, frame).bytes();
}

inline RawProtobuf raw_force(const std::function<void(RawProtobuf&)>& change) {
  RawProtobuf force;
  force.varint(1, 1).varint(5, 1000);
  change(force);
  return RawProtobuf().message(2, force);
}

template <class Message>
Message there(const Message& in) {
  DataReader reader;
  const DataContent* content = read(reader, examples::data(1, {}, in));
  if (content == nullptr) throw std::runtime_error("the datagram is malformed");
  return std::get<Message>(content->frames.at(0));
}

}  // namespace tendon
