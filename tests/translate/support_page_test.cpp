// SPDX-License-Identifier: Apache-2.0
// The columns of docs/reference/usd_support.md against translate/schema_support.h.
#include "translate/schema_support.h"
#include "usd/stage/schema_tables.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace velatura::translate {

namespace {

/// By "schema attribute": the column, 2 to 4.
std::map<std::string, size_t> columns_of_page() {
    std::map<std::string, size_t> columns;
    std::ifstream in(std::filesystem::path(VELATURA_SOURCE_DIR) / "docs/reference/usd_support.md");
    for (std::string line; std::getline(in, line);) {
        if (!line.starts_with("| `")) continue;
        std::vector<std::string> cells;
        std::istringstream row(line.substr(1));
        for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
        const std::string schema = cells[0].substr(2, cells[0].rfind('`') - 2);
        for (size_t i = 2; i < cells.size(); ++i) {
            for (size_t at = cells[i].find('`'); at != std::string::npos;) {
                const size_t end = cells[i].find('`', at + 1);
                columns[schema + " " + cells[i].substr(at + 1, end - at - 1)] = i;
                at = cells[i].find('`', end + 1);
            }
        }
    }
    return columns;
}

}  // namespace

TEST(SchemaSupport, ThePageSaysWhatTheTableSays) {
    const auto columns = columns_of_page();
    for (const usd::stage::SchemaAttribute& a : usd::stage::schema_attributes()) {
        const std::string name = std::string(a.schema) + " " + std::string(a.name);
        const auto found = columns.find(name);
        ASSERT_NE(found, columns.end()) << name;
        const Support support = support_of(a.schema, a.name);
        const size_t expected = support == Support::Used ? 2 : support == Support::Warned ? 3 : 4;
        EXPECT_EQ(found->second, expected) << name;
    }
}

TEST(SchemaSupport, ConsequencesBelongToWarnings) {
    for (const UnusedAttribute& row : unused_attributes()) {
        EXPECT_NE(row.support, Support::Used) << row.attribute;
        EXPECT_TRUE(row.consequence.empty() || row.support == Support::Warned) << row.attribute;
    }
}

}  // namespace velatura::translate
