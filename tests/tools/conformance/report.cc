// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/report.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>
#include <utility>

#include "tests/support/json_line.h"

namespace tendon::conformance {
namespace {

constexpr std::string_view kWire = "WIRE.md";
constexpr std::string_view kSession = "SESSION.md";
constexpr std::string_view kGolden = "vectors/golden.md";
constexpr std::string_view kStream = "stream.h";
constexpr std::string_view kHeader = "Header: 16 bytes in the clear";
constexpr std::string_view kHello = "Type 1, Hello: client → server, always 1200 bytes";
constexpr std::string_view kRetry = "Type 2, Retry: server → client, 48 bytes";
constexpr std::string_view kAnswer = "Type 4, Answer: server → client, shorter than a Hello";
constexpr std::string_view kData = "Type 3, Data: either way";
constexpr std::string_view kSuite1 = "Cipher suite 1";
constexpr std::string_view kSuite2 = "Cipher suite 2";
constexpr std::string_view kOpening = "Opening";
constexpr std::string_view kStates = "States";
constexpr std::string_view kSent = "What is sent when";
constexpr std::string_view kNewest = "State, force and report: newest wins";
constexpr std::string_view kRequests = "Requests: exactly once, in order, answered";
constexpr std::string_view kChannels = "Channels and leases";
constexpr std::string_view kDropped = "Dropped and counted";
constexpr std::string_view kTeleoperation = "Teleoperation";

constexpr Side kServer = Side::kServer;
constexpr Side kClient = Side::kClient;
constexpr Side kBoth = Side::kBoth;
constexpr Side kWorker = Side::kWorker;

constexpr std::array kChecks = {
    Check{"hello-size", kClient, kWire, kHello, "always 1200 bytes"},
    Check{"hello-header", kClient, kWire, kHeader, "Data: 0, 1, 2 … per direction, never twice; 0 in all others"},
    Check{"hello-padding", kClient, kWire, kHello, "zeros"},
    Check{"hello-first-cookie", kClient, kWire, kHello, "cookie from the last Retry; zeros in the first Hello"},
    Check{"hello-body", kClient, kWire, kHello, "n, length of what follows, at most 1000"},
    Check{"hello-repeated", kClient, kSession, kOpening, "The client repeats its Hello every 100 ms."},
    Check{"hello-unchanged", kClient, kWire, kSuite1,
          "an attempt has one Noise message 1, however many cookies it collects"},
    Check{"hello-new-random", kClient, kWire, kHello,
          "client random: new for each attempt, from a cryptographic source"},
    Check{"cookie-returned", kClient, kSession, kOpening, "It replies immediately only to the first Retry"},
    Check{"retry-no-ping-pong", kClient, kSession, kOpening, "later cookies are used in the next repetition"},
    Check{"foreign-retry", kClient, kSession, kOpening,
          "A client only accepts a Retry or an Answer with its own random"},
    Check{"foreign-answer", kClient, kSession, kOpening,
          "A client only accepts a Retry or an Answer with its own random"},
    Check{"version-not-offered", kClient, kSession, kOpening,
          "A client only accepts a Retry or an Answer with its own random, its suite, and an offered version."},
    Check{"bad-answer", kClient, kWire, kAnswer, "Bytes 16–31 the client random of the Hello, then to the end message"},
    Check{"plain-answer", kClient, kSession, kOpening, "A client with a key ignores a plain Answer, even a refusal"},
    Check{"refused", kClient, kWire, kAnswer, "why"},
    Check{"retry", kServer, kWire, kRetry, "Bytes 16–31 the client random of the Hello, 32–47 the cookie."},
    Check{"retry-once", kServer, kSession, kOpening, "never sends more bytes than it received"},
    Check{"bad-hello-silence", kServer, kSession, kOpening, "The server only answers well-formed Hellos"},
    Check{"bad-body-silence", kServer, kSession, kOpening, "The server only answers well-formed Hellos"},
    Check{"cookie-bound", kServer, kSession, kOpening,
          "Cookies depend on address, port, client random, and a key that changes every 120 s."},
    Check{"welcome", kServer, kWire, kAnswer, "which is in the range of the client"},
    Check{"features", kServer, kSession, kOpening,
          "The highest common version and the features named by both are used."},
    Check{"answer-again", kServer, kSession, kOpening,
          "If address and client random are the same, the Hello was resent: the server repeats its answer."},
    Check{"version-highest", kServer, kSession, kOpening,
          "The highest common version and the features named by both are used."},
    Check{"version-mismatch", kServer, kSession, kOpening,
          "Without a common version, the server refuses (CODE_UNSUPPORTED) with its own range."},
    Check{"plain-denied", kServer, kSession, kOpening,
          "A server with keys refuses plain clients on loopback (CODE_DENIED)"},
    Check{"unknown-key-silence", kServer, kSession, kOpening,
          "In suite 1, the server does not answer unknown key ids or Noise messages that are not authentic."},
    Check{"half-open", kServer, kSession, kOpening,
          "the server does not assign a role, end an older session or send a state until then"},
    Check{"one-controller", kServer, kSession, kOpening, "A second controller of a channel is refused (CODE_BUSY)"},
    Check{"replaced", kServer, kSession, kOpening, "The earlier one receives CODE_REPLACED three times"},
    Check{"hello-limit", kServer, kSession, kOpening,
          "Each source IP (IPv6: /64) may send 20 Hellos per second with a valid cookie, 40 at once; others are "
          "dropped and counted."},
    Check{"first-data", kBoth, kSession, kOpening,
          "The client sends this Data immediately, and the server answers it immediately."},
    Check{"data-header", kBoth, kWire, kHeader, "Type 3 has the version that the Answer names."},
    Check{"data-size", kBoth, kWire, "Ground rules", "Each UDP datagram has at most 1200 bytes."},
    Check{"data-opens", kBoth, kWire, kSuite1, "Nonce: 4 zeros ‖ packet number as 8 bytes LE"},
    Check{"suite-2", kBoth, kWire, kSuite2,
          "If the server chooses it, it names it in its Welcome, and suite 2 is used for Data in both directions."},
    Check{"data-body", kBoth, kWire, kData, "After the header, to the end, message Datagram (suites 1 and 2: sealed):"},
    Check{"packet-numbers", kBoth, kWire, kHeader, "Data: 0, 1, 2 … per direction, never twice; 0 in all others"},
    Check{"tx-time", kBoth, kWire, "Ground rules",
          "Times are nanoseconds of the sender's monotonic clock, |t| ≤ 2⁶⁰, never of the wall clock."},
    Check{"echo-newest", kBoth, kWire, kData,
          "Acknowledges the newest accepted datagram of the peer, which is the one with the highest packet number."},
    Check{"echo-times", kBoth, kWire, kData,
          "the time at which that datagram arrived, on the clock of the sender of the echo; T2 ≤ T3"},
    Check{"echo-mask", kBoth, kWire, kData, "Bit i is set if the packet peer_packet_number − 1 − i has also arrived."},
    Check{"keep-alive", kBoth, kSession, kSent, "an empty datagram 50 ms after the last one"},
    Check{"foreign-header", kBoth, kSession, kDropped,
          "wrong length, header, suite or connection id, packet number ≥ 2⁶⁰"},
    Check{"malformed-body", kBoth, kSession, kDropped,
          "not protobuf, text that is not UTF-8, more than 64 frames, or no usable tx_time_ns"},
    Check{"forged", kBoth, kSession, kDropped, "not authentic for the key of its epoch, or too short to be sealed"},
    Check{"damaged-copy", kBoth, kSession, kDropped, "a damaged copy does not block the original"},
    Check{"replay", kBoth, kSession, kDropped, "duplicated: known packet number"},
    Check{"reordering", kBoth, kSession, kDropped, "accepted, but not the newest"},
    Check{"window-edge", kBoth, kSession, kDropped, "duplicated: known packet number, 1984 or more behind the newest"},
    Check{"unknown-ignored", kBoth, kWire, "Ground rules", "Unknown fields, frames and requests are not errors."},
    Check{"out-of-bounds", kBoth, kWire, "Ground rules", "A frame with a value out of bounds is dropped and counted."},
    Check{"newest-wins", kBoth, kSession, kNewest,
          "A received value must have a higher tick, sequence or number than all before, otherwise it is stale"},
    Check{"golden-frame", kBoth, kGolden, "", "Each line has the bytes in hex, then their meaning."},
    Check{"rekey-followed", kBoth, kWire, kSuite1,
          "the next one, to which it moves on once such a datagram has opened"},
    Check{"old-key-overlap", kBoth, kWire, kSuite1, "the previous one for 2 s after moving on"},
    Check{"old-key-over", kBoth, kSession, kDropped,
          "the key of its epoch has expired, or is more than one epoch ahead"},
    Check{"rekey-sent", kBoth, kWire, kSuite1, "The sender renews its key at the latest after 2²⁰ datagrams or 600 s."},
    Check{"states", kServer, kWire, kData, "number of the haptic step"},
    Check{"stray-data-silence", kServer, kSession, kDropped,
          "unknown_connection (Data without a session, or in suite 0 from another address)"},
    Check{"roaming", kServer, kSession, kOpening,
          "A client's address is the source of its authentic datagram with the highest packet number. Addresses of "
          "servers, and in suite 0, never change."},
    Check{"observer-only-looks", kServer, kWire, kHello, "Observers receive states, and controllers also send forces."},
    Check{"rearm-by-controller", kServer, kWire, kData,
          "Clears a latched fault and revokes a Disarm. Can only be used by controllers of the device."},
    Check{"disarm-by-controller", kServer, kWire, kData,
          "Sets the force to zero without a ramp, from the next haptic step until a Rearm. Can be used by any "
          "controller of the device"},
    Check{"forces", kClient, kWire, kData, "1, 2, 3 … per session, device and channel"},
    Check{"force-bounds", kClient, kWire, kData, "the time after its arrival during which the force is fresh"},
    Check{"force-answers", kClient, kWire, kData,
          "the DeviceState.tick of the state that was used for computing the force"},
    Check{"force-granted", kClient, kSession, "Older peers",
          "If either peer does not name a feature, its fields and messages are not sent"},
    Check{"observer-sends-none", kClient, kWire, kHello, "Observers receive states, and controllers also send forces."},
    Check{"request-order", kServer, kSession, kRequests,
          "The responder delivers each request exactly once, and in the order of the numbers."},
    Check{"request-once", kServer, kSession, kRequests,
          "The responder delivers each request exactly once, and in the order of the numbers."},
    Check{"answer-kept", kServer, kSession, kRequests,
          "Its last 16 answers are kept. If a request is received again, its answer is sent again."},
    Check{"request-unknown", kServer, kSession, kRequests,
          "The session itself answers unknown requests with CODE_UNSUPPORTED"},
    Check{"request-invalid", kBoth, kSession, kRequests,
          "If the number of a request is readable, but a field is out of bounds, or has a value of a newer version "
          "such as a new coupling method, the session answers CODE_INVALID with the field in detail"},
    Check{"request-bounds", kServer, kWire, kData,
          "1, 2, 3 … per session and direction. At most 16 requests can be unanswered"},
    Check{"request-numbers", kClient, kSession, kRequests,
          "The requester numbers its requests 1, 2, 3 …, has at most 16 pending"},
    Check{"request-repeated", kClient, kSession, kRequests, "resends each until it is answered"},
    Check{"request-resend-rate", kClient, kSession, kSent,
          "max(20 ms, SRTT + 4 RTTVAR), 100 ms before the first sample; doubled each time up to 1 s, until the answer "
          "or the end of the session"},
    Check{"request-stops", kClient, kSession, kRequests,
          "resends each until it is answered; there is no other acknowledgment"},
    Check{"claims-granted", kServer, kWire, kAnswer, "One for each claim, in the same order."},
    Check{"claim-refused", kServer, kSession, kOpening,
          "It is refused (CODE_INVALID) if a name does not exist (the detail lists the existing ones), if a claim "
          "occurs twice, or if role is not the highest of the claims."},
    Check{"describe", kServer, kWire, kData, "the kind of device, as in Welcome.device_name"},
    Check{"describe-unknown", kServer, kWire, kData,
          "if the server does not have this device, the answer is CODE_INVALID"},
    Check{"lease-denied", kServer, kSession, kChannels, "any, if it was not claimed as a controller | – | CODE_DENIED"},
    Check{"lease-kept", kServer, kSession, kChannels, "none, or the same client | takes it | CODE_OK"},
    Check{"deadband-bounds", kServer, kWire, kData, "If it is not in 0 … 0.5, the answer is CODE_INVALID"},
    Check{"deadband", kServer, kSession, "Narrow links",
          "After a state with velocity v, the next one sent is the first whose velocity differs from v by more than "
          "max(share · |v|, floor), whose mode or buttons differ, or that is max_silence_us later"},
    Check{"link-report", kServer, kSession, "Report",
          "After a controller's first force, the server sends it a LinkReport once a second"},
    Check{"diagnostics-unasked", kServer, kSession, "Older peers",
          "If either peer does not name a feature, its fields and messages are not sent"},
    Check{"handle-unasked", kServer, kSession, "Older peers",
          "If either peer does not name a feature, its fields and messages are not sent"},
    Check{"columns-unasked", kServer, kWire, kData, "server → client, unreliable, with the feature state-columns only"},
    Check{"columns", kServer, kWire, kData,
          "Positions are exact, and all other values are accurate to 6 · 10⁻⁸ of their magnitude."},
    Check{"couple-unasked", kServer, kSession, kTeleoperation,
          "CODE_UNSUPPORTED if the device cannot be coupled, or the feature was not granted"},
    Check{"couple-differs", kServer, kSession, kTeleoperation,
          "CODE_INVALID if they differ; detail names the first difference"},
    Check{"couple", kServer, kSession, kTeleoperation,
          "CODE_OK if the settings match. The server then sends PortStates instead of states of that device"},
    Check{"engage-at-leader", kServer, kSession, kTeleoperation,
          "At a follower, or without a coupling, engage gets CODE_UNSUPPORTED."},
    Check{"scale-at-leader", kServer, kSession, kTeleoperation, "CODE_UNSUPPORTED: no coupling, or a follower."},
    Check{"share-of-several", kServer, kSession, kTeleoperation,
          "CODE_UNSUPPORTED: no coupling, a single leader, or a leader."},
    Check{"output-unasked", kServer, kSession, "Older peers",
          "If either peer does not name a feature, its fields and messages are not sent, and its requests get "
          "CODE_UNSUPPORTED."},
    Check{"output-unknown", kServer, kWire, kData,
          "If the device does not have this output, the answer is CODE_INVALID"},
    Check{"bye-silence", kBoth, kSession, kStates, "A closed session does not send, accept or count anything."},
    Check{"bye-thrice", kBoth, kSession, kStates, "sends Bye three times, drops unsent data"},
    Check{"timeout", kBoth, kSession, kSent, "Replayed, malformed and foreign datagrams do not reset the timeout."},
    Check{"stream-opens", kWorker, kStream, "",
          "The worker opens the stream with sequence 0 and a body of kOpeningMagic and 64 hexadecimal digits of the "
          "secret."},
    Check{"record-length", kWorker, kStream, "", "n, length of the rest, little-endian: 8 … 8 + kMaxDatagram"},
    Check{"stream-silent", kWorker, kStream, "",
          "Only one state is in flight: the proxy waits for the answer before it sends the next."},
    Check{"answer-comes", kWorker, kStream, "", "worker → proxy the same sequence, one frame force"},
    Check{"answer-sequence", kWorker, kStream, "", "worker → proxy the same sequence"},
    Check{"answer-body", kWorker, kStream, "",
          "Each further body is a Datagram of tendon.proto without the network header"},
    Check{"answer-names-state", kWorker, kStream, "",
          "one frame force with based_on_tick = tick of the state and sequence = the record's sequence"},
    Check{"answer-bounds", kWorker, kStream, "", "valid_for_us is ignored but must be valid"},
    Check{"state-in-pieces", kWorker, kStream, "", "records on a byte stream"},
    Check{"state-of-a-handle", kWorker, kWire, kData, "bit i is set if button i is pressed"},
    Check{"state-unknown-field", kWorker, kWire, "Ground rules", "Unknown fields, frames and requests are not errors."},
    Check{"states-in-a-row", kWorker, kStream, "", "proxy → worker sequence 1, 2, 3 …, one frame state"},
    Check{"stream-ends", kWorker, kStream, "", "The worker exits at the end of the stream."},
};

bool concerns(const Check& check, Side side) {
  return (static_cast<unsigned>(check.side) & static_cast<unsigned>(side)) != 0;
}

std::string_view word(Outcome outcome) {
  switch (outcome) {
    case Outcome::kPassed:
      return "pass";
    case Outcome::kFailed:
      return "fail";
    case Outcome::kNotApplicable:
      return "not applicable";
    case Outcome::kUnreached:
      break;
  }
  return "not reached";
}

}  // namespace

std::span<const Check> checks() { return kChecks; }

std::string anchor(const Check& check) {
  std::string out(check.document);
  if (!check.section.empty()) out += '#';
  for (const char c : check.section) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '-' || c == '_') out += static_cast<char>(std::tolower(byte));
    if (c == ' ') out += '-';
  }
  return out;
}

Report::Report(Side side) {
  for (const Check& check : kChecks) {
    if (concerns(check, side)) verdicts_.push_back({.check = &check, .outcome = {}, .seen = {}, .expected = {}});
  }
}

Verdict& Report::find(std::string_view name) {
  const auto found = std::ranges::find(verdicts_, name, [](const Verdict& verdict) { return verdict.check->name; });
  if (found == verdicts_.end()) throw std::logic_error("no check is called " + std::string(name));
  return *found;
}

void Report::judge(std::string_view name, bool kept, std::string seen, std::string expected) {
  Verdict& verdict = find(name);
  if (verdict.outcome == Outcome::kFailed) return;
  verdict.outcome = kept ? Outcome::kPassed : Outcome::kFailed;
  if (kept) return;
  verdict.seen = std::move(seen);
  verdict.expected = std::move(expected);
}

void Report::not_applicable(std::string_view name, std::string why) {
  Verdict& verdict = find(name);
  if (verdict.outcome != Outcome::kUnreached) return;
  verdict.outcome = Outcome::kNotApplicable;
  verdict.seen = std::move(why);
}

std::size_t Report::count(Outcome outcome) const noexcept {
  return static_cast<std::size_t>(std::ranges::count(verdicts_, outcome, &Verdict::outcome));
}

bool Report::failed(std::string_view name) const noexcept {
  return std::ranges::any_of(verdicts_, [name](const Verdict& verdict) {
    return verdict.outcome == Outcome::kFailed && verdict.check->name == name;
  });
}

bool Report::passed() const noexcept { return count(Outcome::kFailed) == 0 && count(Outcome::kUnreached) == 0; }

std::string text_of(const Verdict& verdict) {
  std::string out = std::string(word(verdict.outcome)) + "  " + std::string(verdict.check->name);
  if (verdict.outcome == Outcome::kPassed) return out;
  if (verdict.outcome == Outcome::kFailed) {
    return out + "\n    rule      " + anchor(*verdict.check) + ": " + std::string(verdict.check->sentence) +
           "\n    expected  " + verdict.expected + "\n    seen      " + verdict.seen;
  }
  return out + "  (" + (verdict.seen.empty() ? "the session ended earlier" : verdict.seen) + ')';
}

std::string json_of(const Verdict& verdict) {
  JsonLine line;
  line.add("check", verdict.check->name)
      .add("result", word(verdict.outcome))
      .add("rule", anchor(*verdict.check))
      .add("sentence", verdict.check->sentence);
  if (!verdict.seen.empty()) line.add("seen", verdict.seen);
  if (!verdict.expected.empty()) line.add("expected", verdict.expected);
  return line.str();
}

}  // namespace tendon::conformance
