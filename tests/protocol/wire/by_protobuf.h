// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/stubs/common.h>

#if GOOGLE_PROTOBUF_VERSION < 4022000
#include <google/protobuf/stubs/logging.h>
#endif

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tendon.pb.h"

namespace tendon {

inline std::vector<std::byte> bytes_of(const std::string& text) {
  const auto* const begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

/// Parsed and serialized by libprotobuf. Nothing if the body is malformed.
inline std::optional<std::vector<std::byte>> by_protobuf(std::span<const std::byte> body) {
#if GOOGLE_PROTOBUF_VERSION < 4022000
  const google::protobuf::LogSilencer silence;  // protobuf logs every text that is not UTF-8
#endif
  v1::Datagram parsed;
  if (!parsed.ParseFromArray(body.data(), static_cast<int>(body.size()))) return {};
  parsed.DiscardUnknownFields();
  return bytes_of(parsed.SerializeAsString());
}

}  // namespace tendon
