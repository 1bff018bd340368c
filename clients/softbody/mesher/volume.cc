// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/mesher/volume.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <span>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <unordered_map>

#include "clients/softbody/fem/file_text.h"
#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/surface/shells.h"
#include "clients/softbody/touch/surface_distance.h"
#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "tendon-mesh-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The script contains no names from the user.
std::string script_of(const VolumeConfig& config) {
  // The edges of the hexahedra are half as long as those of the tetrahedra.
  const double small = config.size * (config.hexahedra ? 2 : 1);
  const double large = config.touched ? config.coarsest * small : small;
  std::string text = "Merge \"surface.stl\";\nClassifySurfaces{" + shortest(config.sharp) +
                     ", 1, 1, Pi};\nCreateGeometry;\ns() = Surface{:};\nSurface Loop(1) = {s()};\nVolume(1) = {1};\n"
                     "Mesh.MeshSizeExtendFromBoundary = 0;\nMesh.MeshSizeFromPoints = 0;\n"
                     "Mesh.MeshSizeFromCurvature = 0;\nField[1] = Ball;\n";
  const Vec3 middle = config.touched.value_or(Vec3(Vec3::Zero()));
  const double reach = config.touched ? config.reach : 1;
  const auto set = [&](const char* key, double value) {
    text += std::string("Field[1].") + key + " = " + shortest(value) + ";\n";
  };
  set("XCenter", middle.x());
  set("YCenter", middle.y());
  set("ZCenter", middle.z());
  set("Radius", reach);
  set("Thickness", 2 * reach);
  set("VIn", small);
  set("VOut", large);
  text += "Background Field = 1;\nMesh.Optimize = 1;\nMesh.MshFileVersion = 2.2;\n";
  return text;
}

void run_gmsh(const std::filesystem::path& folder) {
  const std::string words = (folder / "words").string();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, words.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  std::array<std::string, 7> arguments{
      "gmsh", "-3", (folder / "script.geo").string(), "-o", (folder / "out.msh").string(), "-v", "3"};
  std::array<char*, 8> argv{};
  std::ranges::transform(arguments, argv.begin(), [](std::string& each) { return each.data(); });
  pid_t child = 0;
  const int refused = ::posix_spawnp(&child, "gmsh", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (refused == ENOENT) throw std::runtime_error("gmsh is required, but not installed (package gmsh)");
  if (refused != 0) throw std::system_error(refused, std::generic_category(), "cannot start gmsh");
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
}

double scaled(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double lengths = a.norm() * b.norm() * c.norm();
  return lengths > 0 ? a.dot(b.cross(c)) / lengths : 0;
}

/// The three neighbors of each corner, right-handed.
constexpr std::array<std::array<int, 3>, 4> kJoinedOfTet{{{1, 2, 3}, {2, 0, 3}, {0, 1, 3}, {0, 2, 1}}};
constexpr std::array<std::array<int, 3>, 8> kJoinedOfHex{
    {{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7}, {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}}};

std::span<const std::array<int, 3>> joined_of(Shape shape) {
  if (shape == Shape::kTet4) return kJoinedOfTet;
  return kJoinedOfHex;
}

std::string hundredths(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f", value);
  return text.data();
}

double quality(const Mesh& mesh, int element) {
  const auto nodes = mesh.element(element);
  const auto corner = [&](int i) -> const Vec3& { return mesh.nodes[at(nodes[at(i)])]; };
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; const auto& [a, b, c] : joined_of(mesh.shape)) {
    least = std::min(least, scaled(corner(a) - corner(i), corner(b) - corner(i), corner(c) - corner(i)));
    ++i;
  }
  return (mesh.shape == Shape::kTet4 ? std::sqrt(2.0) : 1) * least;
}

Mesh read_made(const std::string& text) {
  std::istringstream file(text);
  Mesh mesh{.shape = Shape::kTet4, .nodes = {}, .elements = {}};
  std::unordered_map<long, int> number;
  std::string line;
  const auto find = [&](const char* section) {
    while (std::getline(file, line) && line != section) {
    }
    std::size_t count = 0;
    if (!(file >> count)) throw std::runtime_error(std::string("the file of gmsh has no ") + section);
    return count;
  };
  for (std::size_t left = find("$Nodes"); left > 0; --left) {
    long id = 0;
    Vec3 place;
    file >> id >> place.x() >> place.y() >> place.z();
    number[id] = static_cast<int>(mesh.nodes.size());
    mesh.nodes.push_back(place);
  }
  constexpr long kTetrahedron = 4;
  for (std::size_t left = find("$Elements"); left > 0; --left) {
    std::getline(file >> std::ws, line);
    std::istringstream words(line);
    long id = 0;
    long type = 0;
    long tags = 0;
    words >> id >> type >> tags;
    if (type != kTetrahedron) continue;
    for (long tag = 0; tags > 0; --tags) words >> tag;
    for (int i = 0; i < 4; ++i) {
      words >> id;
      mesh.elements.push_back(number.at(id));
    }
    if (!words) throw std::runtime_error("the file of gmsh is truncated");
  }
  if (mesh.elements.empty()) throw std::runtime_error("gmsh has created no elements");
  return mesh;
}

Mesh made_by_gmsh(const Triangles& body, const VolumeConfig& config, std::string& words) {
  const Scratch scratch;
  write_stl(scratch.path() / "surface.stl", body);
  std::ofstream(scratch.path() / "script.geo") << script_of(config);
  run_gmsh(scratch.path());
  constexpr std::uintmax_t kMostWords = 16U << 20U;
  const std::filesystem::path file = scratch.path() / "words";
  const std::string said = std::filesystem::exists(file) ? read_file(file, kMostWords) : "";
  words += said;
  const std::filesystem::path made = scratch.path() / "out.msh";
  if (!std::filesystem::exists(made) || said.find("Error ") != std::string::npos) {
    throw std::runtime_error("gmsh could not mesh the surface that starts with " + body.place(0));
  }
  return read_made(read_file(made, kMaxMeshBytes));
}

/// `places` are the positions of the boundary nodes on the surface.
Mesh in_hexahedra(const Mesh& tetrahedra, const Triangles& surface, std::vector<Vec3>& places) {
  Mesh mesh{.shape = Shape::kHex8, .nodes = tetrahedra.nodes, .elements = {}};
  std::map<std::vector<int>, int> known;
  const auto middle = [&](std::vector<int> of) {
    std::ranges::sort(of);
    const auto [found, is_new] = known.try_emplace(of, static_cast<int>(mesh.nodes.size()));
    if (is_new) {
      Vec3 place = Vec3::Zero();
      for (const int node : of) place += tetrahedra.nodes[at(node)] / static_cast<double>(of.size());
      mesh.nodes.push_back(place);
    }
    return found->second;
  };
  // These orders keep the orientation.
  constexpr std::array<std::array<int, 4>, 4> kOrders{{{0, 1, 2, 3}, {1, 2, 0, 3}, {2, 0, 1, 3}, {3, 1, 0, 2}}};
  for (int e = 0; e < tetrahedra.element_count(); ++e) {
    const auto nodes = tetrahedra.element(e);
    for (const auto& order : kOrders) {
      const int a = nodes[at(order[0])];
      const int b = nodes[at(order[1])];
      const int c = nodes[at(order[2])];
      const int d = nodes[at(order[3])];
      mesh.elements.insert(mesh.elements.end(), {a, middle({a, b}), middle({a, b, c}), middle({a, c}), middle({a, d}),
                                                 middle({a, b, d}), middle({a, b, c, d}), middle({a, c, d})});
    }
  }
  places = mesh.nodes;
  const SurfaceDistance distance(surface);
  for (const Facet& facet : tendon::softbody::surface(tetrahedra)) {
    const std::vector<int> corners = nodes_on(tetrahedra, facet);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::vector<int> edge{corners[i], corners[(i + 1) % 3]};
      const double most = (tetrahedra.nodes[at(edge[0])] - tetrahedra.nodes[at(edge[1])]).norm() / 2;
      for (const int node : {middle(edge), middle(corners)}) {
        places[at(node)] = distance.nearest_point(mesh.nodes[at(node)], most);
      }
    }
  }
  return mesh;
}

/// The elements must stay well shaped.
void bring_closer(Mesh& mesh, const std::vector<Vec3>& places) {
  constexpr double kGoodElement = 2 * kPoorElement;
  constexpr int kHalvings = 6;
  std::vector<double> least;
  for (int e = 0; e < mesh.element_count(); ++e) least.push_back(std::min(kGoodElement, 0.999 * quality(mesh, e)));
  const std::vector<Vec3> start = mesh.nodes;
  std::vector<int> halvings(start.size(), 0);
  const auto put = [&](std::size_t node) {
    const double way = halvings[node] > kHalvings ? 0 : std::ldexp(1.0, -halvings[node]);
    mesh.nodes[node] = start[node] + way * (places[node] - start[node]);
  };
  for (std::size_t node = 0; node < start.size(); ++node) put(node);
  for (bool moved = true; moved;) {  // at most kHalvings times for each node
    moved = false;
    for (int e = 0; e < mesh.element_count(); ++e) {
      if (quality(mesh, e) >= least[at(e)]) continue;
      for (const int node : mesh.element(e)) {
        if (halvings[at(node)] > kHalvings) continue;
        ++halvings[at(node)];
        put(at(node));
        moved = true;
      }
    }
  }
}

}  // namespace

Mesh volume_of(const Triangles& surface, const VolumeConfig& config, std::string& words) {
  expect_above_zero(config.size, "size");
  expect(config.coarsest >= 1 && std::isfinite(config.coarsest), "coarsest", config.coarsest, "a number of at least 1");
  if (config.touched) expect_above_zero(config.reach, "reach");
  expect(config.sharp > 0 && config.sharp < std::numbers::pi, "sharp", config.sharp, "an angle above 0 and below π");
  Mesh tetrahedra{.shape = Shape::kTet4, .nodes = {}, .elements = {}};
  for (const Triangles& body : bodies(surface)) {
    const Mesh made = made_by_gmsh(body, config, words);
    const int before = static_cast<int>(tetrahedra.nodes.size());
    tetrahedra.nodes.insert(tetrahedra.nodes.end(), made.nodes.begin(), made.nodes.end());
    for (const int node : made.elements) tetrahedra.elements.push_back(before + node);
  }
  if (!config.hexahedra) return tetrahedra;
  std::vector<Vec3> places;
  Mesh mesh = in_hexahedra(tetrahedra, surface, places);
  bring_closer(mesh, places);
  return mesh;
}

std::string to_gmsh(const Mesh& mesh) {
  const int corners = nodes_of(mesh.shape);
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(mesh.nodes.size()) + "\n";
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const Vec3& node = mesh.nodes[i];
    std::array<char, 100> line{};
    std::snprintf(line.data(), line.size(), "%zu %.6g %.6g %.6g\n", i + 1, node.x(), node.y(), node.z());
    text += line.data();
  }
  text += "$EndNodes\n$Elements\n" + std::to_string(mesh.element_count()) + "\n";
  for (int e = 0; e < mesh.element_count(); ++e) {
    text += std::to_string(e + 1) + (corners == 4 ? " 4 2 1 1" : " 5 2 1 1");
    for (const int node : mesh.element(e)) text += " " + std::to_string(node + 1);
    text += "\n";
  }
  return text + "$EndElements\n";
}

MeshReport report_on(const Mesh& mesh, const Triangles& surface) {
  MeshReport report{.nodes = static_cast<int>(mesh.nodes.size()), .elements = mesh.element_count()};
  report.volume = check(mesh, "the mesh");
  report.volume_error = report.volume / surface.volume() - 1;
  std::vector<double> qualities;
  report.shortest_edge = std::numeric_limits<double>::infinity();
  for (int e = 0; e < mesh.element_count(); ++e) {
    qualities.push_back(quality(mesh, e));
    const auto nodes = mesh.element(e);
    if (e == 0 || qualities.back() < report.worst) {
      report.worst = qualities.back();
      report.worst_at = Vec3::Zero();
      for (const int node : nodes) report.worst_at += mesh.nodes[at(node)] / static_cast<double>(nodes.size());
    }
    for (int i = 0; const auto& joined : joined_of(mesh.shape)) {
      for (const int j : joined) {
        const double length = (mesh.nodes[at(nodes[at(i)])] - mesh.nodes[at(nodes[at(j)])]).norm();
        report.shortest_edge = std::min(report.shortest_edge, length);
        report.longest_edge = std::max(report.longest_edge, length);
      }
      ++i;
    }
  }
  const auto quantile = [&](double share) {
    const auto nth = qualities.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(qualities.size() - 1));
    std::nth_element(qualities.begin(), nth, qualities.end());
    return *nth;
  };
  report.worst_percent = quantile(0.01);
  report.median = quantile(0.5);
  if (report.worst < kPoorElement) {
    report.warnings.push_back("the worst element has a scaled Jacobian of " + hundredths(report.worst) +
                              ": forces near it are inaccurate; try other sizes");
  }
  if (std::abs(report.volume_error) > 0.05) {
    report.warnings.push_back("the mesh has " + hundredths(std::abs(100 * report.volume_error)) + " % " +
                              (report.volume_error < 0 ? "less" : "more") +
                              " volume than the surface; use smaller elements");
  }
  return report;
}

}  // namespace tendon::softbody
