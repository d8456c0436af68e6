// SPDX-License-Identifier: Apache-2.0
#include "base/diagnostics.h"

#include "base/tasks.h"

#include <gtest/gtest.h>

namespace velatura {

namespace {

TEST(Diagnostics, FormatIsClickable) {
    Diagnostics diagnostics;
    const uint32_t file = diagnostics.file_id("lamp.usda");
    const Diagnostic d{Severity::Error,
                       "usd-unresolved-prim-path",
                       {file, 41, 9},
                       "/World/Lamp_03",
                       "reference target </Lamp> not found in @bulb.usda@",
                       {"bulb.usda has no defaultPrim"}};
    EXPECT_EQ(diagnostics.format(d),
              "lamp.usda:41:9: error: reference target </Lamp> not found in @bulb.usda@ "
              "[usd-unresolved-prim-path]\n  note: at </World/Lamp_03>\n  note: bulb.usda has no "
              "defaultPrim");
}

TEST(Diagnostics, FormatWithoutPlace) {
    Diagnostics diagnostics;
    EXPECT_EQ(diagnostics.format({Severity::Warning, "c", {}, "", "m", {}}), "warning: m [c]");
    const uint32_t file = diagnostics.file_id("a.usda");
    EXPECT_EQ(diagnostics.format({Severity::Note, "c", {file, 0, 0}, "", "m", {}}),
              "a.usda: note: m [c]");
}

TEST(Diagnostics, FilesAreInternedFromOne) {
    Diagnostics diagnostics;
    EXPECT_EQ(diagnostics.file_id("a"), 1u);
    EXPECT_EQ(diagnostics.file_id("b"), 2u);
    EXPECT_EQ(diagnostics.file_id("a"), 1u);
    EXPECT_EQ(diagnostics.file_name(2), "b");
    EXPECT_EQ(diagnostics.file_name(0), "");
    EXPECT_EQ(diagnostics.file_name(3), "");
}

TEST(Diagnostics, CountsBySeverityAndKeepsTheOrder) {
    Diagnostics diagnostics;
    diagnostics.warn("w", {}, "", "first");
    diagnostics.error("e", {}, "", "second");
    diagnostics.note("n", {}, "", "third");
    EXPECT_EQ(diagnostics.error_count(), 1u);
    EXPECT_EQ(diagnostics.warning_count(), 1u);
    const std::vector<Diagnostic> all = diagnostics.all();
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[0].message, "first");
    EXPECT_EQ(all[2].message, "third");
}

TEST(Diagnostics, RepeatsAreStoredOnce) {
    Diagnostics diagnostics;
    int heard = 0;
    diagnostics.set_listener([&](const Diagnostic&) { ++heard; });
    for (int i = 0; i < 5; ++i) diagnostics.warn("w", {1, 2, 3}, "/A", "same");
    diagnostics.warn("w", {1, 2, 4}, "/A", "same");
    diagnostics.warn("w", {1, 2, 3}, "/B", "same");
    EXPECT_EQ(diagnostics.all().size(), 3u);
    EXPECT_EQ(heard, 3);
}

TEST(Diagnostics, AFloodOfOneCodeKeepsItsFirstEntriesAndACount) {
    Diagnostics diagnostics;
    const size_t extra = 7;
    for (size_t i = 0; i < Diagnostics::per_code_limit + extra; ++i) {
        diagnostics.warn("flood", {}, "", std::to_string(i));
    }
    diagnostics.warn("other", {}, "", "still heard");
    EXPECT_EQ(diagnostics.all().size(), Diagnostics::per_code_limit + 1);
    EXPECT_EQ(diagnostics.dropped().at("flood"), extra);
    EXPECT_EQ(diagnostics.all().back().message, "still heard");
}

TEST(Diagnostics, TakesReportsFromManyThreads) {
    Diagnostics diagnostics;
    const ThreadLimit threads(4);
    parallel_for(800, [&](size_t i) { diagnostics.error("e", {}, "", std::to_string(i)); });
    EXPECT_EQ(diagnostics.error_count(), 800u);
    EXPECT_EQ(diagnostics.all().size(), 800u);
}

}  // namespace

}  // namespace velatura
