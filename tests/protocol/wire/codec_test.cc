// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "core/base/rotation.h"
#include "protocol/limits.h"
#include "protocol/secrets/crypto.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/read_back.h"

namespace tendon::codec_test {
namespace {

using examples::data;

double any_value() {
  const double mantissa = *rc::gen::map(rc::gen::inRange(-1'000'000, 1'000'001), [](int i) { return i / 1e6; });
  return mantissa * std::pow(10.0, *rc::gen::inRange(-12, 13));
}
Vec3 any_vector() {
  const double x = any_value();
  const double y = any_value();
  return {x, y, any_value()};
}
Duration any_time() {
  return Duration{*rc::gen::inRange<std::int64_t>(-limits::kMaxTime.count(), limits::kMaxTime.count())};
}

/// One, three or nine entries on the wire.
Mat3 any_stiffness() {
  const int form = *rc::gen::inRange(1, 4);
  Mat3 stiffness = any_value() * Mat3::Identity();
  if (form == 2) stiffness = any_vector().asDiagonal();
  if (form == 3) stiffness << any_vector(), any_vector(), any_vector();
  return stiffness;
}

Quat any_rotation() {
  Quat q;
  do {
    q = {.w = *rc::gen::inRange(-1000, 1001) / 1e3,
         .x = *rc::gen::inRange(-1000, 1001) / 1e3,
         .y = *rc::gen::inRange(-1000, 1001) / 1e3,
         .z = *rc::gen::inRange(-1000, 1001) / 1e3};
  } while (q == Quat{.w = 0, .x = 0, .y = 0, .z = 0});
  return unit(q);
}

RC_GTEST_PROP(Codec, AStateComesOutAsItWentIn, ()) {
  DeviceState in;
  in.tick = *rc::gen::arbitrary<std::uint64_t>();
  in.sampled = PeerTime{any_time()};
  in.position = any_vector();
  in.velocity = any_vector();
  in.force_applied = any_vector();
  in.energy = any_value();
  in.permitted_force = *rc::gen::arbitrary<bool>() ? kInf : std::abs(any_value());
  in.reasons = *rc::gen::arbitrary<std::uint32_t>();
  in.force_sequence = *rc::gen::arbitrary<std::uint64_t>();
  in.force_age = std::chrono::abs(any_time());
  in.mode = static_cast<Mode>(*rc::gen::inRange(1, 7));
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  if (*rc::gen::arbitrary<bool>()) in.force_wanted = any_vector();
  if (*rc::gen::arbitrary<bool>()) in.stiffness_wanted = any_stiffness();
  in.buttons = *rc::gen::arbitrary<std::uint32_t>();
  if (*rc::gen::arbitrary<bool>()) in.turning = {.orientation = any_rotation(), .angular_velocity = any_vector()};
  if (*rc::gen::arbitrary<bool>()) in.torque_applied = any_vector();
  if (*rc::gen::arbitrary<bool>()) in.grip = {.opening = any_value(), .velocity = any_value()};
  if (*rc::gen::arbitrary<bool>()) in.grip_applied = any_value();
  if (*rc::gen::arbitrary<bool>()) in.hand_force = any_vector();
  if (const std::size_t count = *rc::gen::inRange<std::size_t>(0, Joints::kMost + 1); count > 0) {
    in.joints = Joints{.count = count};
    for (std::size_t i = 0; i < count; ++i) {
      in.joints->angle[i] = any_value();
      in.joints->velocity[i] = any_value();
    }
  }

  DataReader reader;
  const DataContent* content = read(reader, data(1, {}, in));
  RC_ASSERT(content != nullptr);
  RC_ASSERT(content->frames.size() == 1U);
  const auto& out = std::get<DeviceState>(content->frames[0]);
  RC_ASSERT(out.force_wanted == in.force_wanted);
  RC_ASSERT(out.stiffness_wanted == in.stiffness_wanted);
  RC_ASSERT(out.buttons == in.buttons);
  RC_ASSERT((out.turning == in.turning));
  RC_ASSERT(out.torque_applied == in.torque_applied);
  RC_ASSERT((out.grip == in.grip));
  RC_ASSERT(out.grip_applied == in.grip_applied);
  RC_ASSERT(out.hand_force == in.hand_force);
  RC_ASSERT(out.joints == in.joints);
  RC_ASSERT(out.tick == in.tick);
  RC_ASSERT((out.sampled == in.sampled));
  RC_ASSERT(out.position == in.position);
  RC_ASSERT(out.velocity == in.velocity);
  RC_ASSERT(out.force_applied == in.force_applied);
  RC_ASSERT(out.energy == in.energy);
  RC_ASSERT(out.permitted_force == in.permitted_force);
  RC_ASSERT(out.reasons == in.reasons);
  RC_ASSERT(out.force_sequence == in.force_sequence);
  RC_ASSERT((out.force_age == in.force_age));
  RC_ASSERT((out.mode == in.mode));
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.channel == in.channel);
}

RC_GTEST_PROP(Codec, AForceComesOutAsItWentIn, ()) {
  ForceCommand in;
  in.sequence = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.based_on_tick = *rc::gen::arbitrary<std::uint64_t>();
  in.force = any_vector();
  in.valid_for = std::chrono::microseconds(*rc::gen::inRange(1, 10'000'001));
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  if (*rc::gen::arbitrary<bool>()) {
    in.model = LocalModel{.at = any_vector(), .stiffness = any_stiffness()};
    if (*rc::gen::arbitrary<bool>()) in.model->valid_radius = std::abs(any_value());
    if (*rc::gen::arbitrary<bool>()) {
      Contact& contact = in.model->contact.emplace(Contact{.normal = Vec3(0.6, 0, -0.8), .gap = any_value()});
      if (*rc::gen::arbitrary<bool>()) {
        ForceTable& table =
            contact.table.emplace(ForceTable{.first = any_value(), .step = std::abs(any_value()) + 1e-9});
        table.step = std::min(table.step, limits::kMaxValue);
        table.size =
            static_cast<std::uint32_t>(*rc::gen::inRange(ForceTable::kMinEntries, ForceTable::kMaxEntries + 1));
        for (std::size_t i = 0; i < table.size; ++i) table.force[i] = any_value();
      }
    }
  }
  in.topology_changed = *rc::gen::arbitrary<bool>();
  if (*rc::gen::arbitrary<bool>()) in.error = std::abs(any_value());
  const int torque_form = *rc::gen::inRange(0, 5);
  if (torque_form > 0) in.torque = RemoteTorque{.torque = any_vector()};
  if (torque_form > 1) {
    RotationModel& model = in.torque->model.emplace();
    model.at = any_rotation();
    if (torque_form == 2) model.stiffness = any_value() * Mat3::Identity();
    if (torque_form == 3) model.stiffness = any_vector().asDiagonal();
    if (torque_form == 4) model.stiffness << any_vector(), any_vector(), any_vector();
  }
  if (*rc::gen::arbitrary<bool>()) in.grip_force = any_value();
  in.way = *rc::gen::inRange<std::uint32_t>(0, limits::kMaxWays + 1);

  DataReader reader;
  const DataContent* content = read(reader, data(1, {}, in));
  RC_ASSERT(content != nullptr);
  RC_ASSERT(content->frames.size() == 1U);
  const auto& out = std::get<ForceCommand>(content->frames[0]);
  RC_ASSERT(out.sequence == in.sequence);
  RC_ASSERT(out.based_on_tick == in.based_on_tick);
  RC_ASSERT(out.force == in.force);
  RC_ASSERT((out.valid_for == in.valid_for));
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.channel == in.channel);
  RC_ASSERT(out.model.has_value() == in.model.has_value());
  if (in.model) {
    RC_ASSERT(out.model->at == in.model->at);
    RC_ASSERT(out.model->stiffness == in.model->stiffness);
    RC_ASSERT(out.model->valid_radius == in.model->valid_radius);
    RC_ASSERT(out.model->contact.has_value() == in.model->contact.has_value());
    if (const auto& contact = in.model->contact) {
      RC_ASSERT(out.model->contact->normal == contact->normal);
      RC_ASSERT(out.model->contact->gap == contact->gap);
      RC_ASSERT(out.model->contact->table.has_value() == contact->table.has_value());
      if (contact->table) {
        const ForceTable& table = *out.model->contact->table;
        RC_ASSERT(table.first == contact->table->first);
        RC_ASSERT(table.step == contact->table->step);
        RC_ASSERT(table.size == contact->table->size);
        RC_ASSERT(table.force == contact->table->force);
      }
    }
  }
  RC_ASSERT(out.topology_changed == in.topology_changed);
  RC_ASSERT(out.error == in.error);
  RC_ASSERT(out.grip_force == in.grip_force);
  RC_ASSERT(out.way == in.way);
  RC_ASSERT(out.torque.has_value() == in.torque.has_value());
  if (!in.torque) return;
  RC_ASSERT(out.torque->torque == in.torque->torque);
  RC_ASSERT(out.torque->model.has_value() == in.torque->model.has_value());
  if (!in.torque->model) return;
  RC_ASSERT((out.torque->model->at == in.torque->model->at));
  RC_ASSERT(out.torque->model->stiffness == in.torque->model->stiffness);
}

Duration any_length() { return Duration{*rc::gen::inRange<std::int64_t>(0, limits::kMaxTime.count())}; }

std::string any_text(std::size_t limit) { return std::string(*rc::gen::inRange<std::size_t>(0, limit + 1), 'w'); }

LinkReport any_report() {
  const auto any_delays = []() -> std::optional<Delays> {
    if (*rc::gen::arbitrary<bool>()) return {};
    const Duration median = any_time();
    return Delays{median, any_time()};
  };
  LinkReport in;
  in.number = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.until = PeerTime{any_time()};
  in.span = any_length();
  in.forces = *rc::gen::arbitrary<std::uint64_t>();
  in.late_server = *rc::gen::arbitrary<std::uint64_t>();
  in.late_network = *rc::gen::arbitrary<std::uint64_t>();
  in.late_engine = *rc::gen::arbitrary<std::uint64_t>();
  in.worst_late = any_length();
  in.longest_gap = any_length();
  in.round_trip = any_delays();
  in.to_server = any_delays();
  in.to_client = any_delays();
  in.clock_offset = any_time();
  in.clock_drift_ppm = any_value();
  in.clock_error = any_length();
  in.received = *rc::gen::arbitrary<std::uint64_t>();
  in.lost = *rc::gen::arbitrary<std::uint64_t>();
  in.reordered = *rc::gen::arbitrary<std::uint64_t>();
  in.duplicated = *rc::gen::arbitrary<std::uint64_t>();
  in.words = any_text(limits::kMaxDetail);
  in.late_unknown = *rc::gen::arbitrary<std::uint64_t>();
  in.refused = {.not_finite = *rc::gen::arbitrary<std::uint64_t>(),
                .out_of_bounds = *rc::gen::arbitrary<std::uint64_t>(),
                .unknown_tick = *rc::gen::arbitrary<std::uint64_t>(),
                .old_sequence = *rc::gen::arbitrary<std::uint64_t>()};
  return in;
}

void assert_same(const LinkReport& out, const LinkReport& in) {
  const auto same = [](const std::optional<Delays>& a, const std::optional<Delays>& b) {
    return a.has_value() == b.has_value() && (!a || (a->median == b->median && a->p99 == b->p99));
  };
  RC_ASSERT(out.number == in.number);
  RC_ASSERT((out.until == in.until));
  RC_ASSERT((out.span == in.span && out.worst_late == in.worst_late && out.longest_gap == in.longest_gap));
  RC_ASSERT(out.forces == in.forces);
  RC_ASSERT(out.late_server == in.late_server);
  RC_ASSERT(out.late_network == in.late_network);
  RC_ASSERT(out.late_engine == in.late_engine);
  RC_ASSERT(same(out.round_trip, in.round_trip));
  RC_ASSERT(same(out.to_server, in.to_server));
  RC_ASSERT(same(out.to_client, in.to_client));
  RC_ASSERT((out.clock_offset == in.clock_offset && out.clock_error == in.clock_error));
  RC_ASSERT(out.clock_drift_ppm == in.clock_drift_ppm);
  RC_ASSERT(out.received == in.received);
  RC_ASSERT(out.lost == in.lost);
  RC_ASSERT(out.reordered == in.reordered);
  RC_ASSERT(out.duplicated == in.duplicated);
  RC_ASSERT(out.words == in.words);
  RC_ASSERT(out.late_unknown == in.late_unknown);
  RC_ASSERT((out.refused == in.refused));
}

RC_GTEST_PROP(Codec, AReportComesOutAsItWentIn, ()) {
  const LinkReport in = any_report();
  assert_same(there(in), in);
}

RC_GTEST_PROP(Codec, AReportOnADeviceComesOutAsItWentIn, ()) {
  DeviceReport in;
  in.number = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.until = PeerTime{any_time()};
  in.span = any_length();
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.missed = *rc::gen::arbitrary<std::uint64_t>();
  const auto buckets = *rc::gen::inRange<std::size_t>(0, limits::kLatenessBuckets + 1);
  for (std::size_t i = 0; i < buckets; ++i) {
    in.lateness[i] = *rc::gen::inRange<std::uint64_t>(0, std::uint64_t{1} << 59);  // 24 of them stay below 2^64
    in.steps += in.lateness[i];
  }
  in.steps += *rc::gen::inRange<std::uint64_t>(0, 1000);
  in.overruns = *rc::gen::inRange<std::uint64_t>(0, in.steps + 1);
  in.unseen = *rc::gen::inRange<std::uint64_t>(0, in.steps + 1);
  in.safety = static_cast<Safety>(*rc::gen::inRange(1, 9));
  in.fault = any_text(limits::kMaxDetail);
  in.degraded = any_text(limits::kMaxDetail);

  const DeviceReport out = there(in);
  RC_ASSERT(out.number == in.number);
  RC_ASSERT((out.until == in.until && out.span == in.span));
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.steps == in.steps);
  RC_ASSERT(out.missed == in.missed);
  RC_ASSERT(out.overruns == in.overruns);
  RC_ASSERT(out.unseen == in.unseen);
  RC_ASSERT(out.lateness == in.lateness);
  RC_ASSERT((out.safety == in.safety));
  RC_ASSERT(out.fault == in.fault);
  RC_ASSERT(out.degraded == in.degraded);
}

RC_GTEST_PROP(Codec, AReportOnAnEngineComesOutAsItWentIn, ()) {
  PeerReport in;
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  in.name = any_text(limits::kMaxName);
  in.state_one_in = *rc::gen::inRange(1U, limits::kMaxOneIn + 1);
  in.forces_refused = *rc::gen::arbitrary<bool>();
  in.link = any_report();

  const PeerReport out = there(in);
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.channel == in.channel);
  RC_ASSERT(out.name == in.name);
  RC_ASSERT(out.state_one_in == in.state_one_in);
  RC_ASSERT(out.forces_refused == in.forces_refused);
  assert_same(out.link, in.link);
}

RC_GTEST_PROP(Codec, APortComesOutAsItWentIn, ()) {
  const auto between = [](double least, double most) {
    return least + (most - least) * (*rc::gen::inRange(0, 1'000'001) / 1e6);
  };
  PortFrame in;
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  in.epoch = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.sequence = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.answers_epoch = *rc::gen::arbitrary<std::uint64_t>();
  in.answers = *rc::gen::arbitrary<std::uint64_t>();
  in.time = any_time();
  in.round_trip = Duration{*rc::gen::inRange<std::int64_t>(0, PortState::kMostRoundTrip.count() + 1)};
  in.phase = static_cast<PortPhase>(*rc::gen::inRange(1, 8));
  in.engagement = *rc::gen::arbitrary<std::uint64_t>();
  in.buttons = *rc::gen::arbitrary<std::uint32_t>();
  in.position = any_vector();
  in.velocity = any_vector();
  in.force = any_vector();
  if (*rc::gen::arbitrary<bool>()) in.contact_force = any_vector();
  in.account = between(-1e3, 1e3);
  in.need = between(0, 1e3);
  in.given = between(0, 1e6);
  in.taken = between(0, 1e6);
  if (*rc::gen::arbitrary<bool>()) in.wave_integral = any_vector();
  in.wave_energy = between(0, 1e6);
  if (*rc::gen::arbitrary<bool>()) {
    in.surface = {.normal = {0, 0.6, -0.8}, .offset = between(-1e12, 1e12), .stiffness = between(0, 1e12)};
  }
  if (*rc::gen::arbitrary<bool>()) {
    in.turn = {.turn = any_rotation(), .angular_velocity = any_vector(), .torque = any_vector()};
  }
  if (*rc::gen::arbitrary<bool>()) {
    in.grip = {.opening = any_value(),
               .velocity = any_value(),
               .force = any_value(),
               .account = between(-1e3, 1e3),
               .need = between(0, 1e3),
               .given = between(0, 1e6),
               .taken = between(0, 1e6)};
  }
  in.energy_in = between(0, 1e6);
  if (*rc::gen::arbitrary<bool>()) in.share = between(0, 1);
  if (*rc::gen::arbitrary<bool>()) in.position_scale = between(0.01, 100);
  if (*rc::gen::arbitrary<bool>()) in.force_scale = between(0.01, 100);
  in.of_peer = *rc::gen::arbitrary<bool>();

  const PortFrame out = there(in);
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.channel == in.channel);
  RC_ASSERT(out.epoch == in.epoch);
  RC_ASSERT(out.sequence == in.sequence);
  RC_ASSERT(out.answers_epoch == in.answers_epoch);
  RC_ASSERT(out.answers == in.answers);
  RC_ASSERT((out.time == in.time && out.round_trip == in.round_trip));
  RC_ASSERT((out.phase == in.phase));
  RC_ASSERT(out.engagement == in.engagement);
  RC_ASSERT(out.buttons == in.buttons);
  RC_ASSERT((out.position == in.position && out.velocity == in.velocity && out.force == in.force));
  RC_ASSERT(out.contact_force == in.contact_force);
  RC_ASSERT(out.account == in.account);
  RC_ASSERT(out.need == in.need);
  RC_ASSERT(out.given == in.given);
  RC_ASSERT(out.taken == in.taken);
  RC_ASSERT(out.wave_integral == in.wave_integral);
  RC_ASSERT(out.wave_energy == in.wave_energy);
  RC_ASSERT(out.surface.has_value() == in.surface.has_value());
  if (in.surface) {
    RC_ASSERT(out.surface->normal == in.surface->normal);
    RC_ASSERT(out.surface->offset == in.surface->offset);
    RC_ASSERT(out.surface->stiffness == in.surface->stiffness);
  }
  RC_ASSERT(out.turn.has_value() == in.turn.has_value());
  if (in.turn) {
    RC_ASSERT((out.turn->turn == in.turn->turn));
    RC_ASSERT(out.turn->angular_velocity == in.turn->angular_velocity);
    RC_ASSERT(out.turn->torque == in.turn->torque);
  }
  RC_ASSERT(out.grip.has_value() == in.grip.has_value());
  if (in.grip) {
    RC_ASSERT(out.grip->opening == in.grip->opening);
    RC_ASSERT(out.grip->velocity == in.grip->velocity);
    RC_ASSERT(out.grip->force == in.grip->force);
    RC_ASSERT(out.grip->account == in.grip->account);
    RC_ASSERT(out.grip->need == in.grip->need);
    RC_ASSERT(out.grip->given == in.grip->given);
    RC_ASSERT(out.grip->taken == in.grip->taken);
  }
  RC_ASSERT(out.energy_in == in.energy_in);
  RC_ASSERT(out.share == in.share);
  RC_ASSERT(out.position_scale == in.position_scale);
  RC_ASSERT(out.force_scale == in.force_scale);
  RC_ASSERT(out.of_peer == in.of_peer);
}

RC_GTEST_PROP(Codec, ACoupleComesOutAsItWentIn, ()) {
  const auto scale = [] { return *rc::gen::inRange(1, 10'001) / 100.0; };
  Couple in;
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  in.role = *rc::gen::arbitrary<bool>() ? PortRole::kLeader : PortRole::kFollower;
  in.method = *rc::gen::elementOf(std::vector(kCouplingMethods.begin(), kCouplingMethods.end()));
  in.position_scale = scale();
  in.force_scale = scale();
  in.rotation = any_rotation();
  in.axes = *rc::gen::inRange(1U, 8U);
  in.stiffness = std::abs(any_value());
  in.mutual_damping = std::abs(any_value());
  in.damping = std::abs(any_value());
  in.adapt_to_delay = *rc::gen::arbitrary<bool>();
  in.purse = *rc::gen::arbitrary<bool>();
  in.period = std::chrono::microseconds(*rc::gen::inRange(1, 10'000'001));
  in.absolute = *rc::gen::arbitrary<bool>();
  in.turn_stiffness = std::abs(any_value());
  in.turn_damping = std::abs(any_value());
  in.grip_stiffness = std::abs(any_value());
  in.grip_damping = std::abs(any_value());
  in.drift_rate = std::abs(any_value());
  if (*rc::gen::arbitrary<bool>()) {
    const auto above_zero = [] { return std::min(std::abs(any_value()) + 1e-9, limits::kMaxValue); };
    in.rate = {.dead_zone = std::abs(any_value()), .gain = above_zero(), .max_speed = above_zero()};
  }
  const auto out = there(Control{.id = 1, .request = in});
  RC_ASSERT(std::get<Couple>(*out.request) == in);
}

TEST(Codec, EngageAndDisengageComeOutAsTheyWentIn) {
  EXPECT_EQ(std::get<Engage>(*there(Control{.id = 1, .request = Engage{.device = 15}}).request).device, 15U);
  EXPECT_EQ(std::get<Disengage>(*there(Control{.id = 1, .request = Disengage{.device = 15}}).request).device, 15U);
}

RC_GTEST_PROP(Codec, ScalesAndSharesComeOutAsTheyWentIn, ()) {
  SetScale scale;
  scale.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  scale.position_scale = *rc::gen::inRange(1, 10'001) / 100.0;
  scale.force_scale = *rc::gen::inRange(1, 10'001) / 100.0;
  const auto scaled = std::get<SetScale>(*there(Control{.id = 1, .request = scale}).request);
  RC_ASSERT(scaled.device == scale.device);
  RC_ASSERT(scaled.position_scale == scale.position_scale);
  RC_ASSERT(scaled.force_scale == scale.force_scale);
  SetShare share;
  share.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  share.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  share.share = *rc::gen::inRange(0, 1001) / 1000.0;
  const auto shared = std::get<SetShare>(*there(Control{.id = 1, .request = share}).request);
  RC_ASSERT(shared.device == share.device);
  RC_ASSERT(shared.channel == share.channel);
  RC_ASSERT(shared.share == share.share);
}

TEST(Codec, AShareOfNothingIsNotTheSameAsNone) {
  PortFrame port = examples::port();
  EXPECT_FALSE(there(port).share);
  port.share = 0;
  EXPECT_EQ(there(port).share, 0.0);
}

TEST(Codec, ASettingComesOutAsItWentIn) {
  for (const SetOutput& in : {examples::lamp(), examples::vibration()}) {
    const auto out = std::get<SetOutput>(*there(Control{.id = 1, .request = in}).request);
    EXPECT_EQ(out.device, in.device);
    EXPECT_EQ(out.output, in.output);
    EXPECT_EQ(out.setting, in.setting);
  }
}

TEST(Codec, AStiffnessTravelsInItsShortestForm) {
  ForceCommand force = examples::force();
  const auto size = [&](const Mat3& stiffness) {
    force.model->stiffness = stiffness;
    return data(1, {}, force).size();
  };
  const std::size_t isotropic = size(2000 * Mat3::Identity());
  EXPECT_EQ(size(Vec3(1, 2, 3).asDiagonal()), isotropic + 16);
  EXPECT_GE(size(Mat3::Constant(1)), isotropic + 64);
}

TEST(Codec, NineStiffnessEntriesAreRowByRow) {
  DataReader reader;
  const auto* content = reader.read(datagram_with(raw_force([](RawProtobuf& force) {
    force.message(4, RawProtobuf().packed(2, {0, 1, 2, 3, 4, 5, 6, 7, 8}));
  })));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<ForceCommand>(content->frames[0]).model->stiffness(1, 0), 3.0);
}

TEST(Codec, AForceIsValidForWholeMicrosecondsRoundedUp) {
  ForceCommand force = examples::force();
  force.valid_for = Duration{1};
  DataReader reader;
  const auto* content = read(reader, data(1, {}, force));
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<ForceCommand>(content->frames[0]).valid_for, std::chrono::microseconds(1));
}

}  // namespace
}  // namespace tendon::codec_test
