// SPDX-License-Identifier: Apache-2.0
#include "tests/protocol/wire/vectors.h"

#include <google/protobuf/util/json_util.h>

#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/expect.h"
#include "protocol/field/manifest.h"
#include "protocol/handshake.h"
#include "protocol/reliable/replay_window.h"
#include "protocol/secrets/blake2b.h"
#include "protocol/secrets/client_key.h"
#include "protocol/secrets/noise.h"
#include "protocol/secrets/seal.h"
#include "tendon.pb.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/field/field_vectors.h"
#include "tests/protocol/wire/bounds.h"

namespace tendon::vectors {
namespace {

using examples::Bytes;
using examples::hex;

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    switch (c) {
      case '\n':
        out += "\\n";
        break;
      case '\r':
        out += "\\r";
        break;
      case '\t':
        out += "\\t";
        break;
      default:
        out += c;
    }
  }
  return out += '"';
}

std::string indented(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c;
    if (c == '\n') out += "  ";
  }
  return out;
}

/// A JSON object with a fixed order of fields. The values are already JSON.
class Object {
 public:
  Object& json(std::string_view name, std::string_view value) {
    text_ += (text_.empty() ? "\n  " : ",\n  ") + quoted(name) + ": " + indented(value);
    return *this;
  }
  Object& text(std::string_view name, std::string_view value) { return json(name, quoted(value)); }
  Object& bytes(std::string_view name, std::span<const std::byte> value) { return text(name, hex(value)); }
  Object& number(std::string_view name, std::uint64_t value) { return json(name, std::to_string(value)); }
  Object& flag(std::string_view name, bool value) { return json(name, value ? "true" : "false"); }
  std::string str() const { return "{" + text_ + "\n}"; }

 private:
  std::string text_;
};

std::string list(const std::vector<std::string>& items) {
  std::string out;
  for (const std::string& item : items) out += (out.empty() ? "\n  " : ",\n  ") + indented(item);
  return "[" + out + "\n]";
}

template <class Message>
std::string meaning(std::span<const std::byte> body) {
  Message message;
  message.ParseFromArray(body.data(), static_cast<int>(body.size()));
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string out;
  if (!google::protobuf::util::MessageToJsonString(message, &out, options).ok()) out = "null";
  return out;
}

std::span<const std::byte> text_bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

/// Returns a fixed key. It is for test vectors only.
Key key_of(std::string_view what) { return Key(crypto::sha256({text_bytes("tendon vectors: "), text_bytes(what)})); }

template <std::size_t Size>
Bytes first(const std::array<std::byte, Size>& buffer, std::size_t size) {
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)};
}

using Buffer = std::array<std::byte, kMaxDatagram>;

struct Shown {
  std::string name;
  bool to_server;
  std::uint64_t packet_number;
  std::uint8_t epoch;
  Bytes plain;
};

std::vector<Shown> shown(std::uint64_t far) {
  const auto at = [](std::uint64_t packet_number, const auto&... frames) {
    return examples::data(packet_number, packet_number == 0 ? std::optional<OutgoingEcho>() : examples::echo(),
                          frames...);
  };
  const Control rate{.id = 7, .request = SetStateRate{.hz = 500}};
  const Control rearm{.id = 8, .request = Rearm{}};
  const ControlAck ack{.id = 7, .code = Code::kOk, .detail = "500 Hz"};
  const auto request = [&](std::uint64_t packet_number, std::uint32_t id, const Request& what) {
    return at(packet_number, Control{.id = id, .request = what});
  };
  const Bye bye{.code = Code::kShutdown, .reason = "SIGTERM"};
  return {
      {"keep-alive from the client", true, 0, 0, at(0)},
      {"keep-alive from the server", false, 0, 0, at(0)},
      {"state", false, 1, 0, at(1, examples::state())},
      {"force", true, 1, 0, at(1, examples::force())},
      {"force at packet number 255", true, 255, 0, at(255, examples::force())},
      {"state rate", true, 256, 0, at(256, rate)},
      {"rearm and a force in one datagram", true, 257, 0, at(257, examples::force(), rearm)},
      {"states of two devices", false, 2, 0, at(2, examples::state(), examples::state_of_the_second_device())},
      {"force to a channel", true, 258, 0, at(258, examples::force_to_a_channel())},
      {"state rate of a device", true, 259, 0, request(259, 9, SetStateRate{.hz = 250, .device = 1})},
      {"rearm a device", true, 260, 0, request(260, 10, Rearm{.device = 1})},
      {"describe", true, 261, 0, request(261, 11, Describe{.device = 1})},
      {"description", false, 3, 0, at(3, examples::described(11))},
      {"take a lease", true, 262, 0, request(262, 12, TakeLease{.device = 1, .channel = 1})},
      {"another one holds it", false, 4, 0, at(4, examples::busy(12))},
      {"give a lease", true, 263, 0, request(263, 13, GiveLease{.device = 1, .channel = 1})},
      {"a lease is lost", false, 5, 0, request(5, 1, LeaseLost{.device = 1, .channel = 1, .to = "wall"})},
      {"answer to a request", false, 258, 0, at(258, ack)},
      {"report on a client's forces", false, 261, 0, at(261, examples::report())},
      {"deadband of states", true, 264, 0, at(264, examples::state_deadband())},
      {"force with all that it can say", true, 265, 0, at(265, examples::force_with_all())},
      {"state with the force that is wanted", false, 266, 0, at(266, examples::state_with_wanted())},
      {"reports on a device and on an engine", false, 267, 0,
       at(267, examples::device_report(), examples::peer_report())},
      {"disarm a device", true, 268, 0, request(268, 14, Disarm{.device = 1})},
      {"buttons that are held", false, 269, 0, at(269, examples::state_with_buttons())},
      {"description of a handle", false, 270, 0, at(270, examples::handle_described(15))},
      {"a handle with all there is", false, 271, 0, at(271, examples::state_with_handle())},
      {"torque and grip force", true, 272, 0, at(272, examples::force_with_torque())},
      {"one end of a coupling", true, 273, 0, at(273, examples::port())},
      {"its other end beside a state", false, 274, 0, at(274, examples::state(), examples::port_in_contact())},
      {"one by waves or by a surface", true, 290, 0, at(290, examples::port_by_model())},
      {"couple a device", true, 275, 0, request(275, 15, examples::couple())},
      {"engage", true, 276, 0, request(276, 16, Engage{.device = 1})},
      {"disengage", true, 277, 0, request(277, 17, Disengage{.device = 1})},
      {"set a lamp", true, 278, 0, request(278, 18, examples::lamp())},
      {"start a pulse", true, 279, 0, request(279, 19, examples::vibration())},
      {"outputs of a device", false, 280, 0, at(280, examples::outputs_described(15))},
      {"both ends of a coupling to an observer", false, 281, 0, at(281, examples::port(), examples::port_with_all())},
      {"couple a device with all there is", true, 291, 0, request(291, 20, examples::couple_with_all())},
      {"set the scales of a coupling", true, 292, 0, request(292, 21, examples::set_scale())},
      {"set the share of a leader", true, 293, 0, request(293, 22, examples::set_share())},
      {"force with the way of its answer", true, 294, 0, at(294, examples::force_with_way())},
      {"report on an engine that says its way", false, 282, 0, at(282, examples::peer_report_with_way())},
      {"offer a field", true, 295, 0, request(295, 23, examples::offer_field())},
      {"use a field", true, 296, 0, request(296, 24, examples::use_field())},
      {"drop a field", true, 297, 0, request(297, 25, examples::drop_field())},
      {"a brick", true, 298, 0, at(298, examples::field_brick())},
      {"what is missing of a field", false, 283, 0, at(283, examples::field_status())},
      {"pose of a field", true, 299, 0, at(299, examples::field_pose())},
      {"state with a field", false, 284, 0, at(284, examples::state_with_field())},
      {"a truth", true, 300, 0, at(300, examples::truth())},
      {"force far away", true, far, 0, at(far, examples::force())},
      {"bye", false, 259, 0, at(259, bye)},
  };
}

DeviceState later_state() {
  DeviceState state = examples::state();
  ++state.tick;
  return state;
}

std::string direction(bool to_server) { return to_server ? "client_to_server" : "server_to_client"; }

std::string plain_file() {
  const Bytes hello = write_body(examples::hello());
  const Bytes welcome = write_body(Answer(examples::welcome()));
  const Bytes refused = write_body(Answer(examples::refused()));
  const Bytes claims = write_body(examples::hello_with_claims());
  const Bytes grants = write_body(Answer(examples::welcome_with_grants()));
  const auto datagrams = examples::datagrams();
  std::vector<std::string> data;
  for (const Shown& d : shown(std::uint64_t{1} << 32)) {
    const auto body = std::span(d.plain).subspan(kHeaderSize);
    data.push_back(Object()
                       .text("name", d.name)
                       .text("direction", direction(d.to_server))
                       .text("packet_number", std::to_string(d.packet_number))
                       .json("message", meaning<v1::Datagram>(body))
                       .bytes("body", body)
                       .bytes("datagram", d.plain)
                       .str());
  }
  return Object()
             .number("suite", 0)
             .bytes("client_random", examples::random())
             .bytes("cookie", examples::cookie())
             .number("connection_id", examples::kConnection)
             .json("hello", Object()
                                .json("message", meaning<v1::Hello>(hello))
                                .bytes("body", hello)
                                .bytes("datagram", datagrams[0].bytes)
                                .str())
             .json("retry", Object().bytes("datagram", datagrams[1].bytes).str())
             .json("welcome", Object()
                                  .json("message", meaning<v1::Answer>(welcome))
                                  .bytes("body", welcome)
                                  .bytes("datagram", datagrams[2].bytes)
                                  .str())
             .json("refused", Object()
                                  .json("message", meaning<v1::Answer>(refused))
                                  .bytes("body", refused)
                                  .bytes("datagram", datagrams[3].bytes)
                                  .str())
             .json("hello_with_claims", Object()
                                            .json("message", meaning<v1::Hello>(claims))
                                            .bytes("body", claims)
                                            .bytes("datagram", examples::hello_datagram(examples::hello_with_claims()))
                                            .str())
             .json("welcome_with_grants",
                   Object()
                       .json("message", meaning<v1::Answer>(grants))
                       .bytes("body", grants)
                       .bytes("datagram",
                              examples::answer_datagram(examples::kConnection, examples::welcome_with_grants()))
                       .str())
             .json("data", list(data))
             .str() +
         "\n";
}

/// The answer of the server to a Noise message 1, and the keys of `suite` that can be used after it.
struct Answered {
  std::string json;
  NoiseSplit split;
  NoiseSplit keys;
};
Answered answered(Suite suite, const Key& psk, std::span<const std::byte> prologue, const NoiseInitiator& client,
                  std::string_view ephemeral_name, std::uint32_t connection_id, const Answer& answer) {
  const Key ephemeral = key_of(ephemeral_name);
  const Bytes body = write_body(answer);
  const auto server = NoiseResponder::read(psk, prologue, client.message());
  const auto reply = server->reply(ephemeral, body);
  const AnswerDatagram datagram{
      .suite = Suite::kNoise, .connection_id = connection_id, .random = examples::random(), .body = reply->message};
  const NoiseSplit keys = suite == Suite::kAesGcm ? split_of_suite_2(reply->split) : reply->split;
  Object json;
  json.json("message", meaning<v1::Answer>(body))
      .bytes("body", body)
      .bytes("server_ephemeral", ephemeral.bytes())
      .bytes("noise_message", reply->message)
      .bytes("datagram", examples::encoded(datagram))
      .bytes("handshake_hash", reply->split.handshake_hash);
  if (suite == Suite::kAesGcm) {
    json.bytes("split_client_to_server_key", reply->split.initiator_to_responder.bytes())
        .bytes("split_server_to_client_key", reply->split.responder_to_initiator.bytes());
  }
  json.bytes("client_to_server_key", keys.initiator_to_responder.bytes())
      .bytes("server_to_client_key", keys.responder_to_initiator.bytes());
  return {json.str(), reply->split, keys};
}

Bytes sealed(Suite suite, const Key& key, Header header, std::span<const std::byte> body) {
  header.suite = suite;
  const auto clear = encode_header(header);
  Bytes out(clear.begin(), clear.end());
  out.resize(kHeaderSize + body.size() + crypto::kTagSize);
  SealingKey(suite, key).seal(header.packet_number, clear, body, std::span(out).subspan(kHeaderSize));
  return out;
}

Key renewed(Suite suite, const Key& key) {
  return suite == Suite::kAesGcm ? crypto::AesGcm(key).renewed() : crypto::renewed(key);
}

/// Returns the example with the token of suite 2, which is the last one of a client and the first one of a server.
Hello offering(Suite suite) {
  Hello hello = examples::hello();
  if (suite == Suite::kAesGcm) hello.features.emplace_back(kFeatureAesGcm);
  return hello;
}
Welcome choosing(Suite suite) {
  Welcome welcome = examples::welcome();
  if (suite == Suite::kAesGcm) welcome.features.emplace(welcome.features.begin(), kFeatureAesGcm);
  return welcome;
}

std::string sealed_file(Suite suite) {
  const Key psk = key_of("key");
  const KeyId id = key_id(psk);
  const Bytes hello = write_body(offering(suite));

  Bytes prologue;
  const auto append = [](Bytes& to, std::span<const std::byte> piece) {
    to.insert(to.end(), piece.begin(), piece.end());
  };
  append(prologue, text_bytes("tendon-1"));
  append(prologue, encode_header({.type = DatagramType::kHello, .suite = Suite::kNoise}));
  append(prologue, id);
  append(prologue, examples::random());
  const NoiseInitiator client(psk, key_of("client ephemeral"), prologue, hello);
  Bytes body(id.begin(), id.end());
  append(body, client.message());
  const auto hello_datagram = [&](const Cookie& cookie) {
    return examples::encoded(
        HelloDatagram{.suite = Suite::kNoise, .random = examples::random(), .cookie = cookie, .body = body});
  };
  const auto welcome =
      answered(suite, psk, prologue, client, "server ephemeral", examples::kConnection, choosing(suite));
  const auto refused = answered(suite, psk, prologue, client, "another server ephemeral", 0, examples::refused());

  const Key& up = welcome.keys.initiator_to_responder;
  const Key& down = welcome.keys.responder_to_initiator;
  const Key next_up = renewed(suite, up);
  const Key next_down = renewed(suite, down);
  std::vector<Shown> all = shown(std::uint64_t{1} << 32);
  // The Bye remains the last datagram. It uses the previous key and is late.
  const std::uint64_t far = (std::uint64_t{1} << 32) + 1;
  all.insert(all.end() - 1,
             {{"force after the first rekey", true, far, 1, examples::data(far, examples::echo(), examples::force())},
              {"state after the first rekey", false, 260, 1, examples::data(260, examples::echo(), later_state())}});
  std::vector<std::string> data;
  for (const Shown& d : all) {
    const Key& key = d.to_server ? (d.epoch == 0 ? up : next_up) : (d.epoch == 0 ? down : next_down);
    const auto plain = std::span(d.plain).subspan(kHeaderSize);
    const Header header{.epoch = d.epoch, .connection_id = examples::kConnection, .packet_number = d.packet_number};
    data.push_back(Object()
                       .text("name", d.name)
                       .text("direction", direction(d.to_server))
                       .text("packet_number", std::to_string(d.packet_number))
                       .number("epoch", d.epoch)
                       .bytes("key", key.bytes())
                       .json("message", meaning<v1::Datagram>(plain))
                       .bytes("body", plain)
                       .bytes("datagram", sealed(suite, key, header, plain))
                       .str());
  }

  // A client drops this datagram directly after the handshake.
  Bytes state = examples::data(1, examples::echo(), examples::state());
  state.erase(state.begin(), state.begin() + kHeaderSize);
  const Header good{.connection_id = examples::kConnection, .packet_number = 1};
  std::vector<std::string> dropped;
  const auto drop = [&](std::string_view name, std::string_view counter, const Bytes& datagram) {
    dropped.push_back(Object().text("name", name).text("counter", counter).bytes("datagram", datagram).str());
  };
  const auto spoiled = [&](std::size_t at, bool from_end) {
    Bytes bad = sealed(suite, down, good, state);
    bad[from_end ? bad.size() - at : at] ^= std::byte{1};
    return bad;
  };
  const auto with = [&](auto change, const Key& key) {
    Header header = good;
    change(header);
    return sealed(suite, key, header, state);
  };
  drop("a bit of the packet number has changed", "forged", spoiled(8, false));
  drop("a bit of the body has changed", "forged", spoiled(kHeaderSize, false));
  drop("a bit of the tag has changed", "forged", spoiled(1, true));
  drop("sealed with the key of the other direction", "forged", sealed(suite, up, good, state));
  drop("says epoch 1, sealed with the key of epoch 0", "forged", with([](Header& h) { h.epoch = 1; }, down));
  drop("epoch 2", "old_key", with([](Header& h) { h.epoch = 2; }, renewed(suite, next_down)));
  drop("epoch 255, before the first", "old_key", with([](Header& h) { h.epoch = 255; }, down));
  drop("packet number 2^60", "malformed", with([](Header& h) { h.packet_number = std::uint64_t{1} << 60; }, down));
  drop("connection id of somebody else", "malformed", with([](Header& h) { ++h.connection_id; }, down));
  drop("in the clear, suite 0", "malformed", examples::data(1, examples::echo(), examples::state()));
  drop("authentic, but no protobuf", "malformed", sealed(suite, down, good, Bytes(3, std::byte{0xFF})));
  if (suite == Suite::kAesGcm) {
    const Key& split = welcome.split.responder_to_initiator;
    drop("in suite 1, with the key that Split() gave", "malformed", sealed(Suite::kNoise, split, good, state));
    drop("the key that Split() gave", "forged", sealed(suite, split, good, state));
    // The number in the nonce is reversed, as in a little-endian implementation. The number in the header is correct.
    const auto clear = encode_header({.suite = suite, .connection_id = examples::kConnection, .packet_number = 1});
    Bytes turned(clear.begin(), clear.end());
    turned.resize(kHeaderSize + state.size() + crypto::kTagSize);
    SealingKey(suite, down).seal(std::uint64_t{1} << 56, clear, state, std::span(turned).subspan(kHeaderSize));
    drop("the nonce little-endian", "forged", turned);
  }
  Bytes cut = sealed(suite, down, good, state);
  cut.resize(kHeaderSize + crypto::kTagSize / 2);
  drop("header and half a tag", "forged", cut);

  return Object()
             .number("suite", static_cast<std::uint64_t>(suite))
             .text("protocol", "Noise_NNpsk0_25519_ChaChaPoly_SHA256")
             .bytes("psk", psk.bytes())
             .bytes("key_id", id)
             .bytes("client_random", examples::random())
             .bytes("client_ephemeral", key_of("client ephemeral").bytes())
             .bytes("cookie", examples::cookie())
             .number("connection_id", examples::kConnection)
             .json("hello", Object()
                                .json("message", meaning<v1::Hello>(hello))
                                .bytes("body", hello)
                                .bytes("prologue", prologue)
                                .bytes("noise_message", client.message())
                                .bytes("first_datagram", hello_datagram({}))
                                .bytes("datagram", hello_datagram(examples::cookie()))
                                .str())
             .json("retry", Object()
                                .bytes("datagram", examples::encoded(RetryDatagram{.suite = Suite::kNoise,
                                                                                   .random = examples::random(),
                                                                                   .cookie = examples::cookie()}))
                                .str())
             .json("welcome", welcome.json)
             .json("refused", refused.json)
             .json("data", list(data))
             .json("dropped", list(dropped))
             .str() +
         "\n";
}

std::string replay_file() {
  struct Script {
    std::string_view name;
    std::vector<std::uint64_t> numbers;
  };
  const std::vector<Script> scripts = {
      {"in order, each once", {0, 1, 2, 3, 2, 3, 4}},
      {"out of order", {5, 3, 4, 3, 5, 0, 1, 2, 6}},
      {"the first is not 0", {1000, 999, 1000, 0, 0}},
      {"the horizon is 1984 behind the newest", {0, 1, 2, 1984, 0, 1, 3, 1985, 2, 3, 4}},
      {"a jump beyond the whole window", {0, 1, 2, 10000, 2, 9999, 8017, 8016, 10000}},
      {"a jump by exactly the window", {7, 2055, 7, 71, 72, 2054, 2055}},
      {"neighbours of a word of 64", {63, 64, 65, 127, 128, 64, 63, 62, 127}},
      {"beyond 32 bits", {4294967295, 4294967296, 4294967295, 4294967297, 4294965313, 4294965314}},
  };
  std::vector<std::string> out;
  for (const Script& script : scripts) {
    ReplayWindow window;
    std::string numbers;
    std::string accept;
    for (const std::uint64_t number : script.numbers) {
      const bool good = !window.contains(number);
      if (good) window.insert(number);
      numbers += (numbers.empty() ? "" : ", ") + std::to_string(number);
      accept += std::string(accept.empty() ? "" : ", ") + (good ? "true" : "false");
    }
    out.push_back(Object()
                      .text("name", script.name)
                      .json("packet_numbers", "[" + numbers + "]")
                      .json("accept", "[" + accept + "]")
                      .str());
  }
  return Object()
             .number("bits", ReplayWindow::kBits)
             .number("remembered", ReplayWindow::kRemembered)
             .json("scripts", list(out))
             .str() +
         "\n";
}

std::string key_files() {
  const Key key = key_of("key");
  const std::string digits = hex(key.bytes());
  std::string upper = digits;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  const auto repeated = [](std::string_view what, std::size_t times) {
    std::string out;
    for (std::size_t i = 0; i < times; ++i) out += what;
    return out;
  };
  std::string counting;
  for (unsigned i = 0; i < 32; ++i) counting += hex(std::array{static_cast<std::byte>(i)});
  // Returns 32 bytes with `count` different values, without a repeating order. The next one does this for the steps.
  const auto different_bytes = [](unsigned count) {
    std::string out;
    for (unsigned i = 0; i < 32; ++i) {
      const unsigned j = i < count ? i : 5 * i % count;
      out += hex(std::array{static_cast<std::byte>(37 * j * j + 101 * j + 129)});
    }
    return out;
  };
  const auto different_steps = [](unsigned count) {
    std::string out;
    unsigned byte = 129;
    for (unsigned i = 0; i < 32; ++i) {
      out += hex(std::array{static_cast<std::byte>(byte)});
      const unsigned j = i % count;
      byte += 37 * j * j + 11 * j + 3;
    }
    return out;
  };
  struct Case {
    std::string_view name;
    std::string text;
  };
  const std::vector<Case> cases = {
      {"as keygen writes it", key_file_text({.name = "wall", .role = Role::kController, .key = key})},
      {"an observer's", key_file_text({.name = "screen", .role = Role::kObserver, .key = key})},
      {"without comment or end of line", "controller " + digits},
      {"capitals, tabs, empty lines, ends of line of DOS", "\r\n# a comment\r\n\r\n\tobserver\t" + upper + " \r\n"},
      {"empty", ""},
      {"a comment only", "# controller " + digits + "\n"},
      {"without a role", digits + "\n"},
      {"an unknown role", "admin " + digits + "\n"},
      {"too short", "controller " + digits.substr(0, 62) + "\n"},
      {"too long", "controller " + digits + "00\n"},
      {"not hexadecimal", "controller " + digits.substr(0, 63) + "g\n"},
      {"two keys", "controller " + digits + "\nobserver " + digits + "\n"},
      {"three words", "controller " + digits + " wall\n"},
      {"weak: zeros", "controller " + repeated("00", 32) + "\n"},
      {"weak: a few bytes again and again", "controller " + repeated("0123456789abcdef", 4) + "\n"},
      {"weak: counting", "controller " + counting + "\n"},
      {"18 different bytes", "controller " + different_bytes(18) + "\n"},
      {"weak: 17 different bytes", "controller " + different_bytes(17) + "\n"},
      {"18 different steps", "controller " + different_steps(18) + "\n"},
      {"weak: 17 different steps", "controller " + different_steps(17) + "\n"},
      {"weak: text", "controller " + hex(text_bytes("The quick brown fox jumps over !")) + "\n"},
  };
  std::vector<std::string> out;
  for (const Case& c : cases) {
    Object json;
    json.text("name", c.name).text("text", c.text);
    try {
      const ClientKey read = read_key_file(c.text, 0600, "test");
      json.flag("accept", true)
          .text("role", read.role == Role::kController ? "controller" : "observer")
          .bytes("key", read.key.bytes())
          .bytes("key_id", key_id(read.key));
    } catch (const std::invalid_argument&) {
      json.flag("accept", false);
    }
    out.push_back(json.str());
  }
  return Object().json("files", list(out)).str() + "\n";
}

std::string bounds_file() {
  std::ifstream proto(TENDON_PROTO);
  const std::string text(std::istreambuf_iterator<char>(proto), {});
  std::vector<std::string> out;
  for (const bounds::Case& one : bounds::cases(text)) {
    out.push_back(R"({"message": )" + quoted(std::string_view(one.message)) + R"(, "field": )" +
                  quoted(std::string_view(one.field)) + R"(, "value": )" + quoted(std::string_view(one.value)) +
                  R"(, "accepted": )" + (one.accepted ? "true" : "false") + R"(, "body": )" +
                  quoted(std::string_view(hex(one.body))) + "}");
  }
  return Object().json("bounds", list(out)).str() + "\n";
}

std::string shapes(const std::vector<field::Primitive>& primitives) {
  std::vector<std::string> out;
  out.reserve(primitives.size());
  for (const field::Primitive& primitive : primitives) out.push_back(field_vectors::shape(primitive));
  return list(out);
}

std::string fields_file() {
  std::vector<std::string> out;
  for (const field_vectors::Case& one : field_vectors::cases()) {
    const field_vectors::Encoded encoded = field_vectors::encoded(one);
    Object json;
    json.text("name", one.name).json("sampled", shapes(one.sampled));
    json.json("low", field_vectors::numbers(std::span(one.low.data(), 3)))
        .json("high", field_vectors::numbers(std::span(one.high.data(), 3)))
        .json("spacing", shortest(one.spacing));
    json.json("region", shapes(one.region)).json("primitives", shapes(one.primitives));
    json.bytes("manifest", encoded.manifest).bytes("field", crypto::blake2b_256(encoded.manifest));
    if (!encoded.bricks.empty()) json.bytes("first_brick", std::as_bytes(std::span(encoded.bricks.front())));
    out.push_back(json.str());
  }
  return Object().json("fields", list(out)).str() + "\n";
}

}  // namespace

std::map<std::string, std::string> files() {
  return {{"bounds.json", bounds_file()},
          {"fields.json", fields_file()},
          {"plain.json", plain_file()},
          {"sealed.json", sealed_file(Suite::kNoise)},
          {"sealed_aes.json", sealed_file(Suite::kAesGcm)},
          {"replay.json", replay_file()},
          {"key_files.json", key_files()}};
}

}  // namespace tendon::vectors
