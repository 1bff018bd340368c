// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>

#include <string>
#include <utility>

#include "protocol/link.h"

// Non-blocking IPv4 sockets, for bridges whose protocols only support IPv4. Thread-safe: yes, except Descriptor.
// Realtime-safe: no.

namespace tendon::bridge {

/// An owned file descriptor.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();
  int number() const noexcept { return number_; }
  explicit operator bool() const noexcept { return number_ >= 0; }

 private:
  int number_ = -1;
};

std::string words_of(int error);  ///< of errno

sockaddr_in socket_address(const Address& address);  ///< `address` must be IPv4
Address address_of(const sockaddr_in& address);
Address local_address(int socket);

Descriptor new_socket(int kind);  ///< SOCK_STREAM or SOCK_DGRAM
bool bind_to(int socket, const Address& address);
/// Listens for connections. Returns an empty Descriptor and sets errno if the address cannot be used.
Descriptor new_listener(const Address& address);
/// Accepts the next connection. Returns an empty Descriptor if none is waiting.
Descriptor accept_next(int listener, Address& from);
/// Sets the options of a TCP connection to a program. The size of the send buffer is set to `unread`. If the machine of
/// the program disappears, the connection is closed after 8 s.
void set_up_stream(int socket, std::size_t unread);

}  // namespace tendon::bridge
