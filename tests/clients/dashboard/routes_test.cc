// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/routes.h"

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/server/scratch_folder.h"

namespace tendon::dash::routes_test {
namespace {

constexpr std::array<PageFile, 2> kPage = {
    {{"/index.html", "text/html", "<p>", "gz"}, {"/assets/a-1.js", "text/javascript", "1", ""}}};

class RoutesTest : public ::testing::Test {
 protected:
  RoutesTest() { std::ofstream(scratch_.path() / "a b.mcap") << "0123456789"; }

  static Request get(std::string_view target) {
    return {.method = "GET", .target = target, .host = "127.0.0.1:8080", .local = true};
  }
  Reply reply(const Request& request) const {
    auto answer = routes_.answer(request);
    if (auto* found = std::get_if<Reply>(&answer)) return std::move(*found);
    Reply upgrade;
    upgrade.status = 101;
    return upgrade;
  }
  unsigned status(const Request& request) const { return reply(request).status; }
  static std::string header(const Reply& reply, std::string_view name) {
    for (const auto& [key, value] : reply.headers) {
      if (key == name) return value;
    }
    return "none";
  }
  static std::string text(const Reply& reply) {
    if (const auto* own = std::get_if<std::string>(&reply.body)) return *own;
    if (const auto* lent = std::get_if<std::string_view>(&reply.body)) return std::string(*lent);
    const auto& slice = std::get<Reply::Slice>(reply.body);
    return slice.file.read(slice.range.first, slice.range.count);
  }

  tendon::testing::ScratchFolder scratch_;
  Recordings recordings_{scratch_.path()};
  Routes routes_{{.hosts = {"dash.lab", "10.0.0.7:8080"}, .origins = {"https://lab.example"}},
                 {.page = kPage, .recordings = &recordings_, .metrics = [] { return std::string("up 1\n"); }}};
};

TEST_F(RoutesTest, ServesThePageAndItsParts) {
  const Reply page = reply(get("/"));
  EXPECT_EQ(page.status, 200U);
  EXPECT_EQ(text(page), "<p>");
  EXPECT_EQ(header(page, "Cache-Control"), "no-cache");
  EXPECT_EQ(text(reply(get("/?x=/live"))), "<p>");
  EXPECT_NE(header(reply(get("/assets/a-1.js")), "Cache-Control").find("immutable"), std::string::npos);
  Request zipped = get("/");
  zipped.accept_encoding = "deflate, gzip";
  const Reply compressed = reply(zipped);
  EXPECT_EQ(text(compressed), "gz");
  EXPECT_EQ(header(compressed, "Content-Encoding"), "gzip");
  zipped.target = "/assets/a-1.js";
  EXPECT_EQ(header(reply(zipped), "Content-Encoding"), "none") << "there is none";
}

TEST_F(RoutesTest, GivesEveryAnswerThePolicyThatKeepsOthersOut) {
  for (const char* target : {"/", "/nothing", "/metrics", "/api/recordings", "/recordings/a%20b.mcap", "/live"}) {
    const Reply answer = reply(get(target));
    EXPECT_NE(header(answer, "Content-Security-Policy").find("default-src 'none'"), std::string::npos) << target;
    EXPECT_EQ(header(answer, "Content-Security-Policy").find("unsafe"), std::string::npos) << target;
    EXPECT_EQ(header(answer, "X-Content-Type-Options"), "nosniff") << target;
    EXPECT_EQ(header(answer, "Cross-Origin-Resource-Policy"), "same-origin") << target;
    EXPECT_EQ(header(answer, "Access-Control-Allow-Origin"), "none") << target;
  }
}

TEST_F(RoutesTest, AnswersToTheNamesOfThisMachineOnly) {
  for (const char* host : {"127.0.0.1", "127.0.0.1:8080", "localhost", "LOCALHOST:1", "a.localhost", "[::1]:8080",
                           "[::1]", "127.255.0.3:80", "dash.lab", "dash.lab:99", "DASH.lab", "10.0.0.7:8080"}) {
    Request request = get("/metrics");
    request.host = host;
    EXPECT_EQ(status(request), 200U) << host;
  }
  for (const char* host : {"evil.example",
                           "evil.example:8080",
                           "127.0.0.1.evil.example",
                           "localhost.evil.example",
                           "evillocalhost",
                           ".localhost",
                           "",
                           ":8080",
                           "127.0.0.1:",
                           "127.0.0.1:x",
                           "127.0.0.1:8080@evil.example",
                           "[::1",
                           "[::2]",
                           "128.0.0.1",
                           "127.0.0",
                           "127.0.0.256",
                           "127.0.0.1.",
                           "0.0.0.0",
                           "2130706433",
                           "10.0.0.7",
                           "xdash.lab"}) {
    Request request = get("/metrics");
    request.host = host;
    EXPECT_EQ(status(request), 421U) << host;
  }
  Request request = get("/");
  request.host.reset();
  EXPECT_EQ(status(request), 421U);
}

TEST_F(RoutesTest, LetsItsOwnPageLookOnAndNoOthers) {
  Request request = get("/live");
  EXPECT_EQ(status(request), 426U);
  request.upgrade = true;
  EXPECT_EQ(status(request), 101U) << "a program that is no browser";
  request.origin = "http://127.0.0.1:8080";
  EXPECT_EQ(status(request), 101U);
  for (const char* origin :
       {"http://127.0.0.1:8081", "http://127.0.0.1", "http://localhost:8080", "https://lab.example", "null", "",
        "http://evil.example", "ftp://127.0.0.1:8080", "http://127.0.0.1:8080/", "127.0.0.1:8080"}) {
    request.origin = origin;
    EXPECT_EQ(status(request), 403U) << origin;
  }
}

TEST_F(RoutesTest, LetsOntoTheBridgePagesOfThisMachineAndOfNamedOrigins) {
  Request request = get("/bridge");
  request.upgrade = true;
  for (const char* origin : {"http://localhost:8000", "http://127.0.0.1", "http://[::1]:3000", "https://lab.example",
                             "http://127.0.0.1:8080"}) {
    request.origin = origin;
    EXPECT_EQ(status(request), 101U) << origin;
  }
  for (const char* origin : {"https://evil.example", "http://lab.example", "https://lab.example.evil.example", "null",
                             "", "http://localhost.evil.example", "http://127.0.0.1.evil.example",
                             "http://localhost@evil.example", "http://evil.example/localhost"}) {
    request.origin = origin;
    EXPECT_EQ(status(request), 403U) << origin;
  }
}

TEST_F(RoutesTest, TakesDatagramsInTheClearFromThisMachineOnly) {
  Request request = get("/bridge");
  request.upgrade = true;
  const auto local = [&] { return std::get<BridgeSocket>(routes_.answer(request)).local; };
  EXPECT_TRUE(local());
  request.proxied = true;
  EXPECT_FALSE(local());
  request.proxied = false;
  request.local = false;
  EXPECT_FALSE(local());
}

TEST_F(RoutesTest, KnowsNoOtherMethodAndNoOtherPath) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "get", ""}) {
    Request request = get("/");
    request.method = method;
    const Reply answer = reply(request);
    EXPECT_EQ(answer.status, 405U) << method;
    EXPECT_EQ(header(answer, "Allow"), "GET, HEAD");
  }
  for (const char* target : {"/nothing", "/index.html/", "/assets/", "/assets/../index.html", "//index.html", "/live/",
                             "/metrics/", "*", "", "http://127.0.0.1:8080/", "/api"}) {
    EXPECT_EQ(status(get(target)), 404U) << target;
  }
}

TEST_F(RoutesTest, OnlyItsOwnPageOnThisMachineMayArmByPost) {
  std::vector<std::pair<std::uint32_t, Order>> pressed;
  std::string objection;
  const Routes routes({.hosts = {"dash.lab"}, .origins = {"https://lab.example"}},
                      {.page = kPage,
                       .recordings = nullptr,
                       .metrics = [] { return std::string(); },
                       .press =
                           [&](std::uint32_t device, Order order) {
                             if (objection.empty()) pressed.emplace_back(device, order);
                             return objection;
                           },
                       .pass = "0123abcd"});
  const auto answer = [&](const Request& request) { return std::get<Reply>(routes.answer(request)); };
  Request good = get("/api/arm?device=3");
  good.method = "POST";
  good.origin = "http://127.0.0.1:8080";
  good.authorization = "Bearer 0123abcd";
  EXPECT_EQ(answer(good).status, 202U);
  Request other = good;
  other.target = "/api/disarm?device=15";
  EXPECT_EQ(answer(other).status, 202U);
  other.target = "/api/engage?device=0";
  EXPECT_EQ(answer(other).status, 202U);
  other.target = "/api/disengage?device=0";
  EXPECT_EQ(answer(other).status, 202U);
  EXPECT_EQ(pressed,
            (decltype(pressed){{3, Order::kArm}, {15, Order::kDisarm}, {0, Order::kEngage}, {0, Order::kDisengage}}));
  pressed.clear();

  const auto refused = [&](unsigned status, const auto& change) {
    for (const char* target :
         {"/api/arm?device=3", "/api/disarm?device=3", "/api/engage?device=3", "/api/disengage?device=3"}) {
      Request request = good;
      request.target = target;
      change(request);
      EXPECT_EQ(answer(request).status, status)
          << request.method << " " << target << " " << request.origin.value_or("no origin");
    }
  };
  for (const char* method : {"GET", "HEAD", "PUT", "OPTIONS", "post", ""}) {
    refused(405, [&](Request& r) { r.method = method; });
  }
  Request asked = good;
  asked.method = "GET";
  EXPECT_EQ(header(answer(asked), "Allow"), "POST");
  refused(421, [](Request& r) { r.host = "evil.example", r.origin = "http://evil.example"; });
  refused(421, [](Request& r) { r.host.reset(); });
  for (const char* origin : {"http://evil.example", "https://lab.example", "http://127.0.0.1:8081", "http://127.0.0.1",
                             "http://localhost:8080", "null", "", "http://127.0.0.1:8080/", "127.0.0.1:8080"}) {
    refused(403, [&](Request& r) { r.origin = origin; });
  }
  refused(403, [](Request& r) { r.origin.reset(); });
  for (const char* other_pass :
       {"", "Bearer", "Bearer ", "0123abcd", "Bearer 0123abcc", "Bearer 0123abcd0", "Basic 0123abcd"}) {
    refused(403, [&](Request& r) { r.authorization = other_pass; });
  }
  refused(403, [](Request& r) { r.authorization.reset(); });
  refused(403, [](Request& r) { r.local = false; });
  refused(403, [](Request& r) { r.proxied = true; });
  refused(403, [](Request& r) { r.host = "dash.lab", r.origin = "http://dash.lab", r.local = false; });
  for (const char* query : {"", "?", "?device=", "?device=x", "?device=-1", "?device=1x", "?device=1&device=2",
                            "?device=99999999999", "?x=1"}) {
    Request request = good;
    const std::string target = std::string("/api/arm") + query;
    request.target = target;
    EXPECT_EQ(answer(request).status, 400U) << query;
  }
  EXPECT_TRUE(pressed.empty());

  objection = "\"wall\" holds it";
  EXPECT_EQ(answer(good).status, 409U);
  EXPECT_EQ(text(answer(good)), "\"wall\" holds it\n");
}

TEST_F(RoutesTest, WithoutLeaveToArmNobodyMayAndIsToldWhatItTakes) {
  Request request = get("/api/disarm?device=0");
  request.method = "POST";
  request.origin = "http://127.0.0.1:8080";
  const Reply answer = reply(request);
  EXPECT_EQ(answer.status, 403U);
  EXPECT_NE(text(answer).find("--key FILE"), std::string::npos);
  EXPECT_NE(text(answer).find("--arm CHANNEL"), std::string::npos);
}

TEST_F(RoutesTest, ServesTheBytesOfARecording) {
  const Reply whole = reply(get("/recordings/a%20b.mcap"));
  EXPECT_EQ(whole.status, 200U);
  EXPECT_EQ(text(whole), "0123456789");
  EXPECT_EQ(header(whole, "Accept-Ranges"), "bytes");
  Request request = get("/recordings/a%20b.mcap");
  request.range = "bytes=3-5";
  const Reply part = reply(request);
  EXPECT_EQ(part.status, 206U);
  EXPECT_EQ(header(part, "Content-Range"), "bytes 3-5/10");
  EXPECT_EQ(text(part), "345");
  EXPECT_NE(part.head(true).find("Content-Length: 3\r\n"), std::string::npos);
  request.range = "bytes=10-";
  const Reply beyond = reply(request);
  EXPECT_EQ(beyond.status, 416U);
  EXPECT_EQ(header(beyond, "Content-Range"), "bytes */10");
}

TEST_F(RoutesTest, LeadsNowhereElseInTheFileSystem) {
  std::ofstream(scratch_.path().parent_path() / "outside.mcap") << "secret";
  for (const char* name :
       {"", "..", "../outside.mcap", "..%2Foutside.mcap", "%2e%2e%2Foutside.mcap", "..%252Foutside.mcap",
        "%2Fetc%2Fpasswd", "a%20b.mcap%00", "a%20b.mcap%2F", "a%", "a%2", "a%zz.mcap", "%", "a b"}) {
    EXPECT_EQ(status(get("/recordings/" + std::string(name))), 404U) << name;
  }
  std::filesystem::remove(scratch_.path().parent_path() / "outside.mcap");
}

TEST_F(RoutesTest, HasNoRecordingsWithoutAFolder) {
  const Routes routes({}, {.page = kPage, .recordings = nullptr, .metrics = [] { return std::string(); }});
  auto list = routes.answer(get("/api/recordings"));
  EXPECT_EQ(text(std::get<Reply>(list)), "[]");
  auto one = routes.answer(get("/recordings/a%20b.mcap"));
  EXPECT_EQ(std::get<Reply>(one).status, 404U);
}

TEST(ReplyHead, SaysHowLongItIsAndWhetherTheConnectionStays) {
  Reply reply;
  reply.headers = {{"Content-Type", "text/plain"}};
  reply.body = std::string("four");
  EXPECT_EQ(reply.head(true),
            "HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: 4\r\nConnection: keep-alive\r\n\r\n");
  EXPECT_NE(reply.head(false).find("Connection: close"), std::string::npos);
}

TEST_F(RoutesTest, AViewerGetsTheFirstProtocolThatItNamesAndNoneIsRefused) {
  const auto protocol = [&](const std::string& names) {
    Request request = get("/foxglove");
    request.upgrade = true;
    request.protocols = names;
    const Answer answer = routes_.answer(request);
    if (const auto* viewer = std::get_if<FoxgloveSocket>(&answer)) return viewer->protocol;
    return std::to_string(std::get<Reply>(answer).status);
  };
  EXPECT_EQ(protocol("foxglove.sdk.v1,"), "foxglove.sdk.v1");
  EXPECT_EQ(protocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(protocol("foxglove.websocket.v1, foxglove.sdk.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(protocol("a,, \t,\tfoxglove.sdk.v1 ,foxglove.websocket.v1"), "foxglove.sdk.v1");
  for (const char* none :
       {"", ",", " ", "foxglove.sdk.v2", "xfoxglove.sdk.v1", "foxglove.sdk.v1 x", "FOXGLOVE.SDK.V1"}) {
    EXPECT_EQ(protocol(none), "400") << none;
  }
  EXPECT_EQ(status(get("/foxglove")), 426U);
}

TEST_F(RoutesTest, ViewersComeFromThisPageOrFromAnOriginThatIsNamed) {
  const auto from = [&](const char* path, const char* origin) {
    Request request = get(path);
    request.upgrade = true;
    request.protocols = "foxglove.sdk.v1";
    request.origin = origin;
    return status(request);
  };
  EXPECT_EQ(from("/foxglove", "http://127.0.0.1:8080"), 101U);
  EXPECT_EQ(from("/foxglove", "https://lab.example"), 101U);
  for (const char* origin :
       {"http://localhost:9", "http://127.0.0.1:8081", "https://evil.example", "null", "file://"}) {
    EXPECT_EQ(from("/foxglove", origin), 403U) << origin;
  }
  EXPECT_EQ(from("/live", "https://lab.example"), 403U) << "only the two that --origin is for";
}

}  // namespace
}  // namespace tendon::dash::routes_test
