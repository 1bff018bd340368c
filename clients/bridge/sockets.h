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
/// For the TCP connection to a program: no delay, at most `unread` bytes in the kernel that the program has not read,
/// and an error within 8 s if its machine disappears.
void set_up_stream(int socket, std::size_t unread);

}  // namespace tendon::bridge
