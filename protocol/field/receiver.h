// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "protocol/field/brick_store.h"
#include "protocol/field/messages.h"
#include "protocol/messages.h"

namespace tendon {

/// Receives the fields of one client. It verifies the hashes of manifests and bricks, and reports the missing bricks. A
/// brick can be received before the manifest is complete, but not before its entry. A field that is not ready is dropped
/// if nothing new is received for `expiry`.
/// The constructor allocates `offers` · 27 kB. Otherwise, only error messages allocate memory. Thread-safe: no.
class FieldReceiver {
 public:
  struct Config {
    BrickStore::Owner owner = 0;
    std::size_t offers = 3;  ///< maximum number of fields
    double bytes_per_s = 500e3;
    Duration burst = std::chrono::seconds(1);  ///< allows for delays of the network
    Duration period = std::chrono::milliseconds(50);
    Duration expiry = std::chrono::seconds(30);
  };

  /// Explains why a part or a brick was refused. The text contains the hash of the field or brick and the bound.
  struct Refusal {
    Code code = Code::kInvalid;
    std::string detail;  ///< at most limits::kMaxDetail bytes
  };

  /// `store` must outlive the receiver. Throws std::invalid_argument if a number of `config` is not positive, or if the
  /// store does not have the owner.
  FieldReceiver(const Config& config, BrickStore& store);

  /// Parts must be in order, and copies are ignored. If the manifest is invalid, the field is dropped.
  std::optional<Refusal> take(LocalTime now, const OfferField& part);
  std::optional<Refusal> take(LocalTime now, const FieldBrick& brick);

  /// Returns the status of the next field if it is due: each `period` while something is missing, then each second.
  std::optional<FieldStatus> next_status(LocalTime now);
  LocalTime due() const noexcept;  ///< when next_status() should be called; LocalTime::max() without offers

  bool has(const FieldName& field) const noexcept;  ///< true if the field was offered and not dropped

  /// Returns the manifest if all bricks were available at the time of the last status, or nullopt.
  std::optional<FieldManifest> ready(const FieldName& field) const noexcept;
  /// Returns null if the brick is not available.
  const BrickBytes* brick(BrickStore::Hash hash) const noexcept { return store_.find(config_.owner, hash); }
  bool drop(const FieldName& field) noexcept;  ///< false if there is no such field

  std::size_t offers() const noexcept;

 private:
  struct Offer {
    bool open = false;
    FieldName field{};
    std::vector<std::byte> bytes;  ///< FieldManifest::kMost
    std::size_t size = 0;
    std::size_t received = 0;
    std::size_t missing = 0;  ///< number of missing bricks
    bool ready = false;
    int told = 0;  ///< number of statuses after the field was ready
    LocalTime progress{};
    LocalTime status_due{};

    bool whole() const noexcept { return received == size; }
    FieldManifest manifest() const noexcept { return FieldManifest(std::span(bytes).first(received)); }
  };

  void expire(LocalTime now) noexcept;
  std::optional<Refusal> refuse_part(const OfferField& part) const;
  std::optional<Refusal> refuse_head(const Offer& offer) const;
  std::optional<Refusal> refuse_whole(const Offer& offer) const;

  Config config_;
  BrickStore& store_;
  std::vector<Offer> offers_;
  BrickPace pace_;
};

}  // namespace tendon
