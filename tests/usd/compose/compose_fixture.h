// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composer.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace velatura::usd::compose {

/// A folder of layers that vanishes with the test.
class ComposeFixture : public testing::Test {
  protected:
    using Lines = std::vector<std::string>;

    ComposeFixture() {
        const auto base = std::filesystem::temp_directory_path() / "velatura_compose_XXXXXX";
        std::string pattern = base.string();
        folder_ = mkdtemp(pattern.data());
    }

    ~ComposeFixture() override { std::filesystem::remove_all(folder_); }

    /// Layers of these tests are written tersely: gives every brace a line of its own, as the
    /// grammar wants.
    void write(const std::string& name, const std::string& body) {
        std::string text;
        bool in_variable = false;  // "${X}" of an expression
        for (size_t i = 0; i < body.size(); ++i) {
            const char c = body[i];
            in_variable = in_variable || (c == '{' && i > 0 && body[i - 1] == '$');
            if (c == '}' && !in_variable) text += '\n';
            text += c;
            if ((c == '{' || c == '}') && !in_variable) text += '\n';
            if (c == '}') in_variable = false;
        }
        std::ofstream(folder_ / name) << "#usda 1.0\n" << text;
    }

    /// A fresh composer of root.usda.
    Composer& composer() {
        if (composer_) return *composer_;
        composer_ = std::make_unique<Composer>(options_, diagnostics_);
        const auto opened = composer_->open((folder_ / "root.usda").string(), session_);
        if (!opened) {
            std::string why = opened.error().message;
            for (const Diagnostic& d : diagnostics_.all()) why += "\n" + diagnostics_.format(d);
            throw std::runtime_error(why);
        }
        return *composer_;
    }

    void reopen() { composer_.reset(); }

    PrimIndex index(const std::string& path) {
        return composer().prim_index(layer::Path::from(path));
    }

    /// Prim stack of a prim of root.usda: "layer path" lines, strongest first.
    Lines stack(const std::string& path) {
        Lines lines;
        const PrimIndex found = index(path);
        for (const int i : found.contributing()) {
            const Node& node = found.nodes()[size_t(i)];
            for (const StackLayer& entry : node.stack->layers()) {
                if (!entry.layer->has_spec(node.path)) continue;
                const std::filesystem::path file = entry.layer->identifier();
                lines.push_back(file.stem().string() + " " + node.path.to_string());
            }
        }
        return lines;
    }

    Lines children(const std::string& path) {
        Lines names;
        const PrimIndex found = index(path);
        for (const layer::Token& name :
             composer().all_child_names(found, found.is_instanceable()).names) {
            names.push_back(name.str());
        }
        return names;
    }

    Lines prohibited(const std::string& path) {
        Lines names;
        for (const layer::Token& name : composer().all_child_names(index(path), false).prohibited) {
            names.push_back(name.str());
        }
        return names;
    }

    /// Kinds of all errors so far, in the order of arrival.
    Lines errors() {
        Lines kinds;
        for (const CompositionError& error : std::as_const(composer()).errors().all())
            kinds.emplace_back(error_name(error.kind));
        return kinds;
    }

    std::filesystem::path folder_;
    SessionLayers session_;
    ComposeOptions options_;
    Diagnostics diagnostics_;
    std::unique_ptr<Composer> composer_;
};

}  // namespace velatura::usd::compose
