// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::pipe_test {
namespace {

// bash keeps the input of the filter open, so there is only an answer if the filter does not wait for the next row.
TEST(TendonLabFilter, AnswersEachRowOfALivePipeBeforeTheNextComes) {
  const std::string script =
      "coproc FILTER { \"$0\" filter --law aol --b 0.26 --fc 0.005; }\n"
      "ask() { echo \"$1\" >&\"${FILTER[1]}\"; IFS= read -r -t 20 answer <&\"${FILTER[0]}\" && echo \"got $answer\"; "
      "}\n"
      "ask t_s,x_m,wanted_n && ask 0,0,-1 && ask 0.001,0.0001,-1 && echo all answered\n";
  const testing::ScratchFolder folder;
  Process bash("/bin/bash", {"-c", script, program("tendon-lab")}, folder.path());
  EXPECT_EQ(bash.wait(), 0) << bash.out() << bash.err();
  EXPECT_NE(bash.out().find("got t_s,x_m,wanted_n,applied_n"), std::string::npos) << bash.out();
  EXPECT_NE(bash.out().find("got 0.001,0.0001,-1,"), std::string::npos) << bash.out();
  EXPECT_NE(bash.out().find("all answered"), std::string::npos) << bash.out();
}

}  // namespace
}  // namespace tendon::e2e::pipe_test
