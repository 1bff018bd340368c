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

// What a front and its worker say to each other (README.md of this folder): records on a stream of bytes, either way:
//
//     4 bytes   n, the length of what follows, little-endian: 8 … 8 + kMaxDatagram
//     8 bytes   sequence, little-endian
//     n − 8     the body
//
// The worker opens the stream: sequence 0, the body kOpeningMagic and 64 hexadecimal digits of the secret. From then on
// each body is a `Datagram` of tendon.proto, without the header that it has on the network:
//
//     front → worker   sequence 1, 2, 3 …, one frame `state`
//     worker → front   the same sequence, one frame `force` with based_on_tick = the state's tick and sequence = that
//                      sequence; or no frame: no force is known. valid_for_us is not used, but must be within its bounds
//
// There is one state at a time: the next comes after the answer. The end of the stream ends the worker.

namespace tendon::worker {

inline constexpr std::string_view kOpeningMagic = "tendon worker 1\n";
/// The environment of a worker: "unix:PATH" or "tcp:HOST:PORT", and the secret.
inline constexpr const char* kAddressVariable = "TENDON_WORKER_ADDRESS";
inline constexpr const char* kSecretVariable = "TENDON_WORKER_SECRET";
inline constexpr std::size_t kSecretDigits = 64;

struct Record {
  std::uint64_t sequence = 0;
  std::vector<std::byte> body{};
};

std::vector<std::byte> to_bytes(const Record& record);

/// Puts a stream together again. Thread-safe: no.
class RecordReader {
 public:
  void add(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  /// The next whole record. Throws std::runtime_error when the length is impossible: the stream is of no use then.
  std::optional<Record> next();

 private:
  std::vector<std::byte> bytes_;
};

Record opening(std::string_view secret);
/// In constant time for a secret of the right length.
bool opens(const Record& record, std::string_view secret);

/// Bodies to values and back. Thread-safe: no.
class Codec {
 public:
  Record state(std::uint64_t sequence, const DeviceState& hand);
  /// Empty: it is no state.
  std::optional<DeviceState> read_state(const Record& record);

  /// The answer `touch` to the state `hand` of that sequence. A force that cannot be sent (ForceClient) goes out as it
  /// is, and the front says what is wrong with it.
  Record answer(std::uint64_t sequence, const DeviceState& hand, const Touch& touch);
  struct ReadAnswer {
    std::optional<Touch> touch{};  ///< empty: refused
    std::string_view refused{};    ///< why; of static storage
  };
  /// The answer to `hand`, which was sent with `sequence`.
  ReadAnswer read_answer(const Record& record, std::uint64_t sequence, const DeviceState& hand);

 private:
  template <class Frame>
  Record record_of(std::uint64_t sequence, const Frame* frame);

  DataWriter writer_;
  DataReader reader_;
};

}  // namespace tendon::worker
