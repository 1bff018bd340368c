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

/// A network of simulated links between one server and its clients: what one end sends, the other receives when an
/// injector says so. Each client has a link of its own (they count from 0 in the order of `open`), and each direction
/// of it a decider of its own, so no client disturbs another's fates.
///
/// A client whose source port is changed by its NAT (`rebinds`) is a stranger to the server from then on, and what the
/// server sends to the port before finds nobody.
///
/// Counted, and an identity at any time: sent + copies = delivered + lost + nowhere + in flight.
///
/// No allocation per datagram once warm. Thread-safe: no.
class Network {
 public:
  struct Weather {
    injector::Profile up;    ///< client to server
    injector::Profile down;  ///< server to client
  };
  /// Decides instead of an injector where it returns one: a recorded network.
  using Players = std::function<std::unique_ptr<injector::Decider>(injector::Direction, std::uint32_t link)>;
  /// A datagram that comes to the server or to a client.
  struct Arrival {
    injector::Direction direction;
    std::uint32_t link;
    std::span<const std::byte> datagram;
    bool whole;  ///< as it was sent
  };
  /// Sees every decision.
  using Watch = std::function<void(injector::Direction, std::uint32_t link, const injector::Decision&)>;

  struct Counts {
    std::uint64_t sent = 0;
    std::uint64_t copies = 0;  ///< duplicates and stale replays made on the way
    std::uint64_t delivered = 0;
    std::uint64_t lost = 0;
    std::uint64_t nowhere = 0;  ///< to an address where nobody is (any more)
  };

  Network(std::uint64_t seed, const Weather& weather, const Address& server, Players players = {});
  ~Network();

  /// The server's end.
  Link& server();
  /// A client's end. Opened again at the same address it is the same link, with an empty inbox. Lives as long as the
  /// network.
  Link& open(const Address& address);

  /// Another weather from `now` on, on every link that an injector decides about.
  void change(const Weather& weather, LocalTime now);

  /// Moves the clock: datagrams due by `now` are in the inboxes after it.
  void deliver(LocalTime now);
  /// When the next datagram arrives; empty when none is on its way.
  std::optional<LocalTime> next_arrival() const { return flight_.next_wake(); }

  /// When the last of those that were ever sent has come at the latest. One that is lost counts if it would have come
  /// later than that by kLongWait: where the order is kept, those sent after it wait for its turn all the same. A shorter
  /// wait is within the 600 ms of recovery_promise().
  LocalTime latest_arrival() const noexcept {
    constexpr Duration kLongWait = std::chrono::milliseconds(300);
    return latest_of_lost_ > latest_arrival_ + kLongWait ? latest_of_lost_ : latest_arrival_;
  }

  /// Since the last call, something has arrived at the server, or at the client of this link.
  bool take_news_of_server();
  bool take_news_of(std::uint32_t link);
  /// Datagrams that have arrived and were not taken out.
  std::size_t unread_by_server() const;
  std::size_t unread_by(std::uint32_t link) const;
  /// Datagrams that have come to the server, to a client, so far.
  std::uint64_t arrived_at_server() const;
  std::uint64_t arrived_at(std::uint32_t link) const;
  /// Datagrams on their way from a client to the server.
  std::size_t on_their_way_up(std::uint32_t link) const;

  /// Puts bytes into the inbox of `to` at once, as if they came from `from`: forgeries and garbage.
  void forge(const Address& from, const Address& to, std::span<const std::byte> datagram);

  /// The address of a client as the server sees it now.
  Address outside(std::uint32_t link) const;

  const Counts& counts() const noexcept { return counts_; }
  std::size_t in_flight() const noexcept { return flight_.size(); }
  void watch(Watch watch) { watch_ = std::move(watch); }
  /// Called with each that comes, before whom it comes to can read it; not with forgeries.
  void watch_arrivals(std::function<void(const Arrival&)> watch) { watch_arrivals_ = std::move(watch); }

 private:
  class End;
  struct Way {
    std::unique_ptr<injector::Decider> decider;
    injector::Injector* injector = nullptr;  ///< the decider, when it is one
    std::unique_ptr<injector::History> history;
  };
  struct Client;
  struct Tag {
    std::uint32_t link = 0;
    injector::Direction direction{};
    std::uint16_t port = 0;  ///< of the client, as the server sees it
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
  LocalTime latest_of_lost_{};  ///< would have come
  Counts counts_;
};

}  // namespace tendon::simulation
