// SPDX-License-Identifier: Apache-2.0
// The messages of recording.proto about fields.
#include <algorithm>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording.pb.h"
#include "server/recording/recording_codec.h"
#include "server/recording/vector_codec.h"

namespace tendon::recording {
namespace {

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::string encode(const FieldInput& input) {
  pb::FieldInput out;
  out.set_tick(input.tick);
  out.set_kind(static_cast<pb::FieldInputKind>(input.kind));
  out.set_channel(input.channel);
  out.set_source(input.source);
  out.set_generation(input.generation);
  if (input.kind == FieldInput::Kind::kTruth) {
    out.set_answers_tick(input.answers_tick);
    out.set_received_ns((input.received - input.at).count());
    put(out.mutable_force_n(), input.truth);
  }
  if (input.kind == FieldInput::Kind::kPose) {
    out.set_pose_ns((input.pose.at - input.at).count());
    put(out.mutable_position_m(), input.pose.pose.position);
    put(out.mutable_orientation(), input.pose.pose.turn);
    put(out.mutable_velocity_mps(), input.pose.velocity);
    put(out.mutable_angular_velocity_radps(), input.pose.angular_velocity);
  }
  return out.SerializeAsString();
}

FieldInput decode_field_input(std::string_view message, LocalTime at) {
  const auto in = parse<pb::FieldInput>(message);
  if (in.kind() == pb::FIELD_INPUT_KIND_UNSPECIFIED || !pb::FieldInputKind_IsValid(in.kind()))
    throw std::invalid_argument("an input of a field has the unknown kind " + std::to_string(in.kind()));
  FieldInput out{.tick = in.tick(),
                 .at = at,
                 .kind = static_cast<FieldInput::Kind>(in.kind()),
                 .channel = in.channel(),
                 .source = in.source(),
                 .generation = in.generation(),
                 .answers_tick = in.answers_tick(),
                 .received = at + Duration(in.received_ns()),
                 .truth = vec3(in.force_n())};
  if (out.kind != FieldInput::Kind::kPose) return out;
  out.pose = {.at = at + Duration(in.pose_ns()),
              .pose = {.position = vec3(in.position_m()), .turn = quat(in.orientation())},
              .velocity = vec3(in.velocity_mps()),
              .angular_velocity = vec3(in.angular_velocity_radps())};
  return out;
}

std::string encode(const FieldData& data) {
  pb::FieldData out;
  out.set_channel(data.channel);
  out.set_source(data.source);
  out.set_generation(data.generation);
  out.set_manifest(text_of(data.manifest));
  out.set_weights(text_of(data.weights));
  for (const field::Material& material : data.materials) {
    pb::FieldMaterial& one = *out.add_materials();
    one.set_stiffness_npm(material.stiffness);
    one.set_branch_stiffness_npm(material.branch);
    one.set_relaxation_s(material.tau);
    one.set_friction(material.friction);
  }
  for (const field::Fixture& fixture : data.fixtures) {
    pb::FieldFixture& one = *out.add_fixtures();
    one.set_kind(static_cast<std::uint32_t>(fixture.kind));
    put(one.mutable_at_m(), fixture.at);
    put(one.mutable_direction(), fixture.direction);
    one.set_stiffness_npm(fixture.stiffness);
    one.set_most_force_n(fixture.most_force);
  }
  return out.SerializeAsString();
}

FieldData decode_field_data(std::string_view message, LocalTime at) {
  const auto in = parse<pb::FieldData>(message);
  FieldData out{.at = at,
                .channel = in.channel(),
                .source = in.source(),
                .generation = in.generation(),
                .manifest = bytes_of(in.manifest()),
                .weights = bytes_of(in.weights())};
  for (const pb::FieldMaterial& one : in.materials()) {
    out.materials.push_back({.stiffness = one.stiffness_npm(),
                             .branch = one.branch_stiffness_npm(),
                             .tau = one.relaxation_s(),
                             .friction = one.friction()});
  }
  for (const pb::FieldFixture& one : in.fixtures()) {
    if (one.kind() > static_cast<std::uint32_t>(field::Fixture::Kind::kPlane))
      throw std::invalid_argument("a fixture has the unknown kind " + std::to_string(one.kind()));
    out.fixtures.push_back({.kind = static_cast<field::Fixture::Kind>(one.kind()),
                            .at = vec3(one.at_m()),
                            .direction = vec3(one.direction()),
                            .stiffness = one.stiffness_npm(),
                            .most_force = one.most_force_n()});
  }
  return out;
}

}  // namespace tendon::recording
