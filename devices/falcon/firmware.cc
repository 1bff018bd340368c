// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/firmware.h"

#include <sodium.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace tendon::falcon {
namespace {

using namespace usb::ftdi;  // NOLINT(google-build-using-namespace): all requests below are from it

constexpr std::size_t kLeastBytes = 4096;
constexpr std::size_t kMostBytes = 65536;
constexpr std::array<std::uint8_t, 2> kBootKey = {0xAA, 0x08};

struct KnownFile {
  std::string_view name;
  std::string_view sha256;
};

/// From a checkout of libnifalcon.
constexpr std::array kKnownFiles = {
    KnownFile{"nvent_firmware.bin", "1119e39c39fab1f37678ea62dfc715b23dd86ee7f13d78f88f707d9f09b896a1"},
    KnownFile{"test_firmware.bin", "b2700d5cd5ca217e48565fb4de5a502a636c53f6e01ebd0cad193e9f84856c6a"},
};

std::string sha256_of(std::span<const std::uint8_t> bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> hash{};
  crypto_hash_sha256(hash.data(), bytes.data(), bytes.size());
  std::string text(2 * hash.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), hash.data(), hash.size());
  text.pop_back();
  return text;
}

/// DTR resets the processor. With a shorter latency "firmware checks tend to always fail" (libnifalcon).
constexpr std::array kResetToLoader = {kPurgeOne,      kPurgeOther, latency(16), divisor(0x4138), k8N1,
                                       kNoFlowControl, kRtsLow,     kDtrLow,     kDtrHigh};
constexpr std::array<std::uint8_t, 3> kGreeting = {0x0A, 0x43, 0x0D};
/// The first byte is sometimes missing.
constexpr std::array<std::uint8_t, 5> kAnswer = {0x00, 0x0A, 0x44, 0x2C, 0x0D};
constexpr int kMostGreetings = 100;

constexpr std::array kFaster = {kDtrLow, divisor(0x15)};
constexpr std::array<std::uint8_t, 1> kAutobaudLetter = {'A'};

/// The echo of this many bytes fits into one IN packet with its status bytes.
constexpr std::size_t kChunkBytes = usb::kPacketSize - kStatusBytes;

constexpr Duration kPatience = std::chrono::milliseconds(100);  ///< 4 bytes at 9600 baud and the latency timer: 20 ms

}  // namespace

std::vector<std::uint8_t> check_firmware(std::vector<std::uint8_t> bytes, const std::string& name,
                                         UnknownFirmware unknown) {
  const auto refuse = [&name](const std::string& sentence) { throw std::runtime_error(name + ": " + sentence); };
  if (bytes.size() < kLeastBytes || bytes.size() > kMostBytes) {
    refuse("expected the Falcon's firmware, a file of " + std::to_string(kLeastBytes) + " to " +
           std::to_string(kMostBytes) + " bytes, found " +
           (bytes.size() > kMostBytes ? "more" : std::to_string(bytes.size()) + " bytes"));
  }
  if (!std::equal(kBootKey.begin(), kBootKey.end(), bytes.begin())) {
    refuse("expected the Falcon's firmware, which starts with the bytes AA 08, found other bytes");
  }
  if (unknown == UnknownFirmware::kAccept) return bytes;
  const std::string sha256 = sha256_of(bytes);
  if (std::ranges::find(kKnownFiles, std::string_view(sha256), &KnownFile::sha256) == kKnownFiles.end()) {
    std::string known;
    for (const KnownFile& file : kKnownFiles) known.append(known.empty() ? "" : ", ").append(file.name);
    refuse("expected one of the files that are known to work (" + known + "), found another one, with the SHA-256 " +
           sha256 + "; if you trust its source, accept it explicitly");
  }
  return bytes;
}

std::vector<std::uint8_t> read_firmware(std::istream& file, const std::string& name, UnknownFirmware unknown) {
  std::vector<std::uint8_t> bytes(kMostBytes + 1);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (file.bad()) throw std::runtime_error(name + ": cannot read the rest of the firmware file");
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return check_firmware(std::move(bytes), name, unknown);
}

void FirmwareLoader::enter(Stage stage) noexcept {
  stage_ = stage;
  said_ = false;
  heard_size_ = 0;
  too_much_ = false;
}

void FirmwareLoader::restart() noexcept {
  setup_ = Setup(kResetToLoader);
  sent_ = 0;
  greetings_ = 0;
  enter(Stage::kReset);
}

void FirmwareLoader::receive(std::span<const std::uint8_t> bytes) noexcept {
  const std::size_t count = std::min(bytes.size(), heard_.size() - heard_size_);
  std::copy_n(bytes.begin(), count, heard_.begin() + static_cast<std::ptrdiff_t>(heard_size_));
  heard_size_ += count;
  if (count < bytes.size()) too_much_ = true;
}

void FirmwareLoader::say(LocalTime now, std::span<const std::uint8_t> bytes, usb::Pipe& pipe) noexcept {
  heard_size_ = 0;
  too_much_ = false;
  said_ = pipe.write(bytes);
  since_ = now;
}

bool FirmwareLoader::heard(std::span<const std::uint8_t> bytes) const noexcept {
  return !too_much_ && std::ranges::equal(std::span(heard_).first(heard_size_), bytes);
}

std::span<const std::uint8_t> FirmwareLoader::chunk() const noexcept {
  return image_.subspan(sent_, std::min(kChunkBytes, image_.size() - sent_));
}

FirmwareLoader::Progress FirmwareLoader::step(LocalTime now, usb::Pipe& pipe) noexcept {
  const bool out_of_patience = said_ && now - since_ >= kPatience;
  switch (stage_) {
    case Stage::kReset:
      if (setup_.step(pipe)) enter(Stage::kGreet);
      break;
    case Stage::kGreet:
      if (said_ && (heard(kAnswer) || heard(std::span(kAnswer).subspan(1)))) {
        setup_ = Setup(kFaster);
        enter(Stage::kSpeedUp);
      } else if (!said_ || out_of_patience) {
        if (greetings_ == kMostGreetings) {
          enter(Stage::kFailed);
          break;
        }
        say(now, kGreeting, pipe);
        if (said_) ++greetings_;
      }
      break;
    case Stage::kSpeedUp:
      if (setup_.step(pipe)) enter(Stage::kAutobaud);
      break;
    case Stage::kAutobaud:
      if (!said_) {
        say(now, kAutobaudLetter, pipe);
      } else if (heard(kAutobaudLetter)) {
        enter(Stage::kSend);
      } else if (out_of_patience) {
        enter(Stage::kFailed);
      }
      break;
    case Stage::kSend:
      if (said_ && heard(chunk())) {
        sent_ += chunk().size();
        said_ = false;
        if (sent_ == image_.size()) enter(Stage::kDone);
      } else if (said_ && (heard_size_ >= chunk().size() || out_of_patience)) {
        enter(Stage::kFailed);
      }
      if (stage_ == Stage::kSend && !said_) say(now, chunk(), pipe);
      break;
    case Stage::kDone:
    case Stage::kFailed:
      break;
  }
  if (stage_ == Stage::kDone) return Progress::kDone;
  return stage_ == Stage::kFailed ? Progress::kFailed : Progress::kBusy;
}

}  // namespace tendon::falcon
