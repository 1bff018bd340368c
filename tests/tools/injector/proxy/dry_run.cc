// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/dry_run.h"

#include <array>
#include <charconv>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::injector {
namespace {

constexpr std::size_t kPiece = 1 << 16;

void append(std::string& text, std::integral auto number) {
  std::array<char, 24> digits;
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
}

void append_ms(std::string& text, Duration d) {
  append(text, d.count() / 1'000'000);
  std::array<char, 8> rest{'.', '0', '0', '0', '0', '0', '0', '0'};
  std::int64_t ns = d.count() % 1'000'000;
  for (std::size_t i = 6; i > 0; --i, ns /= 10) rest[i] = static_cast<char>('0' + ns % 10);
  text.append(rest.data(), 7);
}

void append_json(std::string& text, const TraceRecord& record) {
  text += record.direction == Direction::kUp ? R"({"dir":"up","index":)" : R"({"dir":"down","index":)";
  append(text, record.index);
  text += R"(,"t_in_ns":)";
  append(text, record.arrival.time_since_epoch().count());
  text += R"(,"verdict":")";
  text += to_string(record.verdict);
  text += R"(","cause":")";
  text += to_string(record.cause);
  text += R"(","t_out_ns":)";
  if (record.verdict == Verdict::kDrop) {
    text += "null";
  } else {
    append(text, record.release.time_since_epoch().count());
  }
  text += "}\n";
}

void append_text(std::string& text, const TraceRecord& record) {
  text += record.direction == Direction::kUp ? "up   " : "down ";
  append(text, record.index);
  text += "  at ";
  append_ms(text, record.arrival.time_since_epoch());
  text += " ms  ";
  text += to_string(record.verdict);
  text += ' ';
  text += to_string(record.cause);
  if (record.verdict != Verdict::kDrop) {
    text += "  after ";
    append_ms(text, record.release - record.arrival);
    text += " ms";
  }
  text += '\n';
}

class Way {
 public:
  Way(const PreparedNetwork& network, Direction direction) : timeline_(network.timeline), direction_(direction) {
    if (network.replay) {
      auto player = std::make_unique<TracePlayer>(*network.replay, direction, kLink, network.playback.by, LocalTime{},
                                                  network.playback.at_end);
      if (network.playback.add) {
        player->add(network.networks[static_cast<std::size_t>(direction)].for_link(kLink, LocalTime{}));
      }
      player_ = player.get();
      decider_ = std::move(player);
      return;
    }
    auto injector =
        std::make_unique<Injector>(network.networks[static_cast<std::size_t>(direction)].for_link(kLink, LocalTime{}));
    injector_ = injector.get();
    decider_ = std::move(injector);
  }

  bool stops(LocalTime at) const { return player_ != nullptr && player_->stops(at); }
  double played() const { return player_ == nullptr ? 0 : player_->played(); }

  TraceRecord decide(const Packet& packet) {
    for (; next_ < timeline_.size() && timeline_[next_].at <= packet.arrival.time_since_epoch(); ++next_) {
      const Proxy::PreparedChange& change = timeline_[next_].change;
      const auto& to = change.to[static_cast<std::size_t>(direction_)];
      if (to && injector_ != nullptr && change.client.value_or(kLink) == kLink) {
        injector_->change(*to, LocalTime(timeline_[next_].at));
      }
    }
    TraceRecord record;
    static_cast<Decision&>(record) = decider_->decide(packet);
    record.direction = direction_;
    record.link = kLink;
    return record;
  }

 private:
  static constexpr ClientIndex kLink = 0;

  const std::vector<Proxy::Step>& timeline_;
  Direction direction_;
  std::unique_ptr<Decider> decider_;
  Injector* injector_ = nullptr;
  TracePlayer* player_ = nullptr;
  std::size_t next_ = 0;
};

}  // namespace

std::array<double, 2> dry_run(const PreparedNetwork& network, const DryRun& options, std::ostream& out,
                              TraceWriter* trace) {
  std::array<Way, 2> ways = {Way(network, Direction::kUp), Way(network, Direction::kDown)};
  std::string text;
  for (std::uint64_t i = 0; i < options.count; ++i) {
    const std::uint64_t round = i / 2;
    const LocalTime at(std::chrono::seconds(round / options.rate_hz) +
                       Duration(round % options.rate_hz * 1'000'000'000 / options.rate_hz));
    if (ways[i % 2].stops(at)) break;
    const TraceRecord record = ways[i % 2].decide({.arrival = at, .size = options.bytes, .bytes = {}});
    options.json ? append_json(text, record) : append_text(text, record);
    if (trace != nullptr) trace->write(record);
    if (text.size() < kPiece) continue;
    out << text;
    text.clear();
    if (!out) break;  // the pipe was closed by the reader
  }
  out << text << std::flush;
  return {ways[0].played(), ways[1].played()};
}

}  // namespace tendon::injector
