// SPDX-License-Identifier: Apache-2.0
#include "server/clients/field_intake.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <utility>

#include "core/base/bytes.h"
#include "core/base/expect.h"
#include "core/field/field.h"
#include "core/field/field_pose.h"

namespace tendon {
namespace {

constexpr Duration kNoticeEvery = std::chrono::seconds(1);  ///< of a client
constexpr std::size_t kMostFieldNotices = 16;
constexpr std::size_t kCellsOfABrick = 64;  ///< number of cells that take as long to build as a brick
constexpr std::string_view kWasOffered = "expected a field that was offered";
constexpr std::string_view kHasArrived = "expected a field whose bricks have all arrived, found one that is incomplete";

std::string named_field(const FieldName& name) { return "field " + short_name(name) + ": "; }

BrickStore::Config store_config(const FieldIntake::Config& config, const std::vector<ServedDevice>& devices) {
  BrickStore::Config store{.bytes = 0, .key = config.secret};
  for (const ServedDevice& device : devices) {
    if (device.fields) store.bytes = std::max(store.bytes, device.fields->cache_bytes);
  }
  store.owner_bytes = store.bytes / 2;
  store.owners = static_cast<BrickStore::Owner>(config.keys.size() + 1);
  return store;
}

field::Material material_of(const FieldMaterial& sent) {
  field::Material material{
      .stiffness = sent.stiffness, .branch = sent.branch_stiffness, .friction = sent.friction, .table = {}};
  if (sent.branch_stiffness > 0) material.tau = sent.relaxation;
  return material;
}

field::Fixture fixture_of(const FieldFixture& sent) {
  field::Fixture fixture{.at = sent.at, .stiffness = sent.stiffness};
  switch (sent.kind) {
    case FieldFixtureKind::kPoint:
      return fixture;
    case FieldFixtureKind::kLine:
      fixture.kind = field::Fixture::Kind::kLine;
      break;
    case FieldFixtureKind::kPlane:
      fixture.kind = field::Fixture::Kind::kPlane;
      break;
  }
  fixture.direction = sent.normal;
  return fixture;
}

/// Adds the tables to the materials. Returns an error message if a table has no material of its own, or an empty string.
std::string objection_to_tables(const UseField& wanted, std::vector<field::Material>& materials) {
  for (std::size_t i = 0; i < wanted.tables.size(); ++i) {
    const FieldDepthTable& sent = wanted.tables[i];
    const std::string name = "tables[" + std::to_string(i) + "].material";
    if (sent.material >= materials.size()) {
      return not_expected(name, sent.material, "below " + std::to_string(materials.size()));
    }
    field::DepthTable& table = materials[sent.material].table;
    if (table.used) return not_expected(name, sent.material, "a material without another table");
    table = field::DepthTable::of(sent.step, std::span(sent.force).first(sent.size));
  }
  return {};
}

/// The relative tolerance of a stiffness and of the forces in a table. It is larger than rounding errors of doubles.
constexpr double kRounding = 1e-9;

/// Moves a stiffness and knots onto their bounds if they are only beyond them by rounding. Without this, half of the
/// measured curves that are as steep as `max_stiffness` would be refused.
void forgive_rounding(field::Material& material, double max_stiffness) noexcept {
  field::Material bounded = material;
  const double over = material.stiffness + material.branch - max_stiffness;
  if (over > 0 && over <= kRounding * max_stiffness) {
    bounded.stiffness = max_stiffness - material.branch;
    while (bounded.stiffness + bounded.branch > max_stiffness)
      bounded.stiffness = std::nextafter(bounded.stiffness, 0.0);
  }
  const field::DepthTable& was = material.table;
  if (was.used) field::bound_table(bounded, max_stiffness);
  for (std::size_t i = 0; i < was.force.size(); ++i) {
    const double force = material.stiffness * was.step * static_cast<double>(i) + std::abs(was.force[i]);
    if (!(std::abs(bounded.table.force[i] - was.force[i]) <= kRounding * force)) return;
  }
  material = bounded;
}

field::Field field_of(const FieldManifest& manifest, const UseField& wanted) {
  field::Field field;
  field.materials.clear();
  for (const FieldMaterial& sent : wanted.materials) field.materials.push_back(material_of(sent));
  for (const FieldFixture& sent : wanted.fixtures) {
    field.fixtures.push_back(fixture_of(sent));
    field.fixtures.back().most_force = sent.most_force.value_or(std::numeric_limits<double>::infinity());
  }
  for (std::size_t i = 0; i < manifest.primitives(); ++i) field.primitives.push_back(manifest.primitive(i));
  return field;
}

field::BrickField::Weights weights_in(const BrickBytes& bytes) {
  field::BrickField::Weights weights;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = static_cast<std::int16_t>(get_little_endian<std::uint16_t>(&bytes[2 * i]));
  }
  return weights;
}

/// Returns an error message if a number of the request is out of bounds, or an empty string.
std::string objection_to(const field::Field& field, const FieldManifest& manifest, double max_stiffness) {
  std::string where;
  try {
    for (std::size_t i = 0; i < field.materials.size(); ++i) {
      where = "materials[" + std::to_string(i) + "].";
      field.materials[i].expect_valid(max_stiffness);
    }
    where.clear();
    field.expect_valid(max_stiffness);
    for (std::size_t i = 0; i < manifest.bricks(); ++i) {
      expect(manifest.brick(i).material < field.materials.size(), "bricks[" + std::to_string(i) + "].material",
             manifest.brick(i).material, "below " + std::to_string(field.materials.size()));
    }
  } catch (const std::invalid_argument& refused) {
    return where + refused.what();
  }
  return {};
}

}  // namespace

FieldIntake::Guest::Guest(const FieldReceiver::Config& config, BrickStore& store)
    : receiver(config, store),
      poses(from_seconds(1 / kPosesPerS), kPoseBurst),
      built(from_seconds(1 / kBuiltBricksPerS), kBuildBurst) {}

FieldIntake::FieldIntake(const Config& config, const std::vector<ServedDevice>& devices,
                         std::vector<ServedClient>& clients)
    : devices_(devices), clients_(clients), keys_(config.keys), store_(store_config(config, devices)) {
  for (const ServedDevice& device : devices_) {
    std::vector<std::unique_ptr<Channel>>& channels = channels_.emplace_back(device.channels.size());
    if (!device.fields) continue;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      if (device.fields->allowed[i]) channels[i] = std::make_unique<Channel>((*device.mail->fields)[i]);
    }
  }
}

bool FieldIntake::needed(const std::vector<ServedDevice>& devices) {
  return std::ranges::any_of(devices, [](const ServedDevice& device) { return device.fields.has_value(); });
}

FieldIntake::Guest& FieldIntake::guest_of(const ServedClient& client) {
  const auto found = guests_.find(client.id());
  if (found != guests_.end()) return found->second;
  const auto key = client.key != nullptr ? std::ranges::find(keys_, client.key->name) : keys_.end();
  const FieldReceiver::Config config{.owner = static_cast<BrickStore::Owner>(key - keys_.begin())};
  return guests_.try_emplace(client.id(), config, store_).first->second;
}

FieldIntake::Channel* FieldIntake::channel_of(std::uint32_t device, std::uint32_t channel) {
  if (device >= channels_.size() || channel >= channels_[device].size()) return nullptr;
  return channels_[device][channel].get();
}

bool FieldIntake::holds(const ServedClient& client, std::uint32_t device, std::uint32_t channel) const {
  return devices_[device].channels[channel].holder == client.id();
}

Outcome FieldIntake::offer(LocalTime now, const ServedClient& client, const OfferField& part) {
  auto refused = guest_of(client).receiver.take(now, part);
  if (!refused) return {};
  return {.code = refused->code, .detail = std::move(refused->detail)};
}

Outcome FieldIntake::use(LocalTime now, const ServedClient& client, const UseField& wanted) {
  if (!holds_slot(client, wanted.device, wanted.channel)) {
    return {.code = Code::kDenied, .detail = "only a controller of the channel may use a field"};
  }
  Channel* const channel = channel_of(wanted.device, wanted.channel);
  if (channel == nullptr) {
    return {.code = Code::kDenied,
            .detail = "the channel \"" + devices_[wanted.device].about.channels[wanted.channel].name +
                      "\" may not use fields: expected it in allow of [field] of the scene"};
  }
  if (!holds(client, wanted.device, wanted.channel)) {
    return {.code = Code::kDenied, .detail = "only the holder of the channel may use a field"};
  }
  if (channel->source == client.id() && wanted.generation <= channel->generation) {
    return {.code = Code::kInvalid,
            .detail = named_field(wanted.field) +
                      not_expected("generation", wanted.generation, "above " + std::to_string(channel->generation))};
  }
  Guest& guest = guest_of(client);
  const auto manifest = guest.receiver.ready(wanted.field);
  if (!manifest) {
    const bool known = guest.receiver.has(wanted.field);
    return {.code = Code::kInvalid,
            .detail = named_field(wanted.field) + std::string(known ? kHasArrived : kWasOffered)};
  }
  return pass_on(now, guest, *channel, *manifest, wanted, client.id());
}

Outcome FieldIntake::pass_on(LocalTime now, Guest& guest, Channel& channel, const FieldManifest& manifest,
                             const UseField& wanted, std::uint32_t source) {
  field::Field field = field_of(manifest, wanted);
  std::string objection = objection_to_tables(wanted, field.materials);
  const double max_stiffness = devices_[wanted.device].fields->max_stiffness;
  for (field::Material& material : field.materials) forgive_rounding(material, max_stiffness);
  if (objection.empty()) objection = objection_to(field, manifest, max_stiffness);
  if (!objection.empty()) return {.code = Code::kInvalid, .detail = named_field(wanted.field) + std::move(objection)};
  const std::size_t bricks = manifest.bricks();
  if (bricks > 0 && !channel.slots.has(wanted.field)) {
    for (std::size_t i = 0; i < bricks; ++i) {
      if (guest.receiver.brick(manifest.hash(i)) != nullptr) continue;
      return {.code = Code::kInvalid,
              .detail = named_field(wanted.field) + "brick " + short_name(manifest.hash(i)) + " is missing"};
    }
    const std::size_t work = bricks + manifest.lattice().cells() / kCellsOfABrick;
    if (!guest.built.pass(now, static_cast<std::int64_t>(work))) {
      return {.code = Code::kBusy,
              .detail = named_field(wanted.field) + "expected at most " + shortest(kBuiltBricksPerS) +
                        " new bricks per second",
              .wait = guest.built.next() - now};
    }
  }
  const auto fill = [&](field::BrickField& shape) {
    shape.reset(manifest.lattice());
    for (std::size_t i = 0; i < bricks; ++i) {
      const PlacedBrick placed = manifest.brick(i);
      field::BrickField::Place place;
      std::ranges::transform(placed.place, place.begin(), [](auto along) { return static_cast<std::uint16_t>(along); });
      shape.put(place, weights_in(*guest.receiver.brick(placed.hash)), placed.material);
    }
    shape.finish();
  };
  record(now, guest, channel, manifest, wanted, field, source);
  channel.slots.use(std::move(field), bricks > 0 ? std::optional(wanted.field) : std::nullopt, fill, wanted.generation,
                    source);
  channel.source = source;
  channel.generation = wanted.generation;
  channel.name = wanted.field;
  return {};
}

/// Passes the field to the log thread. The bricks are only copied if they are not those of the field before.
void FieldIntake::record(LocalTime now, const Guest& guest, Channel& channel, const FieldManifest& manifest,
                         const UseField& wanted, const field::Field& field, std::uint32_t source) {
  const auto& tape = devices_[wanted.device].mail->field_tape;
  if (!tape) return;
  FieldData* const data = tape->data.back();
  if (data == nullptr) {
    tape->data_lost.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  *data = {.at = now,
           .channel = wanted.channel,
           .source = source,
           .generation = wanted.generation,
           .manifest = {manifest.bytes().begin(), manifest.bytes().end()},
           .weights = {},
           .materials = field.materials,
           .fixtures = field.fixtures};
  for (std::size_t i = 0; i < manifest.bricks() && channel.recorded != wanted.field; ++i) {
    const BrickBytes* const brick = guest.receiver.brick(manifest.hash(i));
    if (brick == nullptr) break;  // the field is still in a slot and was already recorded
    data->weights.insert(data->weights.end(), brick->begin(), brick->end());
  }
  if (data->weights.size() != manifest.bricks() * limits::kBrickBytes) data->weights.clear();
  tape->data.push();
  channel.recorded = wanted.field;
}

Outcome FieldIntake::drop(LocalTime /*now*/, const ServedClient& client, const DropField& wanted) {
  if (!guest_of(client).receiver.drop(wanted.field)) {
    return {.code = Code::kInvalid, .detail = named_field(wanted.field) + std::string(kWasOffered)};
  }
  for (auto& channels : channels_) {
    for (const auto& channel : channels) {
      if (channel && channel->source == client.id() && channel->name == wanted.field) channel->slots.stop();
    }
  }
  return {};
}

bool FieldIntake::take(LocalTime now, const ServedClient& client, const FieldBrick& brick) {
  if (!client.has<kFeatureFields>() || client.role != Role::kController) return false;
  Guest& guest = guest_of(client);
  if (const auto refused = guest.receiver.take(now, brick)) note(now, client, guest, refused->detail);
  return true;
}

bool FieldIntake::take(LocalTime now, const ServedClient& client, const FieldPose& pose) {
  const std::uint32_t device = client.device_of(pose.device);
  Channel* const channel = channel_of(device, pose.channel);
  if (!client.has<kFeatureFields>() || channel == nullptr || !holds(client, device, pose.channel)) return false;
  Guest& guest = guest_of(client);
  if (!guest.poses.pass(now)) {
    note(now, client, guest, "expected at most " + shortest(kPosesPerS) + " poses per second");
    return true;
  }
  const field::TimedPose timed{.at = LocalTime(pose.time.time_since_epoch()),
                               .pose = {.position = pose.position, .turn = pose.orientation},
                               .velocity = pose.velocity,
                               .angular_velocity = pose.angular_velocity};
  if (!field::FieldPose().observe(timed)) {
    note(now, client, guest,
         "pose " + std::to_string(pose.sequence) + ": expected at most " + shortest(field::TimedPose::kMostPosition) +
             " m, " + shortest(field::TimedPose::kMostSpeed) + " m/s and " + shortest(field::TimedPose::kMostRate) +
             " rad/s");
    return true;
  }
  channel->slots.move({.pose = timed, .source = client.id()});
  return true;
}

LocalTime FieldIntake::turn(LocalTime now) {
  for (std::size_t device = 0; device < channels_.size(); ++device) {
    for (std::size_t i = 0; i < channels_[device].size(); ++i) {
      if (channels_[device][i]) channels_[device][i]->slots.turn(devices_[device].channels[i].holder);
    }
  }
  LocalTime next = LocalTime::max();
  for (auto one = guests_.begin(); one != guests_.end();) {
    ServedClient* const client = client_of(clients_, one->first);
    if (client == nullptr) {
      one = guests_.erase(one);
      continue;
    }
    FieldReceiver& receiver = one->second.receiver;
    while (const auto status = receiver.next_status(now)) client->session.send(*status);
    next = std::min(next, receiver.due());
    ++one;
  }
  return next;
}

void FieldIntake::note(LocalTime now, const ServedClient& client, Guest& guest, const std::string& refused) {
  if (notices_.size() >= kMostFieldNotices || (guest.noted != LocalTime::min() && now - guest.noted < kNoticeEvery))
    return;
  guest.noted = now;
  notices_.push_back("refused from \"" + client.name + "\": " + refused);
}

std::vector<std::string> FieldIntake::take_notices() { return std::exchange(notices_, {}); }

}  // namespace tendon
