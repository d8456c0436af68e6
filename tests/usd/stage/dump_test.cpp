// SPDX-License-Identifier: Apache-2.0
// Facts that no stored dump of tests/conformance has an example of.
#include "usd/stage/dump.h"

#include "stage_fixture.h"

#include <gtest/gtest.h>

namespace velatura::usd::stage {
namespace {

using DumpTest = StageTest;

TEST_F(DumpTest, OrdersOfNamesAreLists) {
    open("def \"P\" {\n reorder nameChildren = [\"c\", \"a\"]\n def \"a\" {}\n def \"c\" {}\n }\n");
    const std::string dump = dump_stage(stage());
    EXPECT_NE(dump.find("/P meta primOrder = [\"c\", \"a\"]\n"), std::string::npos) << dump;
}

TEST_F(DumpTest, ListsOfUnknownMetadataPrintTheirEdits) {
    // Between parentheses nameChildren is a name like any other
    open("def \"P\" ( reorder nameChildren = [\"c\", \"a\"]\n prepend mine = [1, 2] ) {}\n");
    const std::string dump = dump_stage(stage());
    constexpr const char* expected[] = {
        R"(/P meta mine = <prepend=[<SdfUnregisteredValue>"1", <SdfUnregisteredValue>"2"]>)",
        R"(/P meta nameChildren = <order=[<SdfUnregisteredValue>"\"c\"", )"
        R"(<SdfUnregisteredValue>"\"a\""]>)"};
    for (const char* line : expected)
        EXPECT_NE(dump.find(line), std::string::npos) << line << "\n" << dump;
    EXPECT_EQ(dump.find('?'), std::string::npos) << dump;
}

}  // namespace
}  // namespace velatura::usd::stage
