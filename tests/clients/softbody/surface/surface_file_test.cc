// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/surface_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "clients/softbody/surface/triangles.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::surface_file_test {
namespace {

std::string refusal(const std::string& text, const std::string& ending) {
  return thrown_by([&] { check(parse_surface(text, ending, "a" + ending), "a" + ending); });
}

const std::string kTetrahedron = "0 0 0\n3 0 0\n0 3 0\n0 0 3\n";
const std::string kItsFacets = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
constexpr double kItsVolume = 4.5;

double volume(const std::string& text, const std::string& ending) {
  const Triangles surface = parse_surface(text, ending, "a" + ending);
  check(surface, "a" + ending);
  EXPECT_EQ(surface.notes, std::vector<std::string>{});
  return surface.volume();
}

TEST(SurfaceFile, ReadsEveryHeadOfOffThatHasThreeCoordinates) {
  for (const std::string head :
       {"OFF\n4 4 0\n", "OFF 4 4 0\n", "OFF4 4 0\n", "OFF4 4\n", "# by hand\nOFF\n\n4 4 6\n"}) {
    EXPECT_NEAR(volume(head + kTetrahedron + kItsFacets, ".off"), kItsVolume, 1e-12) << head;
  }
  std::string coloured = kTetrahedron;
  for (std::size_t end = coloured.find('\n'); end != std::string::npos; end = coloured.find('\n', end + 15)) {
    coloured.insert(end, " 0.1 0.2 0.3 1");
  }
  for (const std::string head : {"COFF", "NOFF", "STOFF", "CNOFF", "STCNOFF"}) {
    EXPECT_NEAR(volume(head + "\n4 4 0\n" + coloured + kItsFacets, ".off"), kItsVolume, 1e-12) << head;
  }
  EXPECT_EQ(refusal("4OFF\n4 4 0\n", ".off"), "a.off: line 1: expected points of three coordinates, found \"4OFF\"");
  EXPECT_EQ(refusal("nOFF\n4 4 0\n", ".off"), "a.off: line 1: expected points of three coordinates, found \"nOFF\"");
  EXPECT_EQ(refusal("OFF BINARY\n", ".off"), "a.off: line 1: expected a text OFF file, found a binary file");
  EXPECT_EQ(refusal("SOFTOFF\n", ".off"), "a.off: line 1: expected an OFF file, which starts with \"OFF\"");
  EXPECT_EQ(refusal("OFF 4 3 0\n" + kTetrahedron + kItsFacets, ".off"),
            "a.off: line 9: expected the end of the file after 3 facets");
}

const std::string kObj = "v 0 0 0\nv 3 0 0\nv 0 3 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST(SurfaceFile, ABackslashContinuesALineOfObj) {
  EXPECT_NEAR(volume(kObj, ".obj"), kItsVolume, 1e-12);
  EXPECT_NEAR(
      volume("v 0 0 0\nv 3 \\\n0 0\nv 0 3 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 \\\r\n  4 \\\r\n 3\nf 2 3 4\\\n", ".obj"),
      kItsVolume, 1e-12);
  EXPECT_NEAR(volume("\\\n\n" + kObj + "\\", ".obj"), kItsVolume, 1e-12);
  EXPECT_EQ(refusal("v 0 0 0\nf 1 \\\n1 9\n", ".obj"), "a.obj: line 3: there is no vertex 9");
}

std::string text_stl() {
  return "solid part\n"
         "facet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 3 0\nvertex 3 0 0\nendloop\nendfacet\n"
         "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 3 0 0\nvertex 0 0 3\nendloop\nendfacet\n"
         "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 3\nvertex 0 3 0\nendloop\nendfacet\n"
         "facet normal 1 1 1\nouter loop\nvertex 3 0 0\nvertex 0 3 0\nvertex 0 0 3\nendloop\nendfacet\n"
         "endsolid part\n";
}

std::string with_all(std::string text, const std::string& old, const std::string& by) {
  for (std::size_t place = text.find(old); place != std::string::npos; place = text.find(old, place + by.size())) {
    text.replace(place, old.size(), by);
  }
  return text;
}

TEST(SurfaceFile, ReadsTextOfStlInUpperCaseInOneLineAndWithAnyName) {
  const std::string text = text_stl();
  EXPECT_NEAR(volume(text, ".stl"), kItsVolume, 1e-12);
  std::string upper = text;
  std::ranges::transform(upper, upper.begin(),
                         [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  EXPECT_NEAR(volume(upper, ".stl"), kItsVolume, 1e-12);
  EXPECT_NEAR(volume(with_all(text, "\n", " "), ".stl"), kItsVolume, 1e-12);
  EXPECT_NEAR(volume(with_all(text, "\n", "\r"), ".stl"), kItsVolume, 1e-12);
  EXPECT_NEAR(volume(with_all(text, "\n", "\r\n"), ".stl"), kItsVolume, 1e-12);
  EXPECT_NEAR(volume(with_all(text, "solid part", "solid vertex endloop"), ".stl"), kItsVolume, 1e-12);
  EXPECT_NEAR(volume(with_all(text, "solid part", "solid"), ".stl"), kItsVolume, 1e-12);
  EXPECT_EQ(refusal(text.substr(0, text.rfind("endloop")), ".stl"), "a.stl: truncated within a facet");
  EXPECT_EQ(refusal(text.substr(0, text.rfind("outer")), ".stl"), "a.stl: truncated within a facet");
  EXPECT_EQ(refusal("", ".stl"),
            "a.stl: expected an STL file: text that starts with \"solid\", or 84 bytes and 50 for each facet");
}

std::string binary_stl() {
  const tendon::testing::ScratchFolder scratch;
  write_stl(scratch.path() / "a.stl", parse_surface(text_stl(), ".stl", "a"));
  std::ifstream file(scratch.path() / "a.stl", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(SurfaceFile, SaysByHowMuchABinaryStlIsTooLongOrTooShort) {
  std::string bytes = binary_stl();
  EXPECT_NEAR(volume(bytes, ".stl"), kItsVolume, 1e-12);
  const std::string head = "a.stl: the header of this binary STL file has 4 facets, which require 284 bytes; it has ";
  EXPECT_EQ(refusal(bytes + "x", ".stl"), head + "1 too many");
  EXPECT_EQ(refusal(bytes.substr(0, 283), ".stl"), head + "1 too few");
  EXPECT_EQ(refusal(bytes.substr(0, 184), ".stl"), head + "100 too few, as many as 2 facets");
  bytes.replace(0, 5, "solid");
  EXPECT_NEAR(volume(bytes, ".stl"), kItsVolume, 1e-12);
  EXPECT_EQ(refusal(bytes + "x", ".stl"), head + "1 too many");
  bytes.replace(80, 4, std::string(4, '\0'));
  EXPECT_EQ(refusal(bytes, ".stl"),
            "a.stl: the header of this binary STL file has 0 facets, which require 84 bytes; it has 200 too many, as "
            "many as 4 facets");
  EXPECT_EQ(refusal(bytes.substr(0, 84), ".stl"), "a.stl: has no facet");
  EXPECT_EQ(refusal(bytes.substr(0, 20), ".stl"),
            "a.stl: the header of this binary STL file has 0 facets, which require 84 bytes; it has 64 too few");
}

TEST(SurfaceFile, SkipsTheMarkOfUtf8AndNamesThatOfUtf16) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_NEAR(volume(mark + "OFF 4 4 0\n" + kTetrahedron + kItsFacets, ".off"), kItsVolume, 1e-12);
  EXPECT_NEAR(volume(mark + kObj, ".obj"), kItsVolume, 1e-12);
  EXPECT_NEAR(volume(mark + text_stl(), ".stl"), kItsVolume, 1e-12);
  for (const std::string ending : {".off", ".obj", ".stl"}) {
    EXPECT_EQ(refusal(std::string("\xFF\xFEO\0", 4), ending), "a" + ending + ": is UTF-16; save it as UTF-8");
  }
}

std::string notes_of(const std::string& text, const std::string& ending) {
  const Triangles surface = parse_surface(text, ending, "a" + ending);
  EXPECT_NO_THROW(check(surface, "a"));
  EXPECT_NEAR(surface.volume(), kItsVolume, 1e-9);
  std::string all;
  for (const std::string& note : surface.notes) all += note + "\n";
  return all;
}

TEST(SurfaceFile, SaysWhatIsRepairedInIt) {
  EXPECT_EQ(notes_of("OFF 4 5 0\n" + kTetrahedron + kItsFacets + "3 1 0 2\n", ".off"),
            "1 facet is duplicated and ignored: facet 5 is facet 1\n");
  EXPECT_EQ(notes_of(kObj + kObj, ".obj"), "4 facets are duplicated and ignored: facet 5 is facet 1\n")
      << "the points of the second are of no use";
  EXPECT_EQ(notes_of("OFF 8 8 0\n" + kTetrahedron + kTetrahedron + kItsFacets + "3 4 6 5\n3 4 5 7\n3 4 7 6\n3 5 6 7\n",
                     ".off"),
            "4 places have two points or more, which are merged, the first at (0, 0, 0)\n"
            "4 facets are duplicated and ignored: facet 5 is facet 1\n");
  EXPECT_EQ(notes_of(text_stl() + text_stl(), ".stl"), "4 facets are duplicated and ignored: facet 5 is facet 1\n");
  EXPECT_EQ(notes_of("OFF 4 6 0\n" + kTetrahedron + "3 0 0 1\n" + kItsFacets + "4 1 1 2 2\n", ".off"),
            "2 facets have fewer than three different corners, and are ignored: facet 1\n");
}

/// OBJ. The polygon is counterclockwise; each cap is one facet that starts at corner `start`.
std::string prism(const std::vector<std::array<int, 2>>& polygon, std::size_t start) {
  const std::size_t count = polygon.size();
  std::ostringstream text;
  for (const int z : {0, 10}) {
    for (const auto& [x, y] : polygon) text << "v " << x << ' ' << y << ' ' << z << '\n';
  }
  text << "f";
  for (std::size_t i = 0; i < count; ++i) text << ' ' << count + (start + i) % count + 1;
  text << "\nf";
  for (std::size_t i = count; i-- > 0;) text << ' ' << (start + i) % count + 1;
  text << '\n';
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t next = (i + 1) % count;
    text << "f " << i + 1 << ' ' << next + 1 << ' ' << count + next + 1 << ' ' << count + i + 1 << '\n';
  }
  return text.str();
}

TEST(SurfaceFile, PrismsOverAnLAndAUHaveTheirVolumeFromEveryCorner) {
  const std::vector<std::array<int, 2>> l{{0, 0}, {30, 0}, {30, 10}, {10, 10}, {10, 30}, {0, 30}};
  const std::vector<std::array<int, 2>> u{{0, 0}, {30, 0}, {30, 30}, {20, 30}, {20, 10}, {10, 10}, {10, 30}, {0, 30}};
  for (std::size_t start = 0; start < l.size(); ++start) {
    EXPECT_NEAR(volume(prism(l, start), ".obj"), 5000, 1e-9) << start;
  }
  for (std::size_t start = 0; start < u.size(); ++start) {
    EXPECT_NEAR(volume(prism(u, start), ".obj"), 7000, 1e-9) << start;
  }
}

TEST(SurfaceFile, FacetsAreNumberedAsInTheFile) {
  const std::vector<std::array<int, 2>> bow{{0, 0}, {20, 20}, {20, 0}, {0, 20}};
  EXPECT_EQ(refusal(prism(bow, 0), ".obj"),
            "a.obj: facet 1 at (10, 10, 10) is not simple: its sides that start at (0, 0, 10) and (20, 0, 10) meet");
  const std::vector<std::array<int, 2>> l{{0, 0}, {30, 0}, {30, 10}, {10, 10}, {10, 30}, {0, 30}};
  std::string open = prism(l, 0);
  open = open.substr(0, open.rfind("f "));
  const std::string said = refusal(open, ".obj");
  EXPECT_PRED2(says, said, "has an edge without a second facet");
  EXPECT_TRUE(said.starts_with("a.obj: facet 3 ") || said.starts_with("a.obj: facet 1 ") ||
              said.starts_with("a.obj: facet 2 ") || said.starts_with("a.obj: facet 7 "))
      << said;
  std::string many = "OFF 10001 1 0\n";
  for (int i = 0; i < 10'001; ++i) many += std::to_string(i) + " " + std::to_string(1e-4 * i * i) + " 0\n";
  many += "10001";
  for (int i = 0; i < 10'001; ++i) many += " " + std::to_string(i);
  EXPECT_PRED2(says, refusal(many, ".off"), "has 10001 corners, expected at most 10000: split it into smaller facets");
}

}  // namespace
}  // namespace tendon::softbody::surface_file_test
