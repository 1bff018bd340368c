// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/merge.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/build_info.h"
#include "server/recording/byte_sink.h"
#include "server/recording/mcap_reader.h"
#include "server/recording/mcap_writer.h"
#include "server/recording/recording_codec.h"
#include "tests/support/json_line.h"
#include "tests/tools/replay/clock_bound.h"
#include "tests/tools/replay/copy.h"

namespace tendon::replay {
namespace {

struct End {
  std::map<std::pair<std::uint64_t, std::uint64_t>, LocalTime> sent;  ///< (epoch, sequence) → time
  struct Came {
    std::pair<std::uint64_t, std::uint64_t> which;
    LocalTime by;
    std::uint32_t channel;
  };
  std::vector<Came> came;
};

End read_end(const std::filesystem::path& path) {
  End end;
  McapReader reader = open_mcap(path);
  while (const auto message = reader.next()) {
    if (message->channel.topic != recording::kPort.topic) continue;
    try {
      const LocalTime at{Duration(static_cast<Duration::rep>(message->log_time))};
      const PortRecord port = recording::decode_port(message->data, at);
      end.sent[{port.sent.epoch, port.sent.sequence}] = at;
      if (port.peer) end.came.push_back({{port.peer->epoch, port.peer->sequence}, port.peer_arrived, port.channel});
    } catch (const std::invalid_argument& error) {
      reader.corrupt(message->offset, error.what());
    }
  }
  return end;
}

/// A higher rate means that a clock was stepped.
constexpr double kFastDrift = 10 * kMostDrift;

/// For example "260 ± 12 ppm".
std::string text_of(const ClockDrift& drift) {
  std::ostringstream text;
  text << std::lround(drift.rate * 1e6) << " ± " << std::lround(drift.error * 1e6) << " ppm";
  return text.str();
}

struct Clocks {
  std::vector<ClockBound> bounds;
  ClockDrift drift;
};

Clocks compare_clocks(const End& leader, const End& follower, const MergeOptions& options) {
  std::vector<Crossing> there;
  std::vector<Crossing> back;
  for (const End::Came& came : follower.came) {
    const auto sent = leader.sent.find(came.which);
    if (sent != leader.sent.end()) there.push_back({.at = sent->second, .bound = came.by - sent->second});
  }
  for (const End::Came& came : leader.came) {
    const auto sent = follower.sent.find(came.which);
    if (sent != follower.sent.end()) back.push_back({.at = came.by, .bound = sent->second - came.by});
  }
  for (auto* const crossings : {&there, &back}) std::ranges::sort(*crossings, {}, &Crossing::at);
  Clocks clocks{.bounds = clock_bounds(there, back, std::chrono::seconds(1)), .drift = {}};
  if (clocks.bounds.empty()) {
    throw std::runtime_error(options.leader.string() + " and " + options.follower.string() +
                             " are not the two ends of one coupling: " + (there.empty() ? "the second" : "the first") +
                             " has no state that the other one recorded");
  }
  const auto fast = clock_bounds(there, back, std::chrono::seconds(1), kFastDrift);
  const auto stepped =
      std::ranges::find_if(fast, [](const ClockBound& bound) { return bound.error < Duration::zero(); });
  if (stepped != fast.end()) {
    throw std::runtime_error("a clock was stepped: no offset matches the states at " +
                             std::to_string(seconds(stepped->at - fast.front().at)) + " s of the coupling");
  }
  clocks.drift = drift_over(fast);
  if (!is_possible(clocks.bounds)) {
    throw std::runtime_error("the relative drift of the clocks is " + text_of(clocks.drift) +
                             ", expected less than 200 ppm");
  }
  return clocks;
}

std::set<std::uint32_t> channels_of(const End& leader, const End& follower) {
  std::set<std::uint32_t> channels;
  for (const End::Came& came : follower.came) {
    if (leader.sent.contains(came.which)) channels.insert(came.channel);
  }
  return channels;
}

/// Ports of other channels are not copied.
class Copy {
 public:
  Copy(const std::filesystem::path& path, std::string prefix, std::set<std::uint32_t> channels)
      : reader_(open_mcap(path)), prefix_(std::move(prefix)), ports_by_(std::move(channels)) {
    next();
  }

  bool done() const { return !message_; }
  std::vector<std::string> damage() const { return reader_.damage(); }
  LocalTime at() const { return LocalTime(Duration(static_cast<Duration::rep>(message_->log_time))); }
  void write(McapWriter& writer, LocalTime at) {
    const auto channel = channels_.in(writer, message_->channel, prefix_);
    writer.write(channel, static_cast<std::uint64_t>(at.time_since_epoch().count()), message_->data);
    next();
  }

 private:
  void next() {
    do {
      message_.reset();
      if (const auto message = reader_.next()) message_.emplace(*message);
    } while (message_ && is_of_another_leader(*message_));
  }
  bool is_of_another_leader(const McapReader::Message& message) const {
    return message.channel.topic == recording::kPort.topic &&
           !ports_by_.contains(recording::decode_port(message.data, LocalTime{}).channel);
  }

  McapReader reader_;
  std::string prefix_;
  std::set<std::uint32_t> ports_by_;
  CopiedChannels channels_;
  std::optional<McapReader::Message> message_;
};

std::vector<std::string> write(const MergeOptions& options, const std::vector<ClockBound>& bounds,
                               const std::set<std::uint32_t>& channels) {
  FileSink sink(options.out);
  McapWriter writer("tendon " + std::string(version_text()), sink);
  const auto schema = writer.add_schema(recording::kClock.schema, recording::kEncoding, recording::schema_data());
  const auto clock = writer.add_channel(schema, recording::kClock.topic, recording::kEncoding);
  for (const ClockBound& bound : bounds) {
    const auto at = static_cast<std::uint64_t>(bound.at.time_since_epoch().count());
    writer.write(clock, at, recording::encode(ClockRecord{.offset = bound.offset, .error = bound.error}));
  }
  Copy leader(options.leader, "/leader", {0});
  Copy follower(options.follower, "/follower", channels);
  const auto in_leaders_time = [&](LocalTime at) { return at - offset_at(bounds, at - bounds.front().offset); };
  while (!leader.done() || !follower.done()) {
    const LocalTime next = follower.done() ? LocalTime::max() : in_leaders_time(follower.at());
    if (!leader.done() && leader.at() <= next) {
      leader.write(writer, leader.at());
    } else {
      follower.write(writer, next);
    }
    if (writer.chunk_size() > std::size_t{256} * 1024) check_written(writer.flush_chunk(), sink);
  }
  check_written(writer.close(), sink);
  std::vector<std::string> damage = leader.damage();
  for (std::string& sentence : follower.damage()) damage.push_back(std::move(sentence));
  return damage;
}

}  // namespace

void merge(const MergeOptions& options, std::ostream& out) {
  if (std::filesystem::exists(options.out)) {
    throw std::runtime_error(options.out.string() + ": the file exists and is not overwritten");
  }
  const End leader = read_end(options.leader);
  const End follower = read_end(options.follower);
  const auto [bounds, drift] = compare_clocks(leader, follower, options);
  const auto damage = write(options, bounds, channels_of(leader, follower));
  std::vector<Duration> errors;
  for (const ClockBound& bound : bounds) errors.push_back(bound.error);
  std::ranges::sort(errors);
  const double offset = seconds(bounds[bounds.size() / 2].offset);
  const double middle = seconds(errors[errors.size() / 2]);
  const double p99 = seconds(errors[errors.size() * 99 / 100]);
  if (options.json) {
    out << JsonLine()
               .add("into", options.out.string())
               .add("seconds", bounds.size())
               .add("offset_s", offset)
               .add("error_p50_s", middle)
               .add("error_p99_s", p99)
               .add("drift_ppm", drift.rate * 1e6)
               .add("drift_error_ppm", drift.error * 1e6)
               .add("damage", damage)
               .str()
        << '\n';
  } else {
    out << options.out.string() << ": the follower's clock is " << offset * 1e3
        << " ms ahead of the leader's, proven to ± " << middle * 1e3 << " ms (p50), " << p99 * 1e3 << " ms (p99), over "
        << bounds.size() << " s, and drifts by " << text_of(drift) << "\n";
    if (std::abs(drift.rate) > kMostDrift && drift.error < kMostDrift) {
      out << "warning: the drift of the clocks probably exceeds the 200 ppm that the proof of the offset assumes\n";
    }
    for (const std::string& sentence : damage) out << sentence << '\n';
  }
}

}  // namespace tendon::replay
