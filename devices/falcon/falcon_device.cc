// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/falcon_device.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <span>
#include <utility>
#include <variant>

#include "devices/simulated/profiles.h"

namespace tendon {
namespace {

using namespace usb::ftdi;  // NOLINT(google-build-using-namespace): all requests below are from it
using namespace std::chrono_literals;
using falcon::Counts;
using falcon::Reply;

/// 1.5 Mbaud. Replies are sent immediately, without waiting for the latency timer of 1 ms.
constexpr std::array kRunMode = {latency(1), divisor(2), k8N1, kNoFlowControl, flush_at(falcon::kPacketEnd),
                                 kPurgeOne,  kPurgeOther};

constexpr Duration kProbing = 300ms;   ///< firmware answers within 2 ms; libnifalcon tries about a hundred times
constexpr Duration kGiveUpAfter = 2s;  ///< then reopens the device, because it may have been switched on
/// Sending and receiving 16 bytes takes 0.2 ms at 1.5 Mbaud.
constexpr usb::Dialogue::Patience kPatience{.most_under_way = 1, .answer = 5ms};

/// Within 50 mm of the centre, 1 mm corresponds to at most 55 counts, so this is 3 m/s there and 5 m/s at the centre.
/// Even a released handle does not reach 3 m/s within the workspace.
constexpr double kMostCountsPerSecond = 165e3;
constexpr double kMoreCounts = 30;  ///< for replies that arrive at irregular intervals

constexpr Counts kNoTorque{};

}  // namespace

FalconDevice::FalconDevice(Config config, std::unique_ptr<usb::Pipe> pipe)
    : info_{.name = "Novint Falcon",
            .max_force = 8,  // from CHAI3D's device table; ±4096 counts are 16 N along z, 6 to 8 N across
            .position_resolution = 43e-6,
            .force_resolution = 0.01,  // one count if the distance to the centre is less than 50 mm
            .joints = {"thigh 1", "thigh 2", "thigh 3"},
            .outputs = {{.name = "ring", .kind = OutputKind::kLamp}},
            .watchdog = Duration::zero()},
      firmware_(std::move(config.firmware)),
      dialogue_(std::move(pipe)),
      loader_(firmware_) {}

bool FalconDevice::streaming() const noexcept {
  const State state = this->state();
  return (state == State::kOpening && set_up_) || state == State::kUnhomed || state == State::kHomed;
}

void FalconDevice::enter(State state) noexcept {
  state_.store(state, std::memory_order_relaxed);
  entered_ = dialogue_.now();
  switch (state) {
    case State::kOpening:
      setup_ = Setup(kRunMode);
      set_up_ = false;
      dialogue_.restart(kPatience);
      newest_.reset();
      break;
    case State::kFirmware:
      loader_.restart();
      resting_ = firmware_.empty();
      break;
    case State::kAbsent:
    case State::kUnhomed:
    case State::kHomed:
      homed_replies_ = 0;
      located_ = false;
      break;
  }
}

void FalconDevice::give_up() noexcept {
  dialogue_.reopen();
  enter(State::kAbsent);
}

std::optional<PositionSample> FalconDevice::read(LocalTime now) noexcept {
  fresh_ = false;
  if (dialogue_.begin(now)) {
    loaded_ = false;
    enter(dialogue_.connected() ? State::kOpening : State::kAbsent);
  }
  if (state() == State::kAbsent) return std::nullopt;
  receive();
  advance();
  if (state() != State::kHomed || !fresh_) return std::nullopt;
  return PositionSample{.at = now,
                        .position = pose_->position - falcon::kCentre,
                        .hand_force = std::nullopt,
                        .buttons = newest_->buttons};
}

Joints FalconDevice::joints(const Motion& hand) const noexcept {
  return pose_ ? Joints::three(pose_->angles, pose_->jacobian * hand.velocity) : Joints{};
}

void FalconDevice::receive() noexcept {
  dialogue_.receive([this](std::span<const std::uint8_t> packet) {
    const auto bytes = payload(packet);
    if (state() == State::kFirmware) {
      loader_.receive(bytes);
    } else if (streaming()) {
      parser_.feed(bytes);
      while (const auto reply = parser_.next()) believe(*reply);
    }
  });
  dialogue_.counters().set(DeviceCount::kUnreadable, parser_.left_out());
}

bool FalconDevice::plausible(const Reply& reply) const noexcept {
  if (!newest_) return true;
  const double most = kMoreCounts + kMostCountsPerSecond * seconds(dialogue_.since_heard());
  for (std::size_t leg = 0; leg < reply.encoders.size(); ++leg) {
    if (std::abs(reply.encoders[leg] - newest_->encoders[leg]) > most) return false;
  }
  return true;
}

void FalconDevice::believe(const Reply& reply) noexcept {
  const bool homed = reply.homed == Reply::kAllHomed;
  const bool in_step = plausible(reply);
  dialogue_.hear();
  // The encoders jump if a leg is homed or loses its home position.
  if (state() == State::kHomed && homed && !in_step) {
    dialogue_.counters().add(DeviceCount::kImplausible);
    return;
  }
  dialogue_.believe();
  newest_ = reply;
  if (homed) {
    homed_replies_ = in_step ? std::max(homed_replies_, 0) + 1 : 0;
  } else {
    homed_replies_ = std::min(homed_replies_, 0) - 1;
  }
  if (homed_replies_ <= -usb::Dialogue::kSure) moved_origin_ = false;
  if (state() == State::kOpening || (state() == State::kHomed && !homed)) enter(State::kUnhomed);
  if (state() == State::kUnhomed && homed_replies_ >= usb::Dialogue::kSure && !moved_origin_) enter(State::kHomed);
  if (state() == State::kHomed) locate(reply);
}

void FalconDevice::locate(const Reply& reply) noexcept {
  const Vec3 angles = falcon::angles_at(reply.encoders);
  auto pose = located_ ? falcon::pose_with(angles, pose_->position) : std::nullopt;
  if (!pose) pose = falcon::pose_with(angles, falcon::kCentre);
  located_ = fresh_ = pose.has_value();
  if (pose) {
    pose_ = pose;
  } else {
    dialogue_.counters().add(DeviceCount::kUnreachable);
  }
}

void FalconDevice::advance() noexcept {
  const Duration here = dialogue_.now() - entered_;
  switch (state()) {
    case State::kOpening:
      if (!set_up_) {
        set_up_ = setup_.step(dialogue_.pipe());
        if (set_up_) {
          parser_.clear();
          entered_ = dialogue_.now();
        }
      } else if (here >= kProbing) {
        if (loaded_) dialogue_.counters().add(DeviceCount::kFailedSetups);
        enter(State::kFirmware);
        resting_ = resting_ || loaded_;
      }
      break;
    case State::kFirmware:
      if (resting_) {
        if (here >= kGiveUpAfter) give_up();
        break;
      }
      switch (loader_.step(dialogue_.now(), dialogue_.pipe())) {
        case falcon::FirmwareLoader::Progress::kBusy:
          break;
        case falcon::FirmwareLoader::Progress::kDone:
          loaded_ = true;
          moved_origin_ = false;
          enter(State::kOpening);
          break;
        case falcon::FirmwareLoader::Progress::kFailed:
          dialogue_.counters().add(DeviceCount::kFailedSetups);
          resting_ = true;
          entered_ = dialogue_.now();
          break;
      }
      break;
    case State::kUnhomed:
    case State::kHomed:
      if (dialogue_.silent()) {
        dialogue_.counters().add(DeviceCount::kSilences);
        give_up();
      } else if (state() == State::kHomed && dialogue_.lost_count()) {
        dialogue_.counters().add(DeviceCount::kLostCounts);
        moved_origin_ = true;
        enter(firmware_.empty() ? State::kUnhomed : State::kFirmware);
      }
      break;
    case State::kAbsent:
      break;
  }
}

Vec3 FalconDevice::apply(const Vec3& force) noexcept {
  if (!streaming()) return Vec3::Zero();
  const bool ready = state() == State::kHomed && located_ && dialogue_.trusted();
  const Counts wanted = ready ? falcon::counts_for(*pose_, force) : kNoTorque;
  const bool exerts = wanted != kNoTorque;
  if (dialogue_.may_send(exerts)) {
    const falcon::Command command{.torque = wanted, .homing = true, .lamps = ready ? ready_lamps_ : falcon::kRed};
    if (dialogue_.send(falcon::encode(command), exerts)) held_ = wanted;
  }
  return pose_ && dialogue_.holds_force() ? falcon::force_of(*pose_, held_) : Vec3::Zero();
}

void FalconDevice::set_output(LocalTime /*now*/, std::uint32_t output, const OutputSetting& setting) noexcept {
  const auto* const colour = std::get_if<LampColour>(&setting);
  if (output != 0 || colour == nullptr) return;
  const auto lit = [rgb = colour->rgb](unsigned shift, std::uint8_t lamp) -> unsigned {
    return ((rgb >> shift) & 0x80) != 0 ? lamp : 0U;
  };
  const unsigned lamps = lit(16, falcon::kRed) | lit(8, falcon::kGreen) | lit(0, falcon::kBlue);
  ready_lamps_ = lamps == 0 || lamps == falcon::kRed ? falcon::kGreen : static_cast<std::uint8_t>(lamps);
}

namespace falcon {

const Driver& driver(const Config& /*config*/) {
  static constexpr std::array kIds{FalconDevice::kId};
  static const Driver kRow = [] {
    const auto zero = encode(kLastCommand);
    return Driver{.kind = "falcon",
                  .name = "Novint Falcon",
                  .moves_a_hand = true,
                  .axes = "right=x up=y user=z",
                  .buttons = {"right", "forward", "centre", "left"},
                  .buttons_in_words = "0 to 3, a button of the Falcon",
                  .homing = "homed: pull the grip all the way out, then push it all the way in",
                  .ids = kIds,
                  .zero_packet = {zero.begin(), zero.end()}};
  }();
  return kRow;
}

SimulatedDevice::Config stand_in(const Config& /*config*/) { return find_device_profile("falcon")->device(); }

std::unique_ptr<Device> make(const Config& config, FromOutside outside) {
  FalconDevice::Config device;
  if (config.firmware) {
    std::ifstream file = outside.open_file(*config.firmware);
    device.firmware =
        read_firmware(file, config.firmware->string(),
                      config.accept_unknown_firmware ? UnknownFirmware::kAccept : UnknownFirmware::kRefuse);
  }
  return std::make_unique<FalconDevice>(std::move(device), std::move(outside.pipe));
}

}  // namespace falcon

}  // namespace tendon
