// SPDX-License-Identifier: Apache-2.0
// For Octave: mkoctfile tendon_oct.cc -ltendon
#include <octave/oct.h>
#include <octave/parse.h>
#include <tendon.h>

DEFUN_DLD(tendon_oct, args, , "rows = tendon_oct(server, n, f): sends f(x) = [force; stiffness of x, y, z]") {
  char why[200];
  const std::string server = args(0).string_value();
  const tendon_config config = {.size = sizeof config, .flags = 0, .server = server.c_str()};
  const std::unique_ptr<tendon_client, decltype(&tendon_close)> client(tendon_open(&config, why, 200), &tendon_close);
  if (!client) error("tendon_oct: %s", why);
  tendon_state hand = {.size = sizeof hand};
  Matrix rows(args(1).int_value(), 6, 0.0);
  for (int i = 0; i < rows.rows() && tendon_wait(client.get(), &hand, 1000000000) == TENDON_OK; ++i) {
    for (int j = 0; j < 6; ++j) rows(i, j) = j < 3 ? hand.position[j] : hand.force_applied[j - 3];
    const octave_value f = octave::feval(args(2), ovl(rows.extract_n(i, 0, 1, 3)), 1)(0);
    tendon_force force = {.size = sizeof force, .has = TENDON_FORCE_STIFFNESS, .tick = hand.tick};
    for (int j = 0; j < 3; ++j) force.force[j] = f.vector_value()(j), force.stiffness[4 * j] = f.vector_value()(j + 3);
    tendon_send(client.get(), &force);
  }
  return ovl(rows);
}
