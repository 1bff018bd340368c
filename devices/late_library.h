// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace tendon {

/// A shared library that comes into the process when this is made, and stays until the process ends. A program that
/// seldom needs a library is not linked with it: the library's pages, and those of all that it needs itself, are then
/// taken by the scenes that list what it is for.
///
///     struct Libusb {
///       LateLibrary file{"libusb-1.0.so.0"};
///       decltype(&::libusb_init) init = file["libusb_init"];
///     };
///
/// Names are looked up as the dynamic linker looks them up for a program that is linked: a preloaded library comes first.
///
/// Thread-safe: yes. Realtime-safe: no.
class LateLibrary {
 public:
  /// What a library exports. It becomes a pointer to a function of the type that the caller declares, which nobody
  /// checks: take the type from the library's header.
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

  /// `file`: its name with its version of the interface, as in "libusb-1.0.so.0". Throws std::runtime_error when there
  /// is none: "libusb-1.0.so.0: cannot open shared object file: No such file or directory; expected it to be
  /// installed".
  explicit LateLibrary(const std::string& file);

  /// Throws std::runtime_error when the library exports nothing by this name.
  Function operator[](const char* name) const;
};

}  // namespace tendon
