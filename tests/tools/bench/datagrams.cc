// SPDX-License-Identifier: Apache-2.0
// Cost of one datagram: encode, seal, open, decode, and the kernel's share.
#include <netinet/in.h>
#include <sodium.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "protocol/secrets/noise.h"
#include "protocol/secrets/seal.h"
#include "protocol/secrets/suites.h"
#include "protocol/wire/codec.h"
#include "protocol/wire/handshake_codec.h"
#include "server/machine/udp_link.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t kCalls = 200;
constexpr std::size_t kBatch = 16;

using Buffer = std::array<std::byte, kMaxDatagram>;

DeviceState some_state() {
  DeviceState message;
  message.tick = 123456;
  message.sampled = PeerTime(std::chrono::seconds(1234));
  message.position = Vec3(0.0123, -0.0456, 0.0789);
  message.velocity = Vec3(0.1, -0.2, 0.3);
  message.force_applied = Vec3(-1.5, 2.5, 0.25);
  message.energy = 0.0123;
  message.permitted_force = 3.4;
  message.reasons = 1;
  message.force_sequence = 4567;
  message.force_age = milliseconds(7);
  message.mode = Mode::kActive;
  return message;
}

ForceCommand some_force() {
  ForceCommand message;
  message.sequence = 4567;
  message.based_on_tick = 123456;
  message.force = Vec3(-1.5, 2.5, 0.25);
  message.valid_for = milliseconds(30);
  return message;
}

DeviceState handle_state() {
  DeviceState message = some_state();
  message.buttons = 1;
  message.turning = Turning{.orientation = {.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5}, .angular_velocity = {0.1, 2, -3}};
  message.torque_applied = Vec3(0.01, -0.02, 0.03);
  message.grip = Grip{.opening = 0.25, .velocity = -0.5};
  message.grip_applied = 1.5;
  message.hand_force = Vec3(1.5, -2.5, -0.25);
  return message;
}

ForceCommand handle_force() {
  ForceCommand message = some_force();
  message.model = LocalModel{.at = {0.0123, -0.0456, 0.0789}, .stiffness = Mat3::Constant(123.4)};
  message.torque = RemoteTorque{
      .torque = {0.01, -0.02, 0.03},
      .model = RotationModel{.at = {.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5}, .stiffness = Mat3::Constant(0.123)}};
  message.grip_force = 1.5;
  return message;
}

const OutgoingEcho kEcho{PeerTime(std::chrono::seconds(5)), LocalTime(std::chrono::seconds(6)), 99, 0xffffffff};

template <class Message>
std::size_t write(DataWriter& writer, Buffer& buffer, Message message, std::size_t messages) {
  writer.begin(std::span(buffer).first(kMaxDatagram - crypto::kTagSize), {.connection_id = 7, .packet_number = 1},
               LocalTime(std::chrono::seconds(7)), kEcho);
  std::size_t added = 0;
  for (; added < messages; ++added) {
    message.device = static_cast<std::uint32_t>(added);
    if (!writer.add(message)) break;
  }
  return added;
}

template <class Message>
void codec(Run& run, std::size_t blocks, const std::string& name, const Message& message, std::size_t wanted) {
  DataWriter writer;
  DataReader reader;
  Buffer buffer{};
  Buffer copy{};
  const std::size_t messages = write(writer, buffer, message, wanted);
  const std::size_t size = writer.size();
  const std::string what =
      messages == 1 ? "a " + name + " datagram" : std::to_string(messages) + " " + name + "s in one datagram";
  const auto copying = [&](std::size_t) {
    keep(buffer);
    std::memcpy(copy.data(), buffer.data(), size);
    keep(copy);
  };
  const std::string floor = "memcpy of " + std::to_string(size) + " bytes";
  run.add(row_of(in_turns(
                     blocks, kCalls,
                     [&](std::size_t) {
                       write(writer, buffer, message, messages);
                       keep(buffer);
                     },
                     copying),
                 "encode " + what, floor));
  const auto datagram = std::span<const std::byte>(buffer).first(size);
  run.add(row_of(in_turns(
                     blocks, kCalls,
                     [&](std::size_t) {
                       const auto header = decode_header(datagram);
                       const DataContent* content = reader.read(datagram.subspan(kHeaderSize));
                       if (!header || content == nullptr || content->frames.size() != messages) {
                         throw std::runtime_error("a datagram cannot be decoded");
                       }
                       keep(content);
                     },
                     copying),
                 "decode it", floor));
}

/// libsodium's calls on the same number of bytes: the lower bound of sealing and opening.
struct BareSeal {
  BareSeal(Suite by, std::size_t datagram) : suite(by), size(datagram - kHeaderSize) {
    if (suite == Suite::kAesGcm) crypto_aead_aes256gcm_beforenm(&schedule, key.data());
    seal();
  }
  void seal() {
    if (suite == Suite::kAesGcm) {
      crypto_aead_aes256gcm_encrypt_afternm(sealed.data(), nullptr, plain.data(), size, header.data(), header.size(),
                                            nullptr, nonce.data(), &schedule);
    } else {
      crypto_aead_chacha20poly1305_ietf_encrypt(sealed.data(), nullptr, plain.data(), size, header.data(),
                                                header.size(), nullptr, nonce.data(), key.data());
    }
    keep(sealed);
  }
  void open() {
    const std::size_t whole = size + crypto::kTagSize;
    const int refused =
        suite == Suite::kAesGcm
            ? crypto_aead_aes256gcm_decrypt_afternm(plain.data(), nullptr, nullptr, sealed.data(), whole, header.data(),
                                                    header.size(), nonce.data(), &schedule)
            : crypto_aead_chacha20poly1305_ietf_decrypt(plain.data(), nullptr, nullptr, sealed.data(), whole,
                                                        header.data(), header.size(), nonce.data(), key.data());
    if (refused != 0) throw std::runtime_error("libsodium cannot open its own ciphertext");
    keep(plain);
  }
  Suite suite;
  std::size_t size;
  std::array<unsigned char, kHeaderSize> header{};
  std::array<unsigned char, kMaxDatagram> plain{};
  std::array<unsigned char, kMaxDatagram + crypto::kTagSize> sealed{};
  std::array<unsigned char, sizeof(Key)> key{};
  crypto_aead_aes256gcm_state schedule{};
  std::array<unsigned char, crypto_aead_chacha20poly1305_IETF_NPUBBYTES> nonce{};
};

void sealing(Run& run, std::size_t blocks, Suite suite, std::size_t size) {
  const LocalTime now(std::chrono::seconds(7));
  BareSeal bare(suite, size);
  const SealingKey key(suite, Key{});
  Sealer sealer(key, {}, now);
  Opener opener(key, {});
  Buffer buffer{};
  Buffer body{};
  Header header{.suite = suite, .connection_id = 7};
  const std::string bytes = std::to_string(size) + " bytes by " + names_of({suite});
  run.add(row_of(in_turns(
                     blocks, kCalls,
                     [&](std::size_t) {
                       header.epoch = sealer.next_epoch(now);
                       ++header.packet_number;
                       std::size_t sealed = sealer.seal(header, buffer, size);
                       keep(sealed);
                       keep(buffer);
                     },
                     [&](std::size_t) { bare.seal(); }),
                 "seal " + bytes, "libsodium seals them"));
  Sealer first(key, {}, now);
  const Header fixed{.suite = suite, .connection_id = 7};
  const auto datagram = std::span<const std::byte>(buffer).first(first.seal(fixed, buffer, size));
  run.add(row_of(in_turns(
                     blocks, kCalls,
                     [&](std::size_t) {
                       if (opener.open(now, fixed, datagram, body) != Opener::Verdict::kOpened) {
                         throw std::runtime_error("a datagram cannot be opened");
                       }
                       keep(body);
                     },
                     [&](std::size_t) { bare.open(); }),
                 "open them", "libsodium opens them"));
}

/// Cost to the server of a Hello with a valid cookie, up to the Answer.
void handshake(Run& run, std::size_t blocks) {
  const Key psk = Ratchet(1).next();
  Ratchet secrets(2);
  const NoiseInitiator client(psk, secrets.next(), {},
                              write_body(Hello{.role = Role::kController, .name = "bench", .features = {}}));
  const auto welcome = write_body(Answer(Welcome{}));
  std::array<unsigned char, crypto_scalarmult_BYTES> point{};
  std::array<unsigned char, crypto_scalarmult_SCALARBYTES> scalar{1, 2, 3};
  std::array<unsigned char, crypto_scalarmult_BYTES> product{};
  crypto_scalarmult_base(point.data(), scalar.data());
  run.add(row_of(in_turns(
                     blocks, 4,
                     [&](std::size_t) {
                       auto hello = NoiseResponder::read(psk, {}, client.message());
                       auto answer = hello->reply(secrets.next(), welcome);
                       keep(answer);
                     },
                     [&](std::size_t) {
                       if (crypto_scalarmult(product.data(), scalar.data(), point.data()) != 0) {
                         throw std::runtime_error("the multiplication of libsodium failed");
                       }
                       keep(product);
                     }),
                 "read a Noise Hello and write the Answer", "one X25519 of libsodium"));
}

/// Batches of datagrams against single ones: the saving of sendmmsg(2) and recvmmsg(2).
void batches(Run& run, std::size_t blocks, std::size_t size) {
  const UdpLink from(parse_address("127.0.0.1:0"));
  const UdpLink to(parse_address("127.0.0.1:0"));
  sockaddr_in address{};
  socklen_t length = sizeof address;
  if (::getsockname(to.fd(), reinterpret_cast<sockaddr*>(&address), &length) != 0) {
    throw std::system_error(errno, std::generic_category(), "getsockname");
  }
  std::vector<Buffer> buffers(kBatch);
  std::array<iovec, kBatch> pieces{};
  std::array<mmsghdr, kBatch> messages{};
  std::array<sockaddr_in, kBatch> senders{};
  const auto prepare = [&](std::size_t bytes, sockaddr_in* name, std::size_t step) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      pieces[i] = {buffers[i].data(), bytes};
      messages[i].msg_hdr = {name + step * i, sizeof(sockaddr_in), &pieces[i], 1, nullptr, 0, 0};
    }
  };
  const auto send_each = [&](std::size_t) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      ::sendto(from.fd(), buffers[i].data(), size, 0, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    }
  };
  const auto send_batch = [&](std::size_t) {
    prepare(size, &address, 0);
    ::sendmmsg(from.fd(), messages.data(), kBatch, 0);
  };
  const auto receive_each = [&](std::size_t) {
    socklen_t name = sizeof senders[0];
    while (::recvfrom(to.fd(), buffers[0].data(), kMaxDatagram, MSG_DONTWAIT | MSG_TRUNC,
                      reinterpret_cast<sockaddr*>(senders.data()), &name) > 0) {
    }
  };
  const auto receive_batch = [&](std::size_t) {
    int got = static_cast<int>(kBatch);
    while (got == static_cast<int>(kBatch)) {
      prepare(kMaxDatagram, senders.data(), 1);
      got = ::recvmmsg(to.fd(), messages.data(), kBatch, MSG_DONTWAIT, nullptr);
    }
  };

  const lab::Meter meter;
  Turns sent{.n = blocks * kBatch, .times = {}, .floor_times = {}, .ratios = {}};
  Turns received = sent;
  const auto timed = [&](const auto& call) {
    const double before = meter.read().wall;
    call(0);
    return 1e9 * (meter.read().wall - before) / static_cast<double>(kBatch);
  };
  for (std::size_t b = 0; b < blocks; ++b) {
    sent.floor_times.push_back(timed(send_each));
    received.floor_times.push_back(timed(receive_each));
    sent.times.push_back(timed(send_batch));
    received.times.push_back(timed(receive_batch));
    sent.ratios.push_back(sent.times.back() / sent.floor_times.back());
    received.ratios.push_back(received.times.back() / received.floor_times.back());
  }
  const std::string bytes = std::to_string(size) + " bytes";
  run.add(row_of(sent, "kernel: 16 datagrams of " + bytes + " by one sendmmsg, each", "by 16 sendto"));
  run.add(row_of(received, "kernel: … received by recvmmsg, each", "by recvfrom, until none is there"));
}

}  // namespace

void measure_datagrams(Run& run) {
  const AtPriority high(run.options.priority);
  const std::size_t blocks = run.options.quick ? 20 : 2000;
  if (sodium_init() < 0) throw std::runtime_error("libsodium cannot start");
  codec(run, blocks, "state", some_state(), 1);
  codec(run, blocks, "state", some_state(), 16);
  codec(run, blocks, "force", some_force(), 1);
  codec(run, blocks, "force", some_force(), 16);
  codec(run, blocks, "whole-handle state", handle_state(), 1);
  codec(run, blocks, "whole-handle force", handle_force(), 1);
  DataWriter writer;
  Buffer buffer{};
  write(writer, buffer, some_state(), 1);
  for (const Suite suite : suites_of_this_machine()) sealing(run, blocks, suite, writer.size());
  for (const Suite suite : suites_of_this_machine()) sealing(run, blocks, suite, kMaxDatagram - crypto::kTagSize);
  handshake(run, blocks / 4 + 1);
  batches(run, blocks, 200);
  batches(run, blocks, 1100);
}

}  // namespace tendon::bench
