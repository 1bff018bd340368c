// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>

#include "protocol/messages.h"
#include "protocol/wire/fields.h"
#include "protocol/wire/frame.h"

// The frames of a Data datagram to protobuf and back. Each `read` gives false when a value is out of bounds; each
// `write` cuts texts and lists to their bounds and leaves nothing in `to` of what was there. For the codecs of this
// folder only.

namespace tendon::wire {

bool read(const pb::DeviceState& from, DeviceState& to) noexcept;
void write(const DeviceState& from, pb::DeviceState& to);
/// Columns: `next` gives the place of each state. False: some have been given, and none counts.
bool read(const pb::DeviceStates& from, const std::function<DeviceState&()>& next);
void write(std::span<const DeviceState* const> from, pb::DeviceStates& to);
bool read(const pb::ForceCommand& from, ForceCommand& to) noexcept;
void write(const ForceCommand& from, pb::ForceCommand& to);
bool read(const pb::Control& from, Control& to);
void write(const Control& from, pb::Control& to);
bool read(const pb::ControlAck& from, ControlAck& to);
void write(const ControlAck& from, pb::ControlAck& to);
bool read(const pb::Bye& from, Bye& to);
void write(const Bye& from, pb::Bye& to);
bool read(const pb::LinkReport& from, LinkReport& to);
void write(const LinkReport& from, pb::LinkReport& to);
bool read(const pb::DeviceReport& from, DeviceReport& to);
void write(const DeviceReport& from, pb::DeviceReport& to);
bool read(const pb::PeerReport& from, PeerReport& to);
void write(const PeerReport& from, pb::PeerReport& to);
bool read(const pb::PortState& from, PortFrame& to) noexcept;
void write(const PortFrame& from, pb::PortState& to);
bool read(const pb::Couple& from, Couple& to) noexcept;
void write(const Couple& from, pb::Couple& to);

}  // namespace tendon::wire
