// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/surface_table.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "clients/softbody/fem/file_bytes.h"
#include "clients/softbody/fem/file_text.h"

namespace tendon::softbody {
namespace {

constexpr std::string_view kMagic = "TENDONST";
constexpr std::uint32_t kVersion = 1;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{4} << 30;
constexpr std::size_t kHeader = 64;
constexpr double kRounding = 1e-10;  ///< tolerance for negative eigenvalues, relative to the diagonal

std::size_t bytes_of(std::size_t nodes) {
  return kHeader + 4 * nodes + 4 * (nodes % 2) + 4 * nodes * (nodes + 1) + sizeof(std::uint64_t);
}

SurfaceTable table_of(std::string_view bytes) {
  if (!bytes.starts_with(kMagic)) throw std::invalid_argument("it does not start with the header of a table");
  ByteReader reader(bytes.substr(kMagic.size()));
  const auto version = reader.take<std::uint32_t>();
  if (version != kVersion) {
    throw std::invalid_argument("its version is " + std::to_string(version) + ", expected " + std::to_string(kVersion));
  }
  const auto nodes = reader.take<std::uint32_t>();
  if (bytes.size() != bytes_of(nodes)) {
    throw std::invalid_argument("it has " + std::to_string(bytes.size()) + " bytes, expected " +
                                std::to_string(bytes_of(nodes)) + " for its " + std::to_string(nodes) + " nodes");
  }
  without_checksum(bytes);
  SurfaceTable table;
  table.body = reader.take<std::uint64_t>();
  table.patch_radius = reader.take<double>();
  table.stiffness = reader.take<double>();
  table.linear_up_to = reader.take<double>();
  table.middle.x() = reader.take<double>();
  table.middle.y() = reader.take<double>();
  for (std::uint32_t i = 0; i < nodes; ++i) table.nodes.push_back(reader.take<std::int32_t>());
  if (nodes % 2 != 0) reader.take<std::uint32_t>();
  table.compliance.resize(nodes, nodes);
  for (Eigen::Index i = 0; i < table.compliance.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) table.compliance(i, j) = table.compliance(j, i) = reader.take<double>();
  }
  return table;
}

void expect_passive(const SurfaceTable& table) {
  if (!table.compliance.allFinite()) throw std::invalid_argument("it has numbers that are not finite");
  const double largest = table.compliance.rows() > 0 ? table.compliance.diagonal().maxCoeff() : 0;
  if (!(largest > 0)) throw std::invalid_argument("it has no compliance");
  Eigen::MatrixXd raised = table.compliance;
  raised.diagonal().array() += kRounding * largest;
  if (Eigen::LLT<Eigen::MatrixXd>(raised).info() != Eigen::Success) {
    throw std::invalid_argument("it is not positive semidefinite, so it would generate energy");
  }
}

}  // namespace

std::uint64_t digest_of(const Solid& solid, const Vec3& normal) {
  std::string bytes;
  for (const Vec3& node : solid.mesh().nodes) {
    for (const double x : node) put(bytes, x);
  }
  for (const int node : solid.mesh().elements) put(bytes, node);
  for (const bool held : solid.fixed()) bytes += held ? '1' : '0';
  put(bytes, static_cast<std::uint32_t>(solid.element()));
  put(bytes, solid.material().young);
  put(bytes, solid.material().poisson);
  for (const Material& each : solid.of_elements()) {
    put(bytes, each.young);
    put(bytes, each.poisson);
  }
  for (const double x : normal) put(bytes, x);
  return checksum(bytes);
}

void write_table(const std::filesystem::path& file, const SurfaceTable& table) {
  if (std::ifstream before(file, std::ios::binary); before) {
    std::string beginning(kMagic.size(), '\0');
    before.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
    if (before.gcount() > 0 && beginning != kMagic)
      throw std::runtime_error(file.string() + " exists and is not a table");
  }
  std::string bytes(kMagic);
  put(bytes, kVersion);
  put(bytes, static_cast<std::uint32_t>(table.nodes.size()));
  put(bytes, table.body);
  for (const double value :
       {table.patch_radius, table.stiffness, table.linear_up_to, table.middle.x(), table.middle.y()}) {
    put(bytes, value);
  }
  for (const int node : table.nodes) put(bytes, static_cast<std::int32_t>(node));
  if (table.nodes.size() % 2 != 0) put(bytes, std::uint32_t{0});
  for (Eigen::Index i = 0; i < table.compliance.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) put(bytes, table.compliance(i, j));
  }
  put(bytes, checksum(bytes));
  std::filesystem::path draft = file;
  draft += ".new";
  write_draft(draft, bytes);
  std::filesystem::rename(draft, file);
}

SurfaceTable read_table(const std::filesystem::path& file) {
  const std::string bytes = read_file(file, kMostBytes);
  try {
    SurfaceTable table = table_of(bytes);
    expect_passive(table);
    return table;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(file.string() + ": expected a table of a surface: " + error.what());
  }
}

}  // namespace tendon::softbody
