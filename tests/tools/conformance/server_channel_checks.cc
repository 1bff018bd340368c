// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/server_channel_checks.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "tests/tools/conformance/server_coupling_checks.h"

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;

pb::Claim claim(pb::Role role, const std::string& device = {}, const std::string& channel = {}) {
  pb::Claim out;
  out.set_role(role);
  out.set_device(device);
  out.set_channel(channel);
  return out;
}

/// Checks the grants to an observer of device 0 who also controls its free channel 0.
bool first_of_both(const pb::Welcome& welcome) {
  if (welcome.grants_size() != 2) return false;
  const pb::Grant& sees = welcome.grants(0);
  const pb::Grant& controls = welcome.grants(1);
  return sees.device() == 0 && sees.role() == pb::ROLE_OBSERVER && controls.device() == 0 && controls.channel() == 0 &&
         controls.role() == pb::ROLE_CONTROLLER;
}

bool within_bounds(const pb::DeviceDescription& device) {
  const auto size = [](double value) { return value >= 0 && value <= 1e12; };
  const auto dof = [](std::uint32_t count) { return count >= 1 && count <= 6; };
  const pb::Vec3& low = device.workspace_min_m();
  const pb::Vec3& high = device.workspace_max_m();
  const bool box = device.has_workspace_min_m() == device.has_workspace_max_m() && !far(low) && !far(high) &&
                   low.x() <= high.x() && low.y() <= high.y() && low.z() <= high.z();
  const auto channel_good = [](const pb::ChannelDescription& channel) {
    return channel.name().size() <= 24 && (channel.rule() == 1 || channel.rule() == 2) &&
           channel.lease_ms() <= 3'600'000 && channel.holder().size() <= 24;
  };
  return device.name().size() <= 24 && device.model().size() <= 64 && dof(device.position_dof()) &&
         dof(device.force_dof()) && box && size(device.max_force_n()) && size(device.continuous_force_n()) &&
         size(device.max_stiffness_npm()) && size(device.position_resolution_m()) && device.loop_hz() >= 1 &&
         device.loop_hz() <= 1'000'000 && device.channels_size() >= 1 && device.channels_size() <= 8 &&
         std::ranges::all_of(device.channels(), channel_good);
}

}  // namespace

pb::Hello ChannelChecks::claiming(const std::vector<pb::Claim>& claims) const {
  const bool controls = std::ranges::count(claims, pb::ROLE_CONTROLLER, &pb::Claim::role) > 0;
  pb::Hello out = guest_.hello(controls ? pb::ROLE_CONTROLLER : pb::ROLE_OBSERVER);
  out.add_features("channels");
  *out.mutable_claims() = {claims.begin(), claims.end()};
  return out;
}

void ChannelChecks::check_claims() {
  const auto without = guest_.ask(claiming({}));
  const pb::Welcome welcome = without ? without->body.welcome() : pb::Welcome();
  channels_ = std::ranges::count(welcome.features(), "channels") > 0;
  if (!channels_) {
    for (const std::string_view check : {"claims-granted", "claim-refused", "describe", "describe-unknown",
                                         "lease-denied", "lease-kept", "deadband-bounds", "deadband", "link-report"}) {
      guest_.report.not_applicable(check, "this server does not offer the feature \"channels\"");
    }
    return;
  }
  guest_.report.judge("claims-granted", welcome.grants().empty(), welcome.ShortDebugString(),
                      "no grants for a Hello without claims");

  pb::Hello lower_role = claiming({claim(pb::ROLE_CONTROLLER)});
  lower_role.set_role(pb::ROLE_OBSERVER);
  const std::vector<std::pair<std::string, pb::Hello>> all = {
      {"an unknown device", claiming({claim(pb::ROLE_OBSERVER, "no-server-has-this")})},
      {"an unknown channel", claiming({claim(pb::ROLE_CONTROLLER, "", "no-device-has-this")})},
      {"the same claim twice", claiming({claim(pb::ROLE_CONTROLLER), claim(pb::ROLE_CONTROLLER)})},
      {"a role that is not the highest of the claims", lower_role}};
  for (const auto& [what, words] : all) {
    const auto answered = guest_.ask(words);
    guest_.report.judge("claim-refused", answered && answered->body.refused().code() == pb::CODE_INVALID,
                        answered ? answered->body.ShortDebugString() : "nothing", "Refused, CODE_INVALID, for " + what);
  }
}

void ChannelChecks::check_from_outside(Conversation& observer, std::uint32_t id) {
  if (!channels_) return;
  pb::Control take;
  take.set_id(id);
  take.mutable_take_lease();
  const auto denied = observer.ask(take);
  guest_.report.judge("lease-denied", denied && denied->code() == pb::CODE_DENIED,
                      denied ? denied->ShortDebugString() : "nothing", "CODE_DENIED for an observer");

  pb::Control describe;
  describe.set_id(id + 1);
  describe.mutable_describe();
  const auto described = observer.ask(describe);
  guest_.report.judge("describe", described && described->code() == pb::CODE_OK && described->has_device(),
                      described ? described->ShortDebugString() : "nothing",
                      "CODE_OK with a description of device 0, for an observer too");
  if (described && described->has_device()) about_ = described->device();
}

std::optional<ServerGuest::Session> ChannelChecks::check_channels(std::uint32_t& id) {
  if (!channels_) return guest_.enter(with_coupling(guest_.hello(pb::ROLE_CONTROLLER)));
  const bool named = about_ && about_->channels_size() > 0;
  const std::string device = named ? about_->name() : "";
  const std::string channel = named ? about_->channels(0).name() : "";
  auto session = guest_.enter(
      with_coupling(claiming({claim(pb::ROLE_OBSERVER, device), claim(pb::ROLE_CONTROLLER, device, channel)})));
  if (!session) return session;
  guest_.report.judge(
      "claims-granted", first_of_both(session->welcome), session->welcome.ShortDebugString(),
      "two grants: first for an observer of device 0, then for a controller of its channel 0, which is free");
  check_description(session->talk, session->welcome, id);
  check_lease(session->talk, id);
  check_deadband(session->talk, session->welcome, id);
  return session;
}

void ChannelChecks::check_description(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id) {
  const auto describe = [&](std::uint32_t device) {
    pb::Control control;
    control.set_id(++id);
    control.mutable_describe()->set_device(device);
    return talk.ask(control).value_or(pb::ControlAck());
  };
  const pb::ControlAck first = describe(0);
  const pb::DeviceDescription& device = first.device();
  guest_.report.judge("describe", first.code() == pb::CODE_OK && device.device() == 0 && within_bounds(device),
                      first.ShortDebugString(), "CODE_OK with a description of device 0, values within bounds");
  const bool agrees = device.model() == welcome.device_name() && device.max_force_n() == welcome.max_force_n() &&
                      device.position_resolution_m() == welcome.position_resolution_m() &&
                      device.loop_hz() == welcome.loop_hz();
  // An invalid Welcome cannot be compared.
  guest_.report.judge("describe", agrees || guest_.report.failed("welcome"), device.ShortDebugString(),
                      "as in the Welcome: " + welcome.ShortDebugString());

  const pb::ControlAck last = describe(15);
  if (last.code() == pb::CODE_OK && last.device().device() == 15) {
    guest_.report.not_applicable("describe-unknown", "this server has all 16 devices");
  } else {
    guest_.report.judge("describe-unknown", last.code() == pb::CODE_INVALID, last.ShortDebugString(), "CODE_INVALID");
  }
}

void ChannelChecks::check_lease(Conversation& talk, std::uint32_t& id) {
  const auto ok = [&](bool take, const std::string& to) {
    pb::Control control;
    control.set_id(++id);
    if (take) {
      control.mutable_take_lease();
    } else {
      control.mutable_give_lease();
    }
    const auto ack = talk.ask(control);
    guest_.report.judge("lease-kept", ack && ack->code() == pb::CODE_OK, ack ? ack->ShortDebugString() : "nothing",
                        "CODE_OK for " + to);
  };
  const auto holder_is = [&](const std::string& name, const std::string& after) {
    pb::Control control;
    control.set_id(++id);
    control.mutable_describe();
    const auto ack = talk.ask(control);
    if (!ack || ack->device().channels().empty()) return;  // "describe" has failed
    const std::string& told = ack->device().channels(0).holder();
    guest_.report.judge("lease-kept", told == name, "held by \"" + told + "\" " + after, "held by \"" + name + "\"");
  };
  ok(true, "take_lease of the holder");
  holder_is("conformance", "after take_lease");
  ok(false, "give_lease of the holder");
  holder_is("", "after give_lease");
  ok(false, "give_lease of a client that claimed it, but no longer holds it");
  ok(true, "take_lease of a free channel");
  holder_is("conformance", "after take_lease");
}

void ChannelChecks::check_deadband(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id) {
  constexpr double kShare = 0.1;
  constexpr double kFloor = 0.1;
  constexpr Duration kLongest = milliseconds(20);
  const auto set = [&](double share, double floor, std::uint32_t silence_us) {
    pb::Control control;
    control.set_id(++id);
    pb::SetStateDeadband& band = *control.mutable_set_state_deadband();
    band.set_share(share);
    band.set_floor_mps(floor);
    band.set_max_silence_us(silence_us);
    return talk.ask(control).value_or(pb::ControlAck());
  };
  const std::vector<std::pair<std::string, pb::ControlAck>> refused = {
      {"a share of 0.51", set(0.51, kFloor, 20'000)},
      {"a share of −0.1", set(-0.1, kFloor, 20'000)},
      {"a floor of 0.11 m/s", set(kShare, 0.11, 20'000)},
      {"999 µs of silence", set(kShare, kFloor, 999)},
      {"20 001 µs of silence", set(kShare, kFloor, 20'001)}};
  for (const auto& [what, ack] : refused) {
    guest_.report.judge("deadband-bounds", ack.code() == pb::CODE_INVALID, ack.ShortDebugString(),
                        "CODE_INVALID for " + what);
  }

  // States received from index `since` on, and those that their predecessor predicts by the states' own times.
  struct Count {
    std::size_t all = 0;
    std::size_t predicted = 0;
  };
  const auto count = [&](std::size_t since) {
    Count out;
    std::optional<pb::DeviceState> sent;
    talk.for_each_frame(since, [&](const pb::Frame& frame) {
      if (!frame.has_state()) return;
      const pb::DeviceState& state = frame.state();
      ++out.all;
      if (sent) {
        const pb::Vec3& v = sent->velocity_mps();
        const pb::Vec3& w = state.velocity_mps();
        const double changed = std::hypot(w.x() - v.x(), w.y() - v.y(), w.z() - v.z());
        const bool in_band = changed <= std::max(kShare * std::hypot(v.x(), v.y(), v.z()), kFloor);
        const bool in_time = state.sampled_ns() - sent->sampled_ns() < kLongest.count();
        out.predicted += in_band && in_time && state.mode() == sent->mode() ? 1 : 0;
      }
      sent = state;
    });
    return out;
  };
  const auto said = [](const Count& states) {
    return std::to_string(states.all) + " states, " + std::to_string(states.predicted) + " of them predictable";
  };

  const pb::ControlAck on = set(kShare, kFloor, 20'000);
  guest_.report.judge("deadband", on.code() == pb::CODE_OK, on.ShortDebugString(), "CODE_OK for values within bounds");
  std::size_t before = talk.heard().size();
  talk.listen(milliseconds(500));
  const Count with = count(before);
  // One per 20 ms gives 25 states, or fewer at a low loop rate; requires about half.
  const std::size_t least = std::min<std::size_t>(12, welcome.loop_hz() / 4);
  guest_.report.judge("deadband", with.all >= least, said(with) + ", in 500 ms",
                      "at least one every 20 ms; at least " + std::to_string(least));
  // A state replaced before it was sent is not visible here, so its successor can look as if it was predicted.
  guest_.report.judge("deadband", 10 * with.predicted <= with.all, said(with),
                      "no state that the previous one predicts");

  const pb::ControlAck off = set(0, 0, 0);
  guest_.report.judge("deadband", off.code() == pb::CODE_OK, off.ShortDebugString(),
                      "CODE_OK for 0, which sends all states");
  before = talk.heard().size();
  constexpr std::size_t kMany = 20;
  if (welcome.loop_hz() < 100) return;  // the states are too far apart to be predicted
  const bool all = talk.listen_until(kPatience, [&] { return count(before).predicted >= kMany; });
  guest_.report.judge("deadband", all, said(count(before)) + ", after it was disabled",
                      "all states, including " + std::to_string(kMany) + " that the previous one predicts");
}

void ChannelChecks::check_reports(const Conversation& talk) {
  if (!channels_) return;
  const pb::LinkReport* previous = nullptr;
  std::size_t count = 0;
  std::uint64_t forces = 0;
  const auto size = [](std::uint64_t ns) { return ns <= std::uint64_t{1} << 60; };
  const auto time = [](std::int64_t ns) { return ns >= -(std::int64_t{1} << 60) && ns <= std::int64_t{1} << 60; };
  const auto delays = [&](const pb::Delays& of) { return time(of.median_ns()) && time(of.p99_ns()); };
  talk.for_each_frame(0, [&](const pb::Frame& frame) {
    if (!frame.has_report()) return;
    const pb::LinkReport& report = frame.report();
    const auto expect = [&](bool kept, const std::string& expected) {
      guest_.report.judge("link-report", kept, report.ShortDebugString(), expected);
    };
    expect(size(report.span_ns()) && size(report.worst_late_ns()) && size(report.longest_gap_ns()) &&
               size(report.clock_error_ns()) && time(report.until_ns()) && time(report.clock_offset_ns()) &&
               !far(report.clock_drift_ppm()) && delays(report.round_trip()) && delays(report.to_server()) &&
               delays(report.to_client()) && report.words().size() <= 128,
           "values within bounds");
    expect(report.forces() <= report.received() && report.received() <= talk.next_number(),
           "at most as many forces as datagrams, and as datagrams sent");
    expect(report.number() > (previous == nullptr ? 0 : previous->number()), "a higher number");
    if (previous != nullptr) {
      expect(report.until_ns() - previous->until_ns() >= 500'000'000, "once per second, not more often");
    }
    ++count;
    forces += report.forces();
    previous = &report;
  });
  guest_.report.judge("link-report", count >= 2 && forces > 0,
                      std::to_string(count) + " reports of " + std::to_string(forces) + " forces",
                      "at least two: forces were sent in different seconds");
}

}  // namespace tendon::conformance
