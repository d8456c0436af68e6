// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace velatura::usd::stage {

/// Layers of these tests are written tersely: gives every brace a line of its own, as the grammar
/// wants. Strings stay as they are.
inline std::string spread(const std::string& body) {
    std::string text;
    bool in_string = false;
    for (size_t i = 0; i < body.size(); ++i) {
        const char c = body[i];
        if (c == '"' && (i == 0 || body[i - 1] != '\\')) in_string = !in_string;
        const bool is_brace = !in_string && (c == '{' || c == '}');
        if (is_brace && c == '}') text += '\n';
        text += c;
        if (is_brace) text += '\n';
    }
    return text;
}

/// A folder of layers that vanishes with the test, and the stage of its root.usda.
class StageTest : public testing::Test {
  protected:
    StageTest() {
        std::string pattern =
            (std::filesystem::temp_directory_path() / "velatura_stage_XXXXXX").string();
        folder_ = mkdtemp(pattern.data());
    }

    ~StageTest() override { std::filesystem::remove_all(folder_); }

    void write(const std::string& name, const std::string& body) {
        std::ofstream(folder_ / name) << "#usda 1.0\n" << spread(body);
    }

    void open(const std::string& root) {
        write("root.usda", root);
        auto opened = Stage::open((folder_ / "root.usda").string(), {}, diagnostics_);
        ASSERT_TRUE(opened.has_value()) << opened.error().message;
        stage_ = *opened;
        for (const Diagnostic& d : diagnostics_.all()) {
            if (d.severity == Severity::Error) ADD_FAILURE() << diagnostics_.format(d);
        }
    }

    const Stage& stage() const { return *stage_; }

    std::filesystem::path folder_;
    Diagnostics diagnostics_;
    std::optional<Stage> stage_;
};

}  // namespace velatura::usd::stage
