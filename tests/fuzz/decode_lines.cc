// SPDX-License-Identifier: Apache-2.0
// Reads one datagram per line in hexadecimal digits, and prints the values that C++ decodes. This is compared to
// clients in other languages (tests/clients/python/differential.py). Integers are decimal. Floating-point numbers are
// the 16 hexadecimal digits of their bits. Strings and bytes are hexadecimal digits. Vectors and matrices are printed
// row by row. "-" means that the datagram was rejected.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/wire/codec.h"
#include "protocol/wire/handshake_codec.h"

namespace tendon {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

std::vector<std::byte> from_hex(std::string_view text) {
  if (text.size() % 2 != 0) throw std::invalid_argument("expected an even number of hexadecimal digits");
  const auto digit = [&](std::size_t at) {
    const auto value = kDigits.find(text[at]);
    if (value == std::string_view::npos) throw std::invalid_argument("expected hexadecimal digits, in lower case");
    return static_cast<unsigned>(value);
  };
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < text.size(); i += 2) bytes.push_back(std::byte(digit(i) << 4U | digit(i + 1)));
  return bytes;
}

class Line {
 public:
  Line& operator<<(std::string_view word) {
    text_ << (empty_ ? "" : " ") << word;
    empty_ = false;
    return *this;
  }
  Line& operator<<(std::int64_t number) { return *this << std::to_string(number); }
  Line& operator<<(std::uint64_t number) { return *this << std::to_string(number); }
  Line& operator<<(std::uint32_t number) { return *this << std::to_string(number); }
  Line& operator<<(double number) {
    std::string digits;
    for (unsigned shift = 64; shift > 0; shift -= 4) {
      digits += kDigits[std::bit_cast<std::uint64_t>(number) >> (shift - 4) & 0xFU];
    }
    return *this << digits;
  }
  Line& operator<<(std::span<const std::byte> bytes) {
    std::string digits = "x";
    for (const std::byte b : bytes) {
      digits += kDigits[std::to_integer<std::size_t>(b >> 4)];
      digits += kDigits[std::to_integer<std::size_t>(b & std::byte{0xF})];
    }
    return *this << digits;
  }
  Line& operator<<(const Vec3& v) { return *this << v.x() << v.y() << v.z(); }
  Line& operator<<(const Quat& q) { return *this << q.w << q.x << q.y << q.z; }
  /// −0 becomes 0, because the sign of k · 0 varies.
  Line& operator<<(const Mat3& m) {
    for (int row = 0; row < 3; ++row) *this << Vec3(m.row(row).transpose() + Vec3::Zero());
    return *this;
  }
  Line& operator<<(Duration d) { return *this << std::int64_t{d.count()}; }
  template <class Enum>
  requires std::is_enum_v<Enum> Line& operator<<(Enum value) {
    return *this << std::uint32_t{static_cast<std::uint8_t>(value)};
  }
  Line& put_text(const std::string& text) { return *this << std::as_bytes(std::span(text)); }
  Line& put_texts(const std::vector<std::string>& texts) {
    *this << std::uint64_t{texts.size()};
    for (const auto& text : texts) put_text(text);
    return *this;
  }

  std::string str() const { return text_.str(); }

 private:
  std::ostringstream text_;
  bool empty_ = true;
};

void print(Line& line, const DeviceState& state) {
  line << "state" << state.tick << state.sampled.time_since_epoch() << state.position << state.velocity
       << state.force_applied << state.energy << state.permitted_force << state.reasons << state.force_sequence
       << state.force_age << state.mode;
  if (state.force_wanted) line << "wanted" << *state.force_wanted;
  if (state.stiffness_wanted) line << "stiffness" << *state.stiffness_wanted;
  if (state.buttons != 0) line << "buttons" << state.buttons;
  if (state.turning) line << "turning" << state.turning->orientation << state.turning->angular_velocity;
  if (state.torque_applied) line << "torque" << *state.torque_applied;
  if (state.grip) line << "grip" << state.grip->opening << state.grip->velocity;
  if (state.grip_applied) line << "grip-force" << *state.grip_applied;
  if (state.hand_force) line << "hand" << *state.hand_force;
  if (const auto& joints = state.joints) {
    line << "joints" << static_cast<std::uint32_t>(joints->count);
    for (std::size_t i = 0; i < joints->count; ++i) line << joints->angle[i] << joints->velocity[i];
  }
  if (const auto& field = state.field) line << "field" << field->generation << field->depth << field->proxy;
}

void print(Line& line, const FieldBrick& brick) {
  line << "brick" << std::span<const std::byte>(brick.hash) << brick.weights;
}

void print(Line& line, const FieldStatus& status) {
  line << "field-status" << std::span<const std::byte>(status.field) << std::span<const std::byte>(status.missing);
}

void print(Line& line, const FieldPose& pose) {
  line << "pose" << pose.device << pose.channel << pose.sequence << pose.time.time_since_epoch() << pose.position
       << pose.orientation << pose.velocity << pose.angular_velocity;
}

void print(Line& line, const UseField& use) {
  line << "use-field" << use.device << use.channel << use.generation << std::span<const std::byte>(use.field);
  for (const FieldMaterial& one : use.materials) {
    line << "material" << one.stiffness << one.branch_stiffness << one.relaxation << one.friction;
  }
  for (const FieldFixture& one : use.fixtures) {
    line << "fixture" << one.kind << one.at << one.normal << one.stiffness;
    if (one.most_force) line << *one.most_force;
  }
  for (const FieldDepthTable& one : use.tables) {
    line << "table" << one.material << one.step;
    for (std::size_t i = 0; i < one.size; ++i) line << one.force[i];
  }
}

void print(Line& line, const LocalModel& model) {
  line << "model" << model.at << model.stiffness;
  line << model.valid_radius;
  if (!model.contact) return;
  line << "contact" << model.contact->normal << model.contact->gap;
  if (!model.contact->table) return;
  const ForceTable& table = *model.contact->table;
  line << "table" << table.first << table.step;
  for (std::size_t i = 0; i < table.size; ++i) line << table.force[i];
}

void print(Line& line, const ForceCommand& force) {
  line << "force" << force.sequence << force.based_on_tick << force.force << force.valid_for;
  if (force.model) print(line, *force.model);
  if (force.topology_changed) line << "changed";
  if (force.error) line << "error" << *force.error;
  if (force.torque) {
    line << "torque" << force.torque->torque;
    if (const auto& model = force.torque->model) line << "model" << model->at << model->stiffness;
  }
  if (force.grip_force) line << "grip-force" << *force.grip_force;
  if (force.way > 0) line << "way" << force.way;
  if (force.field > 0) line << "field" << force.field;
}

void print(Line& line, const Control& control) {
  line << "control" << control.id;
  if (!control.invalid.empty()) {
    line << "refused" << control.invalid;
  } else if (!control.request) {
    line << "unknown";
  } else if (const auto* rate = std::get_if<SetStateRate>(&*control.request)) {
    line << "rate" << rate->hz;
  } else if (const auto* deadband = std::get_if<SetStateDeadband>(&*control.request)) {
    line << "deadband" << deadband->share << deadband->floor << deadband->max_silence;
  } else if (std::holds_alternative<Rearm>(*control.request)) {
    line << "rearm";
  } else if (std::holds_alternative<Disarm>(*control.request)) {
    line << "disarm";
  } else if (const auto* couple = std::get_if<Couple>(&*control.request)) {
    line << "couple" << couple->device << couple->channel << couple->role << couple->method << couple->position_scale
         << couple->force_scale << couple->rotation << couple->axes << couple->stiffness << couple->mutual_damping
         << couple->damping << std::uint32_t{couple->adapt_to_delay} << std::uint32_t{couple->purse} << couple->period
         << std::uint32_t{couple->absolute} << couple->turn_stiffness << couple->turn_damping << couple->grip_stiffness
         << couple->grip_damping << couple->drift_rate;
    if (const auto& by = couple->rate) line << "rate" << by->dead_zone << by->gain << by->max_speed;
  } else if (const auto* engage = std::get_if<Engage>(&*control.request)) {
    line << "engage" << engage->device;
  } else if (const auto* disengage = std::get_if<Disengage>(&*control.request)) {
    line << "disengage" << disengage->device;
  } else if (const auto* scale = std::get_if<SetScale>(&*control.request)) {
    line << "scale" << scale->device << scale->position_scale << scale->force_scale;
  } else if (const auto* share = std::get_if<SetShare>(&*control.request)) {
    line << "share" << share->device << share->channel << share->share;
  } else if (const auto* offer = std::get_if<OfferField>(&*control.request)) {
    line << "offer-field" << std::span<const std::byte>(offer->field) << offer->size << offer->offset
         << std::span<const std::byte>(offer->part);
  } else if (const auto* use = std::get_if<UseField>(&*control.request)) {
    print(line, *use);
  } else if (const auto* drop = std::get_if<DropField>(&*control.request)) {
    line << "drop-field" << std::span<const std::byte>(drop->field);
  } else if (const auto* wanted = std::get_if<SetOutput>(&*control.request)) {
    line << "output" << wanted->device << wanted->output;
    if (const auto* lamp = std::get_if<LampColour>(&wanted->setting)) line << "rgb" << lamp->rgb;
    if (const auto* pulse = std::get_if<Vibration>(&wanted->setting)) {
      line << "vibration" << pulse->amplitude << pulse->frequency << pulse->duration;
    }
  } else {
    line << "other";
  }
}

void print(Line& line, const ControlAck& ack) {
  line << "ack" << ack.id << ack.code;
  line.put_text(ack.detail);
  if (!ack.handle) return;
  line << "handle";
  if (const auto& q = ack.handle->operator_from_device) line << "axes" << *q;
  line.put_texts(ack.handle->buttons);
  line.put_texts(ack.handle->joints);
  for (const OutputDescription& output : ack.handle->outputs) {
    line << "output" << static_cast<std::uint32_t>(output.kind);
    line.put_text(output.name);
  }
  line << std::uint32_t{ack.handle->orientation_measured} << ack.handle->max_torque;
  if (ack.handle->gripper_open) line << "gripper" << *ack.handle->gripper_open;
  line << ack.handle->max_gripper_force;
  line.put_text(ack.handle->group);
  line << static_cast<std::uint32_t>(ack.handle->hand);
}

void print(Line& line, const Bye& bye) {
  line << "bye" << bye.code;
  line.put_text(bye.reason);
}

void print(Line& line, const LinkReport& report) {
  line << "report" << report.number << report.until.time_since_epoch() << report.span << report.forces
       << report.late_server << report.late_network << report.late_engine << report.worst_late << report.longest_gap;
  for (const auto& delays : {report.round_trip, report.to_server, report.to_client}) {
    line << (delays ? "measured" : "-");
    if (delays) line << delays->median << delays->p99;
  }
  line << report.clock_offset << report.clock_drift_ppm << report.clock_error << report.received << report.lost
       << report.reordered << report.duplicated;
  line.put_text(report.words);
  line << report.late_unknown << report.refused.not_finite << report.refused.out_of_bounds
       << report.refused.unknown_tick << report.refused.old_sequence;
}

void print(Line& line, const DeviceReport& report) {
  line << "device" << report.number << report.until.time_since_epoch() << report.span << report.device << report.steps
       << report.missed << report.overruns << report.unseen;
  for (const std::uint64_t count : report.lateness) line << count;
  line << report.safety;
  line.put_text(report.fault).put_text(report.degraded);
}

void print(Line& line, const PeerReport& report) {
  line << "peer" << report.device << report.channel;
  line.put_text(report.name) << report.state_one_in << std::uint32_t{report.forces_refused};
  print(line, report.link);
  if (report.error) line << "error" << *report.error;
  line.put_text(report.way);
}

void print(Line& line, const PortFrame& port) {
  line << "port" << port.device << port.channel << port.epoch << port.sequence << port.answers_epoch << port.answers
       << port.time << port.round_trip << port.phase << port.engagement << port.buttons << port.position
       << port.velocity << port.force;
  if (port.contact_force) line << "contact" << *port.contact_force;
  line << port.account << port.need << port.given << port.taken << port.wave_integral << port.wave_energy;
  if (port.surface) line << "surface" << port.surface->normal << port.surface->offset << port.surface->stiffness;
  if (const auto& turn = port.turn) line << "turn" << turn->turn << turn->angular_velocity << turn->torque;
  if (const auto& grip = port.grip) {
    line << "grip" << grip->opening << grip->velocity << grip->force << grip->account << grip->need << grip->given
         << grip->taken;
  }
  line << port.energy_in;
  if (port.share) line << "share" << *port.share;
  line << port.position_scale << port.force_scale << std::uint32_t{port.of_peer};
}

void print(Line& line, const Welcome& welcome) {
  line << "welcome" << welcome.version;
  line.put_texts(welcome.features) << welcome.role;
  line.put_text(welcome.device_name) << welcome.max_force << welcome.position_resolution << welcome.loop_hz
                                     << welcome.timeout;
  line.put_text(welcome.server);
}

void print(Line& line, const Refused& refused) {
  line << "refused" << refused.code;
  line.put_text(refused.detail) << refused.version_min << refused.version_max;
}

void print_data(Line& line, std::span<const std::byte> body) {
  static DataReader reader;
  const DataContent* content = reader.read(body);
  if (content == nullptr) {
    line << "-";
    return;
  }
  line << content->sent.time_since_epoch();
  if (content->echo) {
    line << "echo" << content->echo->sent.time_since_epoch() << content->echo->received.time_since_epoch()
         << content->echo->packet_number << content->echo->received_mask;
  }
  for (const Frame& frame : content->frames) {
    std::visit([&](const auto& value) { print(line, value); }, frame);
  }
  line << "invalid" << content->invalid;
}

std::string verdict(std::span<const std::byte> datagram) {
  Line line;
  const auto header = decode_header(datagram);
  if (!header) return "-";
  line << header->type << header->suite << std::uint32_t{header->epoch} << header->connection_id
       << header->packet_number;
  const bool plain = header->suite == Suite::kPlain;  // otherwise the body is encrypted
  if (header->type == DatagramType::kData) {
    if (plain) print_data(line, datagram.subspan(kHeaderSize));
  } else if (const auto hello = decode_hello(datagram)) {
    line << "hello" << hello->random << hello->cookie << std::uint64_t{hello->body.size()};
    const auto said = read_hello(hello->body);
    if (plain && said) {
      line << said->version_min << said->version_max << said->role;
      line.put_text(said->name);
      line.put_texts(said->features);
    }
  } else if (const auto retry = decode_retry(datagram)) {
    line << "retry" << retry->random << retry->cookie;
  } else if (const auto answer = decode_answer(datagram)) {
    line << "answer" << answer->random << std::uint64_t{answer->body.size()};
    const auto said = read_answer(answer->body);
    if (plain && said) std::visit([&](const auto& value) { print(line, value); }, *said);
  } else {
    line << "-";
  }
  return line.str();
}

}  // namespace
}  // namespace tendon

int main(int argc, char**) {
  if (argc > 1) {
    std::cout << "Prints what C++ takes each datagram for. Hexadecimal lines in, one line each out.\n"
                 "Example: echo 5413000000000000000000000000000009a0509c3b00000000 | decode_lines\n";
    return 2;
  }
  try {
    for (std::string line; std::getline(std::cin, line);) std::cout << tendon::verdict(tendon::from_hex(line)) << '\n';
  } catch (const std::exception& error) {
    std::cerr << "decode_lines: " << error.what() << '\n';
    return 2;
  }
}
