// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "server/commands/explain.h"
#include "tests/server/scene/scene_text.h"

namespace tendon::scene_field_test {
namespace {

const std::string kChannels = "[[channel]]\nname = \"liver\"\n[[channel]]\nname = \"peg\"\n";

TEST(SceneField, ItsKeysAreInUnitsOfTheReader) {
  const Scene none = minimal_and("");
  EXPECT_FALSE(none.has_fields());
  EXPECT_FALSE(none.may_use_fields(none.channels.front()));
  expect_made(std::string(kMinimal),
              {{"field.max_stiffness_n_per_m=900", 900, [](S s) { return s.loop.control.hold.field->max_stiffness; }},
               {"field.push_j=0.05", 0.05, [](S s) { return s.loop.control.hold.field->push.push_j; }},
               {"field.push_w=0.25", 0.25, [](S s) { return s.loop.control.hold.field->push.push_w; }},
               {"field.cache_mb=16", 16e6, [](S s) { return s.fields.cache_bytes; }}});
}

TEST(SceneField, ItsDefaultsAreThoseOfTheRendererAndOfTheStore) {
  const Scene scene = minimal_and("[field]\n");
  const field::Renderer::Config expected;
  ASSERT_TRUE(scene.has_fields());
  EXPECT_EQ(scene.loop.control.hold.field->max_stiffness, expected.max_stiffness);
  EXPECT_EQ(scene.loop.control.hold.field->push.push_j, expected.push.push_j);
  EXPECT_EQ(scene.loop.control.hold.field->push.push_w, expected.push.push_w);
  EXPECT_EQ(scene.fields.cache_bytes, static_cast<double>(BrickStore::Config{}.bytes));
  EXPECT_TRUE(scene.may_use_fields(scene.channels.front()));
  EXPECT_FALSE(scene.loop.control.limiter.shared_account);
  EXPECT_NE(scene_reference("field").find("  cache_mb\n"), std::string::npos);
  EXPECT_NE(scene_reference("field").find("A number from 4 to 1000 MB. Default: 8.\n"), std::string::npos);
}

TEST(SceneField, AllowsTheListedChannels) {
  const Scene scene = minimal_and("[field]\nallow = [\"peg\"]\n" + kChannels);
  EXPECT_FALSE(scene.may_use_fields(scene.channels[0]));
  EXPECT_TRUE(scene.may_use_fields(scene.channels[1]));
}

TEST(SceneField, APushSharesTheAccountOfTheLimiter) {
  EXPECT_TRUE(minimal_and("[field]\npush_j = 0.01\n").loop.control.limiter.shared_account);
}

TEST(SceneField, APresetDoesNotAddASecondPart) {
  const Scene scene = minimal_and("[limiter]\npreset = \"feel\"\n[field]\n");
  EXPECT_TRUE(scene.loop.control.limiter.parts.damper);
  EXPECT_FALSE(scene.loop.control.hold.learned_model);
}

TEST(SceneField, EachErrorNamesTheKeyAndWhatWasExpected) {
  expect_errors({
      {"[field]\nallow = \"peg\"\n",
       "s.toml:5: field.allow: expected […], each a name of 1 to 24 letters, digits, - or _, found \"peg\""},
      {"[field]\nallow = [\"pag\"]\n" + kChannels,
       "s.toml:5: field.allow: expected names of channels, which are \"liver\", \"peg\", found \"pag\"; did you mean "
       "peg?"},
      {"[field]\nmax_stiffness_n_per_m = 0\n",
       "s.toml:5: field.max_stiffness_n_per_m: expected a number above 0 N/m, found 0"},
      {"[field]\npush_j = -1\n", "s.toml:5: field.push_j: expected a number of 0 J or more, found -1"},
      {"[field]\npush_w = nan\n", "s.toml:5: field.push_w: expected a number of 0 W or more, found nan"},
      {"[field]\ncache_mb = 2\n", "s.toml:5: field.cache_mb: expected a number from 4 to 1000 MB, found 2"},
      {"[field]\ncache = 8\n", "s.toml:5: field.cache: unknown key; cache is given in MB: cache_mb"},
      {"[limiter]\nkind = \"clamp\"\nclamp_n = 2\n[field]\npush_j = 0.1\n",
       "s.toml:5: field.push_j: expected the limiter \"aol+\", \"aol\" or \"aol-box\": other limiters have no energy "
       "account that ports can share"},
  });
}

TEST(SceneField, TakenOutItLeavesNoTrace) {
  Scene scene = minimal_and("[field]\npush_j = 0.1\n");
  EXPECT_TRUE(take_out(scene, "field"));
  EXPECT_FALSE(scene.has_fields());
  EXPECT_FALSE(scene.loop.control.limiter.shared_account);
  EXPECT_FALSE(take_out(scene, "field"));
  Scene without_limiter = minimal_and("[field]\npush_j = 0.1\n");
  EXPECT_TRUE(take_out(without_limiter, "limiter"));
  EXPECT_NO_THROW(HapticController{without_limiter.loop.control});
}

TEST(SceneField, ExplainSaysWhetherTheLimiterClipsAndWhatAnObjectGives) {
  const auto says = [](const std::string& keys, const std::string& words) {
    const std::string text = in_words(minimal_and("[field]\n" + keys + kChannels), {});
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n in " << text;
  };
  says("", "Fields: in liver, peg; 13.9 MB ");
  says("", "for 3 fields of each channel, and 8.0 MB for uploaded bricks, for each network thread\n");
  says("allow = [\"peg\"]\n", "Fields: in peg; 6.9 MB ");
  says("", "  a moving object gives the hand no energy\n");
  says("push_j = 0.05\npush_w = 1\n", "  a moving object gives the hand at most 0.05 J + 1 W · t\n");
  // The viscous bound is 0.5 N·s/m, and the longest hold is 2 ms.
  says("", "  1500 > 2b/T = 500 N/m: the limiter will clip\n");
  says("max_stiffness_n_per_m = 200\n", "  200 ≤ 2b/T = 500 N/m: ");
  EXPECT_EQ(in_words(minimal_and(""), {}).find("Fields:"), std::string::npos);
}

}  // namespace
}  // namespace tendon::scene_field_test
