// SPDX-License-Identifier: Apache-2.0
#include <istream>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <variant>

#include "server/recording/recording_codec.h"
#include "server/recording/recording_reader.h"
#include "tests/fuzz/target.h"

// Every sequence of bytes must yield records and then the end, or an error. Encoding must not change a record.

using namespace tendon;

namespace {

void require_same_again(const RecordingReader::Record& record, const SolverPaths& ways) {
  if (const auto* scene = std::get_if<SceneRecord>(&record)) {
    fuzz::require(recording::decode_scene(recording::encode(*scene)) == *scene);
  } else if (const auto* step = std::get_if<StepRecord>(&record)) {
    // The bytes are compared, because NaN is not equal to itself.
    const auto bytes = recording::encode(*step, ways.name_of(step->force_way));
    SolverPaths own;
    const StepRecord again = recording::decode_step(bytes, step->hand.at, own);
    fuzz::require(recording::encode(again, own.name_of(again.force_way)) == bytes);
  } else if (const auto* datagram = std::get_if<DatagramRecord>(&record)) {
    const auto bytes = recording::encode(*datagram);
    fuzz::require(recording::encode(recording::decode_datagram(bytes, datagram->at)) == bytes);
  } else if (const auto* loss = std::get_if<LossRecord>(&record)) {
    fuzz::require(recording::decode_loss(recording::encode(*loss), loss->at) == *loss);
  } else if (const auto* input = std::get_if<FieldInput>(&record)) {
    const auto bytes = recording::encode(*input);
    fuzz::require(recording::encode(recording::decode_field_input(bytes, input->at)) == bytes);
  } else if (const auto* data = std::get_if<FieldData>(&record)) {
    const auto bytes = recording::encode(*data);
    fuzz::require(recording::encode(recording::decode_field_data(bytes, data->at)) == bytes);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::InputBuffer bytes(std::as_bytes(std::span(data, size)));
  try {
    RecordingReader reader(std::make_unique<std::istream>(&bytes), "r");
    while (const auto record = reader.next()) require_same_again(*record, reader.ways());
  } catch (const std::runtime_error& refused) {
    fuzz::require(std::string_view(refused.what()).starts_with("r: "));
  }
  return 0;
}
