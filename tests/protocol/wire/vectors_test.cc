// SPDX-License-Identifier: Apache-2.0
#include "tests/protocol/wire/vectors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <variant>

#include "protocol/handshake.h"
#include "protocol/reliable/replay_window.h"
#include "protocol/secrets/client_key.h"
#include "protocol/secrets/noise.h"
#include "protocol/secrets/seal.h"
#include "protocol/session.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/raw_protobuf.h"

// Other languages test their code with protocol/vectors/.

namespace tendon::vectors_test {
namespace {

using examples::Bytes;
using Json = nlohmann::json;

const std::filesystem::path kFolder = TENDON_VECTORS;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream.is_open()) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

Json read(const std::string& name) { return Json::parse(text_of(kFolder / name)); }

std::string text(const Json& json, const std::string& name) { return json.at(name).get<std::string>(); }

Bytes bytes(const std::string& hex) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    out.push_back(static_cast<std::byte>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  }
  return out;
}
Bytes bytes(const Json& json, const std::string& name) { return bytes(text(json, name)); }
Key key(const std::string& hex) {
  Key key;
  const Bytes from = bytes(hex);
  EXPECT_EQ(from.size(), key.bytes().size()) << hex;
  std::copy(from.begin(), from.end(), key.bytes().begin());
  return key;
}
Key key(const Json& json, const std::string& name) { return key(text(json, name)); }

TEST(Vectors, X25519GivesTheAnswersOfRfc7748) {
  const Json file = read("primitives.json");
  for (const Json& v : file.at("x25519")) {
    Key result;
    ASSERT_TRUE(crypto::x25519(key(v, "scalar"), key(v, "point").bytes(), result));
    EXPECT_EQ(result.bytes(), key(v, "result").bytes()) << text(v, "source");
    if (text(v, "point") == "09" + std::string(62, '0')) {
      EXPECT_EQ(crypto::x25519_public(key(v, "scalar")), result.bytes());
    }
  }
}

TEST(Vectors, HmacGivesTheAnswersOfRfc4231) {
  const Json file = read("primitives.json");
  for (const Json& v : file.at("hmac_sha256")) {
    const Bytes data = bytes(v, "data");
    const auto half = std::span(data).first(data.size() / 2);
    const auto rest = std::span(data).subspan(data.size() / 2);
    EXPECT_EQ(crypto::hmac_sha256(bytes(v, "key"), {half, rest}), key(v, "result").bytes()) << text(v, "source");
  }
}

/// Returns the number in a Noise nonce (four zeros, then the number). Others are for libraries that accept any.
std::optional<std::uint64_t> number_in(const Bytes& nonce, Suite suite) {
  if (std::any_of(nonce.begin(), nonce.begin() + 4, [](std::byte b) { return b != std::byte{}; })) return {};
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    number = number << 8U | std::to_integer<std::uint64_t>(nonce.at(suite == Suite::kAesGcm ? 4 + i : 11 - i));
  }
  return number;
}

void expect_the_answers_of_its_authors(Suite suite, const std::string& cipher) {
  const Json file = read("primitives.json");
  for (const Json& v : file.at(cipher)) {
    const auto number = number_in(bytes(v, "nonce"), suite);
    if (!number) continue;
    const Bytes plain = bytes(v, "text");
    const Bytes sealed = bytes(v, "sealed");
    const SealingKey cipher_key(suite, key(v, "key"));
    Bytes out(sealed.size());
    cipher_key.seal(*number, bytes(v, "associated_data"), plain, out);
    EXPECT_EQ(out, sealed) << text(v, "source");
    Bytes opened(plain.size());
    EXPECT_TRUE(cipher_key.open(*number, bytes(v, "associated_data"), sealed, opened));
    EXPECT_EQ(opened, plain);
  }
}

TEST(Vectors, ChaCha20Poly1305GivesTheAnswersOfRfc8439) {
  expect_the_answers_of_its_authors(Suite::kNoise, "chacha20_poly1305");
}

TEST(Vectors, Aes256GcmGivesTheAnswersOfItsAuthors) {
  if (!crypto::has_aes()) GTEST_SKIP() << "this processor has no AES";
  expect_the_answers_of_its_authors(Suite::kAesGcm, "aes256_gcm");
}

TEST(Vectors, OurNoiseIsThatOfCacophony) {
  const Json file = read("noise.json");
  ASSERT_EQ(file.at("vectors").size(), 1U);
  const Json& v = file.at("vectors").at(0);
  const auto& messages = v.at("messages");
  const Key psk = key(v.at("init_psks").at(0).get<std::string>());
  const Bytes prologue = bytes(v, "init_prologue");

  const NoiseInitiator a(psk, key(v, "init_ephemeral"), prologue, bytes(messages.at(0), "payload"));
  EXPECT_EQ(a.message(), bytes(messages.at(0), "ciphertext"));
  const auto z = NoiseResponder::read(psk, prologue, a.message());
  ASSERT_TRUE(z.has_value());
  EXPECT_EQ(z->payload(), bytes(messages.at(0), "payload"));
  const auto reply = z->reply(key(v, "resp_ephemeral"), bytes(messages.at(1), "payload"));
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->message, bytes(messages.at(1), "ciphertext"));
  const auto answer = a.read(reply->message);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->payload, bytes(messages.at(1), "payload"));

  for (const NoiseSplit& split : {answer->split, reply->split}) {
    EXPECT_EQ(Bytes(split.handshake_hash.begin(), split.handshake_hash.end()), bytes(v, "handshake_hash"));
    for (std::size_t i = 2; i < messages.size(); ++i) {
      const Bytes payload = bytes(messages.at(i), "payload");
      const Key& from = i % 2 == 0 ? split.initiator_to_responder : split.responder_to_initiator;
      Bytes sealed(payload.size() + crypto::kTagSize);
      crypto::seal(from, i / 2 - 1, {}, payload, sealed);
      EXPECT_EQ(sealed, bytes(messages.at(i), "ciphertext")) << i;
    }
  }
}

TEST(Vectors, AreWhatTheCodeWrites) {
  if (!crypto::has_aes()) GTEST_SKIP() << "this processor has no AES: sealed_aes.json cannot be written";
  for (const auto& [name, ours] : vectors::files()) {
    EXPECT_TRUE(text_of(kFolder / name) == ours) << name << " has changed; was that meant? Then run: protocol/generate";
  }
}

TEST(Vectors, AreAllTested) {
  std::set<std::string> names = {"README.md", "golden.md", "noise.json", "primitives.json"};
  for (const auto& [name, ours] : vectors::files()) names.insert(name);
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    EXPECT_EQ(names.erase(entry.path().filename().string()), 1U) << entry.path();
  }
  EXPECT_TRUE(names.empty());
}

/// Returns true if the codec accepts a body and keeps all its values.
bool is_taken(const Json& vector) {
  const Bytes body = bytes(vector, "body");
  if (vector.at("message") == "Hello") return read_hello(body).has_value();
  if (vector.at("message") == "Answer") return read_answer(body).has_value();
  DataReader reader;
  const DataContent* const content = reader.read(body);
  return content != nullptr && content->invalid == 0;
}

TEST(Vectors, BoundsOfTheProtoFileAreThoseOfTheCodec) {
  const Json file = read("bounds.json");
  for (const Json& vector : file.at("bounds")) {
    EXPECT_EQ(is_taken(vector), vector.at("accepted").get<bool>()) << vector.at("field") << ' ' << vector.at("value");
  }
  EXPECT_GT(file.at("bounds").size(), 300U);
}

TEST(Vectors, AFrameOutOfBoundsIsLeftOutAndCountedAndTheNextIsRead) {
  const RawProtobuf idle = RawProtobuf().message(3, RawProtobuf().message(1, RawProtobuf().varint(11, 1)));
  const Json file = read("bounds.json");
  for (const Json& vector : file.at("bounds")) {
    if (vector.at("message") != "Datagram") continue;
    const std::string field = text(vector, "field");
    SCOPED_TRACE(field + ' ' + text(vector, "value"));
    const bool accepted = vector.at("accepted").get<bool>();
    Bytes body = bytes(vector, "body");
    DataReader reader;
    if (field == "Datagram.tx_time_ns" || field == "Datagram.frames") {
      EXPECT_EQ(reader.read(body) != nullptr, accepted);
      continue;
    }
    body.insert(body.end(), idle.bytes().begin(), idle.bytes().end());
    const DataContent* const content = reader.read(body);
    ASSERT_NE(content, nullptr);
    EXPECT_EQ(content->invalid, accepted ? 0U : 1U);
    ASSERT_FALSE(content->frames.empty());
    EXPECT_EQ(std::get<DeviceState>(content->frames.back()).mode, Mode::kIdle);
  }
}

TEST(Vectors, AFrameAtItsBoundsIsWrittenAgainAsItWasRead) {
  const Json file = read("bounds.json");
  for (const Json& vector : file.at("bounds")) {
    const std::string field = text(vector, "field");
    const std::string value = text(vector, "value");
    if (vector.at("message") != "Datagram" || !vector.at("accepted").get<bool>()) continue;
    // Our writer uses shorter forms of lists and of an infinite radius, always writes both numbers of a gripper, and
    // does not write a depth without a field.
    if (field.starts_with("DeviceStates") || field.starts_with("DeviceState.gripper") ||
        field == "DeviceState.field_depth_m" || value.ends_with("entries") || value == "inf")
      continue;
    SCOPED_TRACE(field + ' ' + value);
    const Bytes body = bytes(vector, "body");
    DataReader reader;
    const DataContent* const content = reader.read(body);
    ASSERT_NE(content, nullptr);
    std::optional<OutgoingEcho> echo;
    if (const auto& e = content->echo) {
      echo = {PeerTime(e->sent.time_since_epoch()), LocalTime(e->received.time_since_epoch()), e->packet_number,
              e->received_mask};
    }
    std::array<std::byte, kMaxDatagram> buffer{};
    DataWriter writer;
    writer.begin(buffer, {}, LocalTime(content->sent.time_since_epoch()), echo);
    for (const Frame& frame : content->frames) {
      std::visit([&](const auto& message) { writer.add(message); }, frame);
    }
    EXPECT_EQ(Bytes(buffer.begin() + kHeaderSize, buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())), body);
  }
}

TEST(Vectors, ARequestOrAnswerOutOfBoundsIsReadAsOneThatIsRefused) {
  const std::set<std::string> requests = {
      "SetStateRate",     "Rearm",    "Describe",   "TakeLease", "GiveLease", "LeaseLost",
      "SetStateDeadband", "Disarm",   "Couple",     "Engage",    "Disengage", "SetOutput",
      "SetScale",         "SetShare", "OfferField", "UseField",  "DropField"};
  const std::set<std::string> answers = {"ControlAck", "ChannelDescription", "OutputDescription"};
  std::set<std::string> seen;
  const Json file = read("bounds.json");
  for (const Json& vector : file.at("bounds")) {
    const std::string name = text(vector, "field");
    const std::string message = name.substr(0, name.find('.'));
    const std::string field = name.substr(name.find('.') + 1);
    if (vector.at("accepted").get<bool>() || field == "id" ||
        !(requests.contains(message) || answers.contains(message)))
      continue;
    DataReader reader;
    const DataContent* const content = reader.read(bytes(vector, "body"));
    ASSERT_NE(content, nullptr) << name;
    EXPECT_EQ(content->invalid, 1U) << name;
    ASSERT_FALSE(content->frames.empty()) << name << ' ' << vector.at("value");
    if (requests.contains(message)) {
      const auto& control = std::get<Control>(content->frames[0]);
      EXPECT_EQ(control.invalid, field.starts_with("rotation") ? "rotation" : field) << name << vector.at("value");
      EXPECT_FALSE(control.request.has_value()) << name;
      seen.insert(message);
    } else {
      const bool refused = std::ranges::any_of(content->frames, [](const Frame& frame) {
        const auto* const ack = std::get_if<ControlAck>(&frame);
        return ack != nullptr && ack->code == Code::kInvalid && !ack->device && !ack->handle;
      });
      EXPECT_TRUE(refused) << name << ' ' << vector.at("value");
    }
  }
  EXPECT_EQ(seen, requests);
}

class SealedVectors : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (suite_ == Suite::kAesGcm && !crypto::has_aes()) GTEST_SKIP() << "this processor has no AES";
  }
  static constexpr LocalTime kNow{std::chrono::seconds(10)};
  ClientHandshake::Config config() const {
    ClientHandshake::Config config;
    config.hello = examples::hello();
    config.random = examples::random();
    config.secret = {.key = key(file_, "psk"), .ephemeral = key(file_, "client_ephemeral")};
    config.suites = suite_ == Suite::kAesGcm ? Suites{Suite::kAesGcm, Suite::kNoise} : Suites{Suite::kNoise};
    return config;
  }
  static Bytes next(auto& from) {
    std::array<std::byte, kMaxDatagram> buffer;
    const std::size_t size = from.next_datagram(kNow, buffer);
    return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)};
  }

  SessionKeys keys(bool of_server) const {
    const Key up = key(file_.at("welcome"), "client_to_server_key");
    const Key down = key(file_.at("welcome"), "server_to_client_key");
    return of_server ? SessionKeys{down, up, suite_} : SessionKeys{up, down, suite_};
  }

  Json file_ = read(GetParam());
  Suite suite_ = file_.at("suite") == 2 ? Suite::kAesGcm : Suite::kNoise;
};
INSTANTIATE_TEST_SUITE_P(Of, SealedVectors, ::testing::Values("sealed.json", "sealed_aes.json"),
                         [](const auto& file) { return file.param == "sealed.json" ? "Suite1" : "Suite2"; });

TEST_P(SealedVectors, AClientSaysAndUnderstandsThem) {
  ClientHandshake client(config(), kNow);
  EXPECT_EQ(next(client), bytes(file_.at("hello"), "first_datagram"));
  client.receive(kNow, bytes(file_.at("retry"), "datagram"));
  EXPECT_EQ(next(client), bytes(file_.at("hello"), "datagram"));
  ClientHandshake other = client;

  client.receive(kNow, bytes(file_.at("welcome"), "datagram"));
  ASSERT_TRUE(client.outcome().has_value());
  const auto& accepted = std::get<ClientHandshake::Accepted>(*client.outcome());
  EXPECT_EQ(accepted.connection_id, examples::kConnection);
  EXPECT_EQ(accepted.keys->suite, suite_);
  EXPECT_EQ(accepted.keys->send.bytes(), key(file_.at("welcome"), "client_to_server_key").bytes());
  EXPECT_EQ(accepted.keys->receive.bytes(), key(file_.at("welcome"), "server_to_client_key").bytes());

  other.receive(kNow, bytes(file_.at("refused"), "datagram"));
  ASSERT_TRUE(other.outcome().has_value());
  EXPECT_EQ(std::get<Refused>(*other.outcome()).code, Code::kBusy);
}

TEST_P(SealedVectors, ASessionOpensThemAcrossTheRekey) {
  for (const bool to_server : {true, false}) {
    Session session({.connection_id = examples::kConnection}, keys(to_server), kNow);
    std::uint64_t taken = 0;
    for (const Json& datagram : file_.at("data")) {
      if ((text(datagram, "direction") == "client_to_server") != to_server) continue;
      session.receive(kNow, bytes(datagram, "datagram"));
      EXPECT_EQ(session.stats().datagrams_received, ++taken) << text(datagram, "name");
    }
    EXPECT_GE(taken, 4U);
  }
}

TEST_P(SealedVectors, AClientDropsWhatIsToBeDroppedAndCountsWhy) {
  for (const Json& datagram : file_.at("dropped")) {
    Session session({.connection_id = examples::kConnection}, keys(false), kNow);
    EXPECT_FALSE(session.receive(kNow, bytes(datagram, "datagram")));
    const LinkStats& s = session.stats();
    const std::map<std::string, std::uint64_t> counters = {
        {"malformed", s.malformed}, {"forged", s.forged}, {"old_key", s.old_key}};
    EXPECT_EQ(counters.at(text(datagram, "counter")), 1U) << text(datagram, "name");
    EXPECT_EQ(s.malformed + s.forged + s.old_key, 1U) << text(datagram, "name");
    EXPECT_EQ(s.datagrams_received, 0U);
  }
}

TEST(Vectors, TheReplayScriptsAreDecidedAsASetWouldDecide) {
  const Json file = read("replay.json");
  EXPECT_EQ(file.at("remembered").get<std::uint64_t>(), ReplayWindow::kRemembered);
  for (const Json& script : file.at("scripts")) {
    std::set<std::uint64_t> seen;
    const auto& numbers = script.at("packet_numbers");
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto number = numbers.at(i).get<std::uint64_t>();
      const bool too_old = !seen.empty() && number + ReplayWindow::kRemembered <= *seen.rbegin();
      const bool accept = !too_old && seen.insert(number).second;
      EXPECT_EQ(script.at("accept").at(i).get<bool>(), accept) << text(script, "name") << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace tendon::vectors_test
