// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/shells.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <utility>

#include "clients/softbody/fem/file_text.h"
#include "clients/softbody/fem/groups.h"
#include "clients/softbody/fem/places.h"

namespace tendon::softbody {
namespace {

/// The winding number of a shell around a point: ±1 inside, 0 outside (van Oosterom & Strackee 1983).
double times_around(const Triangles& surface, const Shell& shell, const Vec3& point) {
  double sum = 0;
  for (const std::size_t facet : shell.facets) {
    std::array<Vec3, 3> way = surface.corners(facet);
    for (Vec3& each : way) each -= point;
    const double a = way[0].norm();
    const double b = way[1].norm();
    const double c = way[2].norm();
    sum += std::atan2(way[0].dot(way[1].cross(way[2])),
                      a * b * c + way[0].dot(way[1]) * c + way[1].dot(way[2]) * a + way[2].dot(way[0]) * b);
  }
  return sum / (2 * std::numbers::pi);
}

Vec3 middle_of_facet(const std::array<Vec3, 3>& corners) { return (corners[0] + corners[1] + corners[2]) / 3; }

void find_depths(const Triangles& surface, std::vector<Shell>& all) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Shell& shell : all) {
    std::vector<Vec3> points;
    for (const std::size_t facet : shell.facets) {
      for (const Vec3& corner : surface.corners(facet)) points.push_back(corner);
    }
    boxes.push_back(box_around(points));
  }
  std::vector<std::vector<int>> around(all.size());
  for (std::size_t inner = 0; inner < all.size(); ++inner) {
    const Vec3 point = middle_of_facet(surface.corners(all[inner].facets.front()));
    for (std::size_t outer = 0; outer < all.size(); ++outer) {
      if (outer == inner || !boxes[outer].contains(point)) continue;
      if (std::abs(times_around(surface, all[outer], point)) > 0.5) around[inner].push_back(static_cast<int>(outer));
    }
    all[inner].depth = static_cast<int>(around[inner].size());
  }
  for (std::size_t inner = 0; inner < all.size(); ++inner) {
    for (const int outer : around[inner]) {
      Shell& shell = all[inner];
      if (shell.within < 0 || all[at(outer)].depth > all[at(shell.within)].depth) shell.within = outer;
    }
  }
}

bool is_cavity(const Shell& shell) { return shell.depth % 2 == 1; }

}  // namespace

std::vector<Shell> shells(const Triangles& surface) {
  Groups groups(surface.facets.size());
  std::map<std::pair<int, int>, int> facet_at;
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto& facet = surface.facets[f];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [known, is_new] = facet_at.try_emplace(std::minmax(facet[i], facet[(i + 1) % 3]), static_cast<int>(f));
      if (!is_new) groups.unite(known->second, static_cast<int>(f));
    }
  }
  std::vector<Shell> all;
  std::map<int, std::size_t> number_of;
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto [found, is_new] = number_of.try_emplace(groups.find(static_cast<int>(f)), all.size());
    if (is_new) all.emplace_back();
    Shell& shell = all[found->second];
    shell.facets.push_back(f);
    const Vec3& origin = surface.points.front();
    const auto [a, b, c] = surface.corners(f);
    shell.volume += (a - origin).dot((b - origin).cross(c - origin)) / 6;
  }
  if (all.size() > 1 && all.size() <= kMostShells) find_depths(surface, all);
  return all;
}

void check_shells(const Triangles& surface, std::string_view name) {
  const std::vector<Shell> all = shells(surface);
  if (all.size() > kMostShells) {
    refuse_file(name, "has " + std::to_string(all.size()) + " parts, expected at most " + std::to_string(kMostShells) +
                          ": remove the small parts");
  }
  for (const Shell& shell : all) {
    if (is_cavity(shell) ? shell.volume < 0 : shell.volume > 0) continue;
    if (all.size() == 1) {
      refuse_file(name, "the surface is turned inside out: expected facets anticlockwise, seen from outside");
    }
    const std::string part = "the closed part of " + counted(shell.facets.size(), "facet", "facets") +
                             " that starts with " + surface.place(shell.facets.front());
    if (shell.depth == 0) {
      refuse_file(name, part + " is turned inside out: expected facets anticlockwise, seen from outside");
    }
    const std::string around = surface.place(all[at(shell.within)].facets.front());
    refuse_file(name, part + " is inside the one that starts with " + around +
                          (is_cavity(shell)
                               ? ", and has the same orientation: reverse its facets if it is a cavity, or remove it"
                               : ", a cavity, and has the same orientation: reverse its facets, or remove it"));
  }
}

std::vector<Triangles> bodies(const Triangles& surface) {
  const std::vector<Shell> all = shells(surface);
  std::vector<Triangles> made;
  for (std::size_t body = 0; body < all.size(); ++body) {
    if (is_cavity(all[body])) continue;
    Triangles& own = made.emplace_back();
    std::vector<int> number(surface.points.size(), -1);
    for (std::size_t s = 0; s < all.size(); ++s) {
      if (s != body && !(is_cavity(all[s]) && all[s].within == static_cast<int>(body))) continue;
      for (const std::size_t f : all[s].facets) {
        std::array<int, 3> facet{};
        for (std::size_t i = 0; i < 3; ++i) {
          int& known = number[at(surface.facets[f][i])];
          if (known < 0) {
            known = static_cast<int>(own.points.size());
            own.points.push_back(surface.points[at(surface.facets[f][i])]);
          }
          facet[i] = known;
        }
        own.facets.push_back(facet);
        own.numbers.push_back(surface.number(f));
      }
    }
  }
  return made;
}

std::vector<std::string> notes_on(const Triangles& surface) {
  std::vector<std::string> notes = surface.notes;
  const std::vector<Shell> all = shells(surface);
  const auto say = [&](bool cavities, const char* what) {
    std::vector<const Shell*> those;
    for (const Shell& shell : all) {
      if (is_cavity(shell) == cavities) those.push_back(&shell);
    }
    if (those.size() < (cavities ? 1U : 2U)) return;
    const Shell& least = **std::ranges::min_element(those, {}, [](const Shell* s) { return std::abs(s->volume); });
    notes.push_back("the surface has " + counted(those.size(), cavities ? "cavity" : "body", what) +
                    "; the smallest starts with " + surface.place(least.facets.front()));
  };
  say(false, "separate bodies");
  say(true, "cavities");
  return notes;
}

}  // namespace tendon::softbody
