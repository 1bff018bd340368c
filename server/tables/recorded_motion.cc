// SPDX-License-Identifier: Apache-2.0
#include "server/tables/recorded_motion.h"

#include <cmath>
#include <string>
#include <variant>

#include "core/base/expect.h"
#include "server/tables/table_reader.h"

namespace tendon {

ScriptedMotion::Recorded load_recorded_motion(std::istream& csv, const RecordedMotionFile& file) {
  expect(std::isfinite(file.scale) && file.scale != 0, "recorded.scale", file.scale, "a number that is not 0");
  TableReader table(csv, file.path.string());
  const auto index_of = [&table](const RecordedMotionFile::Column& column) {
    const auto* const index = std::get_if<std::size_t>(&column);
    return index != nullptr ? *index : table.index_of(std::get<std::string>(column));
  };
  const TableReader::Column time = table.column(index_of(file.time), "s");
  const TableReader::Column position{.index = index_of(file.position)};

  ScriptedMotion::Recorded motion{{}, file.origin, file.direction, file.at_end};
  while (table.next_row()) {
    const ScriptedMotion::Recorded::Sample sample{table.needed_number(time),
                                                  table.needed_number(position) * file.scale};
    if (!motion.samples.empty() && !(sample.t > motion.samples.back().t)) {
      table.fail("expected a time later than that of the previous sample, found '" +
                 std::string(table.text(time.index)) + "'");
    }
    if (motion.samples.size() == kMaxRecordedSamples) {
      table.fail("expected at most " + std::to_string(kMaxRecordedSamples) + " samples, found more");
    }
    motion.samples.push_back(sample);
  }
  if (motion.samples.size() < 2) {
    table.fail("expected 2 samples or more, found " + std::to_string(motion.samples.size()));
  }
  return motion;
}

}  // namespace tendon
