// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/field_rerun.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <stdexcept>
#include <string>

#include "core/base/arithmetic.h"
#include "core/base/bytes.h"
#include "protocol/field/manifest.h"

namespace tendon::replay {
namespace {

std::string name_of(const auto& one) {
  return "the field of client " + std::to_string(one.source) + " with generation " + std::to_string(one.generation) +
         " in channel " + std::to_string(one.channel);
}

field::BrickField::Weights weights_at(const std::byte* bytes) {
  field::BrickField::Weights weights;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = static_cast<std::int16_t>(get_little_endian<std::uint16_t>(bytes + 2 * i));
  }
  return weights;
}

constexpr std::size_t kMostShapes = 16;

void fill(field::BrickField& bricks, const FieldManifest& manifest, const std::vector<std::byte>& weights) {
  bricks.reset(manifest.lattice());
  for (std::size_t i = 0; i < manifest.bricks(); ++i) {
    const PlacedBrick placed = manifest.brick(i);
    field::BrickField::Place place;
    std::ranges::transform(placed.place, place.begin(), [](auto along) { return static_cast<std::uint16_t>(along); });
    bricks.put(place, weights_at(weights.data() + i * limits::kBrickBytes), placed.material);
  }
  bricks.finish();
}

}  // namespace

FieldRerun::FieldRerun(const HapticController::Config& control)
    : max_stiffness_(control.hold.field ? control.hold.field->max_stiffness : 0),
      channels_({.hold = control.hold, .rules = control.channels}) {}

const field::BrickField* FieldRerun::bricks_of(const FieldData& data) {
  const FieldManifest manifest(data.manifest);
  if (std::string refused = manifest.has_head() ? manifest.refused() : "the manifest is too short"; !refused.empty()) {
    throw std::runtime_error(name_of(data) + ": " + refused);
  }
  if (manifest.bricks() == 0) return nullptr;
  if (data.weights.empty()) {
    const auto known = std::ranges::find(shapes_, data.manifest, &Shape::manifest);
    if (known != shapes_.end()) return &known->bricks;
  }
  if (data.weights.size() != manifest.bricks() * limits::kBrickBytes) {
    throw std::runtime_error(name_of(data) + ": " + std::to_string(data.weights.size()) +
                             " bytes of weights: expected " + std::to_string(manifest.bricks() * limits::kBrickBytes));
  }
  forget_shapes();
  Shape& shape = shapes_.emplace_back();
  shape.manifest = data.manifest;
  fill(shape.bricks, manifest, data.weights);
  return &shape.bricks;
}

/// Removes the oldest shapes that are not used.
void FieldRerun::forget_shapes() {
  for (auto shape = shapes_.begin(); shape != shapes_.end() && shapes_.size() >= kMostShapes;) {
    const bool used = std::ranges::any_of(built_, [&](const Built& one) { return one.field.bricks == &shape->bricks; });
    shape = used ? std::next(shape) : shapes_.erase(shape);
  }
}

void FieldRerun::take(const FieldData& data) {
  Built built{.channel = data.channel, .source = data.source, .generation = data.generation, .field = {}};
  const FieldManifest manifest(data.manifest);
  built.field.bricks = bricks_of(data);
  for (std::size_t i = 0; i < manifest.primitives(); ++i) built.field.primitives.push_back(manifest.primitive(i));
  built.field.materials = data.materials;
  built.field.fixtures = data.fixtures;
  try {
    built.field.expect_valid(max_stiffness_);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(name_of(data) + ": " + error.what());
  }
  built_.push_back(std::move(built));
}

void FieldRerun::use(const FieldInput& input) {
  const auto same = [&](const Built& one) {
    return one.channel == input.channel && one.source == input.source && one.generation == input.generation;
  };
  const auto last = std::find_if(built_.rbegin(), built_.rend(), same);
  if (last == built_.rend()) throw std::runtime_error(name_of(input) + " is used, but not recorded");
  channels_.use(input.channel, {.field = &last->field, .generation = input.generation, .source = input.source},
                input.at);
  for (auto one = built_.begin(); &*one != &*last;)
    one = one->channel == input.channel ? built_.erase(one) : std::next(one);
}

void FieldRerun::take(const FieldInput& input) {
  if (input.channel >= channels_.size()) throw std::runtime_error(name_of(input) + ": there is no such channel");
  switch (input.kind) {
    case FieldInput::Kind::kUse:
      use(input);
      break;
    case FieldInput::Kind::kStop:
      channels_.use(input.channel, {.field = nullptr, .generation = 0, .source = input.source}, input.at);
      break;
    case FieldInput::Kind::kRelease:
      channels_.release(input.channel, input.source, input.at);
      break;
    case FieldInput::Kind::kPose:
      channels_.observe(input.channel, input.pose);
      break;
    case FieldInput::Kind::kTruth:
      channels_.observe(input.channel, RemoteForce{.answers_tick = input.answers_tick,
                                                   .received = input.received,
                                                   .force = input.truth,
                                                   .source = input.source,
                                                   .field = input.generation});
      break;
  }
}

std::optional<FieldStep> FieldRerun::step(const StepRecord& recorded) {
  const DenormalsOff off;
  if (recorded.rearmed) channels_.disengage();
  if (recorded.reasons.has(Reason::kUnseen) || !channels_.has_fields()) return std::nullopt;
  ForceChannels::Wanted wanted = channels_.wanted(recorded.hand);
  return channels_.render(recorded.hand, recorded.energy, recorded.tick, wanted);
}

}  // namespace tendon::replay
