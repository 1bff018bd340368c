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

#include "core/base/time.h"
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

/// How a conversation is protected, from the fourth byte. Chosen by the client in its first Hello.
enum class Suite : std::uint8_t {
  kPlain = 0,  ///< not at all: loopback only
  kNoise = 1,  ///< Noise_NNpsk0_25519_ChaChaPoly_SHA256
};

/// The 16 bytes in the clear at the front of every datagram; suite 1 authenticates them.
///
///     [0] 0x54 'T' · [1] version << 4 | type · [2] key epoch · [3] cipher suite
///     [4..8) connection id, LE · [8..16) packet number, LE
struct Header {
  DatagramType type = DatagramType::kData;
  Suite suite = Suite::kPlain;
  std::uint8_t epoch = 0;           ///< how often the sender has renewed its key, modulo 256; Data of suite 1 only
  std::uint32_t connection_id = 0;  ///< 0 before the server has given one
  std::uint64_t packet_number = 0;  ///< 0, 1, 2 … per direction in Data, 0 in all others
  bool operator==(const Header&) const = default;
};
inline constexpr std::size_t kHeaderSize = 16;

std::array<std::byte, kHeaderSize> encode_header(const Header& header) noexcept;

/// Empty when the datagram is too short, too long, of another protocol or version, of an unknown type or
/// suite, or has a byte set that must be 0.
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
  Duration wait{};                            ///< with kBusy of a TakeLease; 0 = nobody knows
  std::optional<DeviceDescription> device{};  ///< with kOk of a Describe
};
struct Bye {
  Code code = Code::kOk;
  std::string reason;
};
/// Whether a peer takes what is said of the force itself: `force`, `model` and `error` are within their bounds
/// (WIRE.md).
bool in_bounds(const ForceCommand& command) noexcept;

using Frame = std::variant<DeviceState, ForceCommand, Control, ControlAck, Bye, LinkReport, DeviceReport, PeerReport>;

/// Writes one Data datagram after the other, in the clear. Keeps its protobuf objects: after the first of
/// its kind, a state or a force costs no heap call (a request, or a long text, does).
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

  /// `buffer` must live until the last `add`; what is written stays within it.
  void begin(std::span<std::byte> buffer, const Header& header, LocalTime sent,
             const std::optional<OutgoingEcho>& echo);

  /// Appends one frame; false when it does not fit any more, or is the 65th (then the datagram is as before). A buffer
  /// of kMaxDatagram − 16 bytes or more, without other frames, holds any frame.
  bool add(const DeviceState& state);
  bool add(const ForceCommand& command);
  bool add(const Control& control);
  bool add(const ControlAck& ack);
  bool add(const Bye& bye);
  bool add(const LinkReport& report);
  bool add(const DeviceReport& report);
  bool add(const PeerReport& report);

  std::size_t size() const noexcept { return size_; }

 private:
  struct Pieces;
  template <class Piece>
  bool append(const Piece& piece);

  std::unique_ptr<Pieces> pieces_;
  std::span<std::byte> buffer_;
  std::size_t size_ = 0;
  int frames_ = 0;
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

/// The three as they travel. `body` is in the clear what write_body() gives, in suite 1 that and what
/// the handshake adds: it points into the datagram.
struct HelloDatagram {
  Suite suite = Suite::kPlain;
  ClientRandom random{};
  Cookie cookie{};
  std::span<const std::byte> body;
};
struct RetryDatagram {
  Suite suite = Suite::kPlain;
  ClientRandom random{};
  Cookie cookie{};
};
struct AnswerDatagram {
  Suite suite = Suite::kPlain;
  std::uint32_t connection_id = 0;  ///< 0 with Refused
  ClientRandom random{};
  std::span<const std::byte> body;
};

/// The longest body: of the largest Hello without claims, 674 bytes, and of the largest Welcome, 874, with what suite 1
/// adds to them, 56. A reply is never longer than the Hello it answers.
inline constexpr std::size_t kMaxHandshakeBody = 1000;

/// Each returns the size of the datagram. A Hello always fills kMaxDatagram bytes, so that no reply to
/// it is larger. A body has at most kMaxHandshakeBody bytes.
std::size_t encode(const HelloDatagram& hello, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const RetryDatagram& retry, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const AnswerDatagram& answer, std::span<std::byte, kMaxDatagram> buffer);

/// Each is empty when the datagram is of another type or its layout is not that of the type; the body is
/// not looked into.
std::optional<HelloDatagram> decode_hello(std::span<const std::byte> datagram) noexcept;
std::optional<RetryDatagram> decode_retry(std::span<const std::byte> datagram) noexcept;
std::optional<AnswerDatagram> decode_answer(std::span<const std::byte> datagram) noexcept;

using Answer = std::variant<Welcome, Refused>;

std::vector<std::byte> write_body(const Hello& hello);
std::vector<std::byte> write_body(const Answer& answer);

/// Each is empty when the bytes are not that message, or hold a value out of bounds.
std::optional<Hello> read_hello(std::span<const std::byte> body);
std::optional<Answer> read_answer(std::span<const std::byte> body);

}  // namespace tendon
