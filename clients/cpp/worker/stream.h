// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cpp/touch.h"
#include "protocol/wire/codec.h"

// The protocol of a proxy and its worker (README.md in this directory) has records on a byte stream in both directions:
//
//     4 bytes   n, length of the rest, little-endian: 8 … 8 + kMaxDatagram
//     8 bytes   sequence, little-endian
//     n − 8     body
//
// The worker opens the stream with sequence 0 and a body of kOpeningMagic and 64 hexadecimal digits of the secret. Each
// further body is a `Datagram` of tendon.proto without the network header:
//
//     proxy → worker   sequence 1, 2, 3 …, one frame `state`
//     worker → proxy   the same sequence, one frame `force` with based_on_tick = tick of the state and sequence = the
//                      record's sequence; or no frame if no force is known. valid_for_us is ignored but must be valid
//
// Only one state is in flight: the proxy waits for the answer before it sends the next. The worker exits at the end of
// the stream.

namespace tendon::worker {

inline constexpr std::string_view kOpeningMagic = "tendon worker 1\n";
/// Environment variables of a worker: the address, "unix:PATH" or "tcp:HOST:PORT", and the secret.
inline constexpr const char* kAddressVariable = "TENDON_WORKER_ADDRESS";
inline constexpr const char* kSecretVariable = "TENDON_WORKER_SECRET";
inline constexpr std::size_t kSecretDigits = 64;

struct Record {
  std::uint64_t sequence = 0;
  std::vector<std::byte> body{};
};

std::vector<std::byte> to_bytes(const Record& record);

/// Reassembles records from a byte stream. Thread-safe: no.
class RecordReader {
 public:
  void add(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  /// Returns the next complete record. Throws std::runtime_error, and is unusable then, if its length is invalid.
  std::optional<Record> next();

 private:
  std::vector<std::byte> bytes_;
};

Record opening(std::string_view secret);
bool opens(const Record& record, std::string_view secret);  ///< constant time if the secret has the right length

/// Converts between bodies and values. Thread-safe: no.
class Codec {
 public:
  Record state(std::uint64_t sequence, const DeviceState& hand);
  std::optional<DeviceState> read_state(const Record& record);  ///< nullopt if the record is not a state

  /// Encodes the answer to that state. Invalid forces are kept, so that the proxy can report the reason.
  Record answer(std::uint64_t sequence, const DeviceState& hand, const Touch& touch);
  struct ReadAnswer {
    std::optional<Touch> touch{};  ///< empty if refused
    std::string_view refused{};    ///< reason, in static storage
  };
  ReadAnswer read_answer(const Record& record, std::uint64_t sequence, const DeviceState& hand);

 private:
  template <class Frame>
  Record record_of(std::uint64_t sequence, const Frame* frame);

  DataWriter writer_;
  DataReader reader_;
};

}  // namespace tendon::worker
