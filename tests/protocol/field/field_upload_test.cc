// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "tests/protocol/field/upload.h"
#include "tests/support/property_cases.h"

namespace tendon::field_upload_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::size_t kAll = field::BrickField::kMostBricks;
constexpr Weather kFar{.delay = milliseconds(95), .jitter = milliseconds(10), .loss = 0.05, .duplicate = 0.05};
const Weather kCalm = perfect(milliseconds(100));

/// All bricks of the engine are in the store, byte by byte.
void expect_same(const Upload& upload, std::span<const FieldSender::Brick> bricks) {
  const auto manifest = upload.receiver.ready(upload.sender.field());
  ASSERT_TRUE(manifest);
  ASSERT_EQ(manifest->bricks(), bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    const PlacedBrick placed = manifest->brick(i);
    EXPECT_EQ(placed.place, bricks[i].place);
    EXPECT_EQ(placed.material, bricks[i].material);
    const BrickBytes* const bytes = upload.receiver.brick(placed.hash);
    ASSERT_TRUE(bytes);
    EXPECT_EQ(*bytes, bricks[i].bytes);
  }
}

double quantile(std::vector<double>& values, double q) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

TEST(FieldUpload, AMegabyteIsReadyWithin3500MillisecondsAt200) {
  const auto bricks = random_bricks(kAll, 1);
  std::vector<double> ready;
  std::vector<double> known;
  std::vector<double> sent;
  const int uploads = property_cases() < 10'000 ? 100 : 1000;
  for (int seed = 1; seed <= uploads; ++seed) {
    BrickStore store({});
    Upload upload(store, 0, bricks, kFar, static_cast<std::uint64_t>(seed));
    const LocalTime start = upload.now;
    ASSERT_TRUE(upload.run_until_known()) << "seed " << seed;
    ready.push_back(tendon::seconds(*upload.ready_at - start));
    known.push_back(tendon::seconds(upload.now - start));
    sent.push_back(static_cast<double>(upload.sender.sent()));
    EXPECT_EQ(upload.refusals, std::vector<std::string>{}) << "seed " << seed;
    if (seed == 1) expect_same(upload, bricks);
  }
  std::cout << ready.size() << " uploads: ready after " << quantile(ready, 0.5) << " s (p99 " << quantile(ready, 0.99)
            << "), known after " << quantile(known, 0.5) << " s (p99 " << quantile(known, 0.99) << "), "
            << quantile(sent, 0.5) << " bricks sent (p99 " << quantile(sent, 0.99) << ")\n";
  EXPECT_LE(quantile(ready, 0.99), 3.5);
  EXPECT_LE(quantile(sent, 0.99), 1.15 * kAll);
}

TEST(FieldUpload, TheRateIsThatOfTheConfigAndNoBrickIsRepeatedInVain) {
  const auto bricks = random_bricks(kAll, 2);
  BrickStore store({});
  Upload upload(store, 0, bricks, kCalm, 1);
  const LocalTime start = upload.now;
  ASSERT_TRUE(upload.run_until_known());
  EXPECT_EQ(upload.sender.sent(), kAll);
  EXPECT_GE(*upload.ready_at - start, from_seconds((kAll - 17) * 1024 / 500e3));  // 17 bricks are one burst
  expect_same(upload, bricks);
}

TEST(FieldUpload, ARestartedEngineSendsNothing) {
  const auto bricks = random_bricks(200, 3);
  BrickStore store({});
  Upload first(store, 0, bricks, kFar, 1);
  ASSERT_TRUE(first.run_until_known());
  Upload again(store, 0, bricks, kFar, 2, first.now);
  ASSERT_TRUE(again.run_until_known());
  EXPECT_EQ(again.sender.sent(), 0U);
  expect_same(again, bricks);
}

TEST(FieldUpload, AnEngineKilledHalfWaySendsTheRest) {
  const auto bricks = random_bricks(kAll, 4);
  BrickStore store({});
  Upload killed(store, 0, bricks, kCalm, 1);
  ASSERT_TRUE(killed.run(seconds(20), [&] { return store.held(0) >= kAll / 2; }));
  const std::size_t there = store.held(0);
  EXPECT_FALSE(killed.ready_at);
  Upload again(store, 0, bricks, kCalm, 2, killed.now);
  ASSERT_TRUE(again.run_until_known());
  EXPECT_EQ(again.sender.sent(), kAll - there);
  expect_same(again, bricks);
}

TEST(FieldUpload, ACutSendsItsBricksOnly) {
  auto bricks = random_bricks(300, 5);
  BrickStore store({});
  Upload whole(store, 0, bricks, kFar, 1);
  ASSERT_TRUE(whole.run_until_known());
  for (std::size_t i = 100; i < 107; ++i) bricks[i].bytes[i] ^= std::byte{1};
  bricks.pop_back();  // the cut has removed a brick
  Upload cut(store, 0, bricks, kCalm, 2, whole.now);
  ASSERT_TRUE(cut.run_until_known());
  EXPECT_EQ(cut.sender.sent(), 7U);
  EXPECT_NE(cut.sender.field(), whole.sender.field());
  expect_same(cut, bricks);
}

TEST(FieldUpload, TwoEnginesShareBricksNotQuotas) {
  const auto bricks = random_bricks(300, 6);
  BrickStore store({.bytes = 500 * limits::kBrickBytes, .owner_bytes = 400 * limits::kBrickBytes});
  Upload one(store, 0, bricks, kCalm, 1);
  ASSERT_TRUE(one.run_until_known());
  Upload two(store, 1, bricks, kCalm, 2);
  ASSERT_TRUE(two.run_until_known());
  EXPECT_EQ(two.sender.sent(), 300U) << "the status must not tell what others have uploaded";
  EXPECT_EQ(store.bricks(), 300U) << "equal bricks take memory once";
  EXPECT_EQ(store.held(0), 300U);
  EXPECT_EQ(store.held(1), 300U);
  const auto more = random_bricks(200, 7);
  Upload own(store, 1, more, kCalm, 3, two.now);
  ASSERT_TRUE(own.run_until_known());
  EXPECT_EQ(store.held(1), 400U) << "100 old bricks are given up for 200 new ones";
  EXPECT_EQ(store.held(0), 300U) << "the other engine keeps all of its bricks";
}

TEST(FieldUpload, AFieldOfPrimitivesIsReadyAfterItsManifest) {
  const std::vector<field::Primitive> sent = {
      {.shape = field::Plane{.at = {1, 2, 3}, .normal = {0.6, 0, 0.8}}, .material = 3},
      {.shape = field::Sphere{.centre = {4, 5, 6}, .radius = 7}, .hollow = true},
      {.shape = field::Capsule{.from = {8, 9, 10}, .to = {11, 12, 13}, .radius = 14}, .material = 7},
      {.shape = field::Box{
           .centre = {15, 16, 17}, .half = {18, 19, 20}, .rounding = 1, .turn = {.w = 0.6, .x = 0, .y = 0.8, .z = 0}}}};
  const std::vector<std::byte> manifest = encode_manifest({}, {}, sent);
  EXPECT_EQ(manifest.size(), 50U + 4 * 91);
  BrickStore store({});
  FieldReceiver receiver({}, store);
  FieldSender sender({}, {}, {}, sent);
  const LocalTime now{seconds(100)};
  ASSERT_FALSE(receiver.take(now, sender.next_part(now).value()));
  sender.part_sent();
  EXPECT_FALSE(sender.next_part(now));
  ASSERT_TRUE(sender.take(now, receiver.next_status(now).value(), {}));
  EXPECT_TRUE(sender.complete());
  const auto ready = receiver.ready(sender.field());
  ASSERT_TRUE(ready);
  EXPECT_EQ(ready->bricks(), 0U);
  ASSERT_EQ(ready->primitives(), sent.size());
  std::vector<field::Primitive> received;
  for (std::size_t i = 0; i < sent.size(); ++i) received.push_back(ready->primitive(i));
  EXPECT_EQ(encode_manifest({}, {}, received), manifest);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(received[i].hollow, sent[i].hollow);
    EXPECT_EQ(received[i].material, sent[i].material);
    const Vec3 x(0.3, -0.2, 0.1);
    EXPECT_EQ(distance(received[i], x).distance, distance(sent[i], x).distance) << i;
    EXPECT_EQ(distance(received[i], x).gradient, distance(sent[i], x).gradient) << i;
  }
}

TEST(FieldUpload, AServerThatHasForgottenTheOfferIsOfferedItAgain) {
  const auto bricks = random_bricks(20, 8);
  BrickStore store({});
  Upload upload(store, 0, bricks, kCalm, 1);
  ASSERT_TRUE(upload.run(seconds(1), [&] { return store.held(0) >= 5; }));
  EXPECT_TRUE(upload.receiver.drop(upload.sender.field()));
  EXPECT_FALSE(upload.receiver.drop(upload.sender.field()));
  ASSERT_TRUE(upload.run_until_known());
  EXPECT_LT(tendon::seconds(upload.now.time_since_epoch()), 100 + 4);
  expect_same(upload, bricks);
}

TEST(FieldUpload, AFieldWhoseBricksWereReplacedIsNotReady) {
  const auto bricks = random_bricks(20, 9);
  BrickStore store({.owner_bytes = 20 * limits::kBrickBytes});
  Upload upload(store, 0, bricks, kCalm, 1);
  ASSERT_TRUE(upload.run_until_known());
  const BrickBytes other{};
  store.put(0, BrickHash{}, other);
  ASSERT_TRUE(upload.run(seconds(3), [&] { return !upload.receiver.ready(upload.sender.field()); }));
  ASSERT_TRUE(upload.run(seconds(3), [&] { return upload.receiver.ready(upload.sender.field()).has_value(); }));
  EXPECT_EQ(upload.sender.sent(), 21U);
}

TEST(FieldUpload, RefusesAConfigThatCannotWork) {
  const auto bricks = random_bricks(1, 1);
  BrickStore store({.owners = 2});
  EXPECT_THROW(FieldSender({.bytes_per_s = 0}, {}, bricks), std::invalid_argument);
  EXPECT_THROW(FieldSender({.silence = {}}, {}, bricks), std::invalid_argument);
  EXPECT_THROW(FieldReceiver({.owner = 2}, store), std::invalid_argument);
  EXPECT_THROW(FieldReceiver({.offers = 0}, store), std::invalid_argument);
  EXPECT_THROW(FieldReceiver({.bytes_per_s = std::nan("")}, store), std::invalid_argument);
  EXPECT_THROW(FieldReceiver({.period = {}}, store), std::invalid_argument);
  EXPECT_THROW(FieldReceiver({.expiry = {}}, store), std::invalid_argument);
  EXPECT_THROW(BrickStore({.bytes = 1023}), std::invalid_argument);
  EXPECT_THROW(BrickStore({.owner_bytes = 1023}), std::invalid_argument);
  EXPECT_THROW(BrickStore({.owners = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::field_upload_test
