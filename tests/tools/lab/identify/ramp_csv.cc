// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/ramp_csv.h"

#include <cstddef>
#include <fstream>

#include "server/machine/regular_file.h"
#include "server/tables/table_reader.h"

namespace tendon::lab {
namespace {

constexpr std::size_t kMaxRows = 4'000'000;  // this is more than an hour at 1 kHz

}  // namespace

RampRun read_ramp_csv(std::istream& in, const std::string& name, Freedom freedom) {
  TableReader table(in, name);
  const FreedomInfo& columns = info(freedom);
  const TableReader::Column t = table.column("t_s");
  const TableReader::Column position = table.column(columns.position);
  const TableReader::Column effort = table.column(columns.effort);
  RampRun run;
  while (table.next_row()) {
    const RampSample sample{table.needed_number(t), table.needed_number(position), table.needed_number(effort)};
    if (!run.samples.empty() && !(sample.t > run.samples.back().t)) {
      table.fail("expected a time after that of the previous row, found '" + std::string(table.text(t.index)) + "'");
    }
    if (run.samples.size() == kMaxRows)
      table.fail("expected at most " + std::to_string(kMaxRows) + " rows, found more");
    run.samples.push_back(sample);
  }
  return run;
}

RampRun load_ramp_csv(const std::filesystem::path& file, Freedom freedom) {
  std::ifstream in = open_regular_file(file, "ramp run");
  return read_ramp_csv(in, file.string(), freedom);
}

}  // namespace tendon::lab
