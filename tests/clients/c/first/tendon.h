// SPDX-License-Identifier: Apache-2.0
// The first version of clients/c/tendon.h without comments. It must not be changed, because the test of
// compatibility uses it.
#pragma once

#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
#define TENDON_ABI 1U
typedef struct tendon_client tendon_client;
enum {
  TENDON_OK = 0,
  TENDON_TIMEOUT = 1,
  TENDON_LOST = 2,
  TENDON_BUSY = 3,
  TENDON_REFUSED = 4,
  TENDON_BAD = -1,
  TENDON_ENDED = -2,
};
enum {
  TENDON_TAKE_LEASE = 1,
  TENDON_OBSERVE = 2,
  TENDON_POLL = 4,
};
typedef struct tendon_config {
  uint32_t size;
  uint32_t flags;
  const char* server;
  const char* key_file;
  const char* device;
  const char* channel;
  const char* name;
  double rate_hz;
  int64_t valid_for_ns;
  int64_t open_timeout_ns;
  uint32_t state_hz;
  uint32_t reserved;
} tendon_config;
enum {
  TENDON_STATE_TURNING = 1,
  TENDON_STATE_TORQUE = 2,
  TENDON_STATE_GRIP = 4,
  TENDON_STATE_GRIP_FORCE = 8,
  TENDON_STATE_HAND_FORCE = 16
};
typedef struct tendon_state {
  uint32_t size;
  uint32_t has;
  uint64_t tick;
  int64_t sampled_ns;
  double position[3];
  double velocity[3];
  double force_applied[3];
  uint32_t reasons;
  uint32_t buttons;
  double orientation[4];
  double angular_velocity[3];
  double torque_applied[3];
  double grip;
  double grip_velocity;
  double grip_applied;
  double hand_force[3];
} tendon_state;
enum {
  TENDON_FORCE_STIFFNESS = 1,
  TENDON_FORCE_RADIUS = 2,
  TENDON_FORCE_CONTACT = 4,
  TENDON_FORCE_TORQUE = 8,
  TENDON_FORCE_ANGULAR_STIFFNESS = 16,
  TENDON_FORCE_GRIP = 32,
  TENDON_FORCE_VALID_FOR = 64,
  TENDON_FORCE_TOPOLOGY = 128
};
typedef struct tendon_force {
  uint32_t size;
  uint32_t has;
  uint64_t tick;
  double force[3];
  double stiffness[9];
  double valid_radius;
  double normal[3];
  double gap;
  double torque[3];
  double angular_stiffness[9];
  double grip_force;
  int64_t valid_for_ns;
} tendon_force;
enum {
  TENDON_REARM = 1,
  TENDON_DISARM = 2,
  TENDON_TAKE = 3,
  TENDON_GIVE = 4,
  TENDON_ENGAGE = 5,
  TENDON_DISENGAGE = 6,
  TENDON_SET_SCALE = 7
};
typedef struct tendon_order {
  uint32_t size;
  uint32_t what;
  double value[2];
} tendon_order;
enum {
  TENDON_DESCRIPTION_WORKSPACE = 1,
  TENDON_DESCRIPTION_FRAME = 2,
  TENDON_DESCRIPTION_TURNING = 4,
  TENDON_DESCRIPTION_GRIPPER = 8
};
typedef struct tendon_description {
  uint32_t size;
  uint32_t has;
  char device[32];
  char model[72];
  uint32_t position_axes;
  uint32_t force_axes;
  uint32_t loop_hz;
  uint32_t buttons;
  double workspace_min[3];
  double workspace_max[3];
  double max_force;
  double continuous_force;
  double max_stiffness;
  double position_resolution;
  double max_torque;
  double gripper_open;
  double max_gripper_force;
  double operator_from_device[4];
} tendon_description;
typedef struct tendon_counts {
  uint32_t size;
  uint32_t connected;
  uint32_t holds;
  uint32_t reserved;
  uint64_t sessions;
  uint64_t states;
  uint64_t states_skipped;
  uint64_t forces;
  uint64_t forces_unusable;
  uint64_t lost_incoming;
  uint64_t lost_outgoing;
  int64_t round_trip_ns;
} tendon_counts;
uint32_t tendon_abi(void);
tendon_client* tendon_open(const tendon_config* config, char* why, size_t why_size);
int tendon_wait(tendon_client* client, tendon_state* state, int64_t timeout_ns);
int tendon_send(tendon_client* client, const tendon_force* force);
int tendon_request(tendon_client* client, const tendon_order* order, int64_t timeout_ns);
int tendon_describe(tendon_client* client, tendon_description* description, int64_t timeout_ns);
int tendon_count(tendon_client* client, tendon_counts* counts);
const char* tendon_why(const tendon_client* client);
void tendon_close(tendon_client* client);
#ifdef __cplusplus
}
#endif
