// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/server_coupling_checks.h"

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;

pb::Couple fitting() {
  pb::Couple out;
  out.set_role(pb::PORT_ROLE_LEADER);
  out.set_method(pb::COUPLING_METHOD_POSITION_POSITION);
  out.set_position_scale(1);
  out.set_force_scale(1);
  out.mutable_rotation()->set_w(1);
  out.set_axes(7);
  out.set_stiffness_npm(1000);
  out.set_damping_nspm(4);
  out.set_adapt_to_delay(true);
  out.set_purse(true);
  out.set_period_us(1000);
  return out;
}

class Asker {
 public:
  Asker(Conversation& talk, std::uint32_t first) : talk_(talk), next_(first) {}

  pb::ControlAck couple(const pb::Couple& wanted) {
    return ask([&](pb::Control& control) { *control.mutable_couple() = wanted; });
  }
  pb::ControlAck set_output(std::uint32_t output) {
    return ask([&](pb::Control& control) {
      control.mutable_set_output()->set_output(output);
      control.mutable_set_output()->set_rgb(0);
    });
  }
  pb::ControlAck ask(const std::function<void(pb::Control&)>& fill) {
    pb::Control control;
    control.set_id(next_++);
    fill(control);
    return talk_.ask(control).value_or(pb::ControlAck());
  }

 private:
  Conversation& talk_;
  std::uint32_t next_;
};

void expect_code(Report& report, std::string_view check, const pb::ControlAck& ack, pb::Code code,
                 const std::string& to) {
  report.judge(check, ack.code() == code, ack.ShortDebugString(), pb::Code_Name(code) + " for " + to);
}

bool has(const pb::Welcome& welcome, std::string_view feature) {
  return std::ranges::count(welcome.features(), feature) > 0;
}

void check_outputs(ServerGuest& guest, Asker& asker, const pb::Welcome& welcome) {
  constexpr int kMost = 8;
  if (!has(welcome, "outputs")) {
    return guest.report.not_applicable("output-unknown", "this server does not offer the feature \"outputs\"");
  }
  const pb::ControlAck about = asker.ask([](pb::Control& control) { control.mutable_describe()->set_handle(true); });
  const int count = about.handle().outputs_size();
  if (count >= kMost) return guest.report.not_applicable("output-unknown", "the device has all 8 outputs");
  expect_code(guest.report, "output-unknown", asker.set_output(static_cast<std::uint32_t>(count)), pb::CODE_INVALID,
              "output " + std::to_string(count) + " of a device that has " + std::to_string(count));
}

/// Works for a device without a coupling and for a follower of one leader.
void check_orders(ServerGuest& guest, Asker& asker) {
  const std::string to = "a device that is not a leader";
  expect_code(guest.report, "engage-at-leader", asker.ask([](pb::Control& control) { control.mutable_engage(); }),
              pb::CODE_UNSUPPORTED, to);
  const pb::ControlAck scaled = asker.ask([](pb::Control& control) {
    control.mutable_set_scale()->set_position_scale(1);
    control.mutable_set_scale()->set_force_scale(1);
  });
  expect_code(guest.report, "scale-at-leader", scaled, pb::CODE_UNSUPPORTED, to);
  const pb::ControlAck shared = asker.ask([](pb::Control& control) { control.mutable_set_share()->set_share(0.5); });
  expect_code(guest.report, "share-of-several", shared, pb::CODE_UNSUPPORTED, "a device without several leaders");
}

void check_differences(ServerGuest& guest, Asker& asker) {
  const std::vector<std::pair<std::string, void (*)(pb::Couple&)>> all = {
      {"role", [](pb::Couple& couple) { couple.set_role(pb::PORT_ROLE_FOLLOWER); }},
      {"method", [](pb::Couple& couple) { couple.set_method(pb::COUPLING_METHOD_WAVES); }},
      {"position_scale", [](pb::Couple& couple) { couple.set_position_scale(0.5); }},
      {"axes", [](pb::Couple& couple) { couple.set_axes(3); }},
      {"purse", [](pb::Couple& couple) { couple.set_purse(false); }}};
  for (const auto& [key, change] : all) {
    pb::Couple couple = fitting();
    change(couple);
    const pb::ControlAck ack = asker.couple(couple);
    const bool named = ack.detail().find(key) != std::string::npos;
    guest.report.judge("couple-differs", ack.code() == pb::CODE_INVALID && named, ack.ShortDebugString(),
                       "CODE_INVALID, with \"" + key + "\" in its detail");
  }
}

void judge_ports(Report& report, const Conversation& talk, std::size_t since) {
  const pb::PortState* previous = nullptr;
  talk.for_each_frame(since, [&](const pb::Frame& frame) {
    if (!frame.has_port_state()) return;
    const pb::PortState& port = frame.port_state();
    const auto within = [](double value, double least, double most) { return value >= least && value <= most; };
    const auto scale = [&](double value) { return value == 0 || within(value, 0.01, 100); };
    const bool good = port.device() == 0 && port.channel() == 0 && port.epoch() > 0 && port.sequence() > 0 &&
                      port.phase() >= 1 && port.phase() <= 7 && port.round_trip_ns() <= 10'000'000'000 &&
                      !far(port.position_m()) && !far(port.velocity_mps()) && !far(port.force_n()) &&
                      !far(port.contact_force_n()) && within(port.account_j(), -1e3, 1e3) &&
                      within(port.need_j(), 0, 1e3) && within(port.given_j(), 0, 1e6) &&
                      within(port.taken_j(), 0, 1e6) && within(port.share(), 0, 1) && scale(port.position_scale()) &&
                      scale(port.force_scale()) && !port.of_peer();
    report.judge("couple", good, port.ShortDebugString(), "of device 0 and channel 0, values within bounds");
    const bool newer = previous == nullptr || port.epoch() > previous->epoch() ||
                       (port.epoch() == previous->epoch() && port.sequence() > previous->sequence());
    report.judge("couple", newer, port.ShortDebugString(), "a higher sequence, or a higher epoch");
    previous = &port;
  });
}

void check_couple(ServerGuest& guest, Asker& asker, Conversation& talk) {
  expect_code(guest.report, "couple", asker.couple(fitting()), pb::CODE_OK, "values that fit");
  if (guest.report.failed("couple")) return;
  talk.listen(milliseconds(100));  // a due state may still arrive
  const std::size_t before = talk.heard().size();
  const auto ports = [&] {
    return talk.count_frames(before, [](const pb::Frame& frame) { return frame.has_port_state(); });
  };
  const bool come = talk.listen_until(kPatience, [&] { return ports() >= 20; });
  guest.report.judge("couple", come, std::to_string(ports()) + " PortStates in 3 s", "one per period");
  const std::size_t states = talk.count_frames(before, [](const pb::Frame& frame) { return frame.has_state(); });
  guest.report.judge("couple", states == 0, std::to_string(states) + " states", "no more states");
  judge_ports(guest.report, talk, before);
}

}  // namespace

void check_unasked(ServerGuest& guest, Conversation& controller, std::uint32_t id) {
  Asker asker(controller, id);
  expect_code(guest.report, "couple-unasked", asker.couple(fitting()), pb::CODE_UNSUPPORTED,
              "a client that did not name \"teleoperation\"");
  expect_code(guest.report, "output-unasked", asker.set_output(0), pb::CODE_UNSUPPORTED,
              "a client that did not name \"outputs\"");
}

pb::Hello with_coupling(pb::Hello hello) {
  for (const char* feature : {"teleoperation", "outputs", "handle"}) hello.add_features(feature);
  return hello;
}

void check_coupling(ServerGuest& guest, ServerGuest::Session& controller, std::uint32_t id) {
  Asker asker(controller.talk, id);
  check_outputs(guest, asker, controller.welcome);
  if (guest.options.follower) {
    check_differences(guest, asker);
    check_orders(guest, asker);
    check_couple(guest, asker, controller.talk);
  } else {
    for (const std::string_view check : {"couple-differs", "couple"}) {
      guest.report.not_applicable(check, "requires --follower");
    }
    if (asker.couple(fitting()).code() == pb::CODE_UNSUPPORTED) {
      check_orders(guest, asker);
    } else {
      for (const std::string_view check : {"engage-at-leader", "scale-at-leader", "share-of-several"}) {
        guest.report.not_applicable(check, "requires a device 0 without coupling, but --follower is set");
      }
    }
  }
}

}  // namespace tendon::conformance
