// SPDX-License-Identifier: Apache-2.0
#include "server/flight_file.h"

namespace tendon {

void write_flight(decltype(Mailboxes::flight)& flight, const Recorder::Config& config, ByteSink& sink) {
  Recorder recorder(config, sink);
  for (std::size_t i = 0; i < flight.size(); ++i) recorder.record(flight[i]);
  recorder.close();
  flight.thaw();
}

}  // namespace tendon
