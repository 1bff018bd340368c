// SPDX-License-Identifier: Apache-2.0
//
// What one haptic step and one datagram cost, beside the machine's own floor in the same run: an empty
// loop, a bare square root, a copy of the same size. Ratios travel from machine to machine; nanoseconds
// do not.
#include <benchmark/benchmark.h>
#include <sodium.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/control/adjusting_output_limiter.h"
#include "core/energy_ledger.h"
#include "core/estimation/velocity_estimator.h"
#include "core/haptic_controller.h"
#include "protocol/codec.h"
#include "protocol/noise.h"
#include "protocol/seal.h"

namespace tendon {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};

// ---- Floors --------------------------------------------------------------------------------------

void floor_empty_loop(benchmark::State& state) {
  for (auto _ : state) benchmark::ClobberMemory();
}
BENCHMARK(floor_empty_loop)->Name("floor/empty loop");

void floor_square_root(benchmark::State& state) {
  double x = 2;
  for (auto _ : state) {
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(std::sqrt(x));
  }
}
BENCHMARK(floor_square_root)->Name("floor/sqrt");

void floor_copy(benchmark::State& state) {
  std::array<std::byte, kMaxDatagram> from{};
  std::array<std::byte, kMaxDatagram> to{};
  const auto size = static_cast<std::size_t>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(from.data());
    std::memcpy(to.data(), from.data(), size);
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
}

// ---- One haptic step -----------------------------------------------------------------------------

// A hand on a stiff wall: the limiter has work to do in half of the steps.
Vec3 hand_at(std::uint64_t step) {
  const auto phase = static_cast<double>(step % 2000) / 2000.0;
  const double x = 0.015 * (phase < 0.5 ? 4 * phase - 1 : 3 - 4 * phase);
  return {x, 0.1 * x, 0};
}

void ledger_and_limiter(benchmark::State& state) {
  EnergyLedger ledger(kFriction);
  const AdjustingOutputLimiter limiter({kFriction, milliseconds(1)});
  Vec3 before = hand_at(0);
  Vec3 applied = Vec3::Zero();
  std::uint64_t step = 0;
  for (auto _ : state) {
    const Vec3 x = hand_at(++step);
    const double energy = ledger.observe(applied, Vec3(x - before), milliseconds(1));
    applied = limiter.limit(Vec3(-3000 * x), energy).force;
    before = x;
    benchmark::DoNotOptimize(applied);
  }
}
BENCHMARK(ledger_and_limiter)->Name("EnergyLedger+AdjustingOutputLimiter, 3 DOF");

void velocity_estimator(benchmark::State& state) {
  VelocityEstimator estimator(30e-6);
  LocalTime now{};
  std::uint64_t step = 0;
  for (auto _ : state) {
    now += milliseconds(1);
    Vec3 v = estimator.observe(now, hand_at(++step));
    benchmark::DoNotOptimize(v);
  }
}
BENCHMARK(velocity_estimator)->Name("VelocityEstimator::observe, 3 DOF");

void controller_step(benchmark::State& state) {
  HapticController::Config config;
  config.limiter.friction = kFriction;
  config.limiter.longest_hold = milliseconds(1);
  config.max_force = 8.5;
  config.max_slew = 1000;
  HapticController controller(config);
  Vec3 applied = Vec3::Zero();
  LocalTime now{};
  std::uint64_t step = 0;
  for (auto _ : state) {
    now += milliseconds(1);
    const Vec3 x = hand_at(++step);
    if (step % 10 == 0) {  // a 100 Hz engine
      RemoteForce force;
      force.sequence = step;
      force.received = now;
      force.force = -3000 * x;
      force.valid_for = milliseconds(30);
      controller.observe(force);
    }
    Step result = controller.step({now, x, Vec3::Zero()}, applied);
    applied = result.force;
    benchmark::DoNotOptimize(result);
  }
}
BENCHMARK(controller_step)->Name("HapticController::step");

// ---- One datagram --------------------------------------------------------------------------------

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

const OutgoingEcho kEcho{PeerTime(std::chrono::seconds(5)), LocalTime(std::chrono::seconds(6)), 99, 0xffffffff};

template <class Message>
void encode(benchmark::State& state, const Message& message) {
  DataWriter writer;
  std::array<std::byte, kMaxDatagram> buffer;
  std::uint64_t number = 0;
  for (auto _ : state) {
    writer.begin(buffer, {.connection_id = 7, .packet_number = ++number}, LocalTime(std::chrono::seconds(7)), kEcho);
    writer.add(message);
    benchmark::DoNotOptimize(buffer.data());
    benchmark::ClobberMemory();
  }
  state.counters["bytes"] = static_cast<double>(writer.size());
}

template <class Message>
std::size_t encoded_size(const Message& message) {
  DataWriter writer;
  std::array<std::byte, kMaxDatagram> buffer;
  writer.begin(buffer, {.connection_id = 7, .packet_number = 1}, LocalTime(std::chrono::seconds(7)), kEcho);
  writer.add(message);
  return writer.size();
}

template <class Message>
void decode(benchmark::State& state, const Message& message) {
  DataWriter writer;
  DataReader reader;
  std::array<std::byte, kMaxDatagram> buffer;
  writer.begin(buffer, {.connection_id = 7, .packet_number = 1}, LocalTime(std::chrono::seconds(7)), kEcho);
  writer.add(message);
  const auto datagram = std::span<const std::byte>(buffer).first(writer.size());
  for (auto _ : state) {
    const auto header = decode_header(datagram);
    const DataContent* content = reader.read(datagram.subspan(kHeaderSize));
    if (!header || content == nullptr || content->frames.size() != 1) {
      state.SkipWithError("the datagram was not read");
      break;
    }
    benchmark::DoNotOptimize(content);
  }
}

/// libsodium's bare call over as many bytes as follow the header: what sealing cannot be cheaper than.
void floor_aead(benchmark::State& state) {
  std::array<unsigned char, kMaxDatagram> buffer{};
  std::array<unsigned char, crypto_aead_chacha20poly1305_IETF_KEYBYTES> key{};
  std::array<unsigned char, crypto_aead_chacha20poly1305_IETF_NPUBBYTES> nonce{};
  const auto size = static_cast<unsigned long long>(state.range(0)) - kHeaderSize;
  const bool opens = state.range(1) != 0;
  std::array<unsigned char, kMaxDatagram> sealed{};
  crypto_aead_chacha20poly1305_ietf_encrypt(sealed.data(), nullptr, buffer.data(), size, buffer.data(), kHeaderSize,
                                            nullptr, nonce.data(), key.data());
  for (auto _ : state) {
    if (opens) {
      benchmark::DoNotOptimize(crypto_aead_chacha20poly1305_ietf_decrypt(buffer.data(), nullptr, nullptr, sealed.data(),
                                                                         size + crypto::kTagSize, buffer.data() + 1184,
                                                                         kHeaderSize, nonce.data(), key.data()));
    } else {
      crypto_aead_chacha20poly1305_ietf_encrypt(buffer.data(), nullptr, buffer.data(), size, buffer.data() + 1184,
                                                kHeaderSize, nullptr, nonce.data(), key.data());
    }
    benchmark::DoNotOptimize(buffer.data());
    benchmark::ClobberMemory();
  }
}

/// A datagram of `size` bytes in the clear, under the first key.
void seal(benchmark::State& state, std::size_t size) {
  const LocalTime now(std::chrono::seconds(7));
  Sealer sealer(Key{}, {}, now);
  std::array<std::byte, kMaxDatagram> buffer{};
  Header header{.suite = Suite::kNoise, .connection_id = 7};
  for (auto _ : state) {
    header.epoch = sealer.next_epoch(now);
    ++header.packet_number;
    benchmark::DoNotOptimize(sealer.seal(header, buffer, size));
    benchmark::ClobberMemory();
  }
}

void open(benchmark::State& state, std::size_t size) {
  const LocalTime now(std::chrono::seconds(7));
  Sealer sealer(Key{}, {}, now);
  Opener opener(Key{}, {});
  std::array<std::byte, kMaxDatagram> buffer{};
  std::array<std::byte, kMaxDatagram> body{};
  const Header header{.suite = Suite::kNoise, .connection_id = 7};
  const auto datagram = std::span<const std::byte>(buffer).first(sealer.seal(header, buffer, size));
  for (auto _ : state) {
    if (opener.open(now, header, datagram, body) != Opener::Verdict::kOpened) {
      state.SkipWithError("the datagram did not open");
      break;
    }
    benchmark::DoNotOptimize(body.data());
    benchmark::ClobberMemory();
  }
}

/// What a Hello with a good cookie costs the server, up to the Answer.
void answer_a_handshake(benchmark::State& state) {
  const Key psk = Ratchet(1).next();
  Ratchet secrets(2);
  const NoiseInitiator client(psk, secrets.next(), {},
                              write_body(Hello{.role = Role::kController, .name = "bench", .features = {}}));
  const auto welcome = write_body(Answer(Welcome{}));
  for (auto _ : state) {
    const auto hello = NoiseResponder::read(psk, {}, client.message());
    benchmark::DoNotOptimize(hello->reply(secrets.next(), welcome));
  }
}

void register_security(std::size_t size) {
  const auto bytes = static_cast<std::int64_t>(size);
  benchmark::RegisterBenchmark("floor/libsodium seals a state datagram", floor_aead)->Args({bytes, 0});
  benchmark::RegisterBenchmark("seal a state datagram", [size](benchmark::State& state) { seal(state, size); });
  benchmark::RegisterBenchmark("floor/libsodium opens a state datagram", floor_aead)->Args({bytes, 1});
  benchmark::RegisterBenchmark("open a state datagram", [size](benchmark::State& state) { open(state, size); });
  benchmark::RegisterBenchmark("read a Noise Hello and write the Answer", answer_a_handshake);
}

void register_datagrams() {
  const DeviceState device_state = some_state();
  const ForceCommand force = some_force();
  benchmark::RegisterBenchmark("floor/memcpy of a state datagram", floor_copy)
      ->Arg(static_cast<std::int64_t>(encoded_size(device_state)));
  benchmark::RegisterBenchmark("encode a state datagram",
                               [device_state](benchmark::State& state) { encode(state, device_state); });
  benchmark::RegisterBenchmark("decode a state datagram",
                               [device_state](benchmark::State& state) { decode(state, device_state); });
  register_security(encoded_size(device_state));
  benchmark::RegisterBenchmark("floor/memcpy of a force datagram", floor_copy)
      ->Arg(static_cast<std::int64_t>(encoded_size(force)));
  benchmark::RegisterBenchmark("encode a force datagram", [force](benchmark::State& state) { encode(state, force); });
  benchmark::RegisterBenchmark("decode a force datagram", [force](benchmark::State& state) { decode(state, force); });
}

}  // namespace
}  // namespace tendon

int main(int argc, char** argv) {
  tendon::register_datagrams();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
