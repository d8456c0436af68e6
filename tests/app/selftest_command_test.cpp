// SPDX-License-Identifier: Apache-2.0
// What a user asks of the program itself; what it asks is tested in tests/hardcases.
#include "command.h"

#include <gtest/gtest.h>

namespace velatura::test {

TEST(SelftestCommand, SaysInPlainWordsWhatWasChecked) {
    const Workplace w;
    const CommandResult r = w.velatura("selftest");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    for (const char* said : {"passed  Do rays slip through between adjacent triangles?",
                             "must be 0", "16 of 16 checks passed"})
        EXPECT_NE(r.output.find(said), std::string::npos) << said << "\n" << r.output;
    EXPECT_EQ(r.output.find("FAILED"), std::string::npos) << r.output;
}

TEST(SelftestCommand, IsForProgramsAsWell) {
    const Workplace w;
    const CommandResult r = w.velatura("selftest --json --amount 2");
    EXPECT_EQ(r.exit_code, 0);
    EXPECT_TRUE(r.output.starts_with("[")) << r.output;
    EXPECT_NE(r.output.find("\"case\": \"H01\""), std::string::npos);
    EXPECT_EQ(r.output.find("\"passed\": false"), std::string::npos) << r.output;
    EXPECT_EQ(w.velatura("selftest --amount 0").exit_code, 2);
}

}  // namespace velatura::test
