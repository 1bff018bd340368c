// SPDX-License-Identifier: Apache-2.0
// DNS-SD in records of name servers: PTR, SRV and TXT, by the C library's resolver.
#include <arpa/inet.h>
#include <arpa/nameser.h>
#include <netdb.h>
#include <netinet/in.h>
#include <resolv.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "clients/cpp/discovery/discovery.h"

namespace tendon::dns_sd {
namespace {

constexpr std::size_t kMaxAnswer = 65'535;

struct Record {
  std::uint16_t type;
  std::vector<std::byte> data;
  std::size_t at;  ///< offset of the data in the answer
};

struct Answer {
  std::vector<unsigned char> bytes;
  std::vector<Record> records;

  /// The name at `offset` in a record's data, escaped as in zone files. Empty if there is none or its pointers loop.
  std::string name(const Record& record, std::size_t offset) const {
    std::array<char, NS_MAXDNAME> text{};
    const unsigned char* const end = bytes.data() + bytes.size();
    if (offset >= record.data.size() ||
        ns_name_uncompress(bytes.data(), end, bytes.data() + record.at + offset, text.data(), text.size()) < 0) {
      return {};
    }
    return text.data();
  }
};

std::uint16_t two_bytes(const Record& record, std::size_t offset) {
  return static_cast<std::uint16_t>(std::to_integer<unsigned>(record.data[offset]) << 8U |
                                    std::to_integer<unsigned>(record.data[offset + 1]));
}

class Resolver {
 public:
  explicit Resolver(const std::optional<Address>& server) {
    if (res_ninit(&state_) != 0) throw std::runtime_error("cannot start the resolver of the C library");
    state_.retrans = 1;  // s
    state_.retry = 2;
    if (!server) return;
    state_.nscount = 1;
    sockaddr_in& to = state_.nsaddr_list[0];
    to = {};
    to.sin_family = AF_INET;
    to.sin_port = htons(server->port);
    std::memcpy(&to.sin_addr, &server->ip[12], 4);
  }
  ~Resolver() { res_nclose(&state_); }
  Resolver(const Resolver&) = delete;
  Resolver& operator=(const Resolver&) = delete;

  /// Returns the records of a type; empty if the name has none. Throws if no name server gives a usable answer.
  Answer ask(const std::string& name, ns_type type) {
    Answer answer;
    answer.bytes.resize(kMaxAnswer);
    const int size =
        res_nquery(&state_, name.c_str(), ns_c_in, type, answer.bytes.data(), static_cast<int>(answer.bytes.size()));
    if (size < 0) {
      if (state_.res_h_errno == HOST_NOT_FOUND || state_.res_h_errno == NO_DATA) return {};
      refuse(name, state_.res_h_errno == TRY_AGAIN ? "no name server replies" : "the name server refused the request");
    }
    answer.bytes.resize(std::min(answer.bytes.size(), static_cast<std::size_t>(size)));
    ns_msg message;
    if (ns_initparse(answer.bytes.data(), static_cast<int>(answer.bytes.size()), &message) != 0) {
      refuse(name, "the reply of the name server is malformed");
    }
    for (int i = 0; i < ns_msg_count(message, ns_s_an); ++i) {
      ns_rr record;
      if (ns_parserr(&message, ns_s_an, i, &record) != 0) refuse(name, "the reply of the name server is malformed");
      if (ns_rr_type(record) != type) continue;
      const auto* const data = reinterpret_cast<const std::byte*>(ns_rr_rdata(record));
      answer.records.push_back({static_cast<std::uint16_t>(ns_rr_type(record)),
                                std::vector(data, data + ns_rr_rdlen(record)),
                                static_cast<std::size_t>(ns_rr_rdata(record) - answer.bytes.data())});
    }
    return answer;
  }

 private:
  [[noreturn]] static void refuse(const std::string& name, const char* why) {
    throw std::runtime_error("cannot search for " + name + ": " + why +
                             ". Expected DNS-SD records in this domain, or HOST:PORT instead of a name");
  }

  struct __res_state state_ {};
};

/// Returns the hosts of an instance in order of preference: lowest priority first (RFC 2782), then highest weight.
std::vector<Found> hosts_of(Resolver& resolver, const Instance& instance) {
  constexpr std::size_t kTarget = 6;  // after priority, weight, port
  const Answer answer = resolver.ask(full_name(instance), ns_t_srv);
  std::vector<std::pair<std::pair<int, int>, Found>> ranked;
  for (const Record& record : answer.records) {
    const std::string host = answer.name(record, kTarget);
    if (!is_domain(host)) continue;  // ".": the service is not available (RFC 2782)
    Found found{.instance = instance, .host = host, .port = two_bytes(record, 4)};
    ranked.emplace_back(std::pair<int, int>(two_bytes(record, 0), -two_bytes(record, 2)), std::move(found));
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Found> all;
  if (ranked.empty()) return all;
  const Answer texts = resolver.ask(full_name(instance), ns_t_txt);
  const About about = texts.records.empty() ? About{} : read_txt(split_txt(texts.records.front().data));
  for (auto& [rank, found] : ranked) {
    found.about = about;
    all.push_back(std::move(found));
  }
  return all;
}

}  // namespace

std::vector<Found> resolve_by_dns(const Instance& instance, const std::optional<Address>& server) {
  Resolver resolver(server);
  std::vector<Found> all = hosts_of(resolver, instance);
  if (all.empty()) {
    throw std::runtime_error("cannot find dns-sd:" + to_string(instance) + ": the name servers have no SRV record of " +
                             full_name(instance) + ". --server dns-sd:." + instance.domain + " lists all devices");
  }
  return all;
}

std::vector<Found> browse_by_dns(const std::string& domain, const std::optional<Address>& server) {
  Resolver resolver(server);
  const std::string all_of_it = full_name({.name = {}, .domain = domain});
  const Answer answer = resolver.ask(all_of_it, ns_t_ptr);
  std::vector<Found> all;
  for (const Record& record : answer.records) {
    const std::string name = answer.name(record, 0);
    try {
      const Instance instance = parse_instance(name);
      if (instance.name.empty() || instance.domain != std::string(kService) + "." + domain) continue;
      all.push_back({.instance = {instance.name, domain}});
    } catch (const std::invalid_argument&) {
      continue;  // not a valid name
    }
  }
  std::sort(all.begin(), all.end(), [](const Found& a, const Found& b) { return a.instance.name < b.instance.name; });
  for (std::size_t i = 0; i < std::min(all.size(), kDescribed); ++i) {
    const std::vector<Found> hosts = hosts_of(resolver, all[i].instance);
    if (!hosts.empty()) all[i] = hosts.front();
  }
  return all;
}

}  // namespace tendon::dns_sd
