// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/shells.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/clients/softbody/touch/surfaces.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::shells_test {
namespace {

using testing::box_surface;
using testing::together;
using testing::turned_inside_out;

std::string refusal(const Triangles& surface) {
  return thrown_by([&] { check(surface, "a"); });
}

Triangles cube(double side, const Vec3& middle = Vec3::Zero()) {
  return testing::moved(box_surface(Vec3::Constant(side)), 1, middle);
}

TEST(Shells, AShellWithinAnotherIsACavityOrIsRefused) {
  const Triangles hollow = together(cube(40), turned_inside_out(cube(20)));
  EXPECT_EQ(refusal(hollow), "");
  EXPECT_NEAR(hollow.volume(), 56'000, 1e-9);
  EXPECT_EQ(bodies(hollow).size(), 1U);
  EXPECT_EQ(notes_on(hollow),
            (std::vector<std::string>{
                "the surface has 1 cavity; the smallest starts with facet 13 at (-3.333, 3.333, -10)"}));
  EXPECT_EQ(refusal(together(cube(40), cube(20))),
            "a: the closed part of 12 facets that starts with facet 13 at (-3.333, 3.333, -10) is inside the one that "
            "starts with facet 1 at (-6.667, 6.667, -20), and has the same orientation: reverse its facets if it is a "
            "cavity, or remove it");
  EXPECT_EQ(refusal(together(cube(20), cube(40))),
            "a: the closed part of 12 facets that starts with facet 1 at (-3.333, 3.333, -10) is inside the one that "
            "starts with facet 13 at (-6.667, 6.667, -20), and has the same orientation: reverse its facets if it is a "
            "cavity, or remove it");
  EXPECT_PRED2(says, refusal(together(turned_inside_out(cube(40)), turned_inside_out(cube(20)))),
               "is turned inside out");
}

TEST(Shells, ABodyInACavityIsABodyAndADeeperOneIsRefusedToo) {
  const Triangles russian = together(together(cube(40), turned_inside_out(cube(30))), cube(20));
  EXPECT_EQ(refusal(russian), "");
  EXPECT_NEAR(russian.volume(), 64'000 - 27'000 + 8'000, 1e-9);
  const std::vector<Triangles> parts = bodies(russian);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_NEAR(parts[0].volume(), 37'000, 1e-9);
  EXPECT_NEAR(parts[1].volume(), 8'000, 1e-9);
  EXPECT_EQ(parts[1].place(0), "facet 25 at (-3.333, 3.333, -10)");
  const std::string wrong =
      refusal(together(together(cube(40), turned_inside_out(cube(30))), turned_inside_out(cube(20))));
  EXPECT_PRED2(says, wrong, "a cavity, and has the same orientation");
}

TEST(Shells, BodiesApartAreSaidAndOneThatIsInsideOutIsNamed) {
  const Triangles two = together(cube(40), cube(10, Vec3(50, 0, 0)));
  EXPECT_EQ(refusal(two), "");
  EXPECT_EQ(bodies(two).size(), 2U);
  EXPECT_EQ(notes_on(two),
            (std::vector<std::string>{
                "the surface has 2 separate bodies; the smallest starts with facet 13 at (48.33, 1.667, -5)"}));
  EXPECT_EQ(refusal(together(cube(40), turned_inside_out(cube(10, Vec3(50, 0, 0))))),
            "a: the closed part of 12 facets that starts with facet 13 at (48.33, 1.667, -5) is turned inside out: "
            "expected facets anticlockwise, seen from outside");
}

TEST(Shells, PartsThatTouchAreRefusedWhereTheyDo) {
  const std::string stands = refusal(together(cube(40), cube(10, Vec3(3, 4, 25))));
  EXPECT_PRED2(says, stands, "overlap: parts that touch must be one surface");
  EXPECT_PRED2(says, stands, "facet 13 at (1.333, 5.667, 20)");
  const std::string within = refusal(together(cube(40), cube(10, Vec3(0, 0, 15))));
  EXPECT_PRED2(says, within, " overlap");
  EXPECT_EQ(refusal(together(cube(40), cube(10, Vec3(0, 0, 25.001)))), "");
}

TEST(Shells, ATooLargeNumberOfPartsIsRefused) {
  Triangles specks = cube(1);
  for (int i = 1; i <= 1000; ++i) specks = together(specks, cube(1, Vec3(2 * i, 0, 0)));
  EXPECT_EQ(refusal(specks), "a: has 1001 parts, expected at most 1000: remove the small parts");
}

}  // namespace
}  // namespace tendon::softbody::shells_test
