// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/proxy/flight.h"

namespace tendon::simulation {

/// The links between a server and its clients. Each client has its own link (numbered from 0 in the order of `open`),
/// and each direction its own decider, so clients do not affect each other. After a NAT rebinding (`rebinds`) the
/// server sees an unknown source address, and datagrams sent to the old port are dropped.
///
/// Invariant of the counters: sent + copies = delivered + lost + nowhere + in flight.
///
/// No allocation per datagram once warm. Thread-safe: no.
class Network {
 public:
  struct Weather {
    injector::Profile up;    ///< client to server
    injector::Profile down;  ///< server to client
  };
  /// Returns a decider that replays a recorded network, or null to use an injector.
  using Players = std::function<std::unique_ptr<injector::Decider>(injector::Direction, std::uint32_t link)>;
  struct Arrival {
    injector::Direction direction;
    std::uint32_t link;
    std::span<const std::byte> datagram;
    bool whole;  ///< not damaged in transit
  };
  using Watch = std::function<void(injector::Direction, std::uint32_t link, const injector::Decision&)>;

  struct Counts {
    std::uint64_t sent = 0;
    std::uint64_t copies = 0;  ///< duplicates and stale replays made in transit
    std::uint64_t delivered = 0;
    std::uint64_t lost = 0;
    std::uint64_t nowhere = 0;  ///< sent to an address without a receiver
  };

  Network(std::uint64_t seed, const Weather& weather, const Address& server, Players players = {});
  ~Network();

  Link& server();
  /// Opening an address again returns the same link with an empty inbox. Lives as long as the network.
  Link& open(const Address& address);

  /// The weather applies to every link that uses an injector.
  void change(const Weather& weather, LocalTime now);

  /// Datagrams due by `now` are in the inboxes afterwards.
  void deliver(LocalTime now);
  std::optional<LocalTime> next_arrival() const { return flight_.next_wake(); }

  /// Upper bound over all datagrams sent so far. A lost one counts if it would have arrived more than kLongWait later:
  /// with order preserved, later datagrams wait for its slot. A shorter wait fits into the 600 ms of
  /// recovery_promise().
  LocalTime latest_arrival() const noexcept {
    constexpr Duration kLongWait = std::chrono::milliseconds(300);
    return latest_of_lost_ > latest_arrival_ + kLongWait ? latest_of_lost_ : latest_arrival_;
  }

  /// A datagram arrived at the server (or at this link's client) since the last call.
  bool take_news_of_server();
  bool take_news_of(std::uint32_t link);
  std::size_t unread_by_server() const;
  std::size_t unread_by(std::uint32_t link) const;
  std::uint64_t arrived_at_server() const;
  std::uint64_t arrived_at(std::uint32_t link) const;
  std::size_t on_their_way_up(std::uint32_t link) const;

  /// Puts bytes into the inbox of `to` immediately.
  void forge(const Address& from, const Address& to, std::span<const std::byte> datagram);

  Address outside(std::uint32_t link) const;

  const Counts& counts() const noexcept { return counts_; }
  std::size_t in_flight() const noexcept { return flight_.size(); }
  void watch(Watch watch) { watch_ = std::move(watch); }
  /// Before the receiver can read the datagram. Forged ones are not reported.
  void watch_arrivals(std::function<void(const Arrival&)> watch) { watch_arrivals_ = std::move(watch); }

 private:
  class End;
  struct Way {
    std::unique_ptr<injector::Decider> decider;
    injector::Injector* injector = nullptr;  ///< the decider if it is an injector, else null
    std::unique_ptr<injector::History> history;
  };
  struct Client;
  struct Tag {
    std::uint32_t link = 0;
    injector::Direction direction{};
    std::uint16_t port = 0;  ///< of the client, as seen by the server
    bool damaged = false;    ///< unless it is a copy
  };

  Way make_way(injector::Direction direction, std::uint32_t link);
  void launch_up(std::uint32_t link, std::span<const std::byte> datagram);
  void launch_down(const Address& to, std::span<const std::byte> datagram);
  void launch(Way& way, Tag tag, const injector::Decision& decision, std::span<const std::byte> datagram);

  std::uint64_t seed_;
  Weather weather_;
  Address server_address_;
  Players players_;
  Watch watch_;
  std::function<void(const Arrival&)> watch_arrivals_;
  LocalTime now_{};
  std::unique_ptr<End> server_;
  std::vector<std::unique_ptr<Client>> clients_;
  injector::Flight<Tag> flight_;
  LocalTime latest_arrival_{};
  LocalTime latest_of_lost_{};  ///< the time when the last lost datagram would have arrived
  Counts counts_;
};

}  // namespace tendon::simulation
