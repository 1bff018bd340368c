// SPDX-License-Identifier: Apache-2.0
#pragma once

// A client of a Tendon server for C, and for every language that can call C (link with -ltendon):
//
//     char why[200];
//     tendon_config config = {.size = sizeof config, .server = "127.0.0.1:47100"};
//     tendon_client* client = tendon_open(&config, why, sizeof why);
//     tendon_state hand = {.size = sizeof hand};
//     tendon_force wall = {.size = sizeof wall};
//     while (tendon_wait(client, &hand, 1000000000) >= 0) {
//       wall.tick = hand.tick;
//       wall.force[0] = hand.position[0] > 0 ? -500 * hand.position[0] : 0;
//       tendon_send(client, &wall);
//     }
//
// All values are in SI units in the device base frame. Forces act on the hand: a wall that resists motion along +x
// sends −x. Matrices are stored row by row, and quaternions as w, x, y, z. Times are in ns. See clients/README.md for
// states and forces.
//
// Sizes. Each struct begins with its size, which the caller sets to sizeof. Later versions only append members. The
// library never reads or writes beyond the size, so programs and libraries of different versions work together. When
// it fills a struct, it sets the size to the number of filled bytes. An unknown bit of `flags` or `has` is refused, so
// that an older library does not ignore a new member.
//
// Errors. Functions do not throw exceptions and do not use callbacks. If the result is 0 or greater, the client can
// still be used. If it is TENDON_BAD, the arguments must be corrected. If it is TENDON_ENDED, the client must be closed.
//
// Thread-safe: different clients may be used by different threads, but each client only by one thread at a time.
// Realtime-safe: no (system calls), but tendon_wait() and tendon_send() do not use the heap while a session is open
// and the arguments are right. The only exception are reports of the server on late forces, once per second.

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// NOLINTBEGIN(readability-identifier-naming)

#define TENDON_ABI 1U  // increased when a member, a bit or a function is added; the soname changes if one is removed

typedef struct tendon_client tendon_client;

// Results. Use tendon_why() for the reason.
enum {
  TENDON_OK = 0,
  TENDON_TIMEOUT = 1,  // there was no result before the timeout
  TENDON_LOST = 2,     // no session is open; tendon_wait() reconnects
  TENDON_BUSY = 3,     // another controller holds the channel
  TENDON_REFUSED = 4,  // the server refused the request
  TENDON_BAD = -1,     // an argument is invalid, and the call had no effect
  TENDON_ENDED = -2,   // final: the server refuses this client, or another program with the same key has replaced it
};

// tendon_config.flags
enum {
  TENDON_TAKE_LEASE = 1,  // requests the channel until this client holds it
  TENDON_OBSERVE = 2,     // only receive states; tendon_send() returns TENDON_BAD
  TENDON_POLL = 4,        // poll instead of sleeping: answers are 10 to 50 µs faster, for a fully loaded processor
};

typedef struct tendon_config {
  uint32_t size;
  uint32_t flags;
  const char* server;       // "HOST:PORT", "unix:PATH" or "dns-sd:NAME"
  const char* key_file;     // created by `tendond keygen`; NULL: no key
  const char* device;       // NULL: the first device of the server
  const char* channel;      // NULL: the first channel of the device
  const char* name;         // shown in the log of the server; at most 64 bytes; NULL: "guest"
  double rate_hz;           // states that tendon_wait() returns per second, 0.001 … 100 000; 0: each new one
  int64_t valid_for_ns;     // validity of the forces, at most 10 s; 0: derived from the rate
  int64_t open_timeout_ns;  // timeout of tendon_open(); 0: 3 s; negative: it does not wait
  uint32_t state_hz;        // requested states per second; 0: all states
  uint32_t reserved;        // 0
} tendon_config;

// Bits of tendon_state.has. A bit is set if the members are measured. Otherwise, they are 0.
enum {
  TENDON_STATE_TURNING = 1,     // orientation, angular_velocity
  TENDON_STATE_TORQUE = 2,      // torque_applied
  TENDON_STATE_GRIP = 4,        // grip, grip_velocity
  TENDON_STATE_GRIP_FORCE = 8,  // grip_applied
  TENDON_STATE_HAND_FORCE = 16  // hand_force
};

typedef struct tendon_state {
  uint32_t size;
  uint32_t has;
  uint64_t tick;            // number of the haptic step; the first step has the number 1
  int64_t sampled_ns;       // when the position was sampled, on the server's clock; use its differences as time steps
  double position[3];       // m
  double velocity[3];       // m/s
  double force_applied[3];  // N, the actual force on the hand
  uint32_t reasons;         // the reasons for a different force; bits of core/base/reason.h
  uint32_t buttons;         // bit i is set if button i is pressed, or was pressed since the previous state
  double orientation[4];    // rotates the handle frame into the base frame
  double angular_velocity[3];  // rad/s
  double torque_applied[3];    // N·m
  double grip;                 // rad, 0 = closed
  double grip_velocity;        // rad/s
  double grip_applied;         // N, positive opens the fingers
  double hand_force[3];        // N, the measured force of the hand on the handle
} tendon_state;

// Bits of tendon_force.has. Members without their bit are ignored.
enum {
  TENDON_FORCE_STIFFNESS = 1,
  TENDON_FORCE_RADIUS = 2,  // only with TENDON_FORCE_STIFFNESS or TENDON_FORCE_CONTACT
  TENDON_FORCE_CONTACT = 4,
  TENDON_FORCE_TORQUE = 8,
  TENDON_FORCE_ANGULAR_STIFFNESS = 16,
  TENDON_FORCE_GRIP = 32,
  TENDON_FORCE_VALID_FOR = 64,
  TENDON_FORCE_TOPOLOGY = 128  // no member: the body was cut or torn since the previous force
};

typedef struct tendon_force {
  uint32_t size;
  uint32_t has;
  uint64_t tick;                // the tick of one of the last 32 states returned by tendon_wait()
  double force[3];              // N, on the hand
  double stiffness[9];          // N/m, −∂force/∂position, used by the device until the next force arrives
  double valid_radius;          // m, ≥ 0, range of the stiffness
  double normal[3];             // unit vector from the surface to the hand
  double gap;                   // m, distance from the surface to the tool; negative if it is inside
  double torque[3];             // N·m, on the hand
  double angular_stiffness[9];  // N·m/rad, −∂torque/∂θ; ignored without TENDON_STATE_TURNING
  double grip_force;            // N, on the fingers; it opens them if it is positive
  int64_t valid_for_ns;         // instead of the config's; clamped to 1 us … 10 s
} tendon_force;

// tendon_order.what
enum {
  TENDON_REARM = 1,   // clear a fault and undo a disarm; with a safety layer, ask the operator to arm
  TENDON_DISARM = 2,  // disable all forces from the next step until a client rearms
  TENDON_TAKE = 3,  // request the channel once (TENDON_TAKE_LEASE repeats this); TENDON_BUSY at the timeout if refused
  TENDON_GIVE = 4,  // release the channel
  TENDON_ENGAGE = 5,  // engage or disengage the coupling of two devices
  TENDON_DISENGAGE = 6,
  TENDON_SET_SCALE = 7  // of the coupling: value[0] for positions, value[1] for forces, each 0.01 … 100
};

typedef struct tendon_order {
  uint32_t size;
  uint32_t what;
  double value[2];
} tendon_order;

// tendon_description.has
enum {
  TENDON_DESCRIPTION_WORKSPACE = 1,  // workspace_min, workspace_max
  TENDON_DESCRIPTION_FRAME = 2,      // operator_from_device
  TENDON_DESCRIPTION_TURNING = 4,    // states have an orientation
  TENDON_DESCRIPTION_GRIPPER = 8     // gripper_open
};

typedef struct tendon_description {
  uint32_t size;
  uint32_t has;
  char device[32];  // zero-terminated
  char model[72];
  uint32_t position_axes;   // measured, 1 … 6
  uint32_t force_axes;      // with a motor, 1 … 6
  uint32_t loop_hz;         // haptic steps per second
  uint32_t buttons;         // number of bits used in tendon_state.buttons
  double workspace_min[3];  // m
  double workspace_max[3];
  double max_force;                // N; this number and the following four: 0 if unknown
  double continuous_force;         // N, without a time limit
  double max_stiffness;            // N/m
  double position_resolution;      // m
  double max_torque;               // N·m
  double gripper_open;             // rad
  double max_gripper_force;        // N
  double operator_from_device[4];  // rotation to the frame with x right, y up, z towards the user
} tendon_description;

typedef struct tendon_counts {
  uint32_t size;
  uint32_t connected;  // 1: a session is open
  uint32_t holds;      // 1: this client holds the channel
  uint32_t reserved;   // 0
  uint64_t sessions;
  uint64_t states;           // received
  uint64_t states_skipped;   // not returned by tendon_wait(), because a newer one had arrived
  uint64_t forces;           // sent
  uint64_t forces_unusable;  // not sent, because they were not finite or out of bounds
  uint64_t lost_incoming;    // datagrams of this session
  uint64_t lost_outgoing;
  int64_t round_trip_ns;  // smoothed; 0: unknown
} tendon_counts;

// Returns the TENDON_ABI of the library. Thread-safe: yes.
uint32_t tendon_abi(void);

// Opens a client. The texts of `config` are copied. If an error occurs, returns NULL and writes a sentence to
// `why`, which can be NULL, using at most `why_size` bytes. If open_timeout_ns is negative, the server can be started
// later. Name resolution may block.
tendon_client* tendon_open(const tendon_config* config, char* why, size_t why_size);

// Waits for the newest state and skips older ones. Skipped states do not lose button presses. If the timeout is 0, the
// function does not wait, and if it is negative, there is no timeout. Signals do not interrupt it. Returns TENDON_LOST
// when the session ends, and after each timeout without a session. Must be called at least once per second to keep the
// session alive. To reconnect, it resolves the name of the server again, which may block.
int tendon_wait(tendon_client* client, tendon_state* state, int64_t timeout_ns);

// Sends a force. Returns TENDON_BAD without sending if a number is not finite or out of bounds, if the tick is unknown,
// or if a newer state was answered. The server then fades the previous force, as if this program were late.
int tendon_send(tendon_client* client, const tendon_force* force);

// Sends a request and waits for the answer. States that arrive meanwhile are kept for tendon_wait().
int tendon_request(tendon_client* client, const tendon_order* order, int64_t timeout_ns);

// Describes the device. It may have to wait for the description in the first round trip of a session.
int tendon_describe(tendon_client* client, tendon_description* description, int64_t timeout_ns);

// Fills in the statistics. Does not use the network.
int tendon_count(tendon_client* client, tendon_counts* counts);

// Returns the reason for the last result that was not TENDON_OK, or "". Valid until the next call with this client.
const char* tendon_why(const tendon_client* client);

// Closes the session and frees the client. NULL is ignored.
void tendon_close(tendon_client* client);

// NOLINTEND(readability-identifier-naming)

#ifdef __cplusplus
}
#endif
