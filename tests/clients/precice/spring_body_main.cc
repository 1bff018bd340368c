// SPDX-License-Identifier: Apache-2.0
// spring_body CONFIG: the participant Body of clients/precice/precice-config.xml. Its total stiffness is 500 N/m.
#include <cstdio>
#include <exception>
#include <precice/precice.hpp>
#include <string>
#include <vector>

#include "clients/precice/touched_patch.h"

namespace {

constexpr double kStiffness = 500;  // N/m

void run(const std::string& file) {
  const std::vector<double> places = tendon::precice_worker::TouchedPatch({}).places();
  precice::Participant participant("Body", file, 0, 1);
  std::vector<precice::VertexID> nodes(places.size() / 3);
  participant.setMeshVertices("Body-Mesh", places, nodes);
  participant.initialize();
  std::vector<double> values(places.size());
  while (participant.isCouplingOngoing()) {
    const double step = participant.getMaxTimeStepSize();
    participant.readData("Body-Mesh", "Displacement", nodes, step, values);
    for (double& value : values) value *= kStiffness / static_cast<double>(nodes.size());
    participant.writeData("Body-Mesh", "Force", nodes, values);
    participant.advance(step);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 2) {
      run(argv[1]);
      return 0;
    }
    std::fprintf(stderr, "usage: spring_body CONFIG\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "spring_body: %s\n", error.what());
    return 1;
  }
}
