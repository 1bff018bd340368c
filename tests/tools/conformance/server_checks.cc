// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/server_checks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "protocol/messages.h"
#include "tests/tools/conformance/conversation.h"
#include "tests/tools/conformance/server_channel_checks.h"
#include "tests/tools/conformance/server_coupling_checks.h"
#include "tests/tools/conformance/server_guest.h"
#include "tests/tools/conformance/server_opening_checks.h"
#include "tests/tools/conformance/server_request_checks.h"
#include "tests/tools/conformance/shared_checks.h"

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;

void say_bye(Conversation& talk) {
  pb::Datagram bye;
  bye.add_frames()->mutable_bye()->set_code(pb::CODE_OK);
  for (int i = 0; i < 3; ++i) talk.say(bye);
}

void damage_force(std::vector<std::function<void(pb::Frame&)>>& out, void (*change)(pb::ForceCommand&)) {
  out.push_back([change](pb::Frame& frame) { change(*frame.mutable_force()); });
}

pb::Contact& contact(pb::ForceCommand& force) {
  force.mutable_model()->add_stiffness_npm(0);
  pb::Contact& made = *force.mutable_model()->mutable_contact();
  made.mutable_normal()->set_x(-1);
  return made;
}
pb::ForceTable& table(pb::ForceCommand& force) {
  pb::ForceTable& made = *contact(force).mutable_table();
  made.set_step_m(0.001);
  made.mutable_force_n()->Resize(2, 0.0);
  return made;
}

bool has_its_entries(const pb::DeviceStates& columns, int count) {
  const auto each = [count](const auto& column, int width) { return column.size() == width * count; };
  const auto each_or_none = [&](const auto& column) { return column.empty() || each(column, 1); };
  return count > 0 && each(columns.position_m(), 3) && each(columns.velocity_mps(), 3) &&
         each(columns.force_applied_n(), 3) && each(columns.energy_j(), 1) && each(columns.permitted_force_n(), 1) &&
         each(columns.mode(), 1) && each_or_none(columns.reasons()) && each_or_none(columns.force_sequence()) &&
         each_or_none(columns.force_age_ns()) && each_or_none(columns.channel()) && each_or_none(columns.buttons());
}

bool says(const pb::DeviceStates& columns, int k, const pb::DeviceState& whole) {
  const auto near = [](double single, double exact) {
    constexpr double kLeast = std::numeric_limits<float>::min();  // below this value, single precision has fewer digits
    return single == exact || std::abs(single - exact) <= 6e-8 * std::abs(exact) + kLeast;
  };
  const auto vector = [k](const auto& column, const pb::Vec3& exact, auto same) {
    return same(column.Get(3 * k), exact.x()) && same(column.Get(3 * k + 1), exact.y()) &&
           same(column.Get(3 * k + 2), exact.z());
  };
  const auto count = [k](const auto& column, std::uint64_t exact) {
    return (column.empty() ? 0 : static_cast<std::uint64_t>(column.Get(k))) == exact;
  };
  return columns.sampled_ns() == whole.sampled_ns() &&
         vector(columns.position_m(), whole.position_m(), std::equal_to<double>()) &&
         vector(columns.velocity_mps(), whole.velocity_mps(), near) &&
         vector(columns.force_applied_n(), whole.force_applied_n(), near) &&
         near(columns.energy_j(k), whole.energy_j()) && near(columns.permitted_force_n(k), whole.permitted_force_n()) &&
         columns.mode(k) == whole.mode() && count(columns.reasons(), whole.reasons()) &&
         count(columns.force_sequence(), whole.force_sequence()) &&
         count(columns.force_age_ns(), whole.force_age_ns()) && count(columns.channel(), whole.channel()) &&
         count(columns.buttons(), whole.buttons());
}

void check_columns(ServerGuest& guest, Conversation& whole, Conversation& controller) {
  pb::Hello words = guest.hello(pb::ROLE_OBSERVER);
  words.add_features(std::string(kFeatureStateColumns));
  auto session = guest.enter(words);
  if (!session) return;
  if (std::ranges::count(session->welcome.features(), kFeatureStateColumns) == 0) {
    guest.report.not_applicable("columns", "this server does not support state-columns");
    return say_bye(session->talk);
  }
  constexpr int kEnough = 20;
  int compared = 0;
  const std::size_t before = whole.heard().size();
  for (const LocalTime end = whole.now() + kPatience; compared < kEnough && whole.now() < end;) {
    session->talk.listen(milliseconds(50));
    whole.listen(milliseconds(50));
    controller.say();
    std::map<std::uint64_t, pb::DeviceState> of_tick;
    whole.for_each_frame(before, [&](const pb::Frame& frame) {
      if (frame.has_state()) of_tick[frame.state().tick()] = frame.state();
    });
    compared = 0;
    session->talk.for_each_frame(0, [&](const pb::Frame& frame) {
      if (!frame.has_states()) return;
      const pb::DeviceStates& columns = frame.states();
      const bool entries = has_its_entries(columns, std::popcount(columns.devices()));
      guest.report.judge("columns", entries, columns.ShortDebugString(), "an entry for each device in each column");
      const auto at = of_tick.find(columns.tick());
      // The other observer receives device 0, which is the first entry if present.
      if (!entries || at == of_tick.end() || (columns.devices() & 1U) == 0) return;
      ++compared;
      guest.report.judge("columns", says(columns, 0, at->second), columns.ShortDebugString(),
                         "within single precision: " + at->second.ShortDebugString());
    });
  }
  guest.report.judge("columns", compared > 0, "no state in columns for a step that another observer received",
                     "states in columns, because the feature was granted");
  say_bye(session->talk);
}

void check_observer(ServerGuest& guest, ChannelChecks& channels, Conversation& controller) {
  auto session = guest.enter(pb::ROLE_OBSERVER);
  if (!session) return;
  Conversation& talk = session->talk;
  const auto is_state = [](const pb::Frame& frame) { return frame.has_state(); };
  std::uint64_t tick = 0;
  talk.for_each_frame(0, [&](const pb::Frame& frame) {
    if (frame.has_state()) tick = frame.state().tick();
  });
  guest.report.judge("observer-only-looks", tick > 0, "no state", "states");
  constexpr std::uint64_t kSequence = 999'983;
  pb::Datagram body;
  pb::ForceCommand& force = *body.add_frames()->mutable_force();
  force.set_sequence(kSequence);
  force.set_based_on_tick(tick);
  force.set_valid_for_us(1'000'000);
  talk.confirmed(talk.say(body));
  const std::size_t before = talk.heard().size();
  talk.listen_until(kPatience, [&] { return talk.count_frames(before, is_state) >= 20; });
  const std::size_t rendered = talk.count_frames(
      before, [](const pb::Frame& frame) { return frame.has_state() && frame.state().force_sequence() == kSequence; });
  guest.report.judge("observer-only-looks", rendered == 0, "an observer's force was rendered", "only the controller's");

  pb::Control rearm;
  rearm.set_id(1);
  rearm.mutable_rearm();
  const auto ack = talk.ask(rearm);
  guest.report.judge("rearm-by-controller", ack && ack->code() == pb::CODE_DENIED,
                     ack ? ack->ShortDebugString() : "nothing", "CODE_DENIED for an observer");
  pb::Control disarm;
  disarm.set_id(2);
  disarm.mutable_disarm();
  const auto refused = talk.ask(disarm);
  const bool not_done = refused && (refused->code() == pb::CODE_DENIED || refused->code() == pb::CODE_UNSUPPORTED);
  guest.report.judge("disarm-by-controller", not_done, refused ? refused->ShortDebugString() : "nothing",
                     "CODE_DENIED for an observer");
  check_columns(guest, talk, controller);
  channels.check_from_outside(talk, 3);
  controller.say();
  say_bye(talk);
}

void check_roaming(ServerGuest& guest, Conversation& talk) {
  const int before = talk.setup().port;
  const int elsewhere = guest.wire.open_port();
  const std::uint64_t late = talk.next_number();
  talk.skip_to(late + 1);
  if (guest.options.suite() == 0) {
    pb::Datagram body;
    talk.stamp(body);
    talk.move_to(elsewhere);
    talk.say_bad("roaming", late, talk.seal(talk.head(late), bytes_of(body)), "an older number, from another port");
    talk.move_to(before);
    const bool stays = talk.confirmed(talk.say());
    guest.report.judge("roaming", stays && guest.replies(elsewhere, kSilence).empty(),
                       "it answers a plain datagram from another address", "in suite 0 the address never changes");
    return;
  }
  talk.move_to(elsewhere);
  guest.report.judge("roaming", talk.confirmed(talk.say()), "nothing at the new address",
                     "the session continues there");
  // A late datagram from the old address must not move the session back.
  talk.move_to(before);
  talk.attribute(late, "reordering");
  talk.say_at(late, {});
  talk.move_to(elsewhere);
  guest.replies(before, milliseconds(60));
  const auto strays = guest.replies(before, kSilence);
  guest.report.judge("roaming", strays.empty(), "a datagram with a lower packet number changed it to the old address",
                     "the address of the highest packet number");
  guest.report.judge("roaming", talk.confirmed(talk.say()), "nothing at the new address",
                     "the session continues there");
}

bool tells_of_the_handle(const pb::DeviceState& state) {
  return state.buttons() != 0 || state.has_orientation() || state.has_angular_velocity_radps() ||
         state.has_torque_applied_nm() || state.has_gripper_rad() || state.has_gripper_velocity_radps() ||
         state.has_gripper_force_applied_n() || state.has_hand_force_n() || !state.joint_rad().empty() ||
         !state.joint_velocity_radps().empty();
}

void check_states(Report& report, const Conversation& talk) {
  const pb::DeviceState* previous = nullptr;
  std::size_t count = 0;
  talk.for_each_frame(0, [&](const pb::Frame& frame) {
    report.judge("states", !frame.has_force() && !frame.has_control(), frame.ShortDebugString(),
                 "only frames that a server sends");
    const bool diagnosed = frame.has_device_report() || frame.has_peer_report() || frame.state().has_force_wanted_n() ||
                           !frame.state().stiffness_wanted_npm().empty();
    report.judge("diagnostics-unasked", !diagnosed, frame.ShortDebugString(),
                 "none, because no client has this feature");
    report.judge("handle-unasked", !tells_of_the_handle(frame.state()), frame.ShortDebugString(),
                 "no handle, because no client has this feature");
    report.judge("columns-unasked", !frame.has_states(), frame.ShortDebugString(),
                 "states without columns, because no client has this feature");
    if (!frame.has_state()) return;
    const pb::DeviceState& state = frame.state();
    ++count;
    const bool goes_on =
        previous == nullptr || (state.tick() > previous->tick() && state.sampled_ns() >= previous->sampled_ns());
    report.judge("states", goes_on, state.ShortDebugString(), "a higher tick, not sampled before the last");
    const double permitted = state.permitted_force_n();
    const bool good = !far(state.position_m()) && !far(state.velocity_mps()) && !far(state.force_applied_n()) &&
                      !far(state.energy_j()) && permitted >= 0 && (std::isinf(permitted) || permitted <= 1e12) &&
                      state.mode() >= 1 && state.mode() <= 6 && state.force_age_ns() <= std::uint64_t{1} << 60;
    report.judge("states", good, state.ShortDebugString(), "values within bounds");
    previous = &state;
  });
  report.judge("states", count > 0, "no state", "states");
}

void check_conversation(ServerGuest& guest, ChannelChecks& channels, ServerGuest::Session& session) {
  Conversation& talk = session.talk;
  Evidence forces;
  std::uint64_t newest_tick = 0;
  std::size_t looked_at = 0;
  std::set<std::uint64_t> rendered;
  const auto look = [&] {
    talk.for_each_frame(looked_at, [&](const pb::Frame& frame) {
      if (!frame.has_state()) return;
      newest_tick = std::max(newest_tick, frame.state().tick());
      rendered.insert(frame.state().force_sequence());
    });
    looked_at = talk.heard().size();
  };
  forces.frame = [&](std::uint64_t sequence) {
    look();
    pb::Frame frame;
    pb::ForceCommand& force = *frame.mutable_force();
    force.set_sequence(sequence);
    force.set_based_on_tick(newest_tick);
    force.set_valid_for_us(200'000);
    return frame;
  };
  forces.shown = [&](std::uint64_t sequence) {
    look();
    return rendered.contains(sequence);
  };

  check_rekey(talk);
  const LocalTime rekeyed = talk.now();
  check_reordering(talk, forces);
  check_bad_datagrams(talk, forces);
  check_replay(talk);
  check_unknown(talk, forces);
  std::vector<std::function<void(pb::Frame&)>> damages;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  damage_force(damages, [](pb::ForceCommand& force) { force.mutable_force_n()->set_y(kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { force.mutable_force_n()->set_x(1.1e12); });
  damage_force(damages, [](pb::ForceCommand& force) { force.set_valid_for_us(0); });
  damage_force(damages, [](pb::ForceCommand& force) { force.set_valid_for_us(10'000'001); });
  damage_force(damages, [](pb::ForceCommand& force) {
    force.mutable_model()->add_stiffness_npm(1);
    force.mutable_model()->add_stiffness_npm(1);
  });
  damage_force(damages, [](pb::ForceCommand& force) {
    force.mutable_model()->add_stiffness_npm(std::numeric_limits<double>::infinity());
  });
  damage_force(damages, [](pb::ForceCommand& force) { force.set_error_n(-1); });
  damage_force(damages, [](pb::ForceCommand& force) {
    force.mutable_model()->add_stiffness_npm(1);
    force.mutable_model()->set_valid_radius_m(-1);
  });
  damage_force(damages, [](pb::ForceCommand& force) { contact(force).mutable_normal()->set_x(2); });
  damage_force(damages, [](pb::ForceCommand& force) { contact(force).set_gap_m(kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).set_step_m(0); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).set_first_depth_m(kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).set_force_n(1, kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).mutable_force_n()->RemoveLast(); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).mutable_force_n()->Resize(17, 0.0); });
  check_out_of_bounds(talk, forces, damages);
  check_newest_wins(talk, forces);
  check_window(talk, forces);
  check_answer_again(guest, session);
  check_second_controller(guest);
  check_requests(guest, talk);
  check_unasked(guest, talk, 22);
  // More than a second after the previous forces, so another report must follow.
  pb::Datagram last_force;
  *last_force.add_frames() = forces.frame(forces.next++);
  talk.confirmed(talk.say(last_force));
  check_observer(guest, channels, talk);
  check_roaming(guest, talk);
  check_old_key(talk, rekeyed);
  check_rekey_sent(talk, guest.options);
  if (session.welcome.timeout_ms() > 10'000) {
    guest.report.not_applicable(
        "timeout", "the timeout of this server is " + std::to_string(session.welcome.timeout_ms()) + " ms");
  } else {
    check_timeout(talk, milliseconds(session.welcome.timeout_ms()));
    say_bye(talk);
  }
  check_states(guest.report, talk);
  channels.check_reports(talk);
}

void check_end(ServerGuest& guest, ChannelChecks& channels) {
  std::uint32_t id = 0;
  auto first = channels.check_channels(id);
  if (!first) return;
  check_coupling(guest, *first, id + 1);
  if (guest.options.suite() == 0) {
    guest.report.not_applicable("replaced", "suite 0 has no keys");
    guest.report.not_applicable("bye-thrice", "a server with suite 0 sends Bye when it stops");
    return check_bye_silence(first->talk);
  }
  auto second = guest.enter(pb::ROLE_CONTROLLER);
  if (!second) return;
  check_byes(first->talk, 0);
  const std::size_t told = first->talk.count_frames(
      0, [](const pb::Frame& frame) { return frame.has_bye() && frame.bye().code() == pb::CODE_REPLACED; });
  guest.report.judge("replaced", told > 0, "no Bye with CODE_REPLACED to the previous session", "a Bye, CODE_REPLACED");
  check_bye_silence(second->talk);
}

}  // namespace

void judge_server(Wire& wire, const Options& options, Report& report) {
  ServerGuest guest{wire, options, report};
  ChannelChecks channels(guest);
  crypto::start();
  check_retry(guest);
  if (report.count(Outcome::kFailed) > 0) return;  // there is no server for this key
  check_bad_hellos(guest);
  check_bad_bodies(guest);
  check_cookie(guest);
  check_versions(guest);
  check_features(guest);
  check_keys(guest);
  check_half_open(guest);
  check_stray_data(guest);
  channels.check_claims();
  if (auto session = guest.enter(pb::ROLE_OBSERVER)) {
    check_bad_requests(session->talk, 1);
    say_bye(session->talk);
  }
  if (auto session = guest.enter(pb::ROLE_CONTROLLER)) check_conversation(guest, channels, *session);
  check_end(guest, channels);
  check_hello_limit(guest);
}

}  // namespace tendon::conformance
