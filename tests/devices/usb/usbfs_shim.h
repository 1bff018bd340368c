// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <thread>

#include "core/base/time.h"
#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/usb/usbfs_node.h"

namespace tendon {

/// A FakeFalcon that uses a usbfs node in this process, in real time. Thread-safe.
class UsbfsShim final : public UsbfsNode {
 public:
  explicit UsbfsShim(const FakeFalcon::Options& options);
  ~UsbfsShim() override;

  /// Negative if nothing is plugged in.
  int node() const;

  void unplug();
  void plug();

  /// These are errors of USB transfers, not faults of the device.
  enum class Trouble {
    kNone,
    kOverflow,  ///< IN: more data than requested
    kStall,     ///< IN: the endpoint is halted
    kMute,      ///< IN: contains neither data nor the chip status
    kHang,      ///< OUT: never completes
  };
  void set_trouble(Trouble trouble);

  template <class Act>
  auto with(const Act& act) const {
    const std::lock_guard lock(mutex_);
    return act(falcon_);
  }

 private:
  bool gone() const override { return !falcon_.plugged(); }
  std::span<const std::uint8_t> descriptors() const override { return falcon_.descriptors(); }
  bool request(std::uint8_t request, std::uint16_t value) override;
  Taken write(std::span<const std::uint8_t> bytes) override;
  void awaited() override { changed_.notify_all(); }

  void run();
  void let_in(LocalTime now);
  void make_node();

  std::condition_variable changed_;
  mutable FakeFalcon falcon_;
  Trouble trouble_ = Trouble::kNone;
  int master_ = -1;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace tendon
