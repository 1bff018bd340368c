// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace tendon::log {

/// What the operator reads, on stderr: one line each, with the time. Never per packet, never from the haptic thread.
///
/// Thread-safe: yes. Realtime-safe: no.
void info(std::string_view text);
void warn(std::string_view text);
void error(std::string_view text);

}  // namespace tendon::log
