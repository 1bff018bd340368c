// SPDX-License-Identifier: Apache-2.0
// Generated from tendon.proto by protocol/generate.
#pragma once

#include "protocol/messages.h"
#include "protocol/wire/fields/field.h"
#include "protocol/wire/handshake_codec.h"

// Lists of fields for the handshake; see fields/field.h.

namespace tendon::wire {

inline constexpr auto kClaimFields = [](auto& way, auto& claim) TENDON_INLINE {
  way.text(field<1>, "device", claim.device, 24);
  way.text(field<2>, "channel", claim.channel, 24);
  way.choice(field<3>, "role", claim.role, Role::kObserver, Role::kController);
};

inline constexpr auto kHelloFields = [](auto& way, auto& hello) TENDON_INLINE {
  way.count(field<1>, "version_min", hello.version_min, Counts{.least = 1});
  way.count(field<2>, "version_max", hello.version_max);
  way.require("version_min", [&] { return hello.version_min <= hello.version_max; });
  way.choice(field<3>, "role", hello.role, Role::kObserver, Role::kController);
  way.text(field<4>, "name", hello.name, 64);
  way.texts(field<5>, "features", hello.features, Entries{0, 16}, 32);
  way.messages(field<6>, "claims", hello.claims, Entries{0, 16}, kClaimFields);
  way.texts(field<7>, "ways", hello.ways, Entries{0, 8}, 24);
};

inline constexpr auto kGrantFields = [](auto& way, auto& grant) TENDON_INLINE {
  way.count(field<1>, "device", grant.device, Counts{.most = 15});
  way.count(field<2>, "channel", grant.channel, Counts{.most = 7});
  way.choice(field<3>, "role", grant.role, Role::kObserver, Role::kController);
};

inline constexpr auto kWelcomeFields = [](auto& way, auto& welcome) TENDON_INLINE {
  way.count(field<1>, "version", welcome.version, Counts{.least = 1});
  way.texts(field<2>, "features", welcome.features, Entries{0, 16}, 32);
  way.choice(field<3>, "role", welcome.role, Role::kObserver, Role::kController);
  way.text(field<4>, "device_name", welcome.device_name, 64);
  way.number(field<5>, "max_force_n", welcome.max_force, Within{.least = 0});
  way.number(field<6>, "position_resolution_m", welcome.position_resolution, Within{.least = 0});
  way.count(field<7>, "loop_hz", welcome.loop_hz, Counts{.least = 1, .most = 1'000'000});
  way.period(field<8>, "timeout_ms", welcome.timeout, kTimeout);
  way.text(field<9>, "server", welcome.server, 64);
  way.messages(field<10>, "grants", welcome.grants, Entries{0, 16}, kGrantFields);
};

inline constexpr auto kRefusedFields = [](auto& way, auto& refused) TENDON_INLINE {
  way.choice(field<1>, "code", refused.code, Code::kOk, Code::kReplaced);
  way.text(field<2>, "detail", refused.detail, 128);
  way.count(field<3>, "version_min", refused.version_min);
  way.count(field<4>, "version_max", refused.version_max);
};

inline constexpr auto kAnswerFields = [](auto& way, auto& answer) TENDON_INLINE {
  way.one_of("body", field<1, kLength>, field<2, kLength>);
  static_cast<void>(way.arm(field<1, kLength>, "welcome", kind<Welcome>, answer, kWelcomeFields) ||
                    way.arm(field<2, kLength>, "refused", kind<Refused>, answer, kRefusedFields));
};

}  // namespace tendon::wire
