// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

// What clients/precice uses of preCICE 3, with a partner in this process: springs that hold each node. As preCICE, it
// refuses calls in the wrong order and names that it does not know.

// NOLINTBEGIN(readability-identifier-naming): the names are preCICE's
namespace precice {

using VertexID = int;

/// The partner, and what was done. For a test to set and to read.
struct Partner {
  double stiffness = 500;  ///< N/m, of all nodes together
  int dimensions = 3;      ///< of the mesh
  int windows = 1000;      ///< until the end of the coupling
  bool wants_initial = false;
  int advanced = 0;
  int written_before_start = 0;
};
inline Partner partner;

class Participant {
 public:
  Participant(std::string_view name, std::string_view file, int rank, int size) {
    require(name == "Hand" && file == "coupling.xml" && rank == 0 && size == 1, "unknown participant or file");
  }
  int getMeshDimensions(std::string_view mesh) const {
    know(mesh);
    return partner.dimensions;
  }
  void setMeshVertices(std::string_view mesh, std::span<const double> places, std::span<VertexID> ids) {
    know(mesh);
    require(!started_ && places.size() == 3 * ids.size(), "the mesh is set once, before initialize()");
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<VertexID>(100 + i);
    nodes_ = ids.size();
  }
  bool requiresInitialData() {
    asked_ = true;
    return partner.wants_initial;
  }
  void initialize() {
    require(nodes_ > 0 && !started_ && asked_, "initialize() comes once, after the mesh");
    require(!partner.wants_initial || partner.written_before_start > 0, "initial data are missing");
    started_ = true;
    got_.assign(3 * nodes_, 0.0);
  }
  bool isCouplingOngoing() const { return started_ && partner.advanced < partner.windows; }
  double getMaxTimeStepSize() const { return 0.01; }
  void writeData(std::string_view mesh, std::string_view data, std::span<const VertexID> ids,
                 std::span<const double> values) {
    know(mesh);
    require(data == "Displacement", "unknown data");
    check(ids, values.size());
    if (!started_) ++partner.written_before_start;
    written_.assign(values.begin(), values.end());
  }
  void advance(double step) {
    require(isCouplingOngoing() && step == 0.01, "advance() after the end, or by another step than the window");
    for (std::size_t i = 0; i < got_.size(); ++i) {
      got_[i] = partner.stiffness / static_cast<double>(nodes_) * written_.at(i);
    }
    ++partner.advanced;
  }
  void readData(std::string_view mesh, std::string_view data, std::span<const VertexID> ids, double time,
                std::span<double> values) const {
    know(mesh);
    require(started_ && data == "Force" && time == 0, "unknown data, or too early");
    check(ids, values.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = got_[i];
  }

 private:
  static void require(bool holds, const char* why) {
    if (!holds) throw std::runtime_error(why);
  }
  static void know(std::string_view mesh) { require(mesh == "Hand-Mesh", "unknown mesh"); }
  void check(std::span<const VertexID> ids, std::size_t values) const {
    require(ids.size() == nodes_ && values == 3 * nodes_, "not as many values as nodes");
    for (std::size_t i = 0; i < ids.size(); ++i) require(ids[i] == static_cast<VertexID>(100 + i), "unknown node");
  }

  std::size_t nodes_ = 0;
  bool started_ = false;
  bool asked_ = false;
  std::vector<double> written_;
  std::vector<double> got_;
};

}  // namespace precice
// NOLINTEND(readability-identifier-naming)
