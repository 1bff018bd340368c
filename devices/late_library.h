// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace tendon {

/// Loads a shared library, which is never unloaded. This saves the memory of libraries that most scenes do not need.
///
///     struct Libusb {
///       LateLibrary file{"libusb-1.0.so.0"};
///       decltype(&::libusb_init) init = file["libusb_init"];
///     };
///
/// Preloaded libraries take precedence, as for linked libraries. Thread-safe: yes. Realtime-safe: no.
class LateLibrary {
 public:
  /// Converts to any function pointer without checking the type. Use the types in the header of the library.
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

  /// `file` must include the version of the interface. Throws std::runtime_error on failure: "libusb-1.0.so.0: cannot
  /// open shared object file: No such file or directory; expected it to be installed".
  explicit LateLibrary(const std::string& file);

  /// Throws std::runtime_error if there is no such function.
  Function operator[](const char* name) const;
};

}  // namespace tendon
