// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/field/field_upload.h"

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/expect.h"
#include "protocol/wire/bounds.h"

namespace tendon {
namespace {

constexpr Duration kAskAgain = std::chrono::milliseconds(100);  ///< after CODE_BUSY

void expect_material(const std::string& name, std::uint32_t material, const Field& field) {
  expect(material < field.materials.size(), name + ".material", material,
         "below " + std::to_string(field.materials.size()) + ", the number of materials");
}

/// encode_manifest() checks the rest.
void expect_usable(const Field& field) {
  const UseField wanted{.materials = field.materials, .fixtures = field.fixtures, .tables = field.tables};
  if (const std::string_view refused = refused_field(wanted); !refused.empty()) {
    throw std::invalid_argument(std::string(refused) + ": expected a value within the bounds of protocol/WIRE.md");
  }
  for (std::size_t i = 0; i < field.bricks.size(); ++i) {
    expect_material("bricks[" + std::to_string(i) + "]", field.bricks[i].material, field);
  }
  for (std::size_t i = 0; i < field.primitives.size(); ++i) {
    expect_material("primitives[" + std::to_string(i) + "]", field.primitives[i].material, field);
  }
  for (std::size_t i = 0; i < field.tables.size(); ++i) {
    expect_material("tables[" + std::to_string(i) + "]", field.tables[i].material, field);
  }
}

}  // namespace

void FieldUpload::use(Field field) {
  expect_usable(field);
  auto next = std::make_unique<Uploaded>(std::move(field));
  if (uploaded_) replaced_.push_back(uploaded_->sender.field());
  std::erase(replaced_, next->sender.field());
  uploaded_ = std::move(next);
  parts_.clear();
  use_.reset();
  retry_ = LocalTime::min();
  progress_.current = false;
  progress_.refused.clear();
}

void FieldUpload::drop() noexcept {
  if (!uploaded_) return;
  replaced_.push_back(uploaded_->sender.field());
  uploaded_.reset();
  used_.reset();
  use_.reset();
  progress_ = {.bricks_sent = progress_.bricks_sent};
}

void FieldUpload::begin() {
  end();
  if (uploaded_) uploaded_ = std::make_unique<Uploaded>(std::move(uploaded_->field));
}

void FieldUpload::end() noexcept {
  replaced_.clear();
  parts_.clear();
  use_.reset();
  used_.reset();
  generation_ = 0;
  retry_ = LocalTime::min();
  progress_ = {.bricks_sent = progress_.bricks_sent};
}

void FieldUpload::take(LocalTime now, const FieldStatus& status, Duration round_trip) {
  if (uploaded_) uploaded_->sender.take(now, status, round_trip);
}

void FieldUpload::take(LocalTime now, const Session::RequestAnswered& answered) {
  const bool of_part = std::erase(parts_, answered.id) > 0;
  const bool of_use = answered.id == use_;
  if (of_use) use_.reset();
  if ((!of_part && !of_use) || (of_part && answered.code == Code::kOk)) return;
  if (answered.code == Code::kBusy) {  // the sender offers the field again if it gets no status
    retry_ = now + kAskAgain;
  } else if (answered.code != Code::kOk) {
    progress_.refused = answered.detail.empty() ? "the server has refused the field" : answered.detail;
  } else {
    progress_.generation = generation_;
    progress_.current = true;
    used_ = uploaded_->sender.field();
  }
}

void FieldUpload::turn(LocalTime now, Session& session, std::uint32_t device, std::uint32_t channel, bool holds) {
  holds_ = holds;
  if (!holds) {
    used_.reset();
    use_.reset();
    progress_.generation = 0;
    progress_.current = false;
  }
  std::erase_if(replaced_, [&](const FieldName& field) {
    return used_ != field && session.request(DropField{.field = field}).has_value();
  });
  blocked_ = false;
  if (!busy()) return;
  FieldSender& sender = uploaded_->sender;
  while (const auto part = sender.next_part(now)) {
    const auto id = session.request(*part);
    blocked_ = !id;
    if (blocked_) return;
    parts_.push_back(*id);
    sender.part_sent();
  }
  if (!holds || !sender.complete() || progress_.current || use_ || now < retry_) return;
  use_ = session.request(UseField{.device = device,
                                  .channel = channel,
                                  .generation = generation_ + 1,
                                  .field = sender.field(),
                                  .materials = uploaded_->field.materials,
                                  .fixtures = uploaded_->field.fixtures,
                                  .tables = uploaded_->field.tables});
  blocked_ = !use_;
  generation_ += use_ ? 1 : 0;
}

bool FieldUpload::send_brick(LocalTime now, Session& session) {
  const auto brick = busy() ? uploaded_->sender.next_brick(now) : std::nullopt;
  if (!brick || !session.send(*brick)) return false;
  ++progress_.bricks_sent;
  return true;
}

LocalTime FieldUpload::due() const noexcept {
  if (!busy() || blocked_) return LocalTime::max();
  const bool waits = holds_ && uploaded_->sender.complete() && !progress_.current && !use_;
  return waits ? retry_ : uploaded_->sender.due();
}

}  // namespace tendon
