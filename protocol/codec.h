// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/time.h"
#include "protocol/link.h"
#include "protocol/messages.h"

// Values to bytes and back: the only place that knows the byte order of the header and protobuf. The
// bytes are in WIRE.md, the bounds in limits.h.
//
// Encoding trusts its input, except that texts and lists are cut to their bounds. Decoding trusts
// nothing: it never throws, never prints, and returns "nothing" for what it refuses.

namespace tendon {

/// What a datagram is, from its second byte.
enum class DatagramType : std::uint8_t {
  kHello = 1,   ///< client → server: may I come in?
  kRetry = 2,   ///< server → client: say it again with this cookie
  kData = 3,    ///< either way, once connected
  kAnswer = 4,  ///< server → client: Welcome or Refused
};

/// The 16 bytes in the clear at the front of every datagram; they become the AEAD's associated data.
///
///     [0] 0x54 'T' · [1] version << 4 | type · [2] key epoch, 0 · [3] 0
///     [4..8) connection id, LE · [8..16) packet number, LE
struct Header {
  DatagramType type = DatagramType::kData;
  std::uint32_t connection_id = 0;  ///< 0 before the server has given one
  std::uint64_t packet_number = 0;  ///< 0, 1, 2 … per direction in Data, 0 in all others
  bool operator==(const Header&) const = default;
};
inline constexpr std::size_t kHeaderSize = 16;

/// Empty when the datagram is too short, too long, of another protocol, version or unknown type, or has
/// a byte set that must be 0.
std::optional<Header> decode_header(std::span<const std::byte> datagram) noexcept;

// ---- Data ----------------------------------------------------------------------------------------

/// The newest datagram that one end has received from the other, told back to it. `Sent` is the clock
/// of the one who sent that datagram, `Received` the clock of the one who tells.
template <class Sent, class Received>
struct BasicEcho {
  Sent sent{};                      ///< T1: when it was sent
  Received received{};              ///< T2: when it arrived
  std::uint64_t packet_number = 0;  ///< its number
  std::uint32_t received_mask = 0;  ///< bit i: packet (packet_number − 1 − i) has arrived too
};
using OutgoingEcho = BasicEcho<PeerTime, LocalTime>;
using IncomingEcho = BasicEcho<LocalTime, PeerTime>;

struct Control {
  std::uint32_t id = 0;
  std::optional<Request> request;  ///< empty: a request this build does not know
};
struct ControlAck {
  std::uint32_t id = 0;
  Code code = Code::kOk;
  std::string detail;
};
struct Bye {
  Code code = Code::kOk;
  std::string reason;
};
using Frame = std::variant<DeviceState, ForceCommand, Control, ControlAck, Bye>;

/// Writes one Data datagram after the other. Keeps its protobuf objects: after the first of its kind, a
/// state or a force costs no heap call (a request, or a long text, does).
///
/// Use: `begin`, `add` until it is false or nothing is left, then send `size()` bytes.
///
/// Thread-safe: no.
class DataWriter {
 public:
  DataWriter();
  ~DataWriter();
  DataWriter(DataWriter&&) noexcept;
  DataWriter& operator=(DataWriter&&) noexcept;

  /// `buffer` must live until the last `add`.
  void begin(std::span<std::byte, kMaxDatagram> buffer, std::uint32_t connection_id, std::uint64_t packet_number,
             LocalTime sent, const std::optional<OutgoingEcho>& echo);

  /// Appends one frame; false when it does not fit any more (then the datagram is as before). A datagram
  /// without other frames holds any frame.
  bool add(const DeviceState& state);
  bool add(const ForceCommand& command);
  bool add(const Control& control);
  bool add(const ControlAck& ack);
  bool add(const Bye& bye);

  std::size_t size() const noexcept { return size_; }

 private:
  struct Pieces;
  template <class Piece>
  bool append(const Piece& piece);

  std::unique_ptr<Pieces> pieces_;
  std::byte* buffer_ = nullptr;
  std::size_t size_ = 0;
};

/// What a Data datagram holds.
struct DataContent {
  PeerTime sent{};
  std::optional<IncomingEcho> echo;
  std::vector<Frame> frames;  ///< in the order of the datagram, every value within bounds
  std::uint32_t invalid = 0;  ///< frames (and echoes) left out because a value was out of bounds
};

/// Reads one Data datagram after the other. Keeps its memory.
///
/// Thread-safe: no.
class DataReader {
 public:
  DataReader();
  ~DataReader();
  DataReader(DataReader&&) noexcept;
  DataReader& operator=(DataReader&&) noexcept;

  /// `body` is what follows the header. Null when it is malformed: not protobuf, too many frames, or
  /// without a usable tx_time. The content lives until the next call.
  const DataContent* read(std::span<const std::byte> body);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

// ---- Handshake -----------------------------------------------------------------------------------

/// Chosen by the client; ties Retry and Answer to one attempt.
using ClientRandom = std::array<std::byte, 16>;
/// Chosen by the server; all zeros in the first Hello.
using Cookie = std::array<std::byte, 16>;

struct HelloDatagram {
  ClientRandom random{};
  Cookie cookie{};
  Hello hello;
};
struct RetryDatagram {
  ClientRandom random{};
  Cookie cookie{};
};
struct AnswerDatagram {
  std::uint32_t connection_id = 0;  ///< 0 with Refused
  ClientRandom random{};
  std::variant<Welcome, Refused> answer;
};

/// Each returns the size of the datagram. A Hello always fills kMaxDatagram bytes, so that no reply to
/// it is larger.
std::size_t encode(const HelloDatagram& hello, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const RetryDatagram& retry, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const AnswerDatagram& answer, std::span<std::byte, kMaxDatagram> buffer);

/// Each is empty when the datagram is of another type, malformed, or holds a value out of bounds.
std::optional<HelloDatagram> decode_hello(std::span<const std::byte> datagram);
std::optional<RetryDatagram> decode_retry(std::span<const std::byte> datagram);
std::optional<AnswerDatagram> decode_answer(std::span<const std::byte> datagram);

}  // namespace tendon
