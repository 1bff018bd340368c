// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/hand_codec.h"

#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/fields.h"

namespace tendon::wire {
namespace {

using Byte = std::uint8_t;
using States = std::span<const DeviceState* const>;

/// Bytes are moved as the machine holds them. One that holds numbers the other way round leaves all to protobuf.
constexpr bool kLittleEndian = std::endian::native == std::endian::little;

// The wire types of protobuf.
constexpr unsigned kVarint = 0;
constexpr unsigned kFixed64 = 1;
constexpr unsigned kLength = 2;
constexpr unsigned kFixed32 = 5;

/// The one or two bytes in front of a field of a number below 2048.
template <unsigned kField, unsigned kType>
struct Tag {
  static constexpr unsigned kValue = kField << 3U | kType;
  static_assert(kValue < 1U << 14U);
  static constexpr std::size_t kSize = kValue < 0x80 ? 1 : 2;
  static constexpr Byte kFirst = static_cast<Byte>(kSize == 1 ? kValue : (kValue & 0x7FU) | 0x80U);
  static constexpr Byte kSecond = static_cast<Byte>(kValue >> 7U);
};

/// Writes fields one after the other. As proto3 wants, a number that is 0 is left out; a part that has a presence is
/// written when it is there.
class Writer {
 public:
  explicit Writer(Byte* at) noexcept : at_(at) {}
  Byte* at() const noexcept { return at_; }

  template <unsigned kField>
  void count(std::uint64_t value) noexcept {
    if (value == 0) return;
    tag<kField, kVarint>();
    varint(value);
  }
  template <unsigned kField>
  void count(std::uint32_t value) noexcept {
    count<kField>(std::uint64_t{value});
  }
  template <unsigned kField>
  void flag(bool value) noexcept {
    count<kField>(std::uint64_t{value});
  }
  template <unsigned kField>
  void mode(Mode value) noexcept {
    count<kField>(static_cast<std::uint64_t>(value));
  }
  template <unsigned kField>
  void length_of_time(Duration value) noexcept {
    count<kField>(unsigned_ns(value));
  }
  template <unsigned kField>
  void validity(Duration value) noexcept {
    count<kField>(validity_us(value));
  }
  template <unsigned kField, class Time>
  void time(Time value) noexcept {
    if (const auto ns = value.time_since_epoch().count(); ns != 0) fixed<kField, kFixed64>(ns);
  }
  template <unsigned kField>
  void bits(std::uint32_t value) noexcept {
    if (value != 0) fixed<kField, kFixed32>(value);
  }
  template <unsigned kField>
  void number(double value) noexcept {
    if (std::bit_cast<std::uint64_t>(value) != 0) fixed<kField, kFixed64>(value);  // −0 is none
  }
  /// Written when it is 0, too.
  template <unsigned kField>
  void present(double value) noexcept {
    fixed<kField, kFixed64>(value);
  }
  template <unsigned kField>
  void vector(const Vec3& value) noexcept {
    message<kField>([&] {
      number<1>(value.x());
      number<2>(value.y());
      number<3>(value.z());
    });
  }
  template <unsigned kField>
  void rotation(const Quat& value) noexcept {
    message<kField>([&] {
      number<1>(value.w);
      number<2>(value.x);
      number<3>(value.y);
      number<4>(value.z);
    });
  }
  template <unsigned kField>
  void matrix(const Mat3& value) noexcept {
    message<kField>([&] {
      std::array<double, 9> entries;
      const std::size_t size = sizeof(double) * entries_of(value, entries);
      std::memcpy(at_, entries.data(), size);
      at_ += size;
    });
  }
  /// A column of numbers, `kWidth` of each state: value(state, i).
  template <unsigned kField, class Number, int kWidth, class Value>
  void column(States states, Value value) noexcept {
    tag<kField, kLength>();
    varint(states.size() * kWidth * sizeof(Number));
    for (const DeviceState* state : states) {
      for (int i = 0; i < kWidth; ++i) {
        const auto number = static_cast<Number>(value(*state, i));
        std::memcpy(at_, &number, sizeof number);
        at_ += sizeof number;
      }
    }
  }
  /// A part that may be absent; its first field is `kField`.
  template <unsigned kField, unsigned /*kType*/, class Value, class Fields>
  void part(const std::optional<Value>& value, Fields fields) noexcept {
    if (value) fields(*value);
  }
  /// A field with fields inside. Shorter than 128 bytes, as its length is one byte.
  template <unsigned kField, class Fields>
  void message(Fields fields) noexcept {
    tag<kField, kLength>();
    Byte* const length = at_++;
    fields();
    *length = static_cast<Byte>(at_ - length - 1);
  }
  template <unsigned kField>
  void radius(double value) noexcept {
    if (value != std::numeric_limits<double>::infinity()) present<kField>(value);
  }

  void varint(std::uint64_t value) noexcept {
    for (; value >= 0x80; value >>= 7U) *at_++ = static_cast<Byte>(value | 0x80U);
    *at_++ = static_cast<Byte>(value);
  }
  template <unsigned kField, unsigned kType>
  void tag() noexcept {
    using T = Tag<kField, kType>;
    *at_++ = T::kFirst;
    if constexpr (T::kSize == 2) *at_++ = T::kSecond;
  }

 private:
  template <unsigned kField, unsigned kType, class Value>
  void fixed(Value value) noexcept {
    tag<kField, kType>();
    std::memcpy(at_, &value, sizeof value);
    at_ += sizeof value;
  }

  Byte* at_;
};

/// Takes fields one after the other. One that is not next is absent, and its value stays as it was. What cannot be read
/// stops it for good: then `done` is false.
class Reader {
 public:
  Reader(const Byte* at, const Byte* end) noexcept : at_(at), end_(end) {}
  /// Whether all was read.
  bool done() const noexcept { return at_ == end_ && good_; }

  template <unsigned kField>
  void count(std::uint64_t& value) noexcept {
    if (take<kField, kVarint>()) varint(value);
  }
  template <unsigned kField>
  void count(std::uint32_t& value) noexcept {
    value = static_cast<std::uint32_t>(count_up_to<kField>(std::numeric_limits<std::uint32_t>::max(), value));
  }
  template <unsigned kField>
  void flag(bool& value) noexcept {
    value = count_up_to<kField>(1, value ? 1 : 0) != 0;
  }
  template <unsigned kField>
  void mode(Mode& value) noexcept {
    // An absent one is 0, which is refused.
    value = static_cast<Mode>(count_up_to<kField>(std::numeric_limits<std::uint8_t>::max(), 0));
  }
  template <unsigned kField>
  void length_of_time(Duration& value) noexcept {
    value = Duration(
        static_cast<std::int64_t>(count_up_to<kField>(static_cast<std::uint64_t>(limits::kMaxTime.count()), 0)));
  }
  template <unsigned kField>
  void validity(Duration& value) noexcept {
    value = std::chrono::microseconds(count_up_to<kField>(std::numeric_limits<std::uint32_t>::max(), 0));
  }
  template <unsigned kField, class Time>
  void time(Time& value) noexcept {
    std::int64_t ns = 0;
    fixed<kField, kFixed64>(ns);
    value = Time(Duration(ns));
  }
  template <unsigned kField>
  void bits(std::uint32_t& value) noexcept {
    fixed<kField, kFixed32>(value);
  }
  template <unsigned kField>
  void number(double& value) noexcept {
    fixed<kField, kFixed64>(value);
  }
  template <unsigned kField>
  void present(double& value) noexcept {
    fixed<kField, kFixed64>(value);
  }
  template <unsigned kField>
  void vector(Vec3& value) noexcept {
    if (take_three<kField>(value)) return;  // nearly always
    message<kField>([&](Reader& in) {
      value.setZero();  // a new part of a message has no values yet
      in.number<1>(value.x());
      in.number<2>(value.y());
      in.number<3>(value.z());
    });
  }
  template <unsigned kField>
  void rotation(Quat& value) noexcept {
    value = {.w = 0, .x = 0, .y = 0, .z = 0};
    message<kField>([&](Reader& in) {
      in.number<1>(value.w);
      in.number<2>(value.x);
      in.number<3>(value.y);
      in.number<4>(value.z);
    });
  }
  /// Absent, it has no entries, which is refused.
  template <unsigned kField>
  void matrix(Mat3& value) noexcept {
    std::array<double, 9> entries;
    std::size_t size = 0;
    message<kField>([&](Reader& in) {
      const auto left = static_cast<std::size_t>(in.end_ - in.at_);
      if (left > sizeof entries || left % sizeof(double) != 0) return;
      std::memcpy(entries.data(), in.at_, left);
      in.at_ = in.end_;
      size = left / sizeof(double);
    });
    if (!matrix_of(std::span(entries).first(size), value)) good_ = false;
  }
  template <unsigned kField, unsigned kType, class Value, class Fields>
  void part(std::optional<Value>& value, Fields fields) noexcept {
    if (next_is<kField, kType>()) fields(value.emplace());
  }
  template <unsigned kField, class Fields>
  void message(Fields fields) noexcept {
    if (!take<kField, kLength>()) return;
    if (at_ == end_ || *at_ >= 0x80 || *at_ >= end_ - at_) return stop();
    const Byte* const end = at_ + 1 + *at_;
    Reader inside(at_ + 1, end);
    fields(inside);
    if (!inside.done()) return stop();
    at_ = end;
  }
  template <unsigned kField>
  void radius(double& value) noexcept {
    present<kField>(value);
  }

  /// A column of numbers that all take as many bytes.
  template <unsigned kField, class Number>
  void column(std::span<Number> to) noexcept {
    std::uint64_t size = 0;
    if (take<kField, kLength>()) varint(size);
    if (size != to.size_bytes() || size > static_cast<std::uint64_t>(end_ - at_)) return stop();
    std::memcpy(to.data(), at_, size);
    at_ += size;
  }
  /// A column of varints, each at most `most`. Absent, it leaves `to` as it is.
  template <unsigned kField>
  void column(std::span<std::uint64_t> to, std::uint64_t most) noexcept {
    Reader inside(nullptr, nullptr);
    if (!enter<kField>(inside)) return;
    for (std::uint64_t& value : to) {
      inside.varint(value);
      if (value > most) return stop();
    }
    if (!inside.done()) return stop();
  }

  /// The length of a message, and what is in it.
  template <unsigned kField>
  bool enter(Reader& inside) noexcept {
    std::uint64_t length = 0;
    if (!take<kField, kLength>()) return false;
    varint(length);
    if (length > static_cast<std::uint64_t>(end_ - at_)) stop();
    if (!good_) return false;
    inside = Reader(at_, at_ + length);
    at_ += length;
    return true;
  }
  template <unsigned kField, unsigned kType>
  bool next_is() const noexcept {
    using T = Tag<kField, kType>;
    if (static_cast<std::size_t>(end_ - at_) < T::kSize || at_[0] != T::kFirst) return false;
    return T::kSize == 1 || at_[1] == T::kSecond;
  }

 private:
  void stop() noexcept { good_ = false; }
  /// A vector none of whose numbers is absent, in one go.
  template <unsigned kField>
  bool take_three(Vec3& value) noexcept {
    constexpr std::size_t kTag = Tag<kField, kLength>::kSize;
    constexpr std::size_t kNumber = 1 + sizeof(double);
    constexpr std::size_t kSize = kTag + 1 + 3 * kNumber;
    if (static_cast<std::size_t>(end_ - at_) < kSize || !next_is<kField, kLength>()) return false;
    const Byte* const x = at_ + kTag + 1;
    const Byte* const y = x + kNumber;
    const Byte* const z = y + kNumber;
    if (x[-1] != 3 * kNumber || *x != Tag<1, kFixed64>::kFirst || *y != Tag<2, kFixed64>::kFirst ||
        *z != Tag<3, kFixed64>::kFirst) {
      return false;
    }
    std::memcpy(&value.x(), x + 1, sizeof(double));
    std::memcpy(&value.y(), y + 1, sizeof(double));
    std::memcpy(&value.z(), z + 1, sizeof(double));
    at_ += kSize;
    return true;
  }
  template <unsigned kField, unsigned kType>
  bool take() noexcept {
    if (!next_is<kField, kType>()) return false;
    at_ += Tag<kField, kType>::kSize;
    return true;
  }
  void varint(std::uint64_t& value) noexcept {
    std::uint64_t sum = 0;
    for (unsigned shift = 0; at_ != end_ && shift < 64; shift += 7) {
      const Byte byte = *at_++;
      sum |= std::uint64_t{byte & 0x7FU} << shift;
      if (byte >= 0x80) continue;
      // The shortest form does not end with a 0, and the tenth byte holds one bit.
      if ((byte == 0 && shift > 0) || (shift == 63 && byte > 1)) break;
      value = sum;
      return;
    }
    stop();
  }
  template <unsigned kField>
  std::uint64_t count_up_to(std::uint64_t most, std::uint64_t absent) noexcept {
    std::uint64_t value = absent;
    count<kField>(value);
    if (value <= most) return value;
    stop();
    return absent;
  }
  template <unsigned kField, unsigned kType, class Value>
  void fixed(Value& value) noexcept {
    if (!take<kField, kType>()) return;
    if (static_cast<std::size_t>(end_ - at_) < sizeof value) return stop();
    Value taken;
    std::memcpy(&taken, at_, sizeof taken);
    at_ += sizeof taken;
    value = taken;
  }

  const Byte* at_;
  const Byte* end_;
  bool good_ = true;
};

/// Appends what `make` returns to `frames`, made where it will stay: what is made elsewhere has to be moved.
template <class Make>
auto& append(std::vector<Frame>& frames, Make make) {
  using Value = decltype(make());
  struct Made {
    Make make;
    operator Value() const noexcept { return make(); }
  };
  return std::get<Value>(frames.emplace_back(std::in_place_type<Value>, Made{make}));
}

// The fields of each message in their order, for both ways: `State` is const for a Writer.

template <class Way, class State>
void state_fields(Way& way, State& state) noexcept {
  way.template count<1>(state.tick);
  way.template time<2>(state.sampled);
  way.template vector<3>(state.position);
  way.template vector<4>(state.velocity);
  way.template vector<5>(state.force_applied);
  way.template number<6>(state.energy);
  way.template number<7>(state.permitted_force);
  way.template bits<8>(state.reasons);
  way.template count<9>(state.force_sequence);
  way.template length_of_time<10>(state.force_age);
  way.template mode<11>(state.mode);
  way.template count<12>(state.device);
  way.template count<13>(state.channel);
  way.template part<14, kLength>(state.force_wanted, [&](auto& wanted) { way.template vector<14>(wanted); });
  way.template part<15, kLength>(state.turning, [&](auto& turning) {
    way.template rotation<15>(turning.orientation);
    way.template vector<16>(turning.angular_velocity);
  });
  way.template bits<17>(state.buttons);
  way.template part<18, kLength>(state.torque_applied, [&](auto& torque) { way.template vector<18>(torque); });
  way.template part<19, kFixed64>(state.grip, [&](auto& grip) {
    way.template present<19>(grip.opening);
    way.template present<20>(grip.velocity);
  });
  way.template part<21, kFixed64>(state.grip_applied, [&](auto& force) { way.template present<21>(force); });
  way.template part<22, kLength>(state.hand_force, [&](auto& force) { way.template vector<22>(force); });
}

/// A message inside another one, of more fields than a vector.
template <unsigned kField, class Fields>
void inner(Writer& way, Fields fields) noexcept {
  way.template message<kField>([&] { fields(way); });
}
template <unsigned kField, class Fields>
void inner(Reader& way, Fields fields) noexcept {
  way.template message<kField>([&](Reader& inside) { fields(inside); });
}

template <class Way, class Command>
void force_fields(Way& way, Command& command) noexcept {
  way.template count<1>(command.sequence);
  way.template count<2>(command.based_on_tick);
  way.template vector<3>(command.force);
  way.template part<4, kLength>(command.model, [&](auto& model) {
    inner<4>(way, [&](auto& in) {
      in.template vector<1>(model.at);
      in.template matrix<2>(model.stiffness);
      in.template radius<3>(model.valid_radius);
    });
  });
  way.template validity<5>(command.valid_for);
  way.template count<6>(command.device);
  way.template count<7>(command.channel);
  way.template flag<8>(command.topology_changed);
  way.template part<9, kFixed64>(command.error, [&](auto& error) { way.template present<9>(error); });
  way.template part<10, kLength>(command.torque, [&](auto& torque) { way.template vector<10>(torque.torque); });
  way.template part<11, kFixed64>(command.grip_force, [&](auto& force) { way.template present<11>(force); });
  if (command.torque) {  // of a model alone protobuf makes a torque of 0
    way.template part<14, kLength>(command.torque->model, [&](auto& model) {
      inner<14>(way, [&](auto& in) {
        in.template rotation<1>(model.at);
        in.template matrix<2>(model.stiffness);
      });
    });
  }
  way.template count<15>(command.way);
}

template <class Way, class Echo>
void echo_fields(Way& way, Echo& echo) noexcept {
  way.template time<1>(echo.sent);
  way.template time<2>(echo.received);
  way.template count<3>(echo.packet_number);
  way.template bits<4>(echo.received_mask);
}

/// Of a length within a datagram.
constexpr std::size_t size_of_length(std::size_t value) noexcept { return value < 0x80 ? 1 : 2; }
constexpr std::size_t size_of_varint(std::uint64_t value) noexcept {
  return (static_cast<std::size_t>(std::bit_width(value | 1U)) * 9 + 64) / 64;  // a seventh, rounded up
}

/// `Datagram.frames` with one field of `Frame`: two tags and two lengths, and then what `fields` writes. It is written
/// behind the place that these usually take, and moved when they take another one.
template <unsigned kBody, std::size_t kUsualFront, class Fields>
std::size_t write_framed(Byte* to, Fields fields) noexcept {
  Writer body(to + kUsualFront);
  fields(body);
  const auto size = static_cast<std::size_t>(body.at() - to) - kUsualFront;
  const std::size_t frame = 1 + size_of_length(size) + size;
  const std::size_t front = 1 + size_of_length(frame) + frame - size;
  if (front != kUsualFront) std::memmove(to + front, to + kUsualFront, size);
  Writer out(to);
  out.tag<3, kLength>();
  out.varint(frame);
  out.tag<kBody, kLength>();
  out.varint(size);
  return front + size;
}

/// The columns of DeviceStates that hold varints: the first field, how many there are, and what each says of a state.
constexpr unsigned kFirstCount = 9;
constexpr std::size_t kCounts = 6;
template <class Visit>
void for_each_count(Visit visit) noexcept {
  visit(std::size_t{0}, [](const DeviceState& state) { return static_cast<std::uint64_t>(state.mode); });
  visit(std::size_t{1}, [](const DeviceState& state) { return std::uint64_t{state.reasons}; });
  visit(std::size_t{2}, [](const DeviceState& state) { return state.force_sequence; });
  visit(std::size_t{3}, [](const DeviceState& state) { return unsigned_ns(state.force_age); });
  visit(std::size_t{4}, [](const DeviceState& state) { return std::uint64_t{state.channel}; });
  visit(std::size_t{5}, [](const DeviceState& state) { return std::uint64_t{state.buttons}; });
}

/// What columns of some states take.
struct ColumnSizes {
  std::array<std::size_t, kCounts> counts;  ///< bytes in each column of varints; 0: all are 0, and it is left out
  std::uint32_t devices = 0;
  std::size_t body = 0;  ///< of the message

  explicit ColumnSizes(States states) noexcept {
    for (const DeviceState* state : states) devices |= 1U << state->device;
    body = 1 + size_of_varint(devices) + of_field(states.size() * 3 * sizeof(double)) +
           2 * of_field(states.size() * 3 * sizeof(float)) + 2 * of_field(states.size() * sizeof(float));
    if (states.front()->tick != 0) body += 1 + size_of_varint(states.front()->tick);
    if (states.front()->sampled != PeerTime{}) body += 1 + sizeof(std::int64_t);
    for_each_count([&](std::size_t column, auto value) {
      std::uint64_t any = 0;
      std::size_t bytes = 0;
      for (const DeviceState* state : states) {
        any |= value(*state);
        bytes += size_of_varint(value(*state));
      }
      counts[column] = any != 0 || column == 0 ? bytes : 0;  // a mode must be there
      body += counts[column] > 0 ? of_field(counts[column]) : 0;
    });
  }
  static std::size_t of_field(std::size_t inside) noexcept { return 1 + size_of_length(inside) + inside; }
};

/// DeviceStates as states, behind those that `content` holds. False, whatever it then holds: leave it to protobuf.
bool read_columns(Reader& in, DataContent& content) {
  std::uint64_t tick = 0;
  PeerTime sampled{};
  std::uint32_t devices = 0;
  in.count<1>(tick);
  in.time<2>(sampled);
  in.count<3>(devices);
  if (devices == 0 || devices >= 1U << limits::kMaxDevices) return false;
  const auto count = static_cast<std::size_t>(std::popcount(devices));
  constexpr std::size_t kMost = limits::kMaxDevices;
  std::array<double, 3 * kMost> position;
  std::array<float, 3 * kMost> velocity;
  std::array<float, 3 * kMost> force;
  std::array<float, kMost> energy;
  std::array<float, kMost> permitted;
  in.column<4>(std::span(position).first(3 * count));
  in.column<5>(std::span(velocity).first(3 * count));
  in.column<6>(std::span(force).first(3 * count));
  in.column<7>(std::span(energy).first(count));
  in.column<8>(std::span(permitted).first(count));
  std::array<std::array<std::uint64_t, kMost>, kCounts> counts{};
  auto& [mode, reasons, sequence, age, channel, buttons] = counts;
  constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();
  in.column<9>(std::span(mode).first(count), std::numeric_limits<std::uint8_t>::max());
  in.column<10>(std::span(reasons).first(count), kMost32);
  in.column<11>(std::span(sequence).first(count), std::numeric_limits<std::uint64_t>::max());
  in.column<12>(std::span(age).first(count), static_cast<std::uint64_t>(limits::kMaxTime.count()));
  in.column<13>(std::span(channel).first(count), kMost32);
  in.column<14>(std::span(buttons).first(count), kMost32);
  if (!in.done()) return false;
  for (std::size_t i = 0; i < count; ++i, devices &= devices - 1) {
    DeviceState& state = append(content.frames, [tick] { return DeviceState{.tick = tick}; });
    const auto vector = [&](const auto& column) { return Vec3(column[3 * i], column[3 * i + 1], column[3 * i + 2]); };
    state.sampled = sampled;
    state.position = vector(position);
    state.velocity = vector(velocity);
    state.force_applied = vector(force);
    state.energy = energy[i];
    state.permitted_force = permitted[i];
    state.reasons = static_cast<std::uint32_t>(reasons[i]);
    state.force_sequence = sequence[i];
    state.force_age = Duration(static_cast<std::int64_t>(age[i]));
    state.mode = static_cast<Mode>(mode[i]);
    state.device = static_cast<std::uint32_t>(std::countr_zero(devices));
    state.channel = static_cast<std::uint32_t>(channel[i]);
    state.buttons = static_cast<std::uint32_t>(buttons[i]);
    if (!in_bounds(state)) return false;
  }
  return true;
}

}  // namespace

std::size_t write_head(Byte* to, LocalTime sent, const std::optional<OutgoingEcho>& echo) noexcept {
  Writer out(to);
  out.time<1>(sent);
  if (echo) out.message<2>([&] { echo_fields(out, *echo); });
  return static_cast<std::size_t>(out.at() - to);
}

std::size_t write_frame(Byte* to, const DeviceState& state) noexcept {
  if (!kLittleEndian || state.joints || state.stiffness_wanted) return 0;
  return write_framed<1, 6>(to, [&](Writer& out) { state_fields(out, state); });
}

std::size_t write_frame(Byte* to, const ForceCommand& command) noexcept {
  if (!kLittleEndian || (command.model && command.model->contact)) return 0;
  return write_framed<2, 4>(to, [&](Writer& out) { force_fields(out, command); });
}

std::optional<WrittenColumns> write_columns(Byte* to, std::size_t room, States states) noexcept {
  if (!kLittleEndian) return std::nullopt;
  const auto whole = [](const ColumnSizes& sizes) { return ColumnSizes::of_field(ColumnSizes::of_field(sizes.body)); };
  States taken = states;
  std::optional<ColumnSizes> sizes;
  for (; !taken.empty(); taken = taken.first(taken.size() - 1)) {
    sizes.emplace(taken);
    if (whole(*sizes) <= room) break;
  }
  if (taken.empty()) return WrittenColumns{};
  Writer out(to);
  out.tag<3, kLength>();
  out.varint(ColumnSizes::of_field(sizes->body));
  out.tag<10, kLength>();
  out.varint(sizes->body);
  out.count<1>(taken.front()->tick);
  out.time<2>(taken.front()->sampled);
  out.count<3>(sizes->devices);
  out.column<4, double, 3>(taken, [](const DeviceState& state, int i) { return state.position[i]; });
  out.column<5, float, 3>(taken, [](const DeviceState& state, int i) { return state.velocity[i]; });
  out.column<6, float, 3>(taken, [](const DeviceState& state, int i) { return state.force_applied[i]; });
  out.column<7, float, 1>(taken, [](const DeviceState& state, int) { return state.energy; });
  out.column<8, float, 1>(taken, [](const DeviceState& state, int) { return state.permitted_force; });
  for_each_count([&](std::size_t column, auto value) {
    if (sizes->counts[column] == 0) return;
    out.varint((kFirstCount + column) << 3U | kLength);
    out.varint(sizes->counts[column]);
    for (const DeviceState* state : taken) out.varint(value(*state));
  });
  return WrittenColumns{.states = taken.size(), .bytes = whole(*sizes)};
}

bool read_by_hand(std::span<const std::byte> body, DataContent& content) {
  if (!kLittleEndian || body.size() > kMaxDatagram) return false;
  empty(content);
  const auto* const begin = reinterpret_cast<const Byte*>(body.data());
  Reader in(begin, begin + body.size());
  in.time<1>(content.sent);
  in.part<2, kLength>(content.echo,
                      [&](IncomingEcho& echo) { inner<2>(in, [&](Reader& inside) { echo_fields(inside, echo); }); });
  const auto is_time = [](auto time) { return in_time(time.time_since_epoch()); };
  if (!is_time(content.sent)) return false;
  if (content.echo && !(is_time(content.echo->sent) && is_time(content.echo->received))) return false;
  // With a member named, an aggregate is made member by member. Without, all of its bytes are set to 0 before that.
  for (int frames = 0; in.next_is<3, kLength>(); ++frames) {
    Reader frame(nullptr, nullptr);
    Reader fields(nullptr, nullptr);
    if (frames == limits::kMaxFrames || !in.enter<3>(frame)) return false;
    if (frame.enter<1>(fields)) {
      DeviceState& state = append(content.frames, [] { return DeviceState{.tick = 0}; });
      state_fields(fields, state);
      if (!fields.done() || !in_bounds(state)) return false;
    } else if (frame.enter<2>(fields)) {
      ForceCommand& command = append(content.frames, [] { return ForceCommand{.sequence = 0}; });
      force_fields(fields, command);
      if (!fields.done() || !is_receivable(command)) return false;
    } else if (frame.enter<10>(fields)) {
      if (!read_columns(fields, content)) return false;
    } else {
      return false;
    }
    if (!frame.done()) return false;
  }
  return in.done();
}

}  // namespace tendon::wire
