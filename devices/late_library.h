// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace tendon {

/// Loads a shared library at construction; it stays loaded until the process ends. A program that seldom needs a
/// library is not linked with it, so that only scenes that use the library spend memory on it and its dependencies.
///
///     struct Libusb {
///       LateLibrary file{"libusb-1.0.so.0"};
///       decltype(&::libusb_init) init = file["libusb_init"];
///     };
///
/// Names are resolved as for a linked library: a preloaded library takes precedence.
///
/// Thread-safe: yes. Realtime-safe: no.
class LateLibrary {
 public:
  /// The address of an exported function. It converts to any function pointer without a check, so take the type from
  /// the header of the library.
  class Function {
   public:
    template <class Signature>
    operator Signature*() const noexcept {  // NOLINT(google-explicit-constructor): reads as a declaration
      return reinterpret_cast<Signature*>(at_);
    }

   private:
    friend class LateLibrary;
    explicit Function(void* at) : at_(at) {}
    void* at_;
  };

  /// `file` includes the version of the interface, as in "libusb-1.0.so.0". Throws std::runtime_error if it cannot be
  /// loaded: "libusb-1.0.so.0: cannot open shared object file: No such file or directory; expected it to be installed".
  explicit LateLibrary(const std::string& file);

  /// Throws std::runtime_error if the library does not export this name.
  Function operator[](const char* name) const;
};

}  // namespace tendon
