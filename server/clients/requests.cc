// SPDX-License-Identifier: Apache-2.0
#include "server/clients/requests.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/base/expect.h"
#include "server/clients/couple.h"
#include "server/clients/field_intake.h"

namespace tendon {

namespace {

Outcome set_state_rate(LocalTime /*now*/, const Asker& asker, const SetStateRate& rate) {
  if (rate.hz == 0) return {.code = Code::kInvalid, .detail = "expected a state rate above 0 Hz"};
  Subscription* const subscription = subscription_to(asker.client, rate.device);
  if (subscription == nullptr) return {.code = Code::kInvalid, .detail = "the session has not claimed this device"};
  const auto loop_hz = static_cast<double>(asker.devices[rate.device].about.loop_hz);
  subscription->state_every = static_cast<std::uint64_t>(std::max(1.0, std::round(loop_hz / rate.hz)));
  return {};
}

Outcome set_state_deadband(LocalTime /*now*/, const Asker& asker, const SetStateDeadband& wanted) {
  std::string objection = StateDeadband::objection(wanted);
  if (!objection.empty()) return {.code = Code::kInvalid, .detail = std::move(objection)};
  for (Subscription& subscription : asker.client.subscriptions) {
    subscription.deadband.reset();
    if (wanted.max_silence > Duration::zero()) subscription.deadband.emplace(wanted);
  }
  return {};
}

Outcome order(const Asker& asker, std::uint32_t device, const HapticOrder& wanted, const char* done) {
  if (!asker.devices[device].mail->orders.try_push(wanted)) return {.code = Code::kBusy};
  return {.warning = std::string(done) + " by \"" + asker.client.name + "\""};
}

Outcome rearm(LocalTime /*now*/, const Asker& asker, const Rearm& wanted) {
  if (asker.client.coupled && asker.client.coupled->device == wanted.device) {
    return {.code = Code::kDenied, .detail = "each device of a coupling must be armed at its own server"};
  }
  return order(asker, wanted.device, {.kind = HapticOrder::Kind::kRearm}, "rearmed");
}

Outcome disarm(LocalTime /*now*/, const Asker& asker, const Disarm& wanted) {
  ServedDevice& device = asker.devices[wanted.device];
  if (device.outputs.turn_off_all()) device.mail->outputs.put(device.outputs.settings());
  return order(asker, wanted.device, {.kind = HapticOrder::Kind::kDisarm}, "disarmed");
}

Outcome describe(LocalTime /*now*/, const Asker& asker, const Describe& wanted) {
  if (wanted.device >= asker.devices.size()) {
    return {.code = Code::kInvalid, .detail = "there are " + std::to_string(asker.devices.size()) + " devices"};
  }
  const ServedDevice& device = asker.devices[wanted.device];
  if (wanted.handle) {
    HandleDescription handle = device.handle;
    if (!asker.client.has<kFeatureJoints>()) handle.joints.clear();
    if (!asker.client.has<kFeatureOutputs>()) handle.outputs.clear();
    return {.handle = std::move(handle)};
  }
  DeviceDescription about = device.about;
  for (std::size_t i = 0; i < device.channels.size(); ++i) {
    const ServedClient* const holder = client_of(asker.clients, device.channels[i].holder);
    about.channels[i].holder = holder != nullptr ? holder->name : std::string();
  }
  return {.device = std::move(about)};
}

Outcome take_lease(LocalTime now, const Asker& asker, const TakeLease& wanted) {
  const Leases::Taken taken = asker.leases.take(now, wanted.device, wanted.channel, asker.client, asker.may_take_over);
  if (taken.granted) return {.loser = taken.loser};
  const ServedClient* const holder = client_of(asker.clients, taken.holder);
  const std::string name = holder != nullptr ? holder->name : std::string();
  return {.code = Code::kBusy, .detail = "\"" + name + "\" holds it", .wait = taken.wait};
}

Outcome give_lease(LocalTime /*now*/, const Asker& asker, const GiveLease& given) {
  asker.leases.give(given.device, given.channel, asker.client.id());
  asker.client.uncouple(given.device, given.channel);
  return {};
}

Outcome lease_lost(LocalTime /*now*/, const Asker& /*asker*/, const LeaseLost& /*news*/) {
  return {.code = Code::kUnsupported, .detail = "only the server can send this request"};
}

/// A coupling has one peer: the first client that requests it, as long as it holds the channel.
Outcome couple(LocalTime /*now*/, const Asker& asker, const Couple& theirs) {
  if (!asker.client.may_couple()) {
    return {.code = Code::kUnsupported, .detail = "the Hello did not list the feature teleoperation"};
  }
  ServedDevice& device = asker.devices[theirs.device];
  if (!device.coupling) return {.code = Code::kUnsupported, .detail = "this device has no [teleoperation]"};
  const auto wanted = coupling_by(device, theirs.channel);
  if (!wanted) return {.code = Code::kUnsupported, .detail = "this channel is not used by a leader"};
  for (const ServedClient& client : asker.clients) {
    if (client.gone || client.id() == asker.client.id()) continue;
    if (client.coupled && client.coupled->device == theirs.device &&
        coupling_by(device, client.coupled->channel) == wanted) {
      return {.code = Code::kBusy, .detail = "the device is coupled with \"" + client.name + "\""};
    }
  }
  std::string difference = first_difference(theirs, *device.coupling);
  if (!difference.empty()) return {.code = Code::kInvalid, .detail = std::move(difference)};
  if (!renew_peer(device, *wanted)) return {.code = Code::kBusy};
  asker.client.coupled = Slot{.device = theirs.device, .channel = theirs.channel, .role = Role::kController};
  return {.warning = "coupled with \"" + asker.client.name + "\""};
}

/// Returns an empty string if the device is the leader of a coupling.
std::string no_leader(const ServedDevice& device, const char* does) {
  if (!device.coupling) return "this device has no [teleoperation]";
  if (device.coupling->role == PortRole::kLeader) return {};
  return std::string("this device is the follower: only the leader ") + does;
}

Outcome engage(LocalTime /*now*/, const Asker& asker, const Engage& wanted) {
  std::string objection = no_leader(asker.devices[wanted.device], "engages");
  if (!objection.empty()) return {.code = Code::kUnsupported, .detail = std::move(objection)};
  return order(asker, wanted.device, {.kind = HapticOrder::Kind::kEngage}, "engage requested");
}

/// Disengages the coupling whose peer is this client or, if there is none, all couplings of the device.
Outcome disengage(LocalTime /*now*/, const Asker& asker, const Disengage& wanted) {
  const ServedDevice& device = asker.devices[wanted.device];
  if (!device.coupling) return {.code = Code::kUnsupported, .detail = "this device has no [teleoperation]"};
  const auto& own = asker.client.coupled;
  const bool one = own && own->device == wanted.device;
  const std::uint32_t first = one ? coupling_by(device, own->channel).value_or(0) : 0;
  const auto last = one ? first : static_cast<std::uint32_t>(std::max<std::size_t>(device.leaders.size(), 1)) - 1;
  for (std::uint32_t coupling = first; coupling <= last; ++coupling) {
    const bool taken = device.mail->orders.try_push({.kind = HapticOrder::Kind::kDisengage, .coupling = coupling});
    if (!taken) return {.code = Code::kBusy};
  }
  return {.warning = "disengage requested by \"" + asker.client.name + "\""};
}

/// This is refused while the coupling is engaged because the follower would move.
Outcome set_scale(LocalTime /*now*/, const Asker& asker, const SetScale& wanted) {
  const ServedDevice& device = asker.devices[wanted.device];
  std::string objection = no_leader(device, "sets the scales");
  if (!objection.empty()) return {.code = Code::kUnsupported, .detail = std::move(objection)};
  if (device.coupling->grip_stiffness > 0) {
    return {.code = Code::kUnsupported, .detail = "the scales of a coupling of grippers can only be set in the scene"};
  }
  if (info(device.coupling->method).keeps_scales) {
    return {.code = Code::kUnsupported,
            .detail = "a coupling by " + std::string(to_string(device.coupling->method)) +
                      " can only be scaled in the scene"};
  }
  if (device.phase == PortPhase::kEngaged || device.phase == PortPhase::kAligning) {
    return {.code = Code::kBusy, .detail = "the coupling is engaged: use the clutch or disengage it first"};
  }
  return order(asker, wanted.device,
               {.kind = HapticOrder::Kind::kSetScale, .scales = {wanted.position_scale, wanted.force_scale}},
               "change of the scales requested");
}

Outcome set_share(LocalTime /*now*/, const Asker& asker, const SetShare& wanted) {
  const ServedDevice& device = asker.devices[wanted.device];
  const auto refused = [](std::string why) { return Outcome{.code = Code::kUnsupported, .detail = std::move(why)}; };
  if (!device.coupling) return refused("this device has no [teleoperation]");
  if (device.coupling->role == PortRole::kLeader) {
    return refused("this device is a leader: the shares are set at the follower");
  }
  if (device.leaders.empty()) return refused("this device has only one leader");
  const auto coupling = coupling_by(device, wanted.channel);
  if (!coupling) return refused("this channel is not used by a leader");
  if (!(wanted.share >= 0 && wanted.share <= 1)) {
    return {.code = Code::kInvalid, .detail = "expected a share from 0 to 1"};
  }
  const HapticOrder order{.kind = HapticOrder::Kind::kShare, .coupling = *coupling, .share = wanted.share};
  if (!device.mail->orders.try_push(order)) return {.code = Code::kBusy};
  return {.warning = "\"" + device.about.channels[wanted.channel].name + "\" has the share " +
                     rounded(wanted.share, 3) + ", set by \"" + asker.client.name + "\""};
}

/// Only the holder of a channel can set the outputs of the device.
Outcome set_output(LocalTime /*now*/, const Asker& asker, const SetOutput& wanted) {
  if (!asker.client.has<kFeatureOutputs>()) {
    return {.code = Code::kUnsupported, .detail = "the Hello did not list the feature outputs"};
  }
  ServedDevice& device = asker.devices[wanted.device];
  const auto is_held = [&](const ServedChannel& channel) { return channel.holder == asker.client.id(); };
  if (std::ranges::none_of(device.channels, is_held)) {
    return {.code = Code::kDenied, .detail = "only the holder of a channel of the device may set an output"};
  }
  const auto& outputs = device.handle.outputs;
  if (wanted.output >= outputs.size()) {
    return {.code = Code::kInvalid, .detail = "the device has " + std::to_string(outputs.size()) + " outputs"};
  }
  if (kind_of(wanted.setting) != outputs[wanted.output].kind) {
    const bool lamp = outputs[wanted.output].kind == OutputKind::kLamp;
    return {.code = Code::kInvalid,
            .detail = "output " + std::to_string(wanted.output) +
                      (lamp ? " is a lamp: expected rgb" : " is a vibration output: expected vibration")};
  }
  device.outputs.set(asker.client.id(), wanted.output, wanted.setting);
  device.mail->outputs.put(device.outputs.settings());
  return {};
}

/// Calls a member of FieldIntake if the session has the feature and is one of a controller.
template <class Wanted, Outcome (FieldIntake::*kDo)(LocalTime, const ServedClient&, const Wanted&)>
Outcome with_fields(LocalTime now, const Asker& asker, const Wanted& wanted) {
  if (asker.fields == nullptr || !asker.client.has<kFeatureFields>()) {
    return {.code = Code::kUnsupported, .detail = "the session does not have the feature fields"};
  }
  if (asker.client.role != Role::kController) {
    return {.code = Code::kDenied, .detail = "only a controller may upload or use a field"};
  }
  return (asker.fields->*kDo)(now, asker.client, wanted);
}

enum class From : std::uint8_t {
  kAnybody,
  kControllers,  ///< controllers of a channel of the device, even if it is held by another client
  kClaimants,    ///< controllers of the channel in the request
};

struct Row {
  std::size_t index;
  std::string_view name;
  From from;
  bool (*may)(const ServedClient& client, const Request& request);
  Outcome (*handle)(LocalTime now, const Asker& asker, const Request& request);
};

template <class Wanted, std::size_t kIndex = 0>
constexpr std::size_t index_of() {
  if constexpr (std::is_same_v<std::variant_alternative_t<kIndex, Request>, Wanted>) {
    return kIndex;
  } else {
    return index_of<Wanted, kIndex + 1>();
  }
}

template <class Wanted, From kFrom>
bool may(const ServedClient& client, const Request& request) {
  const auto& wanted = std::get<Wanted>(request);
  if constexpr (kFrom == From::kControllers) {
    return controls(client, wanted.device);
  } else if constexpr (kFrom == From::kClaimants) {
    return holds_slot(client, wanted.device, wanted.channel);
  } else {
    static_cast<void>(client);
    static_cast<void>(wanted);
    return true;
  }
}

template <class Wanted, From kFrom, Outcome (*kHandler)(LocalTime, const Asker&, const Wanted&)>
constexpr Row row(std::string_view name) {
  return {index_of<Wanted>(), name, kFrom, &may<Wanted, kFrom>,
          [](LocalTime now, const Asker& asker, const Request& request) {
            return kHandler(now, asker, std::get<Wanted>(request));
          }};
}

/// This must be in the order of the variant.
constexpr std::array kRequests = {
    row<SetStateRate, From::kAnybody, set_state_rate>("set the state rate"),
    row<Rearm, From::kControllers, rearm>("rearm"),
    row<Describe, From::kAnybody, describe>("describe a device"),
    row<TakeLease, From::kClaimants, take_lease>("take a lease"),
    row<GiveLease, From::kClaimants, give_lease>("give a lease"),
    row<LeaseLost, From::kAnybody, lease_lost>("lose a lease"),
    row<SetStateDeadband, From::kAnybody, set_state_deadband>("set the state deadband"),
    row<Disarm, From::kControllers, disarm>("disarm"),
    row<SetOutput, From::kControllers, set_output>("set an output"),
    row<Couple, From::kClaimants, couple>("couple a device"),
    row<Engage, From::kControllers, engage>("engage a coupling"),
    row<Disengage, From::kControllers, disengage>("disengage a coupling"),
    row<SetScale, From::kControllers, set_scale>("set the scales of a coupling"),
    row<SetShare, From::kControllers, set_share>("set the share of a leader"),
    row<OfferField, From::kAnybody, with_fields<OfferField, &FieldIntake::offer>>("offer a field"),
    row<UseField, From::kAnybody, with_fields<UseField, &FieldIntake::use>>("use a field"),
    row<DropField, From::kAnybody, with_fields<DropField, &FieldIntake::drop>>("drop a field"),
};
static_assert(kRequests.size() == std::variant_size_v<Request>);
constexpr bool in_order() {
  for (std::size_t i = 0; i < kRequests.size(); ++i) {
    if (kRequests[i].index != i) return false;
  }
  return true;
}
static_assert(in_order());

}  // namespace

Outcome answer(LocalTime now, const Asker& asker, const Request& request) {
  const Row& row = kRequests[request.index()];
  if (row.may(asker.client, request)) return row.handle(now, asker, request);
  const char* const who =
      row.from == From::kControllers ? "only a controller may " : "only a controller of the channel may ";
  return {.code = Code::kDenied, .detail = who + std::string(row.name)};
}

}  // namespace tendon
