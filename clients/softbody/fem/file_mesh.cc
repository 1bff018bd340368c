// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/file_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "clients/softbody/fem/file_text.h"
#include "clients/softbody/fem/groups.h"
#include "clients/softbody/fem/hold.h"
#include "clients/softbody/fem/places.h"

namespace tendon::softbody {
namespace {

constexpr double kMillimetres = 1e3;

std::string named_element(const FileMesh& file, int element) {
  return "element " + std::to_string(file.numbers[at(element)]);
}

std::string named_place(const FileMesh& file, int element) {
  return named_element(file, element) + " at " + in_words(middle(file.mesh, element));
}

std::vector<std::vector<int>> corners_around(Shape shape) {
  std::vector<std::vector<int>> all;
  for (const Face& face : faces(shape)) {
    const Vec3 out = face.along_s.cross(face.along_t);
    std::vector<int>& corners = all.emplace_back();
    Vec3 middle = Vec3::Zero();
    for (int i = 0; i < corners_of(shape); ++i) {
      if (std::abs(out.dot(node_at(shape, i) - face.origin)) > 1e-12) continue;
      corners.push_back(i);
      middle += node_at(shape, i);
    }
    middle /= static_cast<double>(corners.size());
    const auto angle = [&](int corner) {
      const Vec3 from = node_at(shape, corner) - middle;
      return std::atan2(from.dot(out.cross(face.along_s)) / out.norm(), from.dot(face.along_s));
    };
    std::ranges::sort(corners, {}, angle);
  }
  return all;
}

/// The corners are numbers of places, which coincident nodes share.
struct PlacedFace {
  std::array<int, 4> around;  ///< counterclockwise from the lowest; −1 if unused
  std::array<int, 4> corners;
  Facet facet;
};

std::vector<PlacedFace> placed_faces(const Mesh& mesh, const std::vector<int>& place) {
  const std::vector<std::vector<int>> corners = corners_around(mesh.shape);
  std::vector<PlacedFace> all;
  all.reserve(at(mesh.element_count()) * corners.size());
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto nodes = mesh.element(e);
    for (std::size_t face = 0; face < corners.size(); ++face) {
      PlacedFace placed{.around = {-1, -1, -1, -1}, .corners = {}, .facet = {e, static_cast<int>(face)}};
      const std::size_t count = corners[face].size();
      for (std::size_t i = 0; i < count; ++i) placed.around[i] = place[at(nodes[at(corners[face][i])])];
      const auto end = placed.around.begin() + static_cast<std::ptrdiff_t>(count);
      std::rotate(placed.around.begin(), std::min_element(placed.around.begin(), end), end);
      placed.corners = placed.around;
      std::ranges::sort(placed.corners);
      all.push_back(placed);
    }
  }
  std::ranges::sort(all, [](const PlacedFace& a, const PlacedFace& b) {
    return std::tie(a.corners, a.facet.element) < std::tie(b.corners, b.facet.element);
  });
  return all;
}

bool face_each_other(const PlacedFace& a, const PlacedFace& b) {
  const auto end = a.around[3] < 0 ? a.around.end() - 1 : a.around.end();
  return std::equal(a.around.begin() + 1, end, std::make_reverse_iterator(b.around.begin() + (end - a.around.begin())));
}

void drop_repeated_elements(FileMesh& file, const std::vector<int>& place) {
  const Mesh& mesh = file.mesh;
  std::map<std::vector<int>, int> known;
  std::vector<int> kept;
  std::vector<std::int64_t> numbers;
  std::size_t repeated = 0;
  std::string example;
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto nodes = mesh.element(e);
    std::vector<int> places;
    for (const int node : nodes) places.push_back(place[at(node)]);
    std::ranges::sort(places);
    const auto [first, is_new] = known.try_emplace(std::move(places), e);
    if (is_new) {
      kept.insert(kept.end(), nodes.begin(), nodes.end());
      numbers.push_back(file.numbers[at(e)]);
    } else if (++repeated == 1) {
      example = named_element(file, e) + " has the nodes of " + named_element(file, first->second);
    }
  }
  if (repeated == 0) return;
  file.notes.push_back(counted(repeated, "element is", "elements are") + " duplicated and ignored: " + example);
  file.mesh.elements = std::move(kept);
  file.numbers = std::move(numbers);
}

void drop_unused(Mesh& mesh) {
  std::vector<int> number(mesh.nodes.size(), -1);
  for (const int node : mesh.elements) number[at(node)] = 0;
  std::vector<Vec3> nodes;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] < 0) continue;
    number[i] = static_cast<int>(nodes.size());
    nodes.push_back(mesh.nodes[i]);
  }
  for (int& node : mesh.elements) node = number[at(node)];
  mesh.nodes = std::move(nodes);
}

void expect_apart(const FileMesh& file, const std::vector<int>& place, std::string_view name) {
  for (int e = 0; e < file.mesh.element_count(); ++e) {
    std::vector<std::pair<int, int>> places;
    for (const int node : file.mesh.element(e)) places.emplace_back(place[at(node)], node);
    std::ranges::sort(places);
    const auto twice = std::ranges::adjacent_find(places, {}, &std::pair<int, int>::first);
    if (twice == places.end()) continue;
    refuse_file(name, named_element(file, e) + " has two nodes at " + in_words(file.mesh.nodes[at(twice->second)]));
  }
}

/// Throws std::invalid_argument if elements overlap.
void find_parts(FileMesh& file, const std::vector<int>& place, std::string_view name) {
  const std::vector<PlacedFace> all = placed_faces(file.mesh, place);
  Groups groups(at(file.mesh.element_count()));
  const auto actual = [&](const PlacedFace& face) {
    std::vector<int> nodes = nodes_on(file.mesh, face.facet);
    std::ranges::sort(nodes);
    return nodes;
  };
  for (std::size_t first = 0; first < all.size();) {
    std::size_t end = first + 1;
    while (end < all.size() && all[end].corners == all[first].corners) ++end;
    const auto overlap = [&](const char* why) {
      refuse_file(name, named_element(file, all[first].facet.element) + " and " +
                            named_place(file, all[end - 1].facet.element) + " overlap: " + why);
    };
    if (end - first > 2) overlap("more than two elements share a face");
    if (end - first == 2) {
      if (!face_each_other(all[first], all[first + 1])) overlap("they are on the same side of a shared face");
      if (actual(all[first]) == actual(all[first + 1])) {
        groups.unite(all[first].facet.element, all[first + 1].facet.element);
      }
    }
    first = end;
  }
  std::map<int, int> number_of;
  for (int e = 0; e < file.mesh.element_count(); ++e) {
    const auto [found, is_new] = number_of.try_emplace(groups.find(e), static_cast<int>(number_of.size()));
    file.parts.push_back(found->second);
  }
}

struct MeshPart {
  int first = -1;
  std::size_t elements = 0;
};
std::vector<MeshPart> mesh_parts(const FileMesh& file) {
  std::vector<MeshPart> parts(at(1 + std::ranges::max(file.parts)));
  for (int e = 0; e < file.mesh.element_count(); ++e) {
    MeshPart& part = parts[at(file.parts[at(e)])];
    if (part.elements++ == 0) part.first = e;
  }
  return parts;
}

}  // namespace

FileMesh joined(FileMesh file, bool slits, std::string_view name) {
  Mesh& mesh = file.mesh;
  drop_unused(mesh);
  const std::vector<int> place = first_at_place(mesh.nodes);
  expect_apart(file, place, name);
  std::set<int> doubled;
  std::size_t more = 0;
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] == static_cast<int>(i)) continue;
    doubled.insert(place[i]);
    ++more;
  }
  if (!doubled.empty()) {
    const std::string nodes = (more == doubled.size() ? " two nodes" : " two nodes or more");
    const std::string where = ", the first at " + in_words(mesh.nodes[at(*doubled.begin())]);
    file.notes.push_back(slits ? counted(doubled.size(), "place has", "places have") + nodes +
                                     ", which are not merged" + where
                               : counted(doubled.size(), "place had", "places had") + nodes + ", which are merged" +
                                     where + "; use slits = true in [body] to keep them separate");
  }
  drop_repeated_elements(file, place);
  if (!slits) {
    for (int& node : mesh.elements) node = place[at(node)];
  }
  find_parts(file, place, name);
  const std::vector<MeshPart> parts = mesh_parts(file);
  if (parts.size() > 1) {
    const MeshPart& least = std::ranges::min(parts, {}, &MeshPart::elements);
    file.notes.push_back(
        "the mesh has " + std::to_string(parts.size()) + " parts without a common face; the smallest, of " +
        counted(least.elements, "element", "elements") + ", starts with " + named_place(file, least.first));
  }
  drop_unused(mesh);
  return file;
}

void expect_held(const FileMesh& file, const Fixed& fixed, std::string_view name) {
  const Mesh& mesh = file.mesh;
  const std::vector<MeshPart> parts = mesh_parts(file);
  if (parts.size() < 2) return;
  std::vector<std::set<int>> nodes(parts.size());
  for (int e = 0; e < mesh.element_count(); ++e) {
    for (const int node : mesh.element(e)) nodes[at(file.parts[at(e)])].insert(node);
  }
  std::vector<bool> held(mesh.nodes.size());
  for (std::size_t i = 0; i < held.size(); ++i) held[i] = fixed[3 * i] && fixed[3 * i + 1] && fixed[3 * i + 2];
  std::vector<bool> fast(parts.size());
  for (bool changed = true; changed;) {  // each pass adds a part
    changed = false;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      if (fast[p]) continue;
      Hold hold;
      for (const int node : nodes[p]) {
        if (held[at(node)]) hold.add(mesh.nodes[at(node)]);
      }
      if (!hold.fast()) continue;
      fast[p] = changed = true;
      for (const int node : nodes[p]) held[at(node)] = true;
    }
  }
  const auto loose = std::ranges::find(fast, false);
  if (loose == fast.end()) return;
  const MeshPart& part = parts[static_cast<std::size_t>(loose - fast.begin())];
  refuse_file(
      name,
      "there are no fixed nodes in the part of " + counted(part.elements, "element", "elements") +
          " that starts with " + named_element(file, part.first) + " at " +
          in_words(kMillimetres * middle(mesh, part.first)) +
          " mm: it has no common face with the other elements. Connect it, fix it (clamped_below_mm), or remove it");
}

}  // namespace tendon::softbody
