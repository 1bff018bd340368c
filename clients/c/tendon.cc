// SPDX-License-Identifier: Apache-2.0
#include "clients/c/tendon.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include "clients/c/convert.h"
#include "clients/c/pull_client.h"
#include "clients/c/sized.h"
#include "clients/cpp/key_file.h"

struct tendon_client : tendon::PullClient {  // NOLINT(readability-identifier-naming)
  using PullClient::PullClient;
};

namespace tendon {
namespace {

// All bits of this version.
constexpr std::uint32_t kFlags = TENDON_TAKE_LEASE | TENDON_OBSERVE | TENDON_POLL;
constexpr std::uint32_t kForceBits = TENDON_FORCE_STIFFNESS | TENDON_FORCE_RADIUS | TENDON_FORCE_CONTACT |
                                     TENDON_FORCE_TORQUE | TENDON_FORCE_ANGULAR_STIFFNESS | TENDON_FORCE_GRIP |
                                     TENDON_FORCE_VALID_FOR | TENDON_FORCE_TOPOLOGY;
constexpr Duration kOpenTimeout = std::chrono::seconds(3);

std::string text_or(const char* text, const char* otherwise) { return text != nullptr ? text : otherwise; }

PullClient::Config to_config(const tendon_config& config) {
  check_bits(config.flags, kFlags, "config.flags");
  if (config.reserved != 0) throw std::invalid_argument("config.reserved: expected 0");
  if (config.server == nullptr) throw std::invalid_argument("config.server = NULL: expected \"HOST:PORT\"");
  PullClient::Config result{.server = config.server};
  result.observe = (config.flags & TENDON_OBSERVE) != 0;
  result.poll = (config.flags & TENDON_POLL) != 0;
  ForceClient::Config& client = result.client;
  client.name = text_or(config.name, client.name.c_str());
  client.device = text_or(config.device, "");
  client.channel = text_or(config.channel, "");
  client.take_lease = (config.flags & TENDON_TAKE_LEASE) != 0;
  client.rate_hz = config.rate_hz;
  client.state_hz = config.state_hz;
  client.valid_for = Duration(config.valid_for_ns);
  if (config.key_file != nullptr) client.key = read_client_key(config.key_file).key;
  return result;
}

/// Calls `call`, and converts exceptions to results.
template <class Call>
int guarded(tendon_client* client, Call call) noexcept {
  if (client == nullptr) return TENDON_BAD;
  try {
    return call(*client);
  } catch (const std::invalid_argument& error) {
    return client->fail(TENDON_BAD, "%s", error.what());
  } catch (const std::exception& error) {
    return client->fail(TENDON_ENDED, "%s", error.what());
  } catch (...) {
    return client->fail(TENDON_ENDED, "unknown error");
  }
}

void say(char* why, std::size_t size, const char* text) noexcept {
  if (why != nullptr && size > 0) std::snprintf(why, size, "%s", text);
}

}  // namespace
}  // namespace tendon

// The functions are described in tendon.h.

uint32_t tendon_abi() { return TENDON_ABI; }

tendon_client* tendon_open(const tendon_config* given, char* why, std::size_t why_size) {
  using namespace tendon;
  say(why, why_size, "");
  try {
    const tendon_config config = copy_in(given, "config");
    const auto open_timeout = Duration(config.open_timeout_ns);
    auto client = std::make_unique<tendon_client>(to_config(config));
    if (open_timeout < Duration::zero()) return client.release();
    const int result = client->open(open_timeout > Duration::zero() ? open_timeout : kOpenTimeout);
    if (result == TENDON_OK) return client.release();
    say(why, why_size, client->why());
  } catch (const std::exception& error) {
    say(why, why_size, error.what());
  } catch (...) {
    say(why, why_size, "unknown error");
  }
  return nullptr;
}

int tendon_wait(tendon_client* client, tendon_state* state, int64_t timeout_ns) {
  return tendon::guarded(client, [&](tendon::PullClient& pull) {
    tendon::check_sized(state, "state");
    const int result = pull.wait(tendon::Duration(timeout_ns));
    if (result == TENDON_OK) tendon::copy_out(tendon::to_c(pull.state()), state);
    return result;
  });
}

int tendon_send(tendon_client* client, const tendon_force* given) {
  return tendon::guarded(client, [&](tendon::PullClient& pull) {
    const tendon_force force = tendon::copy_in(given, "force");
    tendon::check_bits(force.has, tendon::kForceBits, "force.has");
    return pull.send(force.tick, tendon::to_touch(force));
  });
}

int tendon_request(tendon_client* client, const tendon_order* order, int64_t timeout_ns) {
  return tendon::guarded(client, [&](tendon::PullClient& pull) {
    return pull.request(tendon::copy_in(order, "order"), tendon::Duration(timeout_ns));
  });
}

int tendon_describe(tendon_client* client, tendon_description* description, int64_t timeout_ns) {
  return tendon::guarded(client, [&](tendon::PullClient& pull) {
    tendon::check_sized(description, "description");
    const int result = pull.describe(tendon::Duration(timeout_ns));
    if (result == TENDON_OK) {
      tendon::copy_out(tendon::to_c(*pull.client().description(), pull.handle()), description);
    }
    return result;
  });
}

int tendon_count(tendon_client* client, tendon_counts* counts) {
  return tendon::guarded(client, [&](tendon::PullClient& pull) {
    tendon::check_sized(counts, "counts");
    const tendon::ForceClient::Stats stats = pull.client().stats();
    tendon_counts all{};
    all.connected = stats.phase == tendon::ForceClient::Phase::kOpen ? 1 : 0;
    all.holds = pull.client().holds() ? 1 : 0;
    all.sessions = stats.sessions;
    all.states = stats.states;
    all.states_skipped = stats.states_skipped + pull.skipped();
    all.forces = stats.forces;
    all.forces_unusable = stats.forces_unusable;
    all.lost_incoming = stats.link.lost;
    all.lost_outgoing = stats.link.lost_outgoing;
    all.round_trip_ns = stats.link.smoothed_round_trip.count();
    tendon::copy_out(all, counts);
    return TENDON_OK;
  });
}

const char* tendon_why(const tendon_client* client) { return client != nullptr ? client->why() : "client = NULL"; }

void tendon_close(tendon_client* client) { delete client; }
